"""A batch is the fits of its logs one by one; only what changed is done again, and a kill loses what was at work."""

import errno
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

import mrfit
from mrfit.batch import page, stage
from mrfit.batch.journal import JOURNAL_NAME, read_journal
from mrfit.batch.log import Job, LogResult, StageSettings
from mrfit.batch.parcel import put
from mrfit.core.progress import Progress
from mrfit.errors import ConfigError, DataError
from mrfit.fit import stage as stage_of_fit
from mrfit.ingest import stage as stage_of_ingest
from mrfit.io.schemas.batch import BatchFile, LogRow
from mrfit.io.workspace import Workspace
from mrfit.settings import fit, flux, ingest
from mrfit.settings.batch import Settings
from tests.batch.logs import CYCLES, write_log

FITTING = fit.Settings(model="bingham", optimizer="lsq")


@pytest.fixture
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write pages without their figures, which take four times as long as the fits; ``test_page.py`` has them."""
    for figure in ("overview", "over_current"):
        monkeypatch.setattr(page, figure, lambda fleet: "<svg></svg>")


@pytest.fixture
def logs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Four logs, of which one is no log at all, and one folder deeper."""
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "logs" / "sub" / "c 1.csv", 2, fy=600.0)
    return two_logs(tmp_path)


def two_logs(folder: Path) -> Path:
    """Write two logs and one that is none."""
    for seed, name in enumerate(("a.csv", "b.csv")):
        write_log(folder / "logs" / name, seed, fy=500.0 + 50.0 * seed)
    (folder / "logs" / "note.csv").write_text("no numbers\nin here\n")
    return Path("logs")


def run(logs: Path, work: str = "work", fitting: fit.Settings = FITTING, **settings: object) -> BatchFile:
    stages = stage.Stages(ingest.Settings(), fitting)
    return stage.run(logs, Path(work), Settings(**settings), stages)  # type: ignore[arg-type]


def files_of(work: str) -> dict[str, bytes]:
    found = {p.relative_to(work).as_posix(): p.read_bytes() for p in Path(work).rglob("*") if p.is_file()}
    return {name: content for name, content in found.items() if not name.endswith(".lock")}


def test_the_table_holds_what_a_fit_of_each_log_alone_gives(logs: Path) -> None:
    summary = run(logs)
    assert (summary.logs, summary.done, summary.unchanged) == (4, 4, 0)
    table = pq.read_table(summary.table).to_pylist()
    for name, fy in (("a.csv", 500.0), ("b.csv", 550.0), ("sub/c 1.csv", 600.0)):
        alone = mrfit.fit(mrfit.read(logs / name), model="bingham", optimizer="lsq")
        rows = {r["parameter"]: r for r in table if r["log"] == f"logs/{name}"}
        assert {p: r["value"] for p, r in rows.items()} == alone.params["value"].to_dict()
        assert rows["fy"]["low"] <= fy <= rows["fy"]["high"] and rows["fy"]["unit"] == "N"
        assert (Path("work") / "logs" / name / "fits" / "bingham.lsq" / "fit.json").is_file()
        given = alone.content.results[0].covariance
        assert given and [rows[n]["covariance"] for n in given.names] == given.rows
        assert [(rows[n]["role"], rows[n]["scale"]) for n in given.names] == [
            (role, "log" if log else "linear") for role, log in zip(given.roles, given.log, strict=True)
        ]
    bad = [r for r in table if r["log"] == "logs/note.csv"]
    assert len(bad) == 1 and np.isnan(bad[0]["value"]) and "note.csv" in bad[0]["warnings"]
    assert [f.log for f in summary.failed] == ["logs/note.csv"]
    assert "note.csv" in Path(summary.page).read_text()


