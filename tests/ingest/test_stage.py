import json
import os
from pathlib import Path

import numpy as np
import pytest

from mrfit.errors import ConfigError, DataError
from mrfit.ingest.stage import Settings, preview, run
from mrfit.io.schemas.stages import About, Copy, IngestFile
from mrfit.io.workspace import Workspace, plain
from tests.ingest.samples import WRITERS, sample

MAP = '[channels]\ncurrent = {column = "CH1", scale = 10.0, unit = "A"}\n'


def _tree(root: Path) -> dict[str, bytes]:
    return {str(p.relative_to(root)): p.read_bytes() for p in sorted(root.rglob("*")) if p.is_file()}


@pytest.fixture
def logs(tmp_path: Path) -> Path:
    folder = tmp_path / "logs"
    folder.mkdir()
    for name in ("rigol", "keysight", "delimited"):
        sample(name, folder)
    return folder


@pytest.fixture
def workspace(tmp_path: Path) -> Workspace:
    return Workspace(tmp_path / "work")


def _ids(summary: IngestFile) -> list[str]:
    return [r.id for r in summary.recordings]


def test_folder_becomes_recordings_and_a_summary(logs: Path, workspace: Workspace) -> None:
    summary = run([logs], Settings(resistance=2.1), workspace)
    assert _ids(summary) == ["NewFile1", "log", "scope_0"]
    assert not summary.skipped and len(summary.added) == 3
    on_disk = json.loads(workspace.ingest_json.read_text())
    assert on_disk["recordings"] == plain(summary.recordings)
    assert on_disk["key"] == summary.key
    for row in summary.recordings:
        record = workspace.read_recording(row.id)
        assert About.of(record) == row
        assert record.condition["resistance"] == 2.1
    assert not list(workspace.root.glob(".ingest-*"))


