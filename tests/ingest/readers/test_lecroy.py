from pathlib import Path

from mrfit.ingest.stage import Settings
from tests.ingest.conftest import ReadLog
from tests.ingest.examining import examine
from tests.ingest.samples import lecroy


def test_channels_of_one_acquisition_are_joined(tmp_path: Path) -> None:
    for name in ("C1Trace00000.txt", "C3Trace00000.txt", "C1Trace00001.txt"):
        (tmp_path / name).write_bytes(lecroy().data)
    recordings, _ = examine([tmp_path], Settings())
    assert sorted(tuple(r.channels) for r in recordings) == [("ch1",), ("ch1", "ch3")]


def test_channels_of_unequal_length_give_what_both_have_and_say_it(tmp_path: Path) -> None:
    whole = lecroy().data
    (tmp_path / "C1Trace00000.txt").write_bytes(whole)
    (tmp_path / "C2Trace00000.txt").write_bytes(b"\n".join(whole.split(b"\n")[:-25]) + b"\n")
    ((record,), refusals) = examine([tmp_path], Settings())
    assert refusals == [] and list(record.channels) == ["ch1", "ch2"]
    assert (record.rows_kept, record.rows_refused) == (216, 24)
    assert any("24 × no row of another channel" in f.text for f in record.findings)


def test_segments_are_runs(read_log: ReadLog) -> None:
    data = lecroy().data.replace(b"Segments,1,SegmentSize,240", b"Segments,2,SegmentSize,120")
    recordings = read_log(data, "C2run00000.txt")
    assert [r.rows_kept for r in recordings] == [120, 120]
    assert list(recordings[0].channels) == ["ch2"]


def test_the_assumed_unit_is_said(read_log: ReadLog) -> None:
    (record,) = read_log(lecroy().data, "any.txt")
    assert record.units == {"ampl": "V"}
    assert "unit-assumed" in {f.kind for f in record.findings}
