"""Files of one array each that a channel map joins as one record."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from mrfit.errors import DataError
from mrfit.ingest.stage import read
from mrfit.settings.ingest import Settings

MAP = """
rate = 750
[[files]]
match = "?val.mat"
join = "val"
[files.channels]
force = {column = "u", unit = "kN"}
displacement = {column = "y", unit = "mm"}
"""


def written(folder: Path, rows: int) -> Path:
    savemat(folder / "uval.mat", {"u": np.arange(40.0)[None]})
    savemat(folder / "yval.mat", {"y": np.sin(np.arange(float(rows)))[None]})
    (folder / "mrfit.toml").write_text(MAP)
    return folder


def test_two_files_are_one_record_column_beside_column(tmp_path: Path) -> None:
    (recording,) = read([written(tmp_path, 40)], Settings(jobs=1)).recordings
    assert recording.channels["force"] == pytest.approx(1e3 * np.arange(40.0))
    assert recording.channels["displacement"] == pytest.approx(1e-3 * np.sin(np.arange(40.0)))
    assert recording.dt == pytest.approx(1 / 750)
    assert "joined uval.mat, yval.mat" in recording.history


def test_tests_side_by_side_in_a_part_are_not_taken_apart(tmp_path: Path) -> None:
    rows = [(0.002 * k, k % 7, 0.004 * k, k % 5) for k in range(40)]
    tests = "".join(f"{a:.3f},{b},{b},{c:.3f},{d},{d}\n" for a, b, c, d in rows)
    (tmp_path / "a_1.csv").write_text("Time (s),Stroke (mm),Force (N),Time (s),Stroke (mm),Force (N)\n" + tests)
    (tmp_path / "b_1.csv").write_text("Time (s),Current (A)\n" + "".join(f"{a:.3f},1\n" for a, *_ in rows))
    (tmp_path / "mrfit.toml").write_text('[[files]]\nmatch = "*_1.csv"\njoin = "x"\n')
    with pytest.raises(DataError, match="are times that differ"):
        read([tmp_path], Settings(jobs=1))


def test_parts_of_other_lengths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="the files joined as 'val' have 40, 39 rows"):
        read([written(tmp_path, 39)], Settings(jobs=1))
