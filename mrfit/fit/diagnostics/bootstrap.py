"""Intervals by a block bootstrap: refit outputs made of the fitted one and residuals resampled in blocks.

Blocks keep the correlation of neighbouring residuals (Künsch 1989). Of a periodic record, what differs between cycles
is drawn over the whole record, and what repeats is drawn over one cycle and repeated, less the power that it has by
chance.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.uncertainty import (
    differing,
    effective_samples,
    mirror_factor,
    phase_bins,
    sensitivities,
)
from mrfit.search.problem import LeastSquaresProblem, SegmentBlock, row_scales

REPLICATES = 400
# Quantiles between which 95 % of the refits end
INTERVAL_QUANTILES = (0.025, 0.975)
# Chord steps of a refit, and most numbers of residuals held at once
REPLICATE_STEPS = 6
BLOCK_NUMBERS = 1 << 22


class BootstrapInterval(NamedTuple):
    """Ends of a 95 % interval, None where it is open."""

    low: float | None
    high: float | None


def bootstrap_intervals(posed: LeastSquaresProblem, points: Array) -> dict[str, BootstrapInterval]:
    """Return percentile intervals of the parameters and derived quantities the data determine, by name.

    An end at which the refits were held by a bound is open.

    Parameters
    ----------
    posed
        Folded blocks that were fitted.
    points
        Where refits to redrawn outputs end, in the cube, shape (R, F).
    """
    values = posed.cube.to_theta(points)
    spec = posed.assembly.spec
    ends = np.quantile(np.hstack([values, posed.assembly.derived(values)]), INTERVAL_QUANTILES, axis=0)
    names = [*spec.names, *(d.name for d in spec.derived)]
    least, most = np.quantile(points, INTERVAL_QUANTILES, axis=0)
    held = np.zeros(ends.shape, dtype=bool)
    held[:, posed.cube.free] = least <= 0.0, most >= 1.0
    shown = [[None if h else float(e) for e, h in zip(*both, strict=True)] for both in zip(ends, held, strict=True)]
    return {n: BootstrapInterval(low, high) for n, low, high in zip(names, *shown, strict=True)}


def replicated(
    posed: LeastSquaresProblem,
    point: Array,
    directions: Array,
    errors: Sequence[Array],
    rng: np.random.Generator,
    replicates: int = REPLICATES,
) -> Array:
    """Return where refits to redrawn outputs end, (R, F): chord steps with the optimum's Jacobian, side by side.

    They move along ``directions`` (F, D), those that the data determine.
    """
    residuals, scales = posed.residuals, row_scales(posed.blocks, posed.weights)
    base = residuals(point[None, :])[0]
    pull = np.linalg.pinv(sensitivities(residuals, point) @ directions)
    worth = sum(effective_samples(e) for e in errors)
    widening = math.sqrt(worth / max(worth - directions.shape[1], 1.0))
    points = np.tile(point, (replicates, 1))
    together = max(1, BLOCK_NUMBERS // len(base))
    for first in range(0, replicates, together):
        part = slice(first, min(first + together, replicates))
        targets = np.stack(
            [base + widening * _redrawn(posed.blocks, scales, errors, rng) for _ in range(part.start, part.stop)]
        )
        for _ in range(REPLICATE_STEPS):
            steps = (targets - residuals(points[part])) @ pull.T @ directions.T
            points[part] = np.clip(points[part] + np.where(np.isfinite(steps), steps, 0.0), 0.0, 1.0)
    return points


def _redrawn(
    blocks: Sequence[SegmentBlock], scales: Sequence[Array], errors: Sequence[Array], rng: np.random.Generator
) -> Array:
    """Return redrawn errors of all blocks as rows of residuals (M,)."""
    drawn = zip(blocks, scales, errors, strict=True)
    parts = [s * b.folded(resampled(e, _period(b, len(e)), rng)) for b, s, e in drawn]
    return np.concatenate([*parts, [0.0]])


def _period(block: SegmentBlock, samples: int) -> float:
    """Return the samples per cycle of a block's measured series."""
    return samples / block.segment.cycles if block.segment.cycles else 0.0


def resampled(series: Array, period: float, rng: np.random.Generator) -> Array:
    """Return a series (N,) of the same correlation, drawn in blocks; ``period`` samples make a cycle, 0 for none."""
    noise = differing(series, period)
    drawn = _drawn(noise, rng)
    if len(series) < 2.0 * period or period < 1.0:
        return drawn
    bins = phase_bins(len(series), period)
    repeated = np.bincount(bins, series) / np.bincount(bins)
    power, chance = float(np.mean(repeated**2)), float(np.mean(noise**2)) * period / len(series)
    if power <= chance:
        return drawn
    scale = math.sqrt((1.0 - chance / power) * mirror_factor(repeated))
    return drawn + scale * _drawn(repeated, rng)[bins]


def _drawn(series: Array, rng: np.random.Generator) -> Array:
    """Return circular blocks of a series put together to its length."""
    samples, length = len(series), block_length(series)
    count = -(-samples // length)
    starts = rng.integers(samples, size=count)
    places = (starts[:, None] + np.arange(length)).reshape(-1)[:samples] % samples
    drawn: Array = series[places] - series.mean()
    return drawn


def block_length(series: Array) -> int:
    """Return twice the block length that is best for the mean of an AR(1) series (Carlstein 1986), at most N / 4.

    Twice, since the variance of a mean over blocks falls short by a share proportional to the inverse length.
    """
    share = effective_samples(series) / max(len(series), 1)
    rho = (1.0 - share) / (1.0 + share)
    length = 2.0 * (math.sqrt(6.0) * rho / (1.0 - rho**2)) ** (2 / 3) * len(series) ** (1 / 3)
    return int(np.clip(math.ceil(length), 1, max(len(series) // 4, 1)))
