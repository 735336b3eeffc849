from pathlib import Path

import numpy as np

from mrfit.ingest.stage import Settings
from tests.ingest.examining import examine

HEAD = "\ufeffFile Path: C:\\x.txt   \nTest: t\nTest Run: Test Run 1\nDate: 10/23/2023\n\n\n"
HEAD += "Crosshead \tLoad \tTime \nmm\tN\tsec\n"


def _part(start: int, count: int) -> bytes:
    rows = "".join(f"{k}\t{2 * k}\t{k * 0.01:.2f}\n" for k in range(start, start + count))
    return (HEAD + rows).encode()


def test_parts_are_joined_in_the_order_of_their_times(tmp_path: Path) -> None:
    """The instrument numbers the parts as it likes: here the last file holds the first rows."""
    (tmp_path / "DAQ, … - (Timed).txt").write_bytes(_part(600, 100))
    (tmp_path / "DAQ, … - (Timed)2.txt").write_bytes(_part(700, 50))
    (tmp_path / "DAQ, … - (Timed)3.txt").write_bytes(_part(100, 500))
    ((record,), refusals) = examine([tmp_path], Settings())
    assert not refusals
    assert (record.start, record.dt, record.rows_kept) == (1.0, 0.01, 650)
    np.testing.assert_allclose(record.channels["displacement"], 1e-3 * np.arange(100, 750))
    np.testing.assert_allclose(record.channels["force"], 2.0 * np.arange(100, 750))


def test_an_empty_part_is_refused_and_the_others_are_read(tmp_path: Path) -> None:
    (tmp_path / "DAQ - (Timed).txt").write_bytes(_part(0, 100))
    (tmp_path / "DAQ - (Timed)2.txt").write_bytes(b"\xef\xbb\xbf")
    ((record,), (refusal,)) = examine([tmp_path], Settings())
    assert record.rows_kept == 100
    assert "byte-order mark and nothing else" in refusal.reason


def test_damage_in_a_later_part_is_counted(tmp_path: Path) -> None:
    (tmp_path / "DAQ - (Timed).txt").write_bytes(_part(0, 100))
    damaged = _part(100, 100).replace(b"150\t300\t1.50", b"150\tx\t1.50")
    (tmp_path / "DAQ - (Timed)2.txt").write_bytes(damaged)
    ((record,), _) = examine([tmp_path], Settings())
    assert (record.rows_kept, record.rows_refused, record.samples) == (199, 1, 200)
