"""The stages in order, each under the workspace's lock; no other logic.

Every function imports the stages it runs, so that a command starts as soon as its own are loaded.
"""

from __future__ import annotations

import glob
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.core.progress import Progress
from mrfit.errors import ConfigError
from mrfit.io.workspace import Workspace, plain

if TYPE_CHECKING:
    import mrfit.flux.stage
    import mrfit.ingest.stage
    import mrfit.report.stage
    import mrfit.segment.stage
    from mrfit.cli.config import DiscoverSection, FitSection, PipelineFile
    from mrfit.discover import stage as discover_stage
    from mrfit.fit import stage as fit_stage

Summary = dict[str, Any]


@dataclass(frozen=True)
class Overrides:
    """What the command line changes in a pipeline file: logs, workspace, worker threads."""

    logs: Sequence[Path] | None = None
    work: Path | None = None
    jobs: int = 1


def ingest(work: Path, logs: Sequence[Path], settings: mrfit.ingest.stage.Settings, progress: Progress) -> Summary:
    """Read logs into the workspace's recordings."""
    import mrfit.ingest.stage

    workspace = Workspace(work)
    with workspace.locked():
        return mrfit.ingest.stage.run(logs, settings, workspace, progress)


def flux(work: Path, settings: mrfit.flux.stage.Settings, progress: Progress) -> Summary:
    """Reconstruct flux linkage."""
    import mrfit.flux.stage

    workspace = Workspace(work)
    with workspace.locked():
        return mrfit.flux.stage.run(workspace, settings, progress)


def segment(work: Path, settings: mrfit.segment.stage.Settings, progress: Progress) -> Summary:
    """Cut recordings by test condition, reconstructing flux first where that is due."""
    import mrfit.segment.stage

    workspace = Workspace(work)
    with workspace.locked():
        _flux_as_before(workspace, None, progress)
        return mrfit.segment.stage.run(workspace, settings, progress)


def fit(work: Path, settings: fit_stage.Settings, resistance: float | str | None, progress: Progress) -> Summary:
    """Fit a model, running flux and segment first where they are due, with the settings they last had."""
    from mrfit.fit import stage as fit_stage

    workspace = Workspace(work)
    fit_stage.check(settings)
    with workspace.locked():
        notes = _segments_as_before(workspace, resistance, progress)
        return {**fit_stage.run(workspace, settings, progress), "notes": notes}


def discover(
    work: Path, settings: discover_stage.Settings, resistance: float | str | None, progress: Progress
) -> Summary:
    """Find what a model lacks and draw the page, running flux and segment first, with the settings they last had."""
    from mrfit.discover import stage as discover_stage

    workspace = Workspace(work)
    discover_stage.check(settings)
    with workspace.locked():
        notes = _segments_as_before(workspace, resistance, progress)
        return {**_discover(workspace, settings, progress), "notes": notes}


def _discover(workspace: Workspace, settings: discover_stage.Settings, progress: Progress) -> Summary:
    import mrfit.report.discovery
    from mrfit.discover import stage as discover_stage

    made = discover_stage.run(workspace, settings, progress)
    page = mrfit.report.discovery.run(workspace, progress).path
    return {**plain(made.found.to_json()), "skipped": made.skipped, "page": str(page)}


def advise(work: Path) -> Summary:
    """Return the last discovery's advice."""
    import mrfit.report.discovery

    return asdict(mrfit.report.discovery.advice(Workspace(work)))


def compare_models(work: Path, models: Sequence[str], options: dict[str, Any], progress: Progress) -> Summary:
    """Fit several models and put them into one table; ``options`` are those of ``mrfit.compare.stage.Settings``."""
    from mrfit.compare import stage as compare_stage

    settings = compare_stage.Settings(models=tuple(models), **options)
    compare_stage.check(settings)
    workspace = Workspace(work)
    with workspace.locked():
        notes = _segments_as_before(workspace, None, progress)
        return {**compare_stage.run(workspace, settings, progress), "notes": notes}


def compare_optimizers(
    work: Path, optimizers: Sequence[str], options: dict[str, Any], seeds: int, progress: Progress
) -> Summary:
    """Run several optimizers on one model; ``options`` are those of ``mrfit.fit.stage.Settings``."""
    from mrfit.compare import optimizers as compare_optimizers
    from mrfit.fit import stage as fit_stage

    settings = compare_optimizers.Settings(tuple(optimizers), fit_stage.Settings(**options), seeds)
    compare_optimizers.check(settings)
    workspace = Workspace(work)
    with workspace.locked():
        notes = _segments_as_before(workspace, None, progress)
        return {**compare_optimizers.run(workspace, settings, progress), "notes": notes}