def test_one_table_without_workspaces_is_the_same_table(logs: Path) -> None:
    first, second = run(logs), run(logs, "other", table=Path("fleet.parquet"))
    assert Path("fleet.parquet").read_bytes() == Path(first.table).read_bytes()
    assert Path(second.page).read_bytes() == Path(first.page).read_bytes()
    assert {p.name for p in Path("other").iterdir()} <= {JOURNAL_NAME, "batch.html", "batch.json", ".lock"}


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of logs as they are done."""
    names: list[str] = []
    do: Callable[[Job, Progress], object] = stage.do

    def noting(job: Job, progress: Progress) -> object:
        names.append(job.name)
        return do(job, progress)

    monkeypatch.setattr(stage, "do", noting)
    return names


@pytest.mark.usefixtures("undrawn")
def test_only_what_changed_is_done_again(logs: Path, counted: list[str]) -> None:
    run(logs)
    before = files_of("work")
    counted.clear()
    assert run(logs).unchanged == 4 and counted == [] and files_of("work") == before
    # a time stamp is no change, other numbers are
    os.utime(logs / "b.csv", (1e9, 1e9))
    assert run(logs).unchanged == 4 and counted == []
    write_log(logs / "a.csv", 9, fy=700.0)
    assert run(logs).done == 1 and counted == ["logs/a.csv"]
    counted.clear()
    # so are another model, and a channel map of one folder
    assert run(logs, fitting=fit.Settings(model="tanh", optimizer="lsq")).done == 4
    run(logs)
    counted.clear()
    (logs / "sub" / "mrfit.toml").write_text('[channels.force]\ncolumn = "force (N)"\nunit = "N"\nscale = 2.0\n')
    assert run(logs).done == 1 and counted == ["logs/sub/c 1.csv"]
    counted.clear()
    # a workspace that is gone is made again
    shutil.rmtree(Path("work") / "logs" / "b.csv")
    assert run(logs).done == 1 and counted == ["logs/b.csv"]


@pytest.mark.usefixtures("undrawn")
def test_a_kill_loses_what_was_at_work_alone(logs: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    run(logs, "whole")
    counted.clear()
    do = stage.do

    def killed_at_the_second(job: Job, progress: Progress) -> object:
        if counted:
            raise KeyboardInterrupt
        return do(job, progress)

    with monkeypatch.context() as patched:
        patched.setattr(stage, "do", killed_at_the_second)
        with pytest.raises(KeyboardInterrupt):
            run(logs)
    assert counted == ["logs/a.csv"]
    # the journal's last line may be torn
    with (Path("work") / JOURNAL_NAME).open("ab") as handle:
        handle.write(b'{"log": "logs/b.csv", "ke')
    assert run(logs).done == 3 and counted == ["logs/a.csv", "logs/b.csv", "logs/note.csv", "logs/sub/c 1.csv"]
    assert files_of("work").keys() == files_of("whole").keys()
    same = [n for n in files_of("whole") if n.startswith("batch.") and n != "batch.json"]
    assert len(same) == 3 and all(files_of("work")[n] == files_of("whole")[n] for n in same)


@pytest.mark.usefixtures("undrawn")
def test_a_log_that_fails_ends_no_other_and_is_not_tried_again(logs: Path, counted: list[str]) -> None:
    (logs / "aa.csv").write_text("time (s),temperature (degC)\n" + "".join(f"{k},{20 + k}\n" for k in range(50)))
    summary = run(logs)
    assert summary.done == 5 and [f.log for f in summary.failed] == ["logs/aa.csv", "logs/note.csv"]
    counted.clear()
    again = run(logs)
    assert counted == [] and [f.error for f in again.failed] == [f.error for f in summary.failed]


@pytest.mark.usefixtures("undrawn")
def test_a_log_that_is_gone_is_in_the_table_no_longer(logs: Path) -> None:
    run(logs)
    (logs / "a.csv").unlink()
    summary = run(logs)
    assert "logs/a.csv" not in set(pq.read_table(summary.table)["log"].to_pylist())
    assert set(read_journal(Path("work") / JOURNAL_NAME)) == {"logs/b.csv", "logs/note.csv", "logs/sub/c 1.csv"}


@pytest.mark.usefixtures("undrawn")
def test_two_processes_write_what_one_does(logs: Path) -> None:
    run(logs)
    run(logs, "two", fit.Settings(model="bingham", optimizer="lsq", jobs=2))
    one, two = files_of("work"), files_of("two")
    for name in ("batch.json",):
        one[name] = one[name].replace(b'"work/', b'"two/')
    assert one == two


def test_what_cannot_be_done_is_said_in_one_line(logs: Path) -> None:
    with pytest.raises(DataError, match=r"no log like \*\.tdms"):
        run(logs, like="*.tdms")
    with pytest.raises(DataError, match="none of 1 log can be fitted; .*note.csv"):
        run(logs, like="NOTE.*")
    with pytest.raises(ConfigError, match=r"--table all.csv: it is written as Parquet; give a name that ends in"):
        run(logs, table=Path("all.csv"))
    # the reason of most logs, not of the first
    with pytest.raises(DataError, match="none of 4 logs can be fitted; .*[abc 1]+.csv: no flux in this log"):
        run(logs, fitting=fit.Settings(model="boucwen-flux", optimizer="lsq"))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table of two logs and one that is none, done without a fault."""
    folder = tmp_path_factory.mktemp("whole")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        return Path(run(two_logs(folder)).table).read_bytes()


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    "fault",
    [
        OSError(errno.ENOSPC, "No space left on device"),
        PermissionError(errno.EACCES, "Permission denied"),
        OSError(errno.EROFS, "Read-only file system"),
        MemoryError(),
    ],
)
@pytest.mark.parametrize("wrapped", [False, True])
def test_a_fault_of_the_machine_is_tried_again(
    fault: Exception, wrapped: bool, whole: bytes, tmp_path: Path, counted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    logs = two_logs(tmp_path)
    write = stage_of_ingest.run

    def failing(files: Sequence[Path], *rest: object) -> object:
        if files[0].name == "b.csv":
            try:
                raise fault
            except Exception as error:
                if not wrapped:
                    raise
                raise DataError(f"work: cannot write ({error})") from None
        return write(files, *rest)  # type: ignore[arg-type]

    with monkeypatch.context() as patched:
        patched.setattr(stage_of_ingest, "run", failing)
        assert [f.log for f in run(logs).failed] == ["logs/b.csv", "logs/note.csv"]
    # as soon as there is room, the next batch does it, and nothing else
    counted.clear()
    again = run(logs)
    assert counted == ["logs/b.csv"] and [f.log for f in again.failed] == ["logs/note.csv"]
    assert Path(again.table).read_bytes() == whole


@pytest.mark.usefixtures("undrawn")
def test_a_folder_that_cannot_be_written_is_tried_again(logs: Path, counted: list[str]) -> None:
    Path("work/logs").mkdir(parents=True)
    # no folder can be made where a file lies, whoever asks
    (Path("work") / "logs" / "b.csv").write_text("in the way")
    assert "cannot write" in [f.error for f in run(logs).failed if f.log == "logs/b.csv"][0]
    (Path("work") / "logs" / "b.csv").unlink()
    counted.clear()
    assert [f.log for f in run(logs).failed] == ["logs/note.csv"] and counted == ["logs/b.csv"]


@pytest.mark.usefixtures("undrawn")
def test_a_fit_by_hand_in_a_log_s_workspace_is_seen(logs: Path, counted: list[str]) -> None:
    before = run(logs)
    table = Path(before.table).read_bytes()
    counted.clear()
    workspace = Workspace(Path("work") / "logs" / "a.csv")
    # another model's fit is no matter of the batch's
    stage_of_fit.run(workspace, fit.Settings(model="tanh", optimizer="lsq"))
    assert run(logs).unchanged == 4 and not counted
    stage_of_fit.run(workspace, fit.Settings(model="bingham", optimizer="lsq", bounds=(("C_inf", 1.0, 2.0),)))
    assert run(logs).done == 1 and counted == ["logs/a.csv"]
    assert Path(before.table).read_bytes() == table
    counted.clear()
    assert run(logs).unchanged == 4 and not counted


@pytest.mark.usefixtures("undrawn")
def test_a_link_that_leads_nowhere_is_named(logs: Path) -> None:
    (logs / "gone.csv").symlink_to("nowhere.csv")
    (logs / "round.csv").symlink_to("round.csv")
    failed = {f.log: f.error for f in run(logs).failed}
    assert failed.keys() == {"logs/gone.csv", "logs/note.csv", "logs/round.csv"}
    assert "a symbolic link to nowhere.csv, which is not there; mend or remove the link" in failed["logs/gone.csv"]


def test_a_journal_that_is_a_link_is_not_followed(logs: Path) -> None:
    Path("elsewhere").write_text("mine\n")
    Path("work").mkdir()
    (Path("work") / JOURNAL_NAME).symlink_to(Path("elsewhere").absolute())
    with pytest.raises(DataError, match=f"{JOURNAL_NAME}: a symbolic link, which mrfit does not follow; remove it"):
        run(logs)
    assert Path("elsewhere").read_text() == "mine\n"


@pytest.mark.parametrize(
    "name", ["../a", "fits/../../a", "/etc/a", "fits/..", "a.txt", "fits", "ingest.json/a", "fits/a\\b", "C:a", ".lock"]
)
def test_a_worker_s_file_lands_in_its_workspace_or_nowhere(name: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="which no workspace has"):
        put(tmp_path / "w", [("fits/m/fit.json", b"1"), (name, b"2")])
    assert not list(tmp_path.rglob("*"))
    put(tmp_path / "w", [("fits/m.lsq/fit.json", b"1"), ("ingest.json", b"2"), ("recordings/a-1.parquet", b"3")])
    assert len([p for p in tmp_path.rglob("*") if p.is_file()]) == 3


@pytest.mark.parametrize(("log", "key"), [("logs/other.csv", "k"), ("logs/a.csv", "another")])
def test_an_answer_for_another_log_is_refused(log: str, key: str, tmp_path: Path) -> None:
    asked = StageSettings(ingest.Settings(), flux.Settings(), FITTING, False, False)
    job = Job("logs/a.csv", "k", (Path("logs/a.csv"),), None, tmp_path / "w", asked)
    row = stage._received(job, LogResult(LogRow(log=log, key=key), (("ingest.json", b"1"),)), apart=True)
    assert (row.log, row.key) == ("logs/a.csv", "") and "a worker has answered for" in row.error
    assert not (tmp_path / "w").exists()
    mine = LogRow(log="logs/a.csv", key="k")
    assert stage._received(job, LogResult(mine, (("ingest.json", b"1"),)), apart=True) == mine
    assert (tmp_path / "w" / "ingest.json").read_bytes() == b"1"
    # what has failed for want of something there bears no key
    assert stage._received(job, LogResult(LogRow(log="logs/a.csv", error="full")), apart=True).error == "full"


@pytest.mark.usefixtures("undrawn")
def test_a_sheet_is_written_for_each_log_that_allows_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_log(tmp_path / "logs" / "a.csv", 1)
    text = (tmp_path / "logs" / "a.csv").read_text().splitlines()
    # two thirds of a cycle: enough for a fit, not for a sheet
    (tmp_path / "logs" / "b.csv").write_text("\n".join(text[: 1 + len(text) * 2 // 3 // CYCLES]))
    assert run(Path("logs")).done == 2
    run(Path("logs"), sheet=True)
    rows = {Path(log).name: row for log, row in read_journal(Path("work") / JOURNAL_NAME).items()}
    sheets = [p.parent.parent for p in Path("work").rglob("sheet/sheet.html")]
    assert len(sheets) == 1 and sheets[0].name.startswith("a")
    warned = {name: "no-sheet" in row.tests[0].warnings for name, row in rows.items()}
    assert warned == {"a.csv": False, "b.csv": True}
    assert run(Path("logs"), sheet=True).done == 0
