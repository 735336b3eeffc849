"""A fit's outcome in words: how good, where best and worst, and every reason to distrust it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from mrfit.core.counting import number_of
from mrfit.io.schemas.fit import Fit, MetricRow
from mrfit.report.numbers import WITHIN_NOISE, in_html, natural, percent, significant
from mrfit.report.output_unit import output_unit


def verdict(fit: Fit) -> list[str]:
    """Return sentences on the error in training and on held-out data, and on the best and the worst condition."""
    said = []
    for role, where in (("train", "training"), ("holdout", "held-out")):
        pooled = fit.pooled(role)
        if pooled:
            said.append(_error(fit, pooled, where, len(fit.rows(role))))
    if not fit.pooled("holdout"):
        said.append("Nothing was held out: how the model does on data it has not seen is not known.")
    said += _floors(fit)
    rows = [m for m in fit.rows("holdout") or fit.rows("train") if m.nrmse is not None]
    if len(rows) > 1:
        best, worst = min(rows, key=_nrmse), max(rows, key=_nrmse)
        where = "held-out" if rows[0].role == "holdout" else "training"
        said.append(
            f"Best {where} condition: {best.condition} ({percent(best.nrmse)}); "
            f"worst: {worst.condition} ({percent(worst.nrmse)})."
        )
    return said


# How a noise floor was found, in words
METHODS = {
    "cycles": "from the difference of cycles",
    "repeats": "from the difference of repeated records",
    "regression": "by regression on the inputs",
    "other records": "from other records",
    "not known": "not known",
}


def _floors(fit: Fit) -> list[str]:
    """Return the origin of the noise floors, with the widest bounds, unless all are from the difference of cycles."""
    used = [s for result in fit.results for s in result.segments if s.noise_floor_method]
    counts = Counter(s.noise_floor_method for s in used)
    if set(counts) <= {"cycles"}:
        return []
    parts = [f"{METHODS.get(m, m)} in {number_of('segment', n)}" for m, n in counts.items()]
    text = f"The noise floor is {', '.join(parts)}"
    lows = [low for low, _ in (s.noise_floor_bounds for s in used) if low is not None]
    highs = [high for _, high in (s.noise_floor_bounds for s in used) if high is not None]
    if lows and highs:
        scale, least = output_unit(fit), min(lows)
        low, high = (in_html(significant(scale.factor * v)) for v in (least, max(highs)))
        text += f"; it lies between about {low} and {high} {scale.unit}".rstrip()
        if any(row.rmse is not None and row.rmse < least for row in fit.metrics):
            text += ", and lower where the model leaves less"
    return [text + "."]


def _nrmse(row: MetricRow) -> float:
    return row.nrmse or 0.0


def _error(fit: Fit, row: MetricRow, where: str, conditions: int) -> str:
    if row.rmse is None:
        return f"On {where} data the simulation diverged: no error can be given."
    amount = output_unit(fit).words(row.rmse)
    data = f"{where} data ({number_of('condition', conditions)})"
    text = f"On {data} the error is {amount} RMS, {percent(row.nrmse)} of the range"
    if not row.noise_floor:
        return f"{text}; the noise floor is not known."
    ratio = row.rmse / row.noise_floor
    if ratio <= WITHIN_NOISE:
        return f"{text}, {in_html(significant(ratio))} times the noise floor: what is left is noise."
    return f"{text}, {in_html(significant(ratio))} times the noise floor."


@dataclass(frozen=True)
class GroupedWarning:
    """A kind of warning.

    Attributes
    ----------
    kind
        Its name.
    count
        How many conditions it concerns; 0 of one on the whole fit.
    text
        Its most frequent wording.
    where
        The conditions concerned, in words; empty for one set of parameters.
    others
        The remaining wordings as (text, where).
    """

    kind: str
    count: int
    text: str
    where: str
    others: Sequence[tuple[str, str]]


def cautions(fit: Fit) -> list[GroupedWarning]:
    """Return the warnings on the whole fit, then those on its conditions by kind, the most frequent first."""
    found: dict[str, dict[str, list[str]]] = {}
    whole = [GroupedWarning(c.kind, 0, c.text, "", ()) for c in fit.warnings]
    for result in fit.results:
        for caution in result.warnings:
            found.setdefault(caution.kind, {}).setdefault(caution.text, []).append(result.condition)
    total = len(fit.results)
    rows = []
    for kind, wordings in found.items():
        (text, _), *others = sorted(wordings.items(), key=lambda item: -len(item[1]))
        conditions = sorted({c for where in wordings.values() for c in where}, key=natural)
        more = [(t, _where(where, total)) for t, where in others]
        rows.append(GroupedWarning(kind, len(conditions), text, _where(conditions, total), more))
    return whole + sorted(rows, key=lambda row: -row.count)


def _where(conditions: list[str], total: int) -> str:
    if total == 1:
        return ""
    if len(conditions) == total:
        return f"all {total} conditions"
    return ", ".join(conditions) if len(conditions) <= 3 else f"{len(conditions)} of {total} conditions"


def open_directions(fit: Fit) -> list[tuple[str, str]]:
    """Return sentences on open directions, each with its condition, for sets of parameters not of full rank."""
    said = []
    for result in fit.results:
        conditioning = result.conditioning
        if result.identifiability:
            said.append((result.condition, " ".join(result.identifiability)))
        elif conditioning and conditioning.rank < conditioning.parameters:
            ways = "; ".join(_direction(d) for d in conditioning.null_directions)
            text = f"the data determine {conditioning.rank} of {conditioning.parameters} directions"
            said.append((result.condition, text + (f"; free to move along {ways}" if ways else "")))
    return said


def _direction(weights: dict[str, float]) -> str:
    ordered = sorted(weights.items(), key=lambda item: -abs(item[1]))
    return " ".join(f"{'+' if w > 0 else '−'}{abs(w):.2g}·{name}" for name, w in ordered)
