"""Shape of the error: a curve over a channel of the motion or the current, a loop over it, or a mark of reversals.

The shape is learnt on training conditions and judged by what it predicts of held-out ones. A static law that is wrong
leaves a curve. A model without memory where the specimen has some leaves what no curve can follow: a loop, or an error
that goes by how far the channel has come since it last turned, as in a hysteresis or a friction with bristles.
"""

from collections.abc import Callable, Sequence

import numpy as np

from mrfit.core.channels import LOOP_AXES
from mrfit.core.specs import Array, Index
from mrfit.discover.evidence.bench import Bench, Stretch
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.policy import STANDARD, Policy
from mrfit.io.schemas.discovery import Look
from mrfit.signal.cycles import last_event


def residual_shapes(bench: Bench, fit: Refit) -> list[Look]:
    """Return for every channel the share of the squared hold-out error that a curve and a loop over it predict.

    Shares are of the squared error and negative where a shape predicts nothing; the channel whose shape says most comes
    first.
    """
    rows = [
        Look(over=name, **{shape: _predicted(bench, fit, name, places) for shape, places in SHAPES.items()})
        for name in LOOP_AXES
        if name in bench.channels
    ]
    return sorted(rows, key=lambda row: -_most(row))


def _most(look: Look) -> float:
    return max(look.curve, look.loop, look.since_it_turned)


def shape_in_words(rows: Sequence[Look], policy: Policy) -> str:
    """Return one sentence on the shape that says most, empty if none says much."""
    if not rows or _most(rows[0]) < policy.shape_told:
        return ""
    over, curve, memory = rows[0].over.replace("_", " "), rows[0].curve, max(rows[0].loop, rows[0].since_it_turned)
    if memory - curve < policy.memory_told:
        return (
            f"{curve:.0%} of what is left on held-out conditions is one curve over the {over}: a static law is missing"
        )
    loop = rows[0].loop >= rows[0].since_it_turned
    what = f"a loop over the {over}" if loop else f"the path of the {over} since its last reversal"
    flat = f"a curve over it {curve:.0%}" if curve > policy.no_curve else "a curve over it nothing"
    share = f"{memory:.0%} of what is left on held-out conditions"
    return f"{what} predicts {share}, {flat}: memory of the {over}, or a term of it and its rate, is missing"


def _predicted(bench: Bench, fit: Refit, name: str, places: Callable[[Array, float], Index]) -> float:
    train, holdout = bench.of_role("train"), bench.of_role("holdout")
    peak = max(float(np.max(np.abs(_values(s, name)))) for s in (*train, *holdout))
    learnt = _means([places(_values(s, name), peak) for s in train], fit.train)
    left = total = 0.0
    for stretch, error in zip(holdout, fit.holdout, strict=True):
        guess = learnt[places(_values(stretch, name), peak)]
        left, total = left + float(np.sum((error - guess) ** 2)), total + float(error @ error)
    return 1.0 - left / max(total, 1e-300)


def _values(stretch: Stretch, name: str) -> Array:
    values = stretch.channel(name)
    assert values is not None  # a bench's channels are those that every stretch has
    return values


def _on_curve(values: Array, peak: float) -> Index:
    """Return the bin of each sample by the channel's value."""
    return np.clip(
        ((values / max(peak, 1e-300) + 1.0) * 0.5 * STANDARD.shape_bins).astype(np.int64), 0, STANDARD.shape_bins - 1
    )


def _rising(values: Array) -> Index:
    return (np.gradient(values) > 0.0).astype(np.int64)


def _on_loop(values: Array, peak: float) -> Index:
    """Return the bin of each sample by the channel's value and by whether it rises or falls."""
    return _on_curve(values, peak) + STANDARD.shape_bins * _rising(values)


def _since_turn(values: Array, peak: float) -> Index:
    """Return the bin of each sample by how far the channel has come since it last turned, and in which direction."""
    rising = _rising(values)
    turns = np.flatnonzero(np.diff(rising, prepend=rising[0]))
    way = np.abs(values - values[last_event(turns, len(values))]) / max(2.0 * peak, 1e-300)
    place = np.clip(
        (np.sqrt(way) * STANDARD.shape_bins).astype(np.int64), 0, STANDARD.shape_bins - 1
    )  # finer where it has just turned
    return place + STANDARD.shape_bins * rising


SHAPES: dict[str, Callable[[Array, float], Index]] = {
    "curve": _on_curve,
    "loop": _on_loop,
    "since_it_turned": _since_turn,
}


def _means(places: Sequence[Index], errors: Sequence[Array]) -> Array:
    at, error = np.concatenate(places), np.concatenate(errors)
    counts = np.bincount(at, minlength=2 * STANDARD.shape_bins)
    return np.bincount(at, error, 2 * STANDARD.shape_bins) / np.maximum(counts, 1)
