"""Intervals by a block bootstrap: refit outputs made of the fitted one and residuals drawn anew in blocks.

Blocks keep the correlation of neighbouring residuals (Künsch 1989). Of a periodic record, what differs between cycles
is drawn over the whole record, and what repeats is drawn over one cycle and repeated, less the power that it has by
chance.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from mrfit import optimize
from mrfit.fit.problem import Posed, differences
from mrfit.fit.uncertainty import differing, effective_samples, mirror_factor, phase_bins
from mrfit.objective import Objective
from mrfit.specs import Array

REPLICATES = 200
# Evaluations per free parameter for a refit that starts at the optimum
REFIT_BUDGET = 15


class Interval(NamedTuple):
    """Ends of a 95 % interval, None where it is open."""

    low: float | None
    high: float | None


def bootstrap_intervals(
    posed: Posed, point: Array, rng: np.random.Generator, replicates: int = REPLICATES
) -> dict[str, Interval]:
    """Return percentile intervals of all free parameters and derived quantities by name.

    Parameters
    ----------
    posed
        Full blocks that were fitted.
    point
        Optimum in the cube, shape (F,).
    rng
        Source of the blocks drawn.
    replicates
        Number of refits.
    """
    theta = posed.cube.to_theta(point[None, :])
    errors = [-differences(b, posed.assembly, theta)[0] for b in posed.blocks]
    fitted = [b.target - e for b, e in zip(posed.blocks, errors, strict=True)]
    worth = sum(effective_samples(e) for e in errors)
    widening = math.sqrt(worth / max(worth - len(point), 1.0))
    points = np.empty((replicates, len(point)))
    for number in range(replicates):
        drawn = [
            f + widening * resampled(e, b.period, rng) for f, e, b in zip(fitted, errors, posed.blocks, strict=True)
        ]
        points[number] = refitted(posed.against(drawn).residuals, point)
    values = posed.cube.to_theta(points)
    names = [*posed.assembly.spec.names, *(d.name for d in posed.assembly.spec.derived)]
    ends = np.quantile(np.hstack([values, posed.assembly.derived(values)]), [0.025, 0.975], axis=0)
    return {n: Interval(float(low), float(high)) for n, low, high in zip(names, *ends, strict=True)}


def refitted(residuals: Callable[[Array], Array], point: Array) -> Array:
    """Return where least squares of residuals (P, F) -> (P, M) goes from a point near the optimum, shape (F,)."""
    objective = Objective(residuals, point, budget=0)
    budget = REFIT_BUDGET * (len(point) + 1)
    return optimize.run("lsq", objective, np.random.default_rng(0), budget).point


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
    total: Array = drawn + scale * _drawn(repeated, rng)[bins]
    return total


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

    Twice, since the variance of a mean over blocks falls short by a share that goes with the inverse length.
    """
    share = effective_samples(series) / max(len(series), 1)
    rho = (1.0 - share) / (1.0 + share)
    length = 2.0 * (math.sqrt(6.0) * rho / (1.0 - rho**2)) ** (2 / 3) * len(series) ** (1 / 3)
    return int(np.clip(math.ceil(length), 1, max(len(series) // 4, 1)))
