"""What was proposed for a specimen, beside the truth: force on held-out tests, factors, intervals; and the table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .forms import GROUPS, KINDS, VARIABLES, Array, Name
from .lawful import lawful_columns, outside, plain_columns
from .reading import read_formula
from .specimen import Run, Specimen

CLOSED = 0.8


@dataclass(frozen=True)
class Proposal:
    """A term that was proposed: its force (N), its shape, and the ends of the interval over its coefficient."""

    at: Callable[[Mapping[str, Array]], Array]
    name: Name
    interval: tuple[float, float] | None = None


def read_proposed(specimen: Specimen, proposed: Mapping[str, Any] | None) -> tuple[list[Proposal], list[list[Name]]]:
    """Return the terms of the formula in a discovery, and those of each formula that the data do not tell from it.

    The coefficients that have intervals belong to the terms in their order.

    Raises
    ------
    FormulaError
        If a formula cannot be read.
    """
    if not proposed or not proposed.get("text"):
        return [], []
    whole = {k: np.concatenate([r.values[k] for r in specimen.tests]) for k in VARIABLES}
    low, high = ({k: float(f(y)) for k, y in whole.items()} for f in (np.min, np.max))
    numbers = {c["name"]: c["value"] for c in proposed["coefficients"]}
    products = read_formula(proposed["text"], numbers)
    ends = [
        tuple(sorted((c["low"] / c["value"], c["high"] / c["value"])))
        for c in proposed["coefficients"]
        if c.get("low") is not None and c.get("high") is not None
    ]
    intervals = ends if len(ends) == len(products) else [None] * len(products)
    terms = [Proposal(p.at, p.name(low, high), e) for p, e in zip(products, intervals, strict=True)]
    readings = (read_formula(text, numbers) for text in proposed.get("alike", ()))
    return terms, [[p.name(low, high) for p in reading] for reading in readings]


def sizes(specimen: Specimen) -> dict[str, object]:
    """Return the sizes of the hidden terms: shares of the law's range, and of squares that a base and any law leave."""
    runs = specimen.tests
    values, planted = [r.values for r in runs], _join(runs, lambda r: r.planted)
    law = _join(runs, lambda r: r.values["L"])
    beside_law, beside_base = lawful_columns(values, specimen.damper), plain_columns(values, specimen.damper)
    left = outside(beside_law, planted)
    return {
        "size": [
            float(np.max(np.abs(_join(runs, lambda r, k=k: r.terms[k])))) / specimen.size
            for k in range(len(specimen.terms))
        ],
        "outside": _rms(left) / specimen.size,
        "contrast": _rms(left) / specimen.sensors.force,
        "noise": specimen.sensors.force / specimen.size,
        "share_of_error": _share(outside(beside_base, planted), outside(beside_base, law)),
        "share_outside": _share(left, outside(beside_law, law)),
    }


def score(
    specimen: Specimen, proposals: Sequence[Proposal], readings: Sequence[Sequence[Name]] = ()
) -> dict[str, object]:
    """Return the outcome of a case and what it is made of.

    ``closed`` is the share of the outside-law part that the proposal takes on held-out tests, of root mean squares:
    1 - rms(outside(planted - found)) / rms(outside(planted)); ``closed_square`` that of squares.
    The outcome is ``right`` with all planted factors and no other term, ``in-set`` with those of a stated reading.
    ``holds`` says of the terms with right factors whether the interval holds the true coefficient, which is that of
    the least outside-law part missed on the tests.
    """
    if not specimen.terms:
        return {"outcome": "null-called" if proposals else "right"}
    if not proposals:
        return {"outcome": "none"}
    held = specimen.held_out
    columns = lawful_columns([r.values for r in held], specimen.damper)
    planted = _join(held, lambda r: r.planted)
    missed = planted - _join(held, lambda r: np.sum([p.at(r.values) for p in proposals], axis=0))
    ratio = _rms(outside(columns, missed)) / _rms(outside(columns, planted))
    right = _matched(specimen.right, [frozenset({p.name}) for p in proposals])
    alike = [r for r in readings if len(r) == len(proposals)]
    slots = [frozenset({p.name, *(r[k] for r in alike)}) for k, p in enumerate(proposals)]
    within = _matched(specimen.right, slots) or any(
        _matched(specimen.right, [frozenset({n}) for n in r]) for r in readings
    )
    result = {
        "closed": 1 - ratio,
        "closed_square": 1 - ratio**2,
        "raw_distance": _rms(missed) / _rms(planted),
        "outcome": "right" if right else "in-set" if within else "other-form",
    }
    scales = _true_scales(specimen, proposals)
    ends = [
        (p.interval, scale)
        for p, scale in zip(proposals, scales, strict=True)
        if p.interval and any(p.name in names for names in specimen.right)
    ]
    return result | {"true_scales": scales, "holds": [low <= scale <= high for (low, high), scale in ends]}


