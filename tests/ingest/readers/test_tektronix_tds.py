from pathlib import Path

import numpy as np
import pytest

from mrfit.ingest.stage import Settings
from tests.ingest.conftest import ReadLog
from tests.ingest.examining import examine
from tests.ingest.samples import Sample, tektronix_tds


def _write(folder: Path, truth: Sample) -> None:
    for k in (1, 2, 3):
        data = truth.data.replace(b"CH1", b"CH%d" % k)
        data = b",,,time,volt,\r\n" + data if k == 3 else data  # as edited by hand
        (folder / f"F0004CH{k}.CSV").write_bytes(data)


def test_files_of_one_record_are_joined(tmp_path: Path) -> None:
    truth = tektronix_tds()
    _write(tmp_path, truth)
    ((record,), refusals) = examine([tmp_path], Settings())
    assert not refusals
    assert list(record.channels) == ["ch1", "ch2", "ch3"]
    assert Path(record.source).name == "F0004CH1.CSV"
    for values in record.channels.values():
        np.testing.assert_array_equal(values, truth.channels["ch1"])


def test_files_of_other_time_bases_stay_records_of_their_own(tmp_path: Path) -> None:
    truth = tektronix_tds()
    _write(tmp_path, truth)
    path = tmp_path / "F0004CH2.CSV"
    path.write_bytes(path.read_bytes().replace(b"Sample Interval,1.0", b"Sample Interval,2.0"))
    recordings, _ = examine([tmp_path], Settings())
    assert len(recordings) == 3


@pytest.mark.parametrize("damage", [b"", b",,,0.1,"])
def test_a_damaged_row_of_one_channel_costs_that_row_in_all(damage: bytes, tmp_path: Path) -> None:
    truth = tektronix_tds()
    _write(tmp_path, truth)
    path = tmp_path / "F0004CH2.CSV"
    lines = path.read_bytes().split(b"\r\n")
    lines[100] = damage or b",,,x,y,"
    path.write_bytes(b"\r\n".join(lines))
    ((record,), _) = examine([tmp_path], Settings())
    assert (record.rows_kept, record.rows_refused) == (239, 1)
    np.testing.assert_array_equal(record.channels["ch1"][101:], truth.channels["ch1"][101:])


def test_channel_and_unit_come_from_the_settings(read_log: ReadLog) -> None:
    data = tektronix_tds().data.replace(b"Vertical Units,V", b"Vertical Units,A")
    (record,) = read_log(data, "anything.csv")
    assert record.units == {"current": "A"}