def test_a_workspace_that_is_the_folder_of_the_logs_is_refused_and_left_alone(
    logs: Path, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = _tree(logs)
    monkeypatch.chdir(logs)
    for path, work in ((logs, logs), (Path("."), logs), (logs, Path("."))):
        with pytest.raises(ConfigError, match="is the folder of the logs: name another"):
            run([path], Settings(), Workspace(work))
    assert _tree(logs) == before
    # logs named one by one may lie beside what is made of them, and then the folder says what it is
    run([logs / "log.csv"], Settings(), Workspace(logs))
    with pytest.raises(DataError, match="a workspace, which mrfit wrote"):
        run([logs], Settings(), workspace)


def test_nothing_is_done_twice(logs: Path, workspace: Workspace) -> None:
    run([logs], Settings(), workspace)
    before = {p: p.stat().st_mtime_ns for p in workspace.root.rglob("*")}
    again = run([logs], Settings(), workspace)
    assert again.skipped and len(again.unchanged) == 3
    assert {p: p.stat().st_mtime_ns for p in workspace.root.rglob("*")} == before


def test_changed_file_replaces_its_recording_and_only_it(logs: Path, workspace: Workspace) -> None:
    run([logs], Settings(), workspace)
    kept = workspace.recording_file("scope_0").stat().st_mtime_ns
    path = logs / "NewFile1.csv"
    path.write_bytes(path.read_bytes().rsplit(b"\r\n", 2)[0] + b"\r\n")
    summary = run([logs], Settings(), workspace)
    assert summary.replaced == [str(path)]
    assert len(summary.unchanged) == 2 and not summary.added
    assert workspace.read_recording("NewFile1").samples == 239
    assert workspace.recording_file("scope_0").stat().st_mtime_ns == kept


def test_further_files_are_added_and_earlier_ones_stay(logs: Path, workspace: Workspace, tmp_path: Path) -> None:
    run([logs / "log.csv"], Settings(), workspace)
    _, more = sample("siglent", tmp_path)
    summary = run([more], Settings(), workspace)
    assert _ids(summary) == ["SDS00001", "log"]
    assert summary.added == [str(more)]


def test_same_file_under_another_spelling_is_the_same_source(
    logs: Path, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    run([logs / "log.csv"], Settings(), workspace)
    monkeypatch.chdir(logs)
    assert run([Path("./log.csv")], Settings(), workspace).skipped


def test_logs_of_one_name_from_two_folders_are_both_kept(
    workspace: Workspace, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("t1", "t2"):
        truth, path = sample("delimited", tmp_path / folder)
        path.write_bytes(truth.data + (b"" if folder == "t1" else truth.data[-30:]))
        path.with_name("bad.csv").write_text("1,2\n3,4\n")
        monkeypatch.chdir(tmp_path / folder)
        summary = run([Path("log.csv"), Path("bad.csv")], Settings(), workspace)
    assert {r.id: r.source for r in summary.recordings} == {"log": "log.csv", "log-2": "../t2/log.csv"}
    assert [r.source for r in summary.refused] == ["../t2/bad.csv", "bad.csv"]
    before = _tree(workspace.root)
    assert run([Path("../t1/log.csv"), Path("log.csv"), Path("bad.csv")], Settings(), workspace).skipped
    monkeypatch.chdir(tmp_path)
    assert run([Path("t1/log.csv"), tmp_path / "t2" / "log.csv"], Settings(), workspace).skipped
    assert _tree(workspace.root) == before


def test_the_same_call_in_another_place_gives_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trees = []
    for place in ("here", "there/deeper"):
        _, path = sample("delimited", tmp_path / place)
        monkeypatch.chdir(path.parent)
        run([Path("log.csv")], Settings(), Workspace(Path("work")))
        trees.append(_tree(Path("work")))
    assert trees[0] == trees[1]


def test_settings_and_map_are_part_of_the_key(logs: Path, workspace: Workspace) -> None:
    run([logs / "NewFile1.csv"], Settings(), workspace)
    assert run([logs / "NewFile1.csv"], Settings(resistance=3.0), workspace).replaced
    (logs / "mrfit.toml").write_text(MAP)
    summary = run([logs / "NewFile1.csv"], Settings(resistance=3.0), workspace)
    assert summary.replaced
    assert {c.name for c in summary.recordings[0].channels} == {"current", "ch2"}
    assert run([logs / "NewFile1.csv"], Settings(resistance=3.0), workspace).skipped


def test_map_is_found_up_to_the_folder_given(tmp_path: Path, workspace: Workspace) -> None:
    deep = tmp_path / "series" / "day1"
    deep.mkdir(parents=True)
    (tmp_path / "series" / "mrfit.toml").write_text(MAP)
    _, path = sample("rigol", deep)
    alone = run([path], Settings(), Workspace(tmp_path / "a"))
    assert "current" not in {c.name for c in alone.recordings[0].channels}
    whole = run([tmp_path / "series"], Settings(), workspace)
    assert "current" in {c.name for c in whole.recordings[0].channels}


def test_why_a_log_is_read_again_is_said_truly(logs: Path, workspace: Workspace) -> None:
    path = logs / "log.csv"
    run([path], Settings(), workspace)
    source = str(path)
    assert "options" in run([path], Settings(resistance=3.0), workspace).reasons[source]
    workspace.recording_file("log").unlink()
    assert "damaged, changed or missing" in run([path], Settings(resistance=3.0), workspace).reasons[source]
    path.write_bytes(path.read_bytes() + path.read_bytes()[-30:])
    assert run([path], Settings(), workspace).reasons == {source: "has changed since it was last read"}
    assert run([path], Settings(), workspace).reasons == {}


def copied(logs: Path, *names: str) -> list[Path]:
    paths = [logs / "log.csv", *(logs / n for n in names)]
    for path in paths[1:]:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(paths[0].read_bytes())
    return paths


def test_a_copy_is_read_once_and_said(logs: Path, workspace: Workspace) -> None:
    paths = copied(logs, "a.csv", "deeper/log.csv")
    first = run(paths, Settings(), workspace)
    assert _ids(first) == ["log"] and first.refused == []
    rows = [Copy(source=str(p), of=str(paths[0]), read=False) for p in paths[1:]]
    assert first.copies == rows
    before = _tree(workspace.root)
    again = run(paths, Settings(), workspace)
    assert again.skipped and again.copies == rows and _tree(workspace.root) == before
    # what the workspace holds stays, in whatever order and call the copies come
    alone = run([paths[1]], Settings(), workspace)
    assert alone.skipped and alone.copies == rows
    later = run(copied(logs, "b.csv")[1:], Settings(), workspace)
    assert _ids(later) == ["log"] and [c.source for c in later.copies] == sorted(map(str, [*paths[1:], logs / "b.csv"]))


def test_a_log_that_becomes_a_copy_gives_way_and_one_that_ceases_to_be_comes_back(
    logs: Path, workspace: Workspace
) -> None:
    path, other = copied(logs, "other.csv")
    same, own = other.read_bytes(), other.read_bytes() + other.read_bytes()[-30:]
    other.write_bytes(own)
    assert _ids(run([path, other], Settings(), workspace)) == ["log", "other"]
    for content, ids in ((same, ["log"]), (own, ["log", "other"])):
        other.write_bytes(content)
        summary = run([path, other], Settings(), workspace)
        assert _ids(summary) == ids and len(summary.copies) == 2 - len(ids)
        assert sorted(p.stem for p in workspace.root.glob("recordings/*")) == ids


def test_the_same_bytes_under_a_name_that_states_another_test_are_kept_and_said(
    logs: Path, workspace: Workspace
) -> None:
    paths = copied(logs, "run-5bar.csv", "run-7bar.csv", "again-5bar.csv")[1:]
    summary = run(paths, Settings(pattern="-{pressure:bar}bar"), workspace)
    assert _ids(summary) == ["run-5bar", "run-7bar"]
    five, seven, again = map(str, paths)
    assert summary.copies == [
        Copy(source=again, of=five, read=False),
        Copy(source=seven, of=five, read=True),
    ]
    assert run(paths, Settings(pattern="-{pressure:bar}bar"), workspace).skipped
    assert _ids(run(paths, Settings(), workspace)) == ["run-5bar"]


def test_a_copy_of_a_refused_log_leaves_the_refusal(logs: Path, workspace: Workspace) -> None:
    for name in ("bad.csv", "worse.csv"):
        (logs / name).write_text("1,2\n3,4\n")
    with pytest.raises(DataError, match=r"bad\.csv"):
        run([logs / "bad.csv", logs / "worse.csv"], Settings(), workspace)
    summary = run([logs], Settings(), workspace)
    assert [Path(r.source).name for r in summary.refused] == ["bad.csv"]
    assert [Path(c.source).name for c in summary.copies] == ["worse.csv"]


def test_refused_files_are_listed_and_the_rest_is_kept(logs: Path, workspace: Workspace) -> None:
    (logs / "bare.csv").write_text("1,2\n3,4\n")
    (logs / "empty.csv").write_text("")
    summary = run([logs], Settings(), workspace)
    assert len(summary.recordings) == 3
    assert [Path(r.source).name for r in summary.refused] == ["bare.csv", "empty.csv"]
    assert all(r.reason and r.remedy for r in summary.refused)
    assert run([logs], Settings(), workspace).skipped
    (logs / "bare.csv").write_text("time (s),force (N)\n0,1\n1,2\n2,3\n")
    mended = run([logs], Settings(), workspace)
    assert [Path(r.source).name for r in mended.refused] == ["empty.csv"]
    assert "bare" in _ids(mended)


@pytest.mark.parametrize("content", [b"", b"1,2\n3,4\n"])
def test_a_log_that_can_no_longer_be_read_keeps_its_recordings(
    content: bytes, logs: Path, workspace: Workspace, tmp_path: Path
) -> None:
    """Empty, it is refused at a look; a table without a header is refused by its reader."""
    first = run([logs], Settings(), workspace)
    path, sound = logs / "NewFile1.csv", (logs / "NewFile1.csv").read_bytes()
    before = workspace.recording_file("NewFile1").read_bytes()
    path.write_bytes(content)
    _, other = sample("siglent", tmp_path / "more")
    for _ in range(2):
        summary = run([logs, other], Settings(), workspace)
        assert _ids(summary) == ["NewFile1", "SDS00001", "log", "scope_0"]
        (refused,) = summary.refused
        assert refused.source == str(path)
        assert refused.remedy.endswith("(the recordings read from it before are kept)")
        assert refused.remedy.count("are kept") == 1
        assert workspace.recording_file("NewFile1").read_bytes() == before
    path.write_bytes(sound)
    mended = run([logs, other], Settings(), workspace)
    assert mended.refused == [] and not mended.skipped
    assert [r for r in mended.recordings if r.id == "NewFile1"] == [r for r in first.recordings if r.id == "NewFile1"]
    assert run([logs, other], Settings(), workspace).skipped


def test_a_log_of_the_same_name_does_not_take_the_place_of_one_that_cannot_be_read(
    logs: Path, workspace: Workspace, tmp_path: Path
) -> None:
    run([logs / "log.csv"], Settings(), workspace)
    (logs / "log.csv").write_text("1,2\n3,4\n")
    sample("delimited", tmp_path / "again")
    summary = run([logs / "log.csv", tmp_path / "again"], Settings(), workspace)
    assert _ids(summary) == ["log", "log-2"]
    assert [Path(r.source).parent.name for r in summary.recordings] == ["logs", "again"]


def test_a_damaged_recording_is_read_again(logs: Path, workspace: Workspace) -> None:
    first = run([logs], Settings(), workspace)
    path = workspace.recording_file(_ids(first)[0])
    whole = path.read_bytes()
    path.write_bytes(whole[:500])
    assert not run([logs], Settings(), workspace).skipped
    assert path.read_bytes() == whole


def test_a_damaged_part_stays_refused_while_other_logs_come(tmp_path: Path, workspace: Workspace) -> None:
    truth, one = sample("tektronix-tds", tmp_path / "logs")
    (tmp_path / "logs" / "F0004CH2.CSV").write_bytes(truth.data.replace(b"CH1", b"CH2"))
    one.write_bytes(b"Record Length,1,,x,\n")
    first = run([tmp_path / "logs"], Settings(), workspace)
    _, other = sample("siglent", tmp_path / "more")
    summary = run([tmp_path / "logs", other], Settings(), workspace)
    assert summary.refused == first.refused and len(first.refused) == 1
    assert [r for r in summary.recordings if r.id != "SDS00001"] == first.recordings


@pytest.mark.parametrize("content", [b"", b"1,2\n3,4\n", b"prose only\n", b"\xef\xbb\xbf"])
def test_no_readable_file_leaves_the_workspace_as_it_was(content: bytes, logs: Path, workspace: Workspace) -> None:
    bad = logs.parent / "bad.csv"
    bad.write_bytes(content)
    with pytest.raises(DataError, match="bad.csv: .*; "):
        run([bad], Settings(), workspace)
    assert not workspace.root.exists()
    run([logs], Settings(), workspace)
    before = _tree(workspace.root)
    with pytest.raises(DataError, match="bad.csv"):
        run([bad], Settings(), workspace)
    assert _tree(workspace.root) == before


def test_missing_file_is_named(workspace: Workspace, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="nowhere.csv: no such file; "):
        run([tmp_path / "nowhere.csv"], Settings(), workspace)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (Settings(resistance=-1.0), "resistance -1 ohm is impossible"),
        (Settings(resistance=float("nan")), "resistance nan ohm is impossible"),
        (Settings(map=Path("none.toml")), "give the path of a channel map"),
        (Settings(pattern="nothing"), "names no condition"),
    ],
)
def test_wrong_settings_are_configuration_errors(
    settings: Settings, message: str, logs: Path, workspace: Workspace
) -> None:
    with pytest.raises(ConfigError, match=message):
        run([logs], settings, workspace)
    assert not workspace.root.exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes anywhere")
def test_read_only_workspace(logs: Path, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir(mode=0o500)
    with pytest.raises(DataError, match="cannot write"):
        run([logs], Settings(), Workspace(folder / "work"))


def test_workspace_that_is_a_file(logs: Path, tmp_path: Path) -> None:
    (tmp_path / "work").write_text("not a folder")
    with pytest.raises(DataError, match="cannot write"):
        run([logs], Settings(), Workspace(tmp_path / "work"))


def test_same_bytes_for_any_number_of_jobs(tmp_path: Path) -> None:
    folder = tmp_path / "logs"
    folder.mkdir()
    for name in sorted(set(WRITERS) - {"mdf", "tdms", "hdf5", "matlab"}):
        sample(name, folder)
    one, many = Workspace(tmp_path / "one"), Workspace(tmp_path / "many")
    run([folder], Settings(jobs=1), one)
    run([folder], Settings(jobs=8), many)
    assert _tree(one.root) == _tree(many.root)


def test_stems_that_differ_in_case_only_get_two_ids(tmp_path: Path, workspace: Workspace) -> None:
    truth = WRITERS["siglent"]()
    truth.write(tmp_path / "logs", "SDS00005.CSV")
    other = truth.write(tmp_path / "logs", "sds00005.txt")
    other.write_bytes(truth.data + truth.data[-30:])
    summary = run([tmp_path / "logs"], Settings(), workspace)
    assert len({i.lower() for i in _ids(summary)}) == 2


def test_pauses_give_numbered_recordings_of_one_source(tmp_path: Path, workspace: Workspace) -> None:
    time = np.concatenate([np.arange(50), np.arange(500, 560)]) * 0.01
    path = tmp_path / "press.csv"
    path.write_text("time (s),force (N)\n" + "".join(f"{t:.2f},{np.sin(t):.6f}\n" for t in time))
    summary = run([path], Settings(), workspace)
    assert _ids(summary) == ["press-1", "press-2"]
    assert {r.source for r in summary.recordings} == {str(path)}
    path.write_text("".join(path.read_text().splitlines(keepends=True)[:51]))
    assert _ids(run([path], Settings(), workspace)) == ["press"]
    assert sorted(p.name for p in workspace.root.glob("recordings/*")) == ["press.parquet"]


def test_progress_is_told_file_by_file(logs: Path, workspace: Workspace) -> None:
    heard: list[tuple[str, int, int]] = []
    run([logs], Settings(), workspace, lambda what, done, total: heard.append((what, done, total)))
    assert heard == [("ingest", 1, 3), ("ingest", 2, 3), ("ingest", 3, 3)]


def test_preview_says_what_would_be_read_and_writes_nothing(logs: Path) -> None:
    (logs / "bare.csv").write_text("1,2\n3,4\n")
    before = _tree(logs.parent)
    rows = preview([logs], Settings())
    assert _tree(logs.parent) == before
    by_name = {Path(r.source).name: r for r in rows}
    assert by_name["log.csv"].channels == "current (A), flux (Wb)"
    assert by_name["log.csv"].rate == "1000 Hz"
    assert by_name["log.csv"].rows == 240
    assert by_name["bare.csv"].reader == "refused"
    assert "channel map" in by_name["bare.csv"].remedy


def test_killed_run_leaves_a_workspace_that_goes_on(
    logs: Path, workspace: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The moment between the renames and the summary is the worst one: recordings are there, ingest.json is not."""
    import mrfit.ingest.stage as stage

    class Killed(BaseException):
        pass

    def die(*_: object) -> None:
        raise Killed

    with monkeypatch.context() as patch:
        patch.setattr(stage, "write_json", die)
        with pytest.raises(Killed):
            run([logs], Settings(), workspace)
    summary = run([logs], Settings(), workspace)
    assert len(summary.recordings) == 3 and not summary.skipped
    assert len(list(workspace.root.glob("recordings/*"))) == 3
