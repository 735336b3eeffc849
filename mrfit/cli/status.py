"""State of a workspace: results, settings, and reasons where they are out of date; nothing is written."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from os import path as os_path
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.cli.summary import held_out
from mrfit.core.counting import few, number_of
from mrfit.core.progress import Progress, silent
from mrfit.errors import DataError
from mrfit.io.keys import code_version, discovery_key
from mrfit.io.outdated import Inputs, flux_reason, other_code, segment_reason
from mrfit.io.schemas.reading import load
from mrfit.io.schemas.stages import About, ReportFile
from mrfit.io.workspace import Workspace
from mrfit.report.key import prediction_files, report_key

if TYPE_CHECKING:
    from mrfit.io.schemas.compare import ModelErrors

# Names written out in a reason
FITS_SHOWN = 3


@dataclass(frozen=True)
class Step:
    """Result of one step in a workspace.

    Attributes
    ----------
    step
        ``recordings``, ``flux``, ``segments``, ``fit``, ``discovery``, ``models compared``, ``optimizers compared`` or
        ``report``.
    name
        Name of the fit; empty for the other steps.
    holds
        What there is, in words.
    names
        Ids of the recordings, names of the conditions, models, optimizers or fits.
    settings
        What it was made with.
    code
        Version of the code that made it; empty where it does not say.
    outdated
        Why it is out of date, empty where it is not.
    """

    step: str
    name: str = ""
    holds: str = ""
    names: list[str] = field(default_factory=list)
    settings: dict[str, Any] = field(default_factory=dict)
    code: str = ""
    outdated: str = ""


def status(workspace: Workspace, progress: Progress = silent) -> list[Step]:
    """Return the result of every step in a workspace, in the order of the steps.

    Parameters
    ----------
    workspace
        What is looked at; a file of it that is damaged is a reason to be out of date.
    progress
        Reports long logs, which are read to see whether they have changed.

    Raises
    ------
    DataError
        If there is nothing.
    """
    looks: list[tuple[str, str, Callable[[], Step | None]]] = [
        ("recordings", "", lambda: _recordings(workspace, progress)),
        ("flux", "", lambda: _flux(workspace)),
        ("segments", "", lambda: _segments(workspace)),
    ]
    inputs = Inputs(workspace)
    looks += [("fit", name, partial(_fit, workspace, name, inputs)) for name in workspace.fit_folders()]
    looks += [
        ("discovery", "", lambda: _discovery(workspace, inputs)),
        ("models compared", "", lambda: _models(workspace, inputs)),
        ("optimizers compared", "", lambda: _optimizers(workspace, inputs)),
        ("report", "", lambda: _report(workspace, inputs)),
    ]
    found = [step for what, name, look in looks if (step := _looked(what, name, look))]
    if not found:
        root = workspace.root
        raise DataError(f"{root}: no workspace, or an empty one; run `mrfit ingest LOGS… --work {root}` first")
    return found


def _looked(what: str, name: str, look: Callable[[], Step | None]) -> Step | None:
    try:
        return look()
    except DataError as error:
        return Step(what, name, "cannot be read", outdated=str(error))


def _recordings(workspace: Workspace, progress: Progress) -> Step | None:
    summary = workspace.ingest_file()
    if not summary:
        return None
    rows, refused = summary.recordings, len(summary.refused)
    holds = f"{number_of('recording', len(rows))} of {number_of('log', len({r.source for r in rows}))}"
    code = summary.code
    reasons = []
    if changed := list(_changed_logs(workspace, rows, progress)):
        reasons.append(f"changed since read: {few(changed, FITS_SHOWN)}")
    if edited := [r.id for r in rows if not workspace.is_whole(r.id)]:
        reasons.append(f"no longer what was read of the logs: {few(edited, FITS_SHOWN)}")
    if code == "":
        reasons.append("read by more than one version of the code")
    elif code is not None and code != code_version("ingest"):
        reasons.append(other_code(code, "ingest"))
    why = "; ".join(reasons)
    told = holds + f", {refused} refused" * bool(refused)
    return Step("recordings", "", told, [r.id for r in rows], {}, code or "", why)


def _changed_logs(workspace: Workspace, rows: Sequence[About], progress: Progress) -> Iterator[str]:
    """Yield the logs that are no longer what was read; one that is gone is none of these."""
    from mrfit.ingest.hashes import hash_of
    from mrfit.ingest.manifest import Manifest
    from mrfit.ingest.refusal import Refusal

    base = Manifest(workspace).base
    for source, digest in {r.source: r.sha256 for r in rows}.items():
        path = Path(os_path.join(base, source))
        try:
            if path.is_file() and hash_of(path, progress) != digest and not _is_part(path):
                yield source
        except Refusal:
            yield source


def _is_part(path: Path) -> bool:
    """Return whether a log is one of several files of one record, whose hashes are hashed together."""
    # loads what reads logs, which a workspace whose logs are as they were does without
    from mrfit.ingest.dispatch import look, part_of

    return bool(part_of(*look(path)))


def _flux(workspace: Workspace) -> Step | None:
    summary = workspace.flux_file()
    if not summary:
        return None
    actions = [r.action for r in summary.recordings]
    holds = ", ".join(f"{actions.count(a)} {a}" for a in dict.fromkeys(actions))
    if summary.resistance is not None:
        holds += f", R {summary.resistance:.4g} Ω"
    names = [r.id for r in summary.recordings]
    return Step("flux", "", holds, names, asdict(summary.settings), summary.code, flux_reason(workspace))


def _segments(workspace: Workspace) -> Step | None:
    summary = workspace.segments_summary()
    if not summary:
        return None
    rows = summary.segments
    conditions = list(dict.fromkeys(s.condition for s in rows))
    held = {s.condition for s in rows if s.role == "holdout"}
    holds = f"{number_of('segment', len(rows))} of {number_of('condition', len(conditions))}, {len(held)} held out"
    why = flux_reason(workspace)
    why = f"the flux linkage is out of date: {why}" if why else segment_reason(workspace)
    return Step("segments", "", holds, conditions, asdict(summary.settings), summary.code, why)


def _fit(workspace: Workspace, name: str, inputs: Inputs) -> Step | None:
    fit = workspace.stored_fit(name)
    if fit is None:
        kept = len(list(workspace.fit_folder(name).glob(".partial/*.json")))
        return Step("fit", name, f"unfinished, {number_of('search', kept, 'searches')} kept") if kept else None
    error = fit.pooled("holdout") or fit.pooled("train")
    holds = f"{fit.model} by {fit.optimizer}: {number_of('set', len(fit.results))} of parameters"
    if error and error.nrmse is not None:
        where = held_out(fit.per) if error.role == "holdout" else "in training"
        holds += f", NRMSE {100.0 * error.nrmse:.3g} % {where}"
    why = inputs.of_fits([fit])
    return Step("fit", name, holds, [r.condition for r in fit.results], fit.settings, fit.code, why.get(fit.name, ""))


def _discovery(workspace: Workspace, inputs: Inputs) -> Step | None:
    path = workspace.root / "discover" / "discovery.json"
    if not path.exists():
        return None
    # documents of steps that a workspace has not are not built
    from mrfit.io.schemas.discovery import DiscoveryFile

    found = load(path, DiscoveryFile, f"delete {path.parent} and run `mrfit discover` again")
    if not found:
        return None
    effects = [e.name for e in found.effects] or [*found.ambiguous_set]
    holds = f"{found.base_model}: {found.verdict}" + f" ({', '.join(effects)})" * bool(effects)
    why = inputs.reason(found, discovery_key, "discover") if found.settings else ""
    return Step("discovery", "", holds, effects, found.settings, found.code, why)


def _models(workspace: Workspace, inputs: Inputs) -> Step | None:
    path = workspace.root / "compare" / "compare.json"
    if not path.exists():
        return None
    from mrfit.io.schemas.compare import ModelsFile

    found = load(path, ModelsFile, "run the comparison again")
    if found is None:
        return None
    fits = {m.fit: m.model for m in found.models}
    rows = {f: [m for m in found.metrics if (m.fit or fits[f]) == (f if m.fit else m.model)] for f in fits}
    why = next((w for fit in fits if (w := _fit_reason(workspace, fit, rows[fit], inputs))), "")
    settings = {k: v for k, v in found.settings.items() if k != "models"}
    return Step("models compared", "", number_of("model", len(fits)), list(fits.values()), settings, "", why)


def _fit_reason(workspace: Workspace, name: str, rows: Sequence["ModelErrors"], inputs: Inputs) -> str:
    """Return the reason why the ``rows`` of errors of a fit in a comparison no longer hold."""
    if name not in workspace.fit_names():
        return f"the fit {name} is gone"
    fit = workspace.stored_fit(name)
    then = {(m.condition, m.role): m.rmse for m in rows}
    if fit and then != {(m.condition, m.role): m.rmse for m in fit.metrics}:
        return f"the fit {name} has been made again since"
    if fit and (why := inputs.reason(fit)):
        return f"the fit {name}: {why}"
    return ""


def _optimizers(workspace: Workspace, inputs: Inputs) -> Step | None:
    path = workspace.root / "compare" / "optimizers.json"
    if not path.exists():
        return None
    from mrfit.io.schemas.compare import OptimizersFile

    found = load(path, OptimizersFile, "run the comparison again")
    if found is None:
        return None
    names = list(dict.fromkeys(r.optimizer for r in found.rows))
    holds = f"{number_of('optimizer', len(names))} on {found.settings.get('model', '')}"
    # an older one does not say what it was made from
    why = inputs.reason(found) if found.key else ""
    return Step("optimizers compared", "", holds, names, found.settings, found.code, why)


def _report(workspace: Workspace, inputs: Inputs) -> Step | None:
    found = load(workspace.report_folder / "report.json", ReportFile, "run `mrfit report` again")
    if not found:
        return None
    holds = f"{number_of('fit', len(found.fits))} on report/index.html"
    return Step("report", "", holds, found.fits, {"fits": found.fits}, found.code, _old(workspace, found, inputs))


def _old(workspace: Workspace, report: ReportFile, inputs: Inputs) -> str:
    """Return the reason why a report is out of date."""
    names = report.fits
    if gone := [n for n in names if n not in workspace.fit_names()]:
        return f"a fit it shows is gone: {', '.join(gone)}"
    if lost := [f for f in report.files if not (workspace.report_folder / f).is_file()]:
        return f"of its files one is gone: {lost[0]}"
    outdated = inputs.of_fits(filter(None, map(workspace.stored_fit, names)))
    if report.key == report_key(workspace, names, outdated):
        return ""
    if report.code and report.key == report_key(workspace, names, outdated, report.code):
        return other_code(report.code, "")
    made = (workspace.report_folder / "report.json").stat().st_mtime
    if newer := sorted({p.stem for p in prediction_files(workspace) if p.stat().st_mtime > made}):
        return f"predictions were saved since: {few(newer, FITS_SHOWN)}"
    read = "recordings, flux linkage or segments" if inputs.flux else "recordings or segments"
    return f"the fits or predictions it shows, or the {read}, have changed since"
