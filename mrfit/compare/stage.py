"""The compare stage: segments in, a table of models against conditions for each output out, best on held-out first."""

import csv
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from mrfit.compare.page import models_page
from mrfit.core.progress import Progress, silent
from mrfit.errors import DataError, MrfitError, Unreachable
from mrfit.fit import stage as fit_stage
from mrfit.io.csv_table import csv_table
from mrfit.io.schemas.compare import LeftOut, ModelCaution, ModelErrors, ModelRow, ModelsFile
from mrfit.io.schemas.fit import Fit
from mrfit.io.workspace import Workspace, checked, write_json, write_text
from mrfit.settings.compare import Settings as Settings

COLUMNS = (
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
ROLES = ("holdout", "train")
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

    Parameters
    ----------
    workspace
        Holds segments and recordings.
    settings
        What to compare.
    progress
        Told of every fit's evaluations.

    Returns
    -------
    ModelsFile
        Content of compare.json, with seconds by model: they are in compare.csv, not in the other files, which are
        the same bytes every time.

    Raises
    ------
    DataError
        If no model can be fitted; the message has the first reason.
    """
    check(settings)
    earlier = _earlier_seconds(workspace.root / "compare" / "compare.csv")
    tried = fit_all(settings, lambda one: fit_stage.run(workspace, one, progress), progress)
    seconds = {
        fit.model: earlier.get((fit.model, fit.name)) if fit.skipped else tried.seconds[fit.model] for fit in tried.fits
    }
    summary = replace(summary_of(settings, tried), seconds=seconds)
    _write(workspace.root / "compare", summary)
    return summary


@dataclass(frozen=True)
class Tried:
    """What became of the models.

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


def fit_all(settings: Settings, fit: Fitting, progress: Progress = silent) -> Tried:
    """Fit every model by ``fit``, which takes the settings of one fit.

    Raises
    ------
    DataError
        If no model can be fitted; the message has the first reason.
    """
    tried = Tried([], [], {})
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
        raise DataError(f"none of {len(tried.left_out)} models can be fitted; {first.model}: {first.reason}")
    return tried


def summary_of(settings: Settings, tried: Tried) -> ModelsFile:
    """Return the content of compare.json."""
    fits = sorted(tried.fits, key=rank)
    return checked(
        ModelsFile(
            settings={k: v for k, v in asdict(settings).items() if k != "jobs"},
            models=[_row(fit) for fit in fits],
            metrics=[
                ModelErrors(model=fit.model, **{k: getattr(m, k) for k in COLUMNS[1:-2]})
                for fit in fits
                for m in sorted(fit.metrics, key=lambda m: (ROLES.index(m.role), m.condition != "all"))
            ],
            warnings=[ModelCaution(model=fit.model, kind=w.kind, text=w.text) for fit in fits for w in fit.warnings],
            left_out=tried.left_out,
        )
    )


def rank(fit: Fit) -> tuple[str, int, int, float, str]:
    """Return the sorting key of a fit: its output, then its error on held-out data, else (and then last) in training.

    Errors on fewer samples, where a model had to leave logs out, come after those on more: they cannot be compared.
    """
    # of a role without data there is no such row
    role = "holdout" if fit.pooled("holdout") else "train"
    whole = fit.pooled(role)
    samples, nrmse = (whole.samples, whole.nrmse) if whole else (0, None)
    return fit.output, int(role == "train"), -samples, float("inf") if nrmse is None else nrmse, fit.model


def _row(fit: Fit) -> ModelRow:
    errors = {
        f"{role}_{name}": getattr(fit.pooled(role), name, None)
        for role in ROLES
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
    names, rows = {m.model: m.fit for m in summary.models}, []
    for row in summary.metrics:
        spent = summary.seconds.get(row.model)
        shown = None if spent is None else round(spent, 3)
        rows.append({**asdict(row), "seconds": shown, "fit": names[row.model]})
    write_text(folder / "compare.csv", csv_table(COLUMNS, rows))
    write_text(folder / "compare.html", models_page(summary))
    write_json(folder / "compare.json", summary)


def _earlier_seconds(path: Path) -> dict[tuple[str, str], float]:
    """Return the times of fits that an earlier comparison made, by model and name of the fit."""
    if not path.is_file():
        return {}
    try:
        with path.open(encoding="utf-8", newline="") as handle:
            rows = list(csv.DictReader(handle))
        return {(r["model"], r["fit"]): float(r["seconds"]) for r in rows if r.get("seconds") and r.get("fit")}
    except (OSError, ValueError, KeyError, csv.Error):
        return {}  # edited by others: times are for information only
