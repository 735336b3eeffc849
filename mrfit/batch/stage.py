"""The batch: every log of a folder through all stages, one process pool for all, and one table and page of them."""

import os
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path

from mrfit.batch import page, table
from mrfit.batch.fleet import fleet_of
from mrfit.batch.journal import JOURNAL_NAME, Journal, read_journal, write_journal
from mrfit.batch.log import ALONE, NO_SHEET, Job, LogResult, StageSettings, do, failed, made_of
from mrfit.batch.parcel import packed, put
from mrfit.batch.plan import plan
from mrfit.core import plugins
from mrfit.core.counting import number_of
from mrfit.core.executors.order import executor, is_apart
from mrfit.core.progress import Progress, silent
from mrfit.errors import ConfigError, DataError, MrfitError, is_of_machine
from mrfit.fit import stage as fit_stage
from mrfit.flux import stage as flux_stage
from mrfit.ingest import stage as ingest_stage
from mrfit.io.keys import code_version, digest_of
from mrfit.io.schemas.batch import BatchFile, LogRow
from mrfit.io.schemas.reading import reusable
from mrfit.io.workspace import Workspace, plain, write_json, write_text
from mrfit.kernels.jit import is_cold
from mrfit.settings.batch import Settings as Settings


@dataclass(frozen=True)
class Stages:
    """Settings with which every log is read and fitted."""

    ingest: ingest_stage.Settings
    fit: fit_stage.Settings


def run(folder: Path, work: Path, settings: Settings, stages: Stages, progress: Progress = silent) -> BatchFile:
    """Fit every log of a folder whose result is not there yet, and write the table and the page of all of them.

    Parameters
    ----------
    folder
        Folder of logs.
    work
        The batch's folder: journal, page, table, and a workspace for each log unless ``settings.table`` is given.
    settings, stages
        What is kept of every log, and how it is read and fitted.
    progress
        Reports every log.

    Returns
    -------
    BatchFile
        How many logs were fitted, were unchanged and failed, and where table and page lie.

    Raises
    ------
    ConfigError
        If a setting or a channel map is wrong.
    DataError
        If there is no log, or none can be fitted.
    """
    fit_stage.check(stages.fit)
    if settings.table and settings.table.suffix.lower() != ".parquet":
        raise ConfigError(f"--table {settings.table}: it is written as Parquet; give a name that ends in .parquet")
    if is_apart() and plugins.of_files():
        raise ConfigError("--on: workers know nothing of a plug-in's file; say --shared where they see the same paths")
    flux = flux_stage.Settings(resistance=settings.resistance)
    alone = replace(stages.ingest, jobs=ALONE), flux, replace(stages.fit, jobs=ALONE)
    asked = StageSettings(*alone, settings.report, settings.sheet)
    with Workspace(work).locked():
        found = plan(folder, settings.like, work, asked, settings.table is None, progress)
        journal = work / JOURNAL_NAME
        earlier = read_journal(journal)
        due = [job for job in found.jobs if not _is_done(job, earlier.get(job.name))]
        new = _done(due, stages.fit.jobs, journal, progress)
        known = earlier | new
        rows = sorted([*(known[job.name] for job in found.jobs), *found.refused], key=lambda row: row.log)
        # what is told of logs elsewhere stays for a batch of theirs
        kept = {name: row for name, row in known.items() if _is_elsewhere(name, folder)}
        write_journal(journal, kept | {row.log: row for row in rows if row.key})
        facts = [("Folder", str(folder)), ("Model", f"{stages.fit.model}, fitted by {stages.fit.optimizer}")]
        return _written(rows, work, settings, _LogCounts(len(due), len(found.jobs) - len(due)), facts)


def _is_done(job: Job, row: LogRow | None) -> bool:
    """Return whether the result of a log is there: its row, and what its workspace is to hold."""
    if row is None or row.key != job.key:
        return False
    if job.workspace is None or row.error:
        return True
    workspace = Workspace(job.workspace)
    sheet = job.asked.sheet and not any(NO_SHEET in test.warnings for test in row.tests)
    wanted = [workspace.report_folder / "report.json"] * job.asked.report + [
        workspace.root / "sheet/sheet.json"
    ] * sheet
    return row.made == made_of(job) and all(path.is_file() for path in wanted)


