"""The workspace gives back what was put in, and a failed write leaves what was there."""

import json
import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.recording import Finding, Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.io.atomic import opened_to_append, write_atomic
from mrfit.io.footer import written_text
from mrfit.io.keys import fit_key
from mrfit.io.outdated import Inputs
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.stages import About
from mrfit.io.tables import write_table
from mrfit.io.workspace import Workspace, plain, read_json, recording_id, write_json


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
    assert About.of(back) == About.of(recording)
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
    assert About.of(workspace.read_recording("log-1")) == About.of(replace(recording, **about))


def test_a_recording_without_a_hash_of_its_content_is_refused_in_one_line(tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    metadata = {"mrfit": json.dumps(plain(About.of(recording)))}
    write_table(workspace.recording_file("log-1"), {"time": np.arange(7.0), **recording.channels}, metadata)
    with pytest.raises(DataError, match=r"log-1\.parquet: .*older mrfit.*run `mrfit ingest` on its log again") as error:
        workspace.contents(["log-1"])
    assert "\n" not in str(error.value)


def test_segments_come_back_as_they_were(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    row = Segment("a#1", "sine-1Hz", "a", 3, 9, 3, "sine", "current", 1.0, 2.0, 0.0, 2, float("nan"), 25.0, "train")
    workspace.write_segments([row], {"key": "k"})
    (back,) = workspace.read_segments()
    assert str(back) == str(row)
    assert written_text(workspace.segments_file, "key") == "k"


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
    with pytest.raises(DataError, match=r"segments\.parquet: .*run `mrfit segment --work") as error:
        workspace.read_segments()
    assert "\n" not in str(error.value)


def test_a_fit_is_outdated_once_its_data_or_segments_change(tmp_path: Path) -> None:
    workspace, recording = Workspace(tmp_path), a_recording()
    row = Segment("a#1", "sine", "log-1", 0, 7, 0, "sine", "current", 1.0, 2.0, 0.0, 2, float("nan"), 25.0, "train")
    workspace.write_recording(recording)
    workspace.write_segments([row], {})
    settings, made_from = {"model": "bingham", "seed": 1}, workspace.made_from([row])
    key = fit_key(settings, *made_from)
    fit = Fit(
        name="x", model="bingham", optimizer="auto", output="force", results=[], metrics=[], settings=settings, key=key
    )
    assert list(Inputs(workspace).of_fits([fit])) == []
    assert fit_key({**settings, "jobs": 3}, *made_from) == key
    workspace.write_segments([replace(row, role="holdout")], {})
    assert list(Inputs(workspace).of_fits([fit])) == ["x"]
    workspace.write_segments([row], {})
    workspace.write_recording(replace(recording, history=("read again",), source="elsewhere.csv", findings=()))
    assert list(Inputs(workspace).of_fits([fit])) == []
    workspace.write_recording(replace(recording, channels={**recording.channels, "current": np.zeros(7)}))
    assert list(Inputs(workspace).of_fits([fit])) == ["x"]
    workspace.recording_file("log-1").unlink()
    assert list(Inputs(workspace).of_fits([fit])) == ["x"]


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


@pytest.mark.parametrize("identifier", ["../outside", "/etc/x", "a/b", "..", ".hidden", "", "a\0b", "a b"])
def test_an_id_that_is_no_plain_name_leads_nowhere(identifier: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="is no id of a recording"):
        Workspace(tmp_path).recording_file(identifier)
    with pytest.raises(ConfigError, match="is no name for a file"):
        Workspace(tmp_path).fit_folder(identifier)


@pytest.mark.parametrize("name", ["boucwen+delay.pso-fmin.all", "a", "_x", "9.5"])
def test_plain_names_name_recordings_and_fits(name: str, tmp_path: Path) -> None:
    assert Workspace(tmp_path).fit_folder(name) == tmp_path / "fits" / name
    if "+" not in name:
        assert Workspace(tmp_path).recording_file(name) == tmp_path / "recordings" / f"{name}.parquet"


def test_ingest_removes_no_file_outside_the_workspace(tmp_path: Path) -> None:
    from mrfit.cli import pipeline
    from mrfit.core.progress import silent
    from mrfit.ingest.stage import Settings

    log, outside = tmp_path / "log.csv", tmp_path / "outside.parquet"
    rows = "\n".join(f"{k / 100},{k % 7}" for k in range(300))
    log.write_text(f"time,force\n{rows}\n")
    outside.write_text("precious")
    pipeline.ingest(tmp_path / "w", [log], Settings(), silent)
    file = tmp_path / "w" / "ingest.json"
    content = json.loads(file.read_text())
    content["recordings"][0]["id"] = "../../outside"
    file.write_text(json.dumps(content))
    log.write_text(f"time,force\n{rows}\n3.0,1\n")
    with pytest.raises(DataError, match=r"ingest\.json: damaged.*recordings\[0\]\.id takes a plain name"):
        pipeline.ingest(tmp_path / "w", [log], Settings(), silent)
    assert outside.read_text() == "precious"


PLACES = ("recordings", "flux", "fits", "fits/x", ".mrfit-scratch", "report", "report/figures", "discover", "compare")


@pytest.mark.parametrize("place", PLACES)
def test_a_folder_that_is_a_link_is_not_written_into(place: str, tmp_path: Path) -> None:
    workspace, elsewhere = Workspace(tmp_path / "w"), tmp_path / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / ".a.json.7.tmp").write_text("another's")
    (workspace.root / place).parent.mkdir(parents=True)
    (workspace.root / place).symlink_to(elsewhere)
    with pytest.raises(DataError, match=f"{place}: a symbolic link, which mrfit does not follow"), workspace.locked():
        raise AssertionError("the command began")
    assert [p.name for p in elsewhere.iterdir()] == [".a.json.7.tmp"]


@pytest.mark.parametrize("name", ["channel-map.toml", "batch.jsonl"])
def test_a_file_that_is_believed_or_added_to_is_no_link(name: str, tmp_path: Path) -> None:
    workspace, mine = Workspace(tmp_path / "w"), tmp_path / "mine"
    workspace.root.mkdir()
    mine.write_text("mine")
    (workspace.root / name).symlink_to(mine)
    with pytest.raises(DataError, match=f"{name}: a symbolic link, which mrfit does not follow"), workspace.locked():
        raise AssertionError("the command began")
    assert mine.read_text() == "mine"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs named pipes")
def test_only_plain_files_are_added_to(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to(tmp_path / "mine")
    for name in ("pipe", "folder", "link"):
        with pytest.raises(OSError):
            opened_to_append(tmp_path / name)
    for text in (b"a", b"b"):
        with opened_to_append(tmp_path / "plain") as handle:
            handle.write(text)
    assert (tmp_path / "plain").read_bytes() == b"ab" and not (tmp_path / "mine").exists()


def test_a_lock_left_aside_that_is_a_link_is_not_opened(tmp_path: Path) -> None:
    left = tmp_path / "w" / ".predict-7"
    left.mkdir(parents=True)
    (tmp_path / "mine").write_text("mine")
    (left / ".lock").symlink_to(tmp_path / "mine")
    with Workspace(tmp_path / "w").locked():
        pass
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_lock_that_is_a_link_is_refused_and_its_target_stays(tmp_path: Path) -> None:
    (tmp_path / "w").mkdir()
    (tmp_path / "precious").write_text("text")
    (tmp_path / "w" / ".lock").symlink_to(tmp_path / "precious")
    with pytest.raises(DataError, match=r"\.lock: a symbolic link"), Workspace(tmp_path / "w").locked():
        raise AssertionError("the command began")
    assert (tmp_path / "precious").read_text() == "text"


def test_a_workspace_that_is_a_link_itself_and_links_to_files_are_followed_to_read_only(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "w").symlink_to(tmp_path / "there")
    workspace = Workspace(tmp_path / "w")
    (tmp_path / "kept.json").write_text('{"old": 1}')
    (tmp_path / "there" / "flux.json").symlink_to(tmp_path / "kept.json")
    temporary = tmp_path / "there" / f".flux.json.{os.getpid()}.tmp"
    temporary.symlink_to(tmp_path / "victim")
    with workspace.locked():
        write_json(workspace.flux_json, {"new": 1})
    assert json.loads((tmp_path / "kept.json").read_text()) == {"old": 1}
    assert json.loads(workspace.flux_json.read_text()) == {"new": 1} and not workspace.flux_json.is_symlink()
    assert not (tmp_path / "victim").exists()


def test_only_temporary_files_of_mrfit_are_cleaned(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    ours = (".ingest.json.12.tmp", ".batch.parquet.3.tmp", "recordings/.a.parquet.7.tmp", "report/a/.a.svg.1.tmp")
    others = (".notes.tmp", ".plan.12.tmp", "logs/.a.csv.7.tmp", "recordings/.mine.tmp", "recordings/a.7.tmp")
    for name in (*ours, *others):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("text")
    with workspace.locked():
        assert not [n for n in ours if (tmp_path / n).exists()]
        assert [n for n in others if (tmp_path / n).exists()] == list(others)


def test_folders_of_others_beside_those_of_a_stage_stay(tmp_path: Path) -> None:
    from mrfit.ingest.stage import _staging

    for name in (".ingest-notes", ".ingest-12"):
        (tmp_path / name).mkdir()
    with _staging(Workspace(tmp_path)):
        assert (tmp_path / ".ingest-notes").is_dir() and not (tmp_path / ".ingest-12").exists()


def test_what_a_command_needs_aside_is_in_the_workspace_and_gone_afterwards(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    workspace = Workspace(tmp_path / "w")
    workspace.root.mkdir()
    with pytest.raises(DataError, match="no such log"), workspace.aside() as other:
        other.write_recording(a_recording())
        assert other.root.parent == workspace.root and not list((tmp_path / "tmp").iterdir())
        with workspace.locked():  # another command must not remove it
            assert other.read_recording("log-1").id == "log-1"
        raise DataError("no such log")
    assert [p.name for p in workspace.root.iterdir()] == [".lock"]
    for name in (".predict-1", ".predict-mine"):  # of a command that was killed; of somebody else
        (workspace.root / name / "recordings").mkdir(parents=True)
    with workspace.aside():
        assert not (workspace.root / ".predict-1").exists() and (workspace.root / ".predict-mine").is_dir()


def test_where_the_workspace_cannot_be_written_the_temporary_folder_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    (tmp_path / "w").write_text("no folder")
    with Workspace(tmp_path / "w").aside() as other:
        other.write_recording(a_recording())
        assert other.root.parent == tmp_path / "tmp"
    assert not list((tmp_path / "tmp").iterdir())