def _segments_as_before(workspace: Workspace, resistance: float | str | None, progress: Progress) -> list[str]:
    """Run flux and segment where they are due, with the settings they last had; return what is to be told of these.

    A resistance given now becomes the workspace's: all its fits are made from one flux linkage, and a command without
    it that went back to another one would make them outdated.
    """
    import mrfit.segment.stage

    notes = _flux_as_before(workspace, resistance, progress)
    mrfit.segment.stage.run(workspace, mrfit.segment.stage.last_settings(workspace), progress)
    return notes


def _flux_as_before(workspace: Workspace, resistance: float | str | None, progress: Progress) -> list[str]:
    import mrfit.flux.stage

    settings = mrfit.flux.stage.last_settings(workspace)
    if resistance is not None:
        settings = replace(settings, resistance=resistance)
    integrated = mrfit.flux.stage.run(workspace, settings, progress)["resistance"] is not None
    if settings.resistance is None or not integrated:
        return []
    auto = settings.resistance == "auto"
    what = "coil resistance: estimated" if auto else f"coil resistance {settings.resistance} Ω"
    if resistance is None:
        return [f"{what}, as an earlier command of this workspace was told; `mrfit flux` sets it anew"]
    return [f"{what}, kept for later commands of this workspace; `mrfit flux` sets it anew"]


def predict(
    work: Path, fit_name: str, logs: Sequence[Path], settings: mrfit.ingest.stage.Settings, progress: Progress
) -> Summary:
    """Simulate a fit on other logs, which pass through ingest, flux and segment in a folder of their own.

    The flux and segment settings of the fit's workspace apply, but for the hold-out. A coil resistance that was given
    there holds for the logs too; one that was found there is used where the logs state none.
    """
    import mrfit.flux.stage
    import mrfit.ingest.stage
    import mrfit.segment.stage
    from mrfit.fit import predict as fit_predict
    from mrfit.fit import select as fit_select

    workspace = Workspace(work)
    found = fit_predict.read_fit(workspace, fit_name)
    with workspace.aside() as other:
        ingested = mrfit.ingest.stage.run(logs, settings, other, progress)
        mrfit.flux.stage.run(other, _flux_to_predict(workspace, settings.resistance), progress)
        segmenting = mrfit.segment.stage.last_settings(workspace)
        cut = mrfit.segment.stage.run(other, replace(segmenting, holdout="none"), progress)
        prediction = fit_predict.predict(found, fit_select.read_dataset(other))
    oddities = [f"{r['id']}: {f['text']}" for r in ingested["recordings"] for f in r["findings"]]
    return {
        "fit": fit_name,
        "model": found["model"],
        "output": found["output"],
        "metrics": prediction.metrics,
        "used": prediction.used,
        "conditions": {s.id: s.condition for s in prediction.blocks.segments},
        "findings": [*oddities, *cut["findings"]],
        "outdated": bool(workspace.outdated([found])),
        "refused": ingested["refused"],
        "warnings": prediction.warnings,
    }


def _flux_to_predict(workspace: Workspace, resistance: float | str | None) -> mrfit.flux.stage.Settings:
    import mrfit.flux.stage

    settings, found = mrfit.flux.stage.last_settings(workspace), mrfit.flux.stage.last_resistance(workspace)
    return mrfit.flux.stage.to_predict(settings, found, resistance)


def status(work: Path, progress: Progress) -> Summary:
    """Return what the workspace holds, what each step used, and what is out of date and why."""
    from mrfit.cli.status import status as look

    return {"work": str(work), "steps": [asdict(step) for step in look(Workspace(work), progress)]}


def remove(work: Path, fits: Sequence[str]) -> Summary:
    """Take fits out of the workspace."""
    from mrfit.io.removal import remove_fits

    workspace = Workspace(work)
    with workspace.locked():
        return {"work": str(work), "removed": remove_fits(workspace, fits), "left": workspace.fit_names()}


