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


def test_parts_of_other_lengths_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="the files joined as 'val' have 40, 39 rows"):
        read([written(tmp_path, 39)], Settings(jobs=1))
