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


def test_damaged_file_is_refused(read_log: ReadLog) -> None:
    with pytest.raises(Refusal):
        read_log(mdf().data[:200], "run.mf4")
