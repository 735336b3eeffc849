from pathlib import Path

import asammdf
import numpy as np
import pytest

from mrfit.ingest.refusal import Refusal
from tests.ingest.conftest import ReadLog
from tests.ingest.samples import mdf, signals


def test_groups_are_records_of_their_own(read_log: ReadLog, tmp_path: Path) -> None:
    time, one, two = signals()
    with asammdf.MDF(version="4.10") as made:
        made.append([asammdf.Signal(one, time + 0.05, name="Load", unit="N")])
        made.append([asammdf.Signal(two[::2], time[::2] + 0.05, name="Current", unit="mA")])
        path = Path(made.save(tmp_path / "two.mf4"))
    first, second = read_log(path.read_bytes(), "run.mf4")
    assert (first.dt, second.dt) == (pytest.approx(1e-3), pytest.approx(2e-3))
    np.testing.assert_allclose(second.channels["current"], 1e-3 * two[::2])


def test_invalid_samples_are_refused_rows_and_shift_nothing(read_log: ReadLog, tmp_path: Path) -> None:
    """ASAM MDF 4 marks invalid samples of one channel in invalidation bits; the group's other channels go on."""
    time, one, two = signals()
    invalid = np.zeros(len(time), dtype=bool)
    invalid[100] = True
    load = asammdf.Signal(one, time + 0.05, name="Load", unit="N", invalidation_bits=asammdf.InvalidationArray(invalid))
    with asammdf.MDF(version="4.10") as made:
        made.append([load, asammdf.Signal(two, time + 0.05, name="Current", unit="A")])
        path = Path(made.save(tmp_path / "invalid.mf4"))
    (record,) = read_log(path.read_bytes(), "run.mf4")
    assert record.rows_refused == 1 and record.rows_kept == len(time) - 1
    np.testing.assert_allclose(record.channels["force"][101:], one[101:])
    np.testing.assert_allclose(record.channels["current"][101:], two[101:])


def test_a_master_that_is_no_time_gives_no_rate(read_log: ReadLog, tmp_path: Path) -> None:
    """Sync type 2 of a master channel is an angle: its steps are no sample interval."""
    angle, one, _ = signals()
    with asammdf.MDF(version="4.10") as made:
        made.append([asammdf.Signal(one, angle + 0.05, name="Load", unit="N", master_metadata=("crank", 2))])
        path = Path(made.save(tmp_path / "angle.mf4"))
    with pytest.raises(Refusal, match="no time column and no sample rate"):
        read_log(path.read_bytes(), "run.mf4")
    (record,) = read_log(path.read_bytes(), "run.mf4", "rate = 100\n")
    assert record.dt == 0.01 and "force" in record.channels


def test_a_group_without_times_beside_one_with_them_is_left_out(read_log: ReadLog, tmp_path: Path) -> None:
    angle, one, two = signals()
    with asammdf.MDF(version="4.10") as made:
        made.append([asammdf.Signal(two[:90], angle[:90] + 0.05, name="Peak", unit="N", master_metadata=("crank", 2))])
        made.append([asammdf.Signal(one, angle + 0.05, name="Load", unit="N")])
        path = Path(made.save(tmp_path / "two.mf4"))
    (record,) = read_log(path.read_bytes(), "run.mf4")
    assert record.samples == len(one)
    assert [f.text for f in record.findings if f.kind == "not-read" and "'Peak' (90)" in f.text]
    assert len(read_log(path.read_bytes(), "run.mf4", "rate = 100\n")) == 2


def test_texts_and_enumerations_are_no_channels(read_log: ReadLog, tmp_path: Path) -> None:
    """A value-to-text conversion (MDF's CC type 7) turns a state into words."""
    time, one, _ = signals()
    words = {"val_0": 0, "text_0": "off", "val_1": 1, "text_1": "on"}
    state = asammdf.Signal(np.arange(len(time)) % 2, time + 0.05, name="State", conversion=words)
    with asammdf.MDF(version="4.10") as made:
        made.append([state, asammdf.Signal(one, time + 0.05, name="Load", unit="N")])
        path = Path(made.save(tmp_path / "state.mf4"))
    (record,) = read_log(path.read_bytes(), "run.mf4")
    assert list(record.channels) == ["force"]


def test_damaged_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal):
        read_log(mdf().data[:200], "run.mf4")
