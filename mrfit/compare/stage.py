"""The compare stage: segments in, a table of models against conditions for each output out, best on held-out first."""

import csv
import time
from collections.abc import Callable, Collection
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from mrfit.compare.page import models_page
from mrfit.core.counting import number_of
from mrfit.core.progress import Progress, silent
from mrfit.errors import DataError, MrfitError, Unreachable
from mrfit.fit import stage as fit_stage
from mrfit.io.csv_table import csv_table
from mrfit.io.outdated import Inputs
from mrfit.io.schemas.compare import LeftOut, ModelCaution, ModelErrors, ModelRow, ModelsFile
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import reusable
from mrfit.io.workspace import Workspace, checked, plain, write_json, write_text
from mrfit.report.ranking import merit
from mrfit.settings.compare import Settings as Settings

MODEL_COLUMNS = (
    "model",
    "condition",
    "role",
    "samples",
    "rmse",
    "nrmse",
    "esr",
    "fit_percent",
    "noise_floor",
    "seconds",
    "fit",
)
COMPARED_ROLES = ("holdout", "train")
Fitting = Callable[[fit_stage.Settings], Fit]


def check(settings: Settings) -> None:
    """Check names and options before any data are touched.

    Raises
    ------
    ConfigError
        If a model, the optimizer or an option is wrong.
    """
    for model in settings.names:
        fit_stage.check(_without_order(settings, model))


def _without_order(settings: Settings, model: str) -> fit_stage.Settings:
    """Return a fit's settings; a model that cannot depend on current as asked is left out later, with the reason."""
    return replace(settings.of_fit(model), current_order="auto")


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> ModelsFile:
    """Fit every model and write ``compare/{compare.csv,compare.json,compare.html}``; the fits stay in ``fits/``.

    The table holds the fits of earlier comparisons too, as long as they are there and made from the data there are. A
    fit that was made otherwise than by a comparison is never replaced.

    Parameters
    ----------
    workspace
        Holds segments and recordings.
    settings
        What to compare.
    progress
        Reports every fit's evaluations.

    Returns
    -------
    ModelsFile
        Content of compare.json, with seconds by fit: they are in compare.csv, not in the other files, which are
        the same bytes every time.

    Raises
    ------
    DataError
        If no model can be fitted; the message has the first reason.
    """
    check(settings)
    folder = workspace.root / "compare"
    earlier, before = _earlier_seconds(folder / "compare.csv"), reusable(folder / "compare.json", ModelsFile)
    own = {row.fit for row in before.models} if before else set()
    tried = fit_all(settings, lambda one: fit_stage.run(workspace, _apart(workspace, one, own), progress), progress)
    seconds = {f.name: earlier.get(f.name) if f.skipped else tried.seconds[f.model] for f in tried.fits}
    kept, dropped = _kept(workspace, before, {f.name for f in tried.fits})
    left_out = [row for row in (before.left_out if before else []) if row.model not in settings.names]
    whole = ModelFits([*tried.fits, *kept], [*tried.left_out, *left_out], tried.seconds)
    seconds |= {fit.name: earlier.get(fit.name) for fit in kept}
    summary = replace(summary_of(settings, whole), seconds=seconds, kept=sorted(f.name for f in kept), dropped=dropped)
    _write(folder, summary)
    return summary


def _apart(workspace: Workspace, one: fit_stage.Settings, own: Collection[str]) -> fit_stage.Settings:
    """Return the settings of a fit under a name that no fit has which was made otherwise and by no comparison."""
    there = reusable(workspace.fit_folder(one.name) / "fit.json", Fit)
    if there is None or one.name in own:
        return one
    settings = [{k: v for k, v in plain(s).items() if k not in ("name", "jobs")} for s in (there.settings, asdict(one))]
    return one if settings[0] == settings[1] else replace(one, name=f"{one.name}.compare")


