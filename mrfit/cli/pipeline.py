"""The stages in order, each under the workspace's lock; no other logic.

Every function imports the stages it runs, so that a command starts as soon as its own are loaded.
"""

from __future__ import annotations

import glob
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.cli import project
from mrfit.core.counting import few
from mrfit.core.progress import Progress
from mrfit.errors import ConfigError
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import reusable
from mrfit.io.schemas.stages import ReportFile
from mrfit.io.workspace import Workspace, plain, to_json

if TYPE_CHECKING:
    import mrfit.settings.compare
    import mrfit.settings.discover
    import mrfit.settings.figure
    import mrfit.settings.fit
    import mrfit.settings.flux
    import mrfit.settings.ingest
    import mrfit.settings.report
    import mrfit.settings.segment
    from mrfit.cli.config import PipelineFile
    from mrfit.io.schemas.compare import OptimizersFile
    from mrfit.io.schemas.discovery import DiscoveryFile

CHANNEL_MAP = "channel-map.toml"
"""The channel map, kept in the workspace, by which its logs were read."""
Summary = dict[str, Any]


@dataclass(frozen=True)
class Overrides:
    """Changes of a pipeline file by the command line: logs, workspace, worker threads."""

    logs: Sequence[Path] | None = None
    work: Path | None = None
    jobs: int = 1


def ingest(work: Path, logs: Sequence[Path], settings: mrfit.settings.ingest.Settings, progress: Progress) -> Summary:
    """Read logs into the workspace's recordings."""
    with Workspace(work).locked() as workspace:
        return _ingest(workspace, logs, settings, progress)


def _ingest(
    workspace: Workspace, logs: Sequence[Path], settings: mrfit.settings.ingest.Settings, progress: Progress
) -> Summary:
    import mrfit.ingest.stage

    summary = to_json(mrfit.ingest.stage.run(logs, settings, workspace, progress))
    _keep_map(workspace, logs, settings)
    return summary


def _keep_map(workspace: Workspace, logs: Sequence[Path], settings: mrfit.settings.ingest.Settings) -> None:
    """Keep the channel map by which logs were read, where it is one, for logs that a fit is to predict."""
    import mrfit.ingest.stage
    from mrfit.io.atomic import write_atomic

    maps = mrfit.ingest.stage.maps_of(logs, settings)
    if len(maps) == 1:
        content = maps[0].read_bytes()
        write_atomic(workspace.root / CHANNEL_MAP, lambda path: path.write_bytes(content))


def flux(work: Path, settings: mrfit.settings.flux.Settings, progress: Progress) -> Summary:
    """Reconstruct flux linkage."""
    import mrfit.flux.stage

    with Workspace(work).locked() as workspace:
        before = workspace.flux_file()
        made = mrfit.flux.stage.run(workspace, settings, progress)
        notes = _replaced("the flux linkage", asdict(before.settings) if before else {}, asdict(made.settings))
        return {**to_json(made), "notes": notes}


def plot(work: Path, progress: Progress) -> list[Path]:
    """Draw the workspace's recordings as recorded, and return the files."""
    from mrfit.sheet.signals import write

    workspace = Workspace(work)
    identifiers = sorted(workspace.identifiers)
    recordings = (workspace.read_recording(i, workspace.latest) for i in identifiers)
    return write(recordings, len(identifiers), workspace.root / "plot", False, progress)[0]


def segment(work: Path, settings: mrfit.settings.segment.Settings, progress: Progress) -> Summary:
    """Cut recordings by test condition, reconstructing flux first where that is due."""
    import mrfit.segment.stage

    with Workspace(work).locked() as workspace:
        _flux_as_before(workspace, None, progress)
        before = workspace.segments_summary()
        made = mrfit.segment.stage.run(workspace, settings, progress)
        notes = _replaced("the segments", asdict(before.settings) if before else {}, asdict(made.settings))
        return {**to_json(made), "notes": notes}


def fit(
    work: Path, settings: mrfit.settings.fit.Settings, resistance: float | str | None, progress: Progress
) -> Summary:
    """Fit a model, running flux and segment first where they are due, with the settings they last had."""
    from mrfit.fit import stage as fit_stage

    workspace = Workspace(work)
    fit_stage.check(settings)
    with workspace.locked():
        notes = _segments_as_before(workspace, resistance, progress)
        before = _settings_of(reusable(workspace.fit_folder(settings.fit_name) / "fit.json", Fit))
        made = fit_stage.run(workspace, settings, progress)
        notes += _replaced(f"the fit {made.name}", before, made.settings)
        return {**to_json(made), "notes": notes}


