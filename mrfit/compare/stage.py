"""The compare stage: segments in, a table of models against conditions for each output out, best on held-out first."""

import csv
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from mrfit.compare.page import models_page
from mrfit.core.progress import Progress, silent
from mrfit.errors import DataError, MrfitError
from mrfit.fit import stage as fit_stage
from mrfit.io.csv_table import csv_table
from mrfit.io.workspace import Workspace, plain, write_json, write_text
from mrfit.settings.compare import Settings as Settings

SCHEMA = "mrfit/compare/1"
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
Fitting = Callable[[fit_stage.Settings], dict[str, Any]]


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


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> dict[str, Any]:
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
    dict
        Content of compare.json, with ``seconds`` by model: they are in compare.csv, not in the other files, which are
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
        fit["model"]: earlier.get((fit["model"], fit["name"])) if fit["skipped"] else tried.seconds[fit["model"]]
        for fit in tried.fits
    }
    summary = summary_of(settings, tried)
    _write(workspace.root / "compare", summary, seconds)
    return {**summary, "seconds": seconds}


@dataclass(frozen=True)
class Tried:
    """What became of the models.

    Attributes
    ----------
    fits
        Contents of their fit.json, in the order of the models.
    left_out
        ``model`` and ``reason`` of those that cannot be fitted.
    seconds
        Time that each fit took, by model.
    """

    fits: list[dict[str, Any]]
    left_out: list[dict[str, str]]
    seconds: dict[str, float]


def fit_all(settings: Settings, fit: Fitting, progress: Progress = silent) -> Tried:
    """Fit every model by ``fit``, which takes the settings of one fit and returns the content of its fit.json.

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
        except MrfitError as error:
            tried.left_out.append({"model": model, "reason": str(error)})
            continue
        tried.seconds[model] = time.perf_counter() - begin
    progress("compare", len(settings.names), len(settings.names))
    if not tried.fits:
        first = tried.left_out[0]
        raise DataError(f"none of {len(tried.left_out)} models can be fitted; {first['model']}: {first['reason']}")
    return tried


def summary_of(settings: Settings, tried: Tried) -> dict[str, Any]:
    """Return the content of compare.json."""
    summary: dict[str, Any] = plain(_summary(settings, sorted(tried.fits, key=rank), tried.left_out))
    return summary


def rank(fit: Mapping[str, Any]) -> tuple[str, int, int, float, str]:
    """Return the sorting key of a fit: its output, then its error on held-out data, else (and then last) in training.

    Errors on fewer samples, where a model had to leave logs out, come after those on more: they cannot be compared.
    """
    whole = _whole(fit["metrics"])
    role = "holdout" if "holdout" in whole else "train"
    nrmse, samples = whole[role]["nrmse"], int(whole[role]["samples"])
    error = float("inf") if nrmse is None else float(nrmse)
    return str(fit["output"]), int(role == "train"), -samples, error, str(fit["model"])


def _whole(metrics: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return the rows over all conditions by role; where there is one condition, its row is both."""
    return {m["role"]: m for m in metrics if m["condition"] == "all"}


def _summary(settings: Settings, fits: list[dict[str, Any]], left_out: list[dict[str, str]]) -> dict[str, Any]:
    return {
        "schema": SCHEMA,
        "settings": {k: v for k, v in asdict(settings).items() if k != "jobs"},
        "models": [_row(fit) for fit in fits],
        "metrics": [
            {"model": fit["model"], **{k: m[k] for k in COLUMNS[1:-2]}}
            for fit in fits
            for m in sorted(fit["metrics"], key=lambda m: (ROLES.index(m["role"]), m["condition"] != "all"))
        ],
        "warnings": [{"model": fit["model"], **w} for fit in fits for w in fit["warnings"]],
        "left_out": left_out,
    }


def _row(fit: Mapping[str, Any]) -> dict[str, Any]:
    whole = _whole(fit["metrics"])
    free = [sum(not p["fixed"] for p in r["parameters"]) for r in fit["results"]]
    dependence = fit["current_dependence"]
    return {
        "model": fit["model"],
        "fit": fit["name"],
        "output": fit["output"],
        "parameters": sum(free),
        "evaluations": sum(r["evaluations"] for r in fit["results"]),
        "current_orders": dependence["orders"] if dependence else {},
        "warnings": sorted({w["kind"] for one in (fit, *fit["results"]) for w in one["warnings"]}),
        **{f"{role}_{n}": whole.get(role, {}).get(n) for role in ROLES for n in ("nrmse", "fit_percent", "rmse")},
    }


def _write(folder: Path, summary: dict[str, Any], seconds: Mapping[str, float | None]) -> None:
    names, rows = {m["model"]: m["fit"] for m in summary["models"]}, []
    for row in summary["metrics"]:
        spent = seconds.get(row["model"])
        shown = None if spent is None else round(spent, 3)
        rows.append({**row, "seconds": shown, "fit": names[row["model"]]})
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