def _kept(workspace: Workspace, before: ModelsFile | None, now: Collection[str]) -> tuple[list[Fit], dict[str, str]]:
    """Return the fits of an earlier comparison that stay in the table, and why others leave it."""
    if before is None:
        return [], {}
    inputs, kept, dropped = Inputs(workspace), list[Fit](), dict[str, str]()
    for name in dict.fromkeys(row.fit for row in before.models if row.fit not in now):
        fit = reusable(workspace.fit_folder(name) / "fit.json", Fit)
        reason = "it is gone" if fit is None else inputs.reason(fit)
        if fit is None or reason:
            dropped[name] = reason
        else:
            kept.append(fit)
    return kept, dropped


@dataclass(frozen=True)
class ModelFits:
    """Outcome of fitting every model.

    Attributes
    ----------
    fits
        In the order of the models.
    left_out
        Those that cannot be fitted.
    seconds
        Time that each fit took, by model.
    """

    fits: list[Fit]
    left_out: list[LeftOut]
    seconds: dict[str, float]


def fit_all(settings: Settings, fit: Fitting, progress: Progress = silent) -> ModelFits:
    """Fit every model by ``fit``, which takes the settings of one fit.

    Raises
    ------
    DataError
        If no model can be fitted; the message has the first reason.
    """
    tried = ModelFits([], [], {})
    for done, model in enumerate(settings.names, 1):
        progress("compare", done - 1, len(settings.names))
        begin = time.perf_counter()
        try:
            tried.fits.append(fit(settings.of_fit(model)))
        except Unreachable:
            raise
        except MrfitError as error:
            tried.left_out.append(LeftOut(model=model, reason=str(error)))
            continue
        tried.seconds[model] = time.perf_counter() - begin
    progress("compare", len(settings.names), len(settings.names))
    if not tried.fits:
        first = tried.left_out[0]
        raise DataError(
            f"none of {number_of('model', len(tried.left_out))} can be fitted; {first.model}: {first.reason}"
        )
    return tried


def summary_of(settings: Settings, tried: ModelFits) -> ModelsFile:
    """Return the content of compare.json."""
    fits = sorted(tried.fits, key=lambda fit: (*merit(fit), fit.model, fit.name))
    return checked(
        ModelsFile(
            settings={k: v for k, v in asdict(settings).items() if k != "jobs"},
            models=[_row(fit) for fit in fits],
            metrics=[
                ModelErrors(model=fit.model, fit=fit.name, **{k: getattr(m, k) for k in MODEL_COLUMNS[1:-2]})
                for fit in fits
                for m in sorted(fit.metrics, key=lambda m: (COMPARED_ROLES.index(m.role), m.condition != "all"))
            ],
            warnings=[
                ModelCaution(model=fit.model, fit=fit.name, kind=w.kind, text=w.text)
                for fit in fits
                for w in fit.warnings
            ],
            left_out=sorted(tried.left_out, key=lambda row: row.model),
        )
    )


def _row(fit: Fit) -> ModelRow:
    errors = {
        f"{role}_{name}": getattr(fit.pooled(role), name, None)
        for role in COMPARED_ROLES
        for name in ("nrmse", "fit_percent", "rmse")
    }
    return ModelRow(
        model=fit.model,
        fit=fit.name,
        output=fit.output,
        parameters=sum(not p.fixed for r in fit.results for p in r.parameters),
        evaluations=sum(r.evaluations for r in fit.results),
        current_orders=fit.current_dependence.orders if fit.current_dependence else {},
        warnings=sorted({w.kind for found in (fit.warnings, *(r.warnings for r in fit.results)) for w in found}),
        **errors,
    )


def _write(folder: Path, summary: ModelsFile) -> None:
    rows = []
    for row in summary.metrics:
        spent = summary.seconds.get(row.fit)
        rows.append({**asdict(row), "seconds": None if spent is None else round(spent, 3)})
    write_text(folder / "compare.csv", csv_table(MODEL_COLUMNS, rows))
    write_text(folder / "compare.html", models_page(summary))
    write_json(folder / "compare.json", summary)


def _earlier_seconds(path: Path) -> dict[str, float]:
    """Return the times of fits that an earlier comparison made, by name of the fit."""
    if not path.is_file():
        return {}
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            rows = list(csv.DictReader(handle))
        return {r["fit"]: float(r["seconds"]) for r in rows if r.get("seconds") and r.get("fit")}
    except (OSError, ValueError, KeyError, csv.Error):
        return {}  # edited by others: times are for information only