def _given(value: Any) -> Any:
    return "not given" if value is None else value


def _settings_of(replaced: Fit | DiscoveryFile | OptimizersFile | None) -> dict[str, Any]:
    """Return the settings of the result that a command is to replace, empty where there is none."""
    return replaced.settings if replaced else {}


def _replaced(what: str, before: Mapping[str, Any], after: Mapping[str, Any]) -> list[str]:
    """Return the note that a result took the place of one made with other settings, if it did."""
    old, new = plain(dict(before)), plain(dict(after))
    changed = [
        f"{k} {_given(old[k])} -> {_given(new[k])}"
        for k in old
        if k in new and k not in ("jobs", "name") and old[k] != new[k]
    ]
    return [f"replaced {what}, made with other settings: {', '.join(changed)}"] if changed else []


def discover(
    work: Path, settings: mrfit.settings.discover.Settings, resistance: float | str | None, progress: Progress
) -> Summary:
    """Run a discovery and draw its page, after flux and segment with the settings they last had."""
    from mrfit.discover import stage as discover_stage
    from mrfit.io.schemas.discovery import DiscoveryFile

    workspace = Workspace(work)
    discover_stage.check(settings)
    with workspace.locked():
        notes = _segments_as_before(workspace, resistance, progress)
        before = _settings_of(reusable(workspace.root / "discover" / "discovery.json", DiscoveryFile))
        made = _discover(workspace, settings, progress)
        return {**made, "notes": [*notes, *_replaced("the discovery", before, made["settings"])]}


def _discover(workspace: Workspace, settings: mrfit.settings.discover.Settings, progress: Progress) -> Summary:
    import mrfit.report.discovery
    from mrfit.discover import stage as discover_stage

    made = discover_stage.run(workspace, settings, progress)
    page = mrfit.report.discovery.run(workspace, progress).path
    return {**plain(made.found.to_json()), "skipped": made.skipped, "page": str(page)}


def advise(work: Path) -> Summary:
    """Return the last discovery's advice."""
    import mrfit.report.discovery

    return asdict(mrfit.report.discovery.advice(Workspace(work)))


def rig_lines(work: Path) -> list[str]:
    """Return a table ``[rig]`` with what the tests of a workspace took."""
    from mrfit.advise.rig import rig_lines as of_segments

    return of_segments(Workspace(work).read_segments())


def compare_models(work: Path, settings: mrfit.settings.compare.Settings, progress: Progress) -> Summary:
    """Fit several models and put them into one table."""
    from mrfit.compare import stage as compare_stage

    compare_stage.check(settings)
    with Workspace(work).locked() as workspace:
        notes = _segments_as_before(workspace, None, progress)
        return {**to_json(compare_stage.run(workspace, settings, progress)), "notes": notes}


def compare_optimizers(work: Path, settings: mrfit.settings.compare.OfOptimizers, progress: Progress) -> Summary:
    """Run several optimizers on one model."""
    from mrfit.compare import optimizers as compare_optimizers
    from mrfit.io.schemas.compare import OptimizersFile

    compare_optimizers.check(settings)
    with Workspace(work).locked() as workspace:
        notes = _segments_as_before(workspace, None, progress)
        before = _settings_of(reusable(workspace.root / "compare" / "optimizers.json", OptimizersFile))
        made = compare_optimizers.run(workspace, settings, progress)
        notes += _replaced("the comparison of optimizers", before, made.settings)
        notes += [f"of an earlier comparison, in the table as they were: {', '.join(made.kept)}"] * bool(made.kept)
        return {**to_json(made), "notes": notes}


def _segments_as_before(workspace: Workspace, resistance: float | str | None, progress: Progress) -> list[str]:
    """Run flux and segment where due, as they last were, else as the project file says; return notes.

    A resistance given now becomes the workspace's: all its fits are made from one flux linkage, and a command without
    it that went back to another one would make them outdated.
    """
    import mrfit.segment.stage

    notes = _flux_as_before(workspace, resistance, progress)
    stage, cut = mrfit.segment.stage, workspace.segments_file.exists()
    stage.run(workspace, stage.last_settings(workspace) if cut else project.settings_of("segment"), progress)
    return notes