def _is_elsewhere(name: str, folder: Path) -> bool:
    return not os.path.abspath(name).startswith(os.path.join(os.path.abspath(folder), ""))


def _done(due: Sequence[Job], jobs: int, path: Path, progress: Progress) -> dict[str, LogRow]:
    """Return the rows of logs that are due, each written to the journal as soon as it is there."""
    rows: dict[str, LogRow] = {}
    left = list(due)
    with Journal(path) as journal:

        def keep(job: Job, row: LogRow) -> None:
            rows[job.name] = row
            journal.add(row)
            progress("logs", len(rows), len(due))

        while left and is_cold():
            # processes side by side would each compile what the first fit compiles for all
            first = left.pop(0)
            keep(first, do(first, silent).row)
        apart = is_apart()
        doer = executor(min(jobs, len(left)))
        with closing(doer.ends(do, _sent(left, apart), silent)) as ends:
            for end in ends:
                job = left[end.place]
                keep(job, _received(job, end.made, apart) if end.made else failed(job.name, "", _fault(end.error)))
    return rows


def _fault(error: BaseException | None) -> BaseException:
    """Return the error of a log whose worker was killed, or met a fault of the machine; raise one that is mrfit's."""
    if error and not isinstance(error, MrfitError) and not is_of_machine(error):
        raise error
    return error or MemoryError()


def _sent(due: Sequence[Job], apart: bool) -> Iterator[Job]:
    """Yield logs as workers get them: with their files, where these are not seen there."""
    for job in due:
        if not apart:
            yield job
            continue
        paths = [*job.files, *([job.map] if job.map else []), *([job.workspace] if job.workspace else [])]
        yield replace(job, parcel=packed(p for p in paths if p.exists()))


def _received(job: Job, done: LogResult, apart: bool) -> LogRow:
    if (done.row.log, done.row.key) not in ((job.name, job.key), (job.name, "")):
        told = DataError(f"a worker has answered for {done.row.log[:80]}; look after your workers")
        return failed(job.name, "", told)
    if apart and job.workspace and done.files:
        try:
            put(job.workspace, done.files)
        except DataError as error:
            return failed(job.name, "", error)
    return done.row


@dataclass(frozen=True)
class _LogCounts:
    """Logs done by this call, and those whose result was there."""

    done: int
    unchanged: int


def _written(
    rows: Sequence[LogRow], work: Path, settings: Settings, counted: _LogCounts, facts: Sequence[tuple[str, str]]
) -> BatchFile:
    """Write the table and the page of all logs, where they are not those of the last call."""
    bad = [row for row in rows if row.error]
    if len(bad) == len(rows):
        # that of most logs, each without its own name
        reasons = [row.error.replace(row.log, "").replace(Path(row.log).name, "") for row in bad]
        usual = max(reasons, key=reasons.count)
        raise DataError(f"none of {number_of('log', len(rows))} can be fitted; {bad[reasons.index(usual)].error}")
    where, target = settings.table or work / "batch.parquet", work / "batch.html"
    key = digest_of(plain(rows), plain(facts), code_version(), version("matplotlib"))
    existing = reusable(work / "batch.json", BatchFile)
    if existing and existing.key == key and existing.table == str(where) and where.is_file() and target.is_file():
        return replace(existing, done=counted.done, unchanged=counted.unchanged)
    fleet = fleet_of([row for row in rows if not row.error])
    table.write(where, rows)
    write_text(target, page.render(rows, fleet, facts))
    summary = BatchFile(
        key=key,
        logs=len(rows),
        done=counted.done,
        unchanged=counted.unchanged,
        failed=bad,
        table=str(where),
        page=str(target),
        outliers=len(fleet.outliers),
        drifts=len(fleet.drifts),
        most=fleet.most,
    )
    write_json(work / "batch.json", summary)
    return summary
