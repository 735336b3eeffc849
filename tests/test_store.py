"""The workspace gives back what was put in, and a failed write leaves what was there."""

import json
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.errors import DataError
from mrfit.keys import fit_key
from mrfit.recording import Finding, Recording, Segment
from mrfit.store import Workspace, read_json, recording_id, write_atomic, write_json, write_table


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


CHANGES: dict[str, dict[str, Any]] = {
    "one sample": {"channels": {"current": np.array([*np.linspace(0, 1, 7)[:6], 1.0 + 1e-15]), "ch2": np.arange(7.0)}},
    "samples exchanged": {"channels": {"current": np.arange(7.0), "ch2": np.linspace(0, 1, 7)}},
    "a name": {"channels": {"current": np.linspace(0, 1, 7), "ch3": np.arange(7.0)}},
    "one fewer": {"channels": {"current": np.linspace(0, 1, 7)}},
    "unit": {"units": {"current": "mA", "ch2": "V"}},
    "dt": {"dt": 1.0000001e-4},
    "condition": {"condition": {"frequency": 5.5}},
    "another condition": {"condition": {"frequency": 5.0, "current": 1.0}},
    "wording": {"wording": {"frequency": "5Hz"}},
}


@pytest.mark.parametrize("what", CHANGES)
def test_what_later_stages_compute_with_is_in_the_hash_of_the_content(what: str, tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    workspace.write_recording(recording)
    before = workspace.content("log-1")
    workspace.write_recording(replace(recording, **CHANGES[what]))
    assert workspace.content("log-1") != before
    workspace.write_recording(recording)
    assert workspace.content("log-1") == before


@pytest.mark.parametrize(
    "about",
    [
        {"source": "b.csv"},
        {"sha256": "0" * 64},
        {"reader": "keysight"},
        {"start": 3.0},
        {"columns": {"current": 4, "ch2": 5}},
        {"rows_refused": 0},
        {"findings": ()},
        {"history": ("read by keysight",)},
    ],
)
def test_where_a_recording_came_from_is_not_in_the_hash_of_its_content(about: dict[str, Any], tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    workspace.write_recording(recording)
    before = workspace.content("log-1")
    workspace.write_recording(replace(recording, **about))
    assert workspace.content("log-1") == before
    assert workspace.read_recording("log-1").about() == replace(recording, **about).about()


def test_a_recording_without_a_hash_of_its_content_is_refused_in_one_line(tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    metadata = {"mrfit": json.dumps(recording.about())}
    write_table(workspace.recording_file("log-1"), {"time": np.arange(7.0), **recording.channels}, metadata)
    with pytest.raises(DataError, match=r"log-1\.parquet: .*older mrfit.*run `mrfit ingest` on its log again") as error:
        workspace.contents(["log-1"])
    assert "\n" not in str(error.value)


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


def test_what_a_killed_command_left_half_written_is_taken_away(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    workspace.write_recording(a_recording())
    kept = sorted(p for p in tmp_path.rglob("*"))
    for name in (".flux.json.7.tmp", "recordings/.log-1.parquet.7.tmp"):
        (tmp_path / name).write_text("half")
    with workspace.locked():
        assert sorted(p for p in tmp_path.rglob("*") if p.name != ".lock") == kept


@pytest.mark.parametrize("content", [b"", b"no table", None])
def test_a_damaged_table_of_segments_is_named_with_its_remedy(content: bytes | None, tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    if content is None:  # another version's: a column it does not know
        write_table(workspace.segments_file, {"id": np.zeros(1), "colour": np.zeros(1)})
    else:
        workspace.segments_file.write_bytes(content)
    with pytest.raises(DataError, match=r"segments\.parquet: .*run `mrfit segment`") as error:
        workspace.read_segments()
    assert "\n" not in str(error.value)


def test_a_fit_is_outdated_once_its_data_or_segments_change(tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    row = Segment("a#1", "sine", "log-1", 0, 7, 0, "sine", "current", 1.0, 2.0, 0.0, 2, float("nan"), 25.0, "train")
    workspace.write_recording(recording)
    workspace.write_segments([row], {})
    settings, made_from = {"model": "bingham", "seed": 1}, workspace.made_from([row])
    fit = {"name": "x", "settings": settings, "key": fit_key(settings, *made_from)}
    assert workspace.outdated([fit]) == []
    assert fit_key({**settings, "jobs": 3}, *made_from) == fit["key"]
    workspace.write_segments([replace(row, role="holdout")], {})
    assert workspace.outdated([fit]) == ["x"]
    workspace.write_segments([row], {})
    workspace.write_recording(replace(recording, history=("read again",), source="elsewhere.csv", findings=()))
    assert workspace.outdated([fit]) == []
    workspace.write_recording(replace(recording, channels={**recording.channels, "current": np.zeros(7)}))
    assert workspace.outdated([fit]) == ["x"]
    workspace.recording_file("log-1").unlink()
    assert workspace.outdated([fit]) == ["x"]


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