def _flux_as_before(workspace: Workspace, resistance: float | str | None, progress: Progress) -> list[str]:
    import mrfit.flux.stage

    there = workspace.flux_file() is not None
    settings = mrfit.flux.stage.last_settings(workspace) if there else project.settings_of("flux")
    if resistance is not None:
        settings = replace(settings, resistance=resistance)
    made = mrfit.flux.stage.run(workspace, settings, progress)
    if settings.resistance is None or made.resistance is None:
        return [note for note in made.findings if mrfit.flux.stage.NO_FLUX in note][:1]
    auto = settings.resistance == "auto"
    what = "coil resistance: estimated" if auto else f"coil resistance {settings.resistance} Ω"
    if resistance is None:
        return [f"{what}, set by an earlier command of this workspace; `mrfit flux` changes it"]
    return [f"{what}, kept for later commands of this workspace; `mrfit flux` changes it"]


@dataclass(frozen=True)
class ToPredict:
    """Fit that is to predict, and the name under which the workspace keeps the prediction; empty for none."""

    fit: str
    save: str = ""


def predict(
    work: Path,
    asked: ToPredict | str,
    logs: Sequence[Path],
    settings: mrfit.settings.ingest.Settings,
    progress: Progress,
) -> Summary:
    """Simulate a fit on other logs, which pass through ingest, flux and segment in a folder of their own.

    The flux and segment settings of the fit's workspace apply, but for the hold-out, and so does its channel map where
    no other is given or lies beside the logs. A coil resistance that was given there holds for the logs too; one that
    was found there is used where the logs state none.
    """
    import mrfit.api.kept_prediction as kept
    import mrfit.flux.stage
    import mrfit.ingest.stage
    import mrfit.segment.stage
    from mrfit.fit import band
    from mrfit.fit import predict as fit_predict
    from mrfit.fit import select as fit_select
    from mrfit.simulate.current_levels import assembly_of

    asked = ToPredict(asked) if isinstance(asked, str) else asked
    workspace = Workspace(work)
    found = fit_predict.read_fit(workspace, asked.fit)
    settings, notes = _read_as_fitted(workspace, logs, settings)
    with workspace.aside() as other:
        ingested = mrfit.ingest.stage.run(logs, settings, other, progress)
        if "flux" in (found.output, *found.inputs):
            mrfit.flux.stage.run(other, flux_to_predict(workspace, settings.resistance), progress)
        segmenting = mrfit.segment.stage.last_settings(workspace)
        cut = mrfit.segment.stage.run(other, replace(segmenting, holdout="none"), progress)
        trained = kept.trained_on(workspace, found)
        prediction = fit_predict.predict(found, fit_select.read_dataset(other), trained)
        findings = [f"{r.id}: {f.text}" for r in ingested.recordings for f in r.findings] + cut.findings
        files, model = [], assembly_of(found)
        if asked.save:
            about = kept.PredictionRecord(found, [str(log) for log in logs], findings)
            with workspace.locked():
                files = kept.save(workspace, asked.save, about, prediction, model)
    return {
        "fit": asked.fit,
        "model": found.model,
        "output": found.output,
        "metrics": [asdict(row) for row in prediction.metrics],
        "used": prediction.used,
        "conditions": {s.id: s.condition for s in prediction.blocks.segments},
        "findings": [*notes, *findings],
        "outdated": bool(found.outdated),
        "reasons": found.outdated,
        "refused": plain(ingested.refused),
        "warnings": plain(prediction.warnings),
        "band": band.promise(found, prediction, model),
        "simulated_only": sorted(prediction.unmeasured),
        "files": files,
    }


def _read_as_fitted(
    workspace: Workspace, logs: Sequence[Path], settings: mrfit.settings.ingest.Settings
) -> tuple[mrfit.settings.ingest.Settings, list[str]]:
    """Return the settings to read logs, with the workspace's channel map where there is no other, and a note on it."""
    import mrfit.ingest.stage
    from mrfit.io.atomic import refuse_link

    own = workspace.root / CHANNEL_MAP
    refuse_link(own)
    if not own.is_file() or mrfit.ingest.stage.maps_of(logs, settings):
        return settings, []
    return replace(settings, map=own), [f"read by the channel map of the workspace, {own}; --map gives another"]