def _matched(right: Sequence[frozenset[Name]], said: Sequence[frozenset[Name]]) -> bool:
    """Whether each planted term is one of the proposed, and the others are lower powers of one: the origin's."""
    open_ = list(said)
    for names in right:
        taken = next((names_said for names_said in open_ if names & names_said), None)
        if taken is None:
            return False
        open_.remove(taken)
    return all(any(_lower(one, other) for one in rest for names in right for other in names) for rest in open_)


def _lower(one: Name, other: Name) -> bool:
    """Whether a term is another with a lower power of place or current, as a shifted origin makes it."""
    first, second = dict(one), dict(other)
    if set(first) - set(second) or set(second) - set(first) - {"x", "i"}:
        return False
    differing = [k for k in second if first.get(k) != second[k]]
    powers = [(first.get(k, "power 0").split(), second[k].split()) for k in differing]
    return len(differing) == 1 and differing[0] in "xi" and all(
        {a[0], b[0]} <= {"odd", "even", "power"} and float(a[1]) < float(b[1]) for a, b in powers
    )  # fmt: skip


def _true_scales(specimen: Specimen, proposals: Sequence[Proposal]) -> list[float]:
    """Return the factors of the proposed terms that bring them nearest to the planted ones, beside every law."""
    runs = specimen.tests
    columns = lawful_columns([r.values for r in runs], specimen.damper)
    found = np.stack([outside(columns, _join(runs, lambda r, p=p: p.at(r.values))) for p in proposals], axis=1)
    size = np.maximum(np.linalg.norm(found, axis=0), 1e-300)
    planted = outside(columns, _join(runs, lambda r: r.planted))
    return [float(c) for c in np.linalg.lstsq(found / size, planted)[0] / size]


def _join(runs: Sequence[Run], of: Callable[[Run], Array]) -> Array:
    return np.concatenate([of(run) for run in runs])


def _rms(y: Array) -> float:
    return float(np.sqrt(np.mean(y**2)))


def _share(part: Array, rest: Array) -> float:
    return float(np.sum(part**2) / (np.sum(part**2) + np.sum(rest**2)))


def table(rows: Sequence[Mapping[str, object]], of: str = "") -> str:
    """Return a table by kind and group, in Markdown; ``of`` names a baseline in the rows."""
    head = [
        "kind",
        "cases",
        "proposed",
        f">= {CLOSED:.0%} closed",
        "right",
        "right or in set",
        "intervals hold",
        "named an effect",
        "failed",
    ]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    classes = {k: [r for r in rows if r["kind"] == k] for k in KINDS}
    for group, kinds in GROUPS.items():
        chosen = [r for r in rows if r["kind"] in kinds]
        classes[f"all of {group}"] = chosen
        if group == "form":
            for low, high in ((0.01, 0.03), (0.03, 0.05), (0.05, 0.081)):
                within = [r for r in chosen if low <= max(r["size"]) < high]  # type: ignore[call-overload]
                classes[f"form, {100 * low:.0f} to {100 * high:.0f} % of range"] = within
    for name, chosen in classes.items():
        scores = [r[of] if of else r for r in chosen if not of or r.get(of)]
        if scores:
            lines.append("| " + " | ".join(map(str, [name, *_counts(scores)])) + " |")
    return "\n".join(lines)


def _counts(scores: Sequence[Mapping[str, object]]) -> list[object]:
    outcomes = [str(s["outcome"]) for s in scores]
    holds = [h for s in scores for h in s.get("holds", ())]  # type: ignore[attr-defined]
    return [
        len(scores),
        sum(bool(s.get("proposed")) for s in scores),
        sum(float(s.get("closed", 0.0)) >= CLOSED for s in scores),  # type: ignore[arg-type]
        outcomes.count("right"),
        outcomes.count("right") + outcomes.count("in-set"),
        f"{sum(holds)}/{len(holds)}",
        sum(bool(s.get("named")) for s in scores),
        outcomes.count("failed"),
    ]
