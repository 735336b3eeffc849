"""One log of a batch from its file to its parameters, as a worker does it."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mrfit.batch.parcel import Parcel, returned, unpacked
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import NAMING
from mrfit.errors import DataError, MrfitError, Unreachable, is_of_machine
from mrfit.fit import stage as fit_stage
from mrfit.flux import stage as flux_stage
from mrfit.ingest import stage as ingest_stage
from mrfit.io.dataset import Dataset
from mrfit.io.keys import digest_of
from mrfit.io.schemas.batch import Fitted, LogRow, OfCondition
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace
from mrfit.segment import stage as segment_stage
from mrfit.settings.sheet import Settings as SheetSettings

# A log's workers: it is itself done by one
ALONE = 1
NO_SHEET = "no-sheet"
"""Warning of a log of which a sheet was asked that it does not allow."""


@dataclass(frozen=True)
class StageSettings:
    """Settings of the stages of every log, each for one worker."""

    ingest: ingest_stage.Settings
    flux: flux_stage.Settings
    fit: fit_stage.Settings
    report: bool
    sheet: bool


@dataclass(frozen=True)
class Job:
    """A log that is due.

    Attributes
    ----------
    name
        Its path as it is told.
    key
        Key of all that determines its result.
    files
        Its file; several where an instrument writes one record into several.
    map
        Its channel map, or None.
    workspace
        Where its stages write; None to keep its parameters only.
    asked
        What is done.
    parcel
        Its files, where the worker does not see them.
    """

    name: str
    key: str
    files: tuple[Path, ...]
    map: Path | None
    workspace: Path | None
    asked: StageSettings
    parcel: Parcel | None = None


@dataclass(frozen=True)
class LogResult:
    """Row of a log, and the files of its workspace where the worker's is not the one here."""

    row: LogRow
    files: tuple[tuple[str, bytes], ...] = ()


def do(job: Job, progress: Progress) -> LogResult:
    """Fit one log and return its row; of one that cannot be used the row states the reason."""
    if job.parcel is None:
        return LogResult(_row(job))
    with unpacked(job.parcel):
        row = _row(job)
        return LogResult(row, returned(job.workspace) if job.workspace else ())


def _row(job: Job) -> LogRow:
    try:
        fit = _in_workspace(job, Workspace(job.workspace)) if job.workspace else _in_memory(job)
        without = [NO_SHEET] if job.workspace and job.asked.sheet and not _has_sheet(Workspace(job.workspace)) else []
    except Unreachable:
        raise
    except MrfitError as error:
        # what is no fault of the log is tried again
        return failed(job.name, "" if is_of_machine(error) else job.key, error)
    return LogRow(log=job.name, key=job.key, made=made_of(job), tests=[*_tests(fit, without)])


def made_of(job: Job) -> str:
    """Return a hash of what a log's workspace holds of its fit, which commands by hand may change."""
    if job.workspace is None:
        return ""
    workspace = Workspace(job.workspace)
    fit = workspace.fit_folder(job.asked.fit.fit_name) / "fit.json"
    files = (workspace.ingest_json, workspace.flux_json, workspace.segments_file, fit)
    return digest_of(*(hashlib.sha256(f.read_bytes()).hexdigest() if f.is_file() else "" for f in files))


def failed(name: str, key: str, error: BaseException) -> LogRow:
    """Return the row of a log that cannot be used."""
    return LogRow(log=name, key=key, error=" ".join(str(error).split()) or type(error).__name__)


def _in_workspace(job: Job, workspace: Workspace) -> Fit:
    asked = job.asked
    with workspace.locked():
        ingest_stage.run(job.files, replace(asked.ingest, map=job.map), workspace)
        flux_stage.run(workspace, asked.flux)
        segment_stage.run(workspace, segment_stage.Settings())
        fit = fit_stage.run(workspace, asked.fit)
        if asked.report:
            from mrfit.report import stage as report_stage

            report_stage.run(workspace, report_stage.Settings((asked.fit.fit_name,), jobs=ALONE))
    return fit


def _in_memory(job: Job) -> Fit:
    asked = job.asked
    read = ingest_stage.read(job.files, replace(asked.ingest, map=job.map)).recordings
    found, _ = flux_stage.reconstruct(read, asked.flux)
    segments, _ = segment_stage.cut(found, len(found), segment_stage.Settings())
    dataset = Dataset(segments, {r.id: r for r in found})
    origin = fit_stage.origin_of(dataset, asked.fit)
    return fit_stage.identify(dataset, asked.fit, origin, silent).content


def _has_sheet(workspace: Workspace) -> bool:
    """Write the test sheet of a log into its workspace, and return whether the log allows one."""
    from mrfit.sheet.write import write

    recordings = [workspace.read_recording(i, workspace.latest) for i in sorted(workspace.identifiers)]
    try:
        write(recordings, SheetSettings(), (), workspace.root / "sheet", pdf=False)
    except DataError:
        return False
    return True


def _tests(fit: Fit, more: Sequence[str]) -> Sequence[OfCondition]:
    errors = {(m.condition, m.role): m.nrmse for m in fit.metrics}
    return [
        OfCondition(
            condition=result.condition,
            **{name: getattr(result.at, name) for name in NAMING},
            nrmse=errors.get((result.condition, "train")),
            nrmse_holdout=errors.get((result.condition, "holdout")),
            warnings=sorted({w.kind for w in (*fit.warnings, *result.warnings)} | {*more}),
            parameters=[
                Fitted(parameter=p.name, value=p.value, unit=p.unit, low=p.low, high=p.high)
                for p in (*result.parameters, *result.derived)
                if not p.fixed
            ],
            covariance=result.covariance,
        )
        for result in fit.results
    ]