def flux_to_predict(workspace: Workspace, resistance: float | str | None) -> mrfit.settings.flux.Settings:
    """Return the settings by which the flux of other logs is found, as that of a fit's workspace."""
    import mrfit.flux.stage

    settings, found = mrfit.flux.stage.last_settings(workspace), mrfit.flux.stage.last_resistance(workspace)
    return mrfit.flux.stage.to_predict(settings, found, resistance)


def status(work: Path, progress: Progress) -> Summary:
    """Return the steps of the workspace: result, settings, and the reason where one is out of date."""
    from mrfit.cli.status import status as look

    return {"work": str(work), "steps": [asdict(step) for step in look(Workspace(work), progress)]}


def remove(work: Path, fits: Sequence[str], dry_run: bool = False) -> Summary:
    """Take fits out of the workspace, or say which would be."""
    from mrfit.io.removal import check_fits, remove_fits

    with Workspace(work).locked() as workspace:
        removed = check_fits(workspace, fits) if dry_run else remove_fits(workspace, fits)
        left = [name for name in workspace.fit_names() if name not in removed]
        return {"work": str(work), "removed": removed, "left": left, "dry_run": dry_run}


def report(work: Path, settings: mrfit.settings.report.Settings, progress: Progress) -> Summary:
    """Write tables, figures and the page."""
    import mrfit.report.stage

    with Workspace(work).locked() as workspace:
        before = reusable(workspace.report_folder / "report.json", ReportFile)
        made = mrfit.report.stage.run(workspace, settings, progress)
        gone = sorted(set(before.fits) - set(made.fits)) if before and not settings.short else []
        notes = [f"replaced the report, in which {', '.join(gone)} stood too"] * bool(gone)
        return {**to_json(made), "notes": notes}


def run(config: PipelineFile, folder: Path, overrides: Overrides, progress: Progress) -> Summary:
    """Run all stages of a pipeline file; its paths are relative to its folder, ``work`` to the current one.

    Raises
    ------
    ConfigError
        If a plug-in cannot be used, a pattern of ``[ingest] logs`` matches nothing, or a fit's settings are wrong.
    """
    import mrfit.flux.stage
    import mrfit.ingest.stage
    import mrfit.segment.stage
    from mrfit.core import plugins
    from mrfit.discover import stage as discover_stage
    from mrfit.fit import stage as fit_stage

    for name in config.plugins:
        plugins.use(folder / name)
    work = overrides.work or Path(config.work)
    fits = [replace(settings, jobs=overrides.jobs) for settings in config.fit]
    for settings in fits:
        fit_stage.check(settings)
    discovery = replace(config.discover, jobs=overrides.jobs) if config.discover else None
    if discovery:
        discover_stage.check(discovery)
    _check_with_the_fits(config, folder, Workspace(work))
    logs = list(overrides.logs) if overrides.logs else _expand(config.logs, folder)
    map_file = folder / config.ingest.map if config.ingest.map else None
    reading = replace(config.ingest, map=map_file, jobs=overrides.jobs)
    stages: list[tuple[str, Callable[[Workspace], Summary]]] = [
        ("ingest", lambda w: _ingest(w, logs, reading, progress)),
        ("flux", lambda w: to_json(mrfit.flux.stage.run(w, config.flux, progress))),
        ("segment", lambda w: to_json(mrfit.segment.stage.run(w, config.segment, progress))),
    ]
    with Workspace(work).locked() as workspace:
        summary: Summary = {"work": str(work)}
        for name, stage in stages:
            summary[name] = stage(workspace)
        summary["fits"], notes = [], list[str]()
        for settings in fits:
            before = _settings_of(reusable(workspace.fit_folder(settings.fit_name) / "fit.json", Fit))
            made = fit_stage.run(workspace, settings, progress)
            notes += _replaced(f"the fit {made.name}", before, made.settings)
            summary["fits"].append(to_json(made))
        summary["notes"] = notes
        if discovery:
            summary["discovery"] = _discover(workspace, discovery, progress)
        if config.sheet:
            summary["sheet"] = _sheet(workspace, config, folder, reading, progress)
    return summary | _with_the_fits(config, folder, replace(overrides, work=work), progress)


def _sheet(
    workspace: Workspace,
    config: PipelineFile,
    folder: Path,
    reading: mrfit.settings.ingest.Settings,
    progress: Progress,
) -> Summary:
    """Write the test sheet of the workspace's recordings into its folder ``sheet``."""
    import mrfit.ingest.stage
    from mrfit.sheet.write import write

    assert config.sheet
    table = config.sheet
    recordings = [workspace.read_recording(name) for name in sorted(workspace.identifiers)]
    beside = _expand(table.against, folder, "[sheet] against") if table.against else []
    others = mrfit.ingest.stage.read(beside, reading, progress).recordings if beside else []
    return to_json(write(recordings, table.settings, others, workspace.root / "sheet", table.pdf, progress))


