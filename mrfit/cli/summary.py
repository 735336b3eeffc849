"""The result of each command in one line, the last that it prints and the only one of ``--quiet``."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.core.counting import number_of
from mrfit.core.recording import WRONG

if TYPE_CHECKING:
    from mrfit.ingest.stage import Preview

Summary = dict[str, Any]


def ingest(summary: Summary, work: Path) -> str:
    """Return the numbers of recordings and of logs that were read."""
    rows, refused = summary["recordings"], len(summary["refused"])
    read = f"{number_of('recording', len(rows))} of {number_of('log', len({r['source'] for r in rows}))} in {work}"
    return f"{read}, {number_of('file', refused)} refused" if refused else read


def preview(rows: "Sequence[Preview]") -> str:
    """Return the numbers of recordings that would be read and of files that would be refused."""
    refused = sum(row.reader == "refused" for row in rows)
    read = f"{number_of('recording', len(rows) - refused)} would be read"
    return f"{read}, {number_of('file', refused)} refused" if refused else read


def flux(summary: Summary, work: Path) -> str:
    """Return the number of recordings by the action taken."""
    actions = [r["action"] for r in summary["recordings"]]
    done = ", ".join(f"{actions.count(a)} {a}" for a in dict.fromkeys(actions))
    return f"Flux linkage in {work}: {done or 'no recordings'}"


def segment(summary: Summary, work: Path) -> str:
    """Return the numbers of segments, of conditions, and of those held out."""
    rows = summary["segments"]
    held = len({s["condition"] for s in rows if s["role"] == "holdout"})
    conditions = number_of("condition", len({s["condition"] for s in rows}))
    return f"{number_of('segment', len(rows))} of {conditions} in {work}, {held} held out"


def fit(summary: Summary, work: Path) -> str:
    """Return the errors of a fit, how many parameters the data determine, and how many warnings there are."""
    results = summary["results"]
    parts = [f"NRMSE {error}" for error in _errors(summary["metrics"], summary["per"])]
    if len(results) == 1:
        free = [p for p in results[0]["parameters"] if not p["fixed"]]
        parts.append(
            f"{sum(p['determined'] == 'well' for p in free)} of {number_of('parameter', len(free))} well determined"
        )
    else:
        parts.append(f"{len(results)} sets of parameters")
    if warnings := [*summary["warnings"], *(w for r in results for w in r["warnings"])]:
        wrong = [w["text"].partition(": ")[0] for w in warnings if w["kind"] in WRONG]
        parts.append(number_of("warning", len(warnings)) + (f" ({'; '.join(wrong)})" if wrong else ""))
    return f"Fit {summary['name']}: {', '.join(parts)}; {work / 'fits' / summary['name']}"


def predict(summary: Summary) -> str:
    """Return the error of a prediction."""
    errors = ", ".join(f"NRMSE {error}" for error in _errors(summary["metrics"], "all")) or "nothing to compare with"
    return f"Prediction by {summary['fit']}: {errors} on {number_of('segment', len(summary['used']))}"


def compare_models(summary: Summary) -> str:
    """Return the best model of every output."""
    best: dict[str, Summary] = {}
    for row in summary["models"]:
        best.setdefault(row["output"], row)
    per = summary["settings"]["per"]
    found = (f"{m['model']} for {output}{_held(m.get('holdout_nrmse'), per)}" for output, m in best.items())
    left_out = f", {len(summary['left_out'])} left out" if summary.get("left_out") else ""
    return f"Best of {number_of('model', len(summary['models']))}{left_out}: {'; '.join(found)}"


def compare_optimizers(summary: Summary) -> str:
    """Return the optimizer of the least median cost on every condition."""
    rows = [row for row in summary["rows"] if row["median"] is not None]
    best: dict[str, Summary] = {}
    for row in sorted(rows, key=lambda row: row["median"]):
        best.setdefault(row["condition"], row)
    found = (f"{r['optimizer']} on {c}, median {r['median']:.4g} {r['unit']}".rstrip() for c, r in best.items())
    number = number_of("optimizer", len({row["optimizer"] for row in summary["rows"]}))
    return f"Best of {number} for {summary['settings']['model']}: {'; '.join(found) or 'none'}"


def status(summary: Summary) -> str:
    """Return the numbers of steps that have run and that are out of date."""
    steps = summary["steps"]
    old = sum(bool(s["outdated"]) for s in steps)
    return f"{number_of('step', len(steps))} in {summary['work']}, {old or 'none'} out of date"


def held_out(per: str) -> str:
    """Return the words on held-out data: whole conditions, or a part of each."""
    return "held out" if per == "all" else "in the held-out part of each test"


def _errors(metrics: Iterable[Summary], per: str) -> Iterable[str]:
    names = {"holdout": f" {held_out(per)}", "train": " in training", "predict": ""}
    pooled = {m["role"]: m["nrmse"] for m in metrics if m["condition"] == "all" and m["nrmse"] is not None}
    return (f"{100.0 * pooled[role]:.3g} %{words}" for role, words in names.items() if role in pooled)


def _held(nrmse: float | None, per: str) -> str:
    return "" if nrmse is None or nrmse != nrmse else f", NRMSE {100.0 * nrmse:.3g} % {held_out(per)}"