def report(work: Path, settings: mrfit.report.stage.Settings, progress: Progress) -> Summary:
    """Write tables, figures and the page."""
    import mrfit.report.stage

    workspace = Workspace(work)
    with workspace.locked():
        return mrfit.report.stage.run(workspace, settings, progress)


def run(config: PipelineFile, folder: Path, overrides: Overrides, progress: Progress) -> Summary:
    """Run all stages of a pipeline file; logs and map are relative to its folder, ``work`` to the current one.

    Raises
    ------
    ConfigError
        If a pattern of ``[ingest] logs`` matches nothing, or a fit's settings are wrong.
    """
    import mrfit.flux.stage
    import mrfit.ingest.stage
    import mrfit.report.stage
    import mrfit.segment.stage
    from mrfit.discover import stage as discover_stage
    from mrfit.fit import stage as fit_stage
    from mrfit.ingest.containers.memory import size_of

    work = overrides.work or Path(config.work)
    fits = [_fit_settings(section, overrides.jobs) for section in config.fit]
    for settings in fits:
        fit_stage.check(settings)
    discovery = _discover_settings(config.discover, overrides.jobs) if config.discover else None
    if discovery:
        discover_stage.check(discovery)
    logs = list(overrides.logs) if overrides.logs else _expand(config.ingest.logs, folder)
    map_file = folder / config.ingest.map if config.ingest.map else None
    given = config.ingest
    most = None if given.max_memory is None else size_of(given.max_memory)
    reading = mrfit.ingest.stage.Settings(
        map_file, given.resistance, given.pattern, jobs=overrides.jobs, max_memory=most
    )
    stages: list[tuple[str, Callable[[Workspace], Summary]]] = [
        ("ingest", lambda w: mrfit.ingest.stage.run(logs, reading, w, progress)),
        ("flux", lambda w: mrfit.flux.stage.run(w, _flux_settings(config), progress)),
        ("segment", lambda w: mrfit.segment.stage.run(w, _segment_settings(config), progress)),
    ]
    workspace = Workspace(work)
    with workspace.locked():
        summary: Summary = {"work": str(work)}
        for name, stage in stages:
            summary[name] = stage(workspace)
        summary["fits"] = [fit_stage.run(workspace, settings, progress) for settings in fits]
        if discovery:
            summary["discovery"] = _discover(workspace, discovery, progress)
        if fits:
            told = mrfit.report.stage.Settings(tuple(s.fit_name for s in fits), overrides.jobs)
            summary["report"] = mrfit.report.stage.run(workspace, told, progress)
    return summary


def _expand(patterns: Sequence[str], folder: Path) -> list[Path]:
    logs: list[Path] = []
    for pattern in patterns:
        # the folder's own name may hold what means something to glob
        found = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
        if not found:
            raise ConfigError(
                f"[ingest] logs: '{pattern}' matches nothing under {folder}; paths start at the file's folder"
            )
        logs += [folder / f for f in found]
    return logs


def _flux_settings(config: PipelineFile) -> mrfit.flux.stage.Settings:
    import mrfit.flux.stage

    section = config.flux
    return mrfit.flux.stage.Settings(resistance=config.ingest.resistance, drift=section.drift, rule=section.rule)


def _segment_settings(config: PipelineFile) -> mrfit.segment.stage.Settings:
    import mrfit.segment.stage

    section = config.segment
    return mrfit.segment.stage.Settings(drive=section.drive, min_cycles=section.min_cycles, holdout=section.holdout)


def _discover_settings(section: DiscoverSection, jobs: int) -> discover_stage.Settings:
    from mrfit.discover import stage as discover_stage

    return discover_stage.Settings(
        section.model, str(section.current_order), tuple(section.start.items()), section.seed, jobs
    )


def _fit_settings(section: FitSection, jobs: int) -> fit_stage.Settings:
    from mrfit.fit import stage as fit_stage

    return fit_stage.Settings(
        model=section.model,
        optimizer=section.opt,
        options=section.options,
        per=section.per,
        name=section.name,
        seed=section.seed,
        budget=section.budget,
        seconds=section.seconds,
        stall=section.stall,
        weight=section.weight,
        bounds=tuple((n, low, high) for n, (low, high) in section.bounds.items()),
        start=tuple(section.start.items()),
        fixed=tuple(section.fixed.items()),
        current_order=str(section.current_order),
        only=section.only,
        intervals=section.intervals,
        jobs=jobs,
    )