def _check_with_the_fits(config: PipelineFile, folder: Path, workspace: Workspace) -> None:
    """Refuse what is wrong in the tables that come after the fits, before any work is done.

    Raises
    ------
    ConfigError
        If a model, an optimizer, a width, a format, a fit's name or a pattern of logs is wrong.
    """
    from mrfit.compare import optimizers
    from mrfit.compare import stage as models
    from mrfit.export import stage as export_stage
    from mrfit.report.paper_stage import check as check_figure

    if config.compare and config.compare.models:
        models.check(config.compare.of_models)
    elif config.compare:
        optimizers.check(config.compare.of_optimizers)
    for table in config.predict:
        _expand(table.logs, folder, "[predict]")
    for figure in config.figure:
        check_figure(figure.kind, figure.settings)
    for one in config.export:
        export_stage.check(one.to)
    if config.sheet and config.sheet.against:
        _expand(config.sheet.against, folder, "[sheet] against")
    made = {s.fit_name for s in config.fit}
    if config.compare and config.compare.models:
        settings = config.compare.of_models
        compared = {settings.name_of(model) for model in settings.names}
        # a fit made otherwise is not replaced by that of a comparison
        made |= {*compared, *(f"{name}.compare" for name in compared & {*workspace.fit_names()})}
    there = sorted({*workspace.fit_names()} - made)
    asked = [("predict", t.fit) for t in config.predict] + [("export", t.fit) for t in config.export]
    for name, fit_name in [*asked, *(("figure", f) for t in config.figure for f in t.settings.fits)]:
        if fit_name not in {*made, *there}:
            others = f", and {workspace.root} holds {', '.join(there)}" if there else ""
            makes = few(sorted(made)) or "none"
            raise ConfigError(f"[{name}] fit: '{fit_name}' is no fit of this file; it makes {makes}{others}")


def _with_the_fits(config: PipelineFile, folder: Path, overrides: Overrides, progress: Progress) -> Summary:
    """Do what a pipeline file asks for with its fits; each step has the lock of the workspace for itself."""
    from mrfit.cli import export

    assert overrides.work
    work, done = overrides.work, Summary()
    if config.compare:
        asked = replace(config.compare, jobs=overrides.jobs)
        if asked.models:
            done["compare"] = compare_models(work, asked.of_models, progress)
        else:
            done["compare"] = compare_optimizers(work, asked.of_optimizers, progress)
    for table in config.predict:
        reading = replace(table.settings, map=folder / table.settings.map if table.settings.map else None)
        logs = _expand(table.logs, folder, "[predict]")
        predicted = predict(work, ToPredict(table.fit, table.save), logs, reading, progress)
        done.setdefault("predict", []).append(predicted)
    if config.fit:
        shown = config.report.fits or tuple(s.fit_name for s in config.fit)
        made = report(work, replace(config.report, fits=shown, jobs=overrides.jobs), progress)
        done["report"] = {name: value for name, value in made.items() if name != "notes"}
    for drawn in config.figure:
        done.setdefault("figure", []).append(figure(work, drawn.kind, drawn.settings))
    for one in config.export:
        place = export.Place(None, one.condition, one.without)
        done.setdefault("export", []).append(export.exported(work, one.fit, one.to, place, one.settings, progress))
    return done


def figure(work: Path, kind: str, settings: mrfit.settings.figure.Settings, out: Path | None = None) -> Summary:
    """Draw a figure for print."""
    from mrfit.report import paper_stage

    with Workspace(work).locked() as workspace:
        return {**asdict(paper_stage.run(workspace, kind, settings, out)), "width": settings.width}


def _expand(patterns: Sequence[str], folder: Path, table: str = "[ingest]") -> list[Path]:
    logs: list[Path] = []
    for pattern in patterns:
        # the folder's own name may hold what means something to glob
        found = sorted(glob.glob(pattern, root_dir=folder, recursive=True))
        if not found:
            raise ConfigError(
                f"{table}: '{pattern}' in logs matches nothing under {folder}; paths start at the file's folder"
            )
        logs += [folder / f for f in found]
    return logs
