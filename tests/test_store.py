"""The workspace gives back what was put in, and a failed write leaves what was there."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.errors import DataError
from mrfit.recording import Finding, Recording, Segment
from mrfit.store import Workspace, read_json, recording_id, write_atomic, write_json


def a_recording() -> Recording:
    return Recording(
        id="log-1",
        source="somewhere/log 1.csv",
        sha256="ab" * 32,
        reader="rigol",
        dt=1e-4,
        start=-0.5,
        channels={"current": np.linspace(0, 1, 7), "ch2": np.arange(7.0)},
        units={"current": "A", "ch2": "V"},
        columns={"current": 1, "ch2": 2},
        condition={"frequency": 5.0},
        rows_kept=7,
        rows_refused=1,
        findings=(Finding("offset", "current", 0.1, "starts at zero"),),
        history=("read by rigol",),
    )


def test_a_recording_comes_back_as_it_was(tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    workspace.write_recording(recording)
    back = workspace.read_recording("log-1")
    assert back.about() == recording.about()
    assert all(np.array_equal(back.channels[n], v) for n, v in recording.channels.items())


def test_segments_come_back_as_they_were(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    row = Segment("a#1", "sine-1Hz", "a", 3, 9, 3, "sine", "current", 1.0, 2.0, 0.0, 2, float("nan"), 25.0, "train")
    workspace.write_segments([row], {"key": "k"})
    (back,), metadata = workspace.read_segments()
    assert str(back) == str(row)
    assert metadata["key"] == "k"


def test_a_write_that_fails_leaves_the_old_file_and_no_litter(tmp_path: Path) -> None:
    path = tmp_path / "summary.json"
    write_json(path, {"old": 1})

    def broken(temporary: Path) -> None:
        temporary.write_text("half")
        raise OSError(28, "No space left on device")

    with pytest.raises(DataError, match="No space left"):
        write_atomic(path, broken)
    assert read_json(path) == {"old": 1}
    assert os.listdir(tmp_path) == ["summary.json"]


def test_non_finite_numbers_become_null(tmp_path: Path) -> None:
    write_json(tmp_path / "a.json", {"x": [float("nan"), np.inf, np.float64(1.5)]})
    assert read_json(tmp_path / "a.json") == {"x": [None, None, 1.5]}


def test_a_failing_command_leaves_no_new_workspace_behind(tmp_path: Path) -> None:
    root = tmp_path / "work"
    with pytest.raises(DataError, match="no such log"), Workspace(root).locked():
        raise DataError("no such log")
    assert not root.exists()


@given(st.lists(st.text(min_size=1, max_size=12), min_size=1, max_size=8))
def test_identifiers_are_unique_and_safe_on_any_file_system(names: list[str]) -> None:
    taken: set[str] = set()
    made = [recording_id(Path("/logs") / (n.replace("/", "_").replace("\0", "_") + ".csv"), taken) for n in names]
    assert len({m.lower() for m in made}) == len(made)
    assert all(m and not set(m) & set('/\\:*?"<>| ') for m in made)
