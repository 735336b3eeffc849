"""Estimates of quantities of repeated cycles: mean, 95 % interval, and the course over the cycles.

A quantity is a function of what every cycle gives, taken at the means over the cycles. Its interval is that of the
jackknife's pseudo-values over the cycles, with Student's t. Of few cycles the channels' noise is pooled with their
scatter, unless the scatter is larger. A drift over the cycles that chance does not explain widens the interval by as
much as the quantity changed from the middle of the record to its ends.

Source: Tukey's jackknife (Ann. Math. Stat. 29 (1958) 614); guide to the expression of uncertainty, JCGM 100, 4.2.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as fisher
from scipy.stats import t as student

from mrfit.core.specs import Array

CONFIDENCE = 0.95
FEW = 6
"""Cycles below which the noise of the channels counts beside the scatter."""
NOISE_FREEDOM = 24
"""Degrees of freedom of a noise level, of which a few hundred samples and a doubt about its colour leave so many."""
DRIFTS = 0.05
"""Chance below which a slope over the cycles is a drift."""
EXCEEDS = 0.05
"""Chance below which the scatter of few cycles is more than noise."""

Function = Callable[..., Array]
"""A quantity of arrays (N,), element by element."""


@dataclass(frozen=True)
class PerCycle:
    """Values of the cycles (N,), the variance that noise gives each (N,), and a bound of an error that all share."""

    values: Array
    noise: Array
    shared: float = 0.0

    def __post_init__(self) -> None:
        """Check that every value has its variance."""
        assert self.values.shape == self.noise.shape


@dataclass(frozen=True)
class Interval:
    """A number with its 95 % interval, each in the number's unit."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Estimate:
    """A quantity of repeated cycles.

    Attributes
    ----------
    value, low, high
        At the means over the cycles, with its 95 % interval.
    freedom
        Degrees of freedom of the interval.
    cycles
        The quantity of every cycle (N,).
    noise
        Standard deviation that the channels' noise gives the quantity of one cycle.
    slope
        Change per cycle; None of fewer than three cycles.
    drift
        Change from the first cycle to the last where it is more than chance, else 0.
    """

    value: float
    low: float
    high: float
    freedom: float
    cycles: Array
    noise: float
    slope: Interval | None
    drift: float

    @property
    def error(self) -> float:
        """Half of the interval."""
        return (self.high - self.low) / 2.0

    @property
    def greatest_deviation(self) -> float | None:
        """Greatest deviation of one cycle from the value, as a share of it."""
        if len(self.cycles) < 2 or self.value == 0.0:
            return None
        return float(np.max(np.abs(self.cycles - self.value)) / abs(self.value))

    @property
    def first_to_third(self) -> float | None:
        """Loss from the first to the third cycle, as a share of the first."""
        if len(self.cycles) < 3 or self.cycles[0] == 0.0:
            return None
        return float(1.0 - self.cycles[2] / self.cycles[0])


def estimate(function: Function, *inputs: PerCycle, reach: float = 0.0) -> Estimate:
    """Return a quantity with its interval.

    Parameters
    ----------
    function
        The quantity of the inputs' values.
    inputs
        What the cycles give, of N cycles each.
    reach
        Cycles from the middle of these to the farther end of the record.
    """
    count = len(inputs[0].values)
    means = [np.array([one.values.mean()]) for one in inputs]
    whole = float(function(*means)[0])
    each = np.asarray(function(*(one.values for one in inputs)), dtype=np.float64)
    noise, shared = _noise_variance(function, inputs, means, whole), _shared(function, inputs, means)
    if count < 2:
        return _of_one(whole, each, noise, shared)
    others = [(count * mean - one.values) / (count - 1) for mean, one in zip(means, inputs, strict=True)]
    pseudo = count * whole - (count - 1) * np.asarray(function(*others))
    slope, residual, chance = _line(pseudo)
    drifts = slope is not None and chance < DRIFTS and count >= FEW
    scatter = residual if drifts else float(np.var(pseudo, ddof=1))
    freedom = float(count - 2 if drifts else count - 1)
    if count < FEW:
        scatter, freedom = _pooled(scatter, freedom, noise)
    half = float(student.ppf(0.5 + CONFIDENCE / 2.0, freedom)) * float(np.sqrt(scatter / count))
    drift = slope.value * (count - 1) if drifts and slope else 0.0
    if drifts and slope:
        half += abs(slope.value) * max(reach, (count - 1) / 2.0)
    half += shared
    return Estimate(whole, whole - half, whole + half, freedom, each, float(np.sqrt(noise)), slope, drift)


def of_values(values: Array) -> Estimate:
    """Return the mean of values (N,) whose noise is known by their scatter alone; two or more have an interval."""
    noise = np.full(len(values), np.nan if len(values) < 2 else float(np.var(values, ddof=1)))
    return estimate(lambda x: x, PerCycle(values, noise))


def _of_one(value: float, each: Array, noise: float, shared: float) -> Estimate:
    half = float(student.ppf(0.5 + CONFIDENCE / 2.0, NOISE_FREEDOM)) * float(np.sqrt(noise)) + shared
    return Estimate(value, value - half, value + half, NOISE_FREEDOM, each, float(np.sqrt(noise)), None, 0.0)


def _noise_variance(function: Function, inputs: tuple[PerCycle, ...], means: list[Array], whole: float) -> float:
    """Return the variance that noise gives the quantity of one cycle, by its derivatives at the means."""
    total = 0.0
    for place, one in enumerate(inputs):
        spread = float(one.noise.mean())
        if spread > 0.0:
            moved = list(means)
            moved[place] = means[place] + 0.1 * np.sqrt(spread)
            total += float((function(*moved)[0] - whole) * 10.0) ** 2
    return total


def _shared(function: Function, inputs: tuple[PerCycle, ...], means: list[Array]) -> float:
    """Return a bound of the error that the cycles share, by that of the inputs."""
    total = 0.0
    for place, one in enumerate(inputs):
        if one.shared > 0.0:
            moved = [list(means), list(means)]
            for ends, sign in zip(moved, (1.0, -1.0), strict=True):
                ends[place] = means[place] + sign * one.shared
            total += abs(float(function(*moved[0])[0] - function(*moved[1])[0])) / 2.0
    return total


def _pooled(scatter: float, freedom: float, noise: float) -> tuple[float, float]:
    """Return the variance of few cycles with the channels' noise, unless it is more than that noise."""
    if not noise > 0.0 or scatter > noise * float(fisher.ppf(1.0 - EXCEEDS, freedom, NOISE_FREEDOM)):
        return scatter, freedom
    together = freedom + NOISE_FREEDOM
    return (freedom * scatter + NOISE_FREEDOM * noise) / together, together


def _line(values: Array) -> tuple[Interval | None, float, float]:
    """Return the slope of values over their number, the variance about the line, and the chance of such a slope."""
    count = len(values)
    if count < 3:
        return None, float("nan"), 1.0
    at = np.arange(count) - (count - 1) / 2.0
    power = float(at @ at)
    slope = float(at @ values) / power
    residual = float(np.sum((values - values.mean() - slope * at) ** 2)) / (count - 2)
    error = float(np.sqrt(residual / power))
    half = float(student.ppf(0.5 + CONFIDENCE / 2.0, count - 2)) * error
    chance = 2.0 * float(student.sf(abs(slope) / error, count - 2)) if error > 0.0 else float(slope == 0.0)
    return Interval(slope, slope - half, slope + half), residual, chance
