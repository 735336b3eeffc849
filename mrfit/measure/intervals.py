"""Estimates of quantities of repeated cycles: mean, 95 % interval, and the course over the cycles.

A quantity is a function of what every cycle gives, taken at the means over the cycles. Its interval is that of the
jackknife's pseudo-values over the cycles, with Student's t. Of few cycles the channels' noise is pooled with their
scatter, unless the scatter is larger.

An error that all cycles share has a bound b: what a fit cannot follow, and what a drift over the cycles changes from
the middle of the record to its ends. The interval is then value ± (b + c*u), u the standard error, and c such that a
truth at the bound is held in 95 % of cases: T(c + 2*b/u) - T(-c) = 0.95, T the distribution of Student's t. The drift
of the force's zero is known from whole cycles (``PerCycle.zero``), any other from the quantity's own course.

Source: Tukey's jackknife (Ann. Math. Stat. 29 (1958) 614); guide to the expression of uncertainty, JCGM 100, 4.2;
Imbens and Manski, Econometrica 72 (2004) 1845, eq. 7, for an error with a bound.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import fdtri, stdtr, stdtrit

from mrfit.core.specs import Array

CONFIDENCE = 0.95
FEW_CYCLES = 6
"""Cycles below which the noise of the channels counts beside the scatter."""
NOISE_FREEDOM = 24
"""Degrees of freedom of a noise level, of which a few hundred samples and a doubt about its colour leave so many."""
DRIFT_CHANCE = 0.05
"""Chance below which a slope over the cycles is a drift."""
SCATTER_CHANCE = 0.05
"""Chance below which the scatter of few cycles is more than noise."""
QUANTILE_HALVINGS = 30

Function = Callable[..., Array]
"""A quantity of arrays (N,), element by element."""


@dataclass(frozen=True)
class PerCycle:
    """Values of a quantity, one a cycle, with bounds of their errors.

    Attributes
    ----------
    values
        One of each cycle (N,), less the drift of the force's zero.
    noise
        Variance that noise gives each (N,).
    shared
        Bound of an error that all of them share.
    zero
        Drift of the force's zero per cycle, in the values' unit.
    """

    values: Array
    noise: Array
    shared: float = 0.0
    zero: float = 0.0

    def __post_init__(self) -> None:
        """Check that every value has its variance."""
        assert self.values.shape == self.noise.shape


@dataclass(frozen=True)
class ConfidenceInterval:
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
    slope: ConfidenceInterval | None
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
    noise = _noise_variance(function, inputs, means, whole)
    bound = sum(
        _half_change(function, means, [one.shared * (k == place) for k in range(len(inputs))])
        for place, one in enumerate(inputs)
        if one.shared > 0.0
    )
    bound += _half_change(function, means, [one.zero * reach for one in inputs])
    own = np.asarray(function(*(one.values for one in inputs)), dtype=np.float64)
    if count < 2:
        half = _half_interval(float(np.sqrt(noise)), NOISE_FREEDOM, bound)
        return Estimate(whole, whole - half, whole + half, NOISE_FREEDOM, own, float(np.sqrt(noise)), None, 0.0)
    others = [(count * mean - one.values) / (count - 1) for mean, one in zip(means, inputs, strict=True)]
    pseudo = count * whole - (count - 1) * np.asarray(function(*others))
    line = line_of(pseudo)
    drifts = line is not None and line.chance < DRIFT_CHANCE and count >= FEW_CYCLES
    scatter, freedom = float(np.var(pseudo, ddof=1)), float(count - 1)
    if drifts and line:
        scatter, freedom = line.variance, float(count - 2)
        bound += abs(line.slope.value) * max(reach, (count - 1) / 2.0)
    if count < FEW_CYCLES:
        scatter, freedom = _pooled(scatter, freedom, noise)
    half = _half_interval(float(np.sqrt(scatter / count)), freedom, bound)
    each, course = own, line
    if any(one.zero for one in inputs):
        number = np.arange(count) - (count - 1) / 2.0
        each = np.asarray(function(*(one.values + one.zero * number for one in inputs)), dtype=np.float64)
        course = line_of(pseudo + each - own)
    drifts = course is not None and course.chance < DRIFT_CHANCE and count >= FEW_CYCLES
    return Estimate(
        whole,
        whole - half,
        whole + half,
        freedom,
        each,
        float(np.sqrt(noise)),
        course.slope if course else None,
        course.slope.value * (count - 1) if drifts and course else 0.0,
    )


def of_values(values: Array) -> Estimate:
    """Return the mean of values (N,) whose noise is known by their scatter alone; two or more have an interval."""
    noise = np.full(len(values), np.nan if len(values) < 2 else float(np.var(values, ddof=1)))
    return estimate(lambda x: x, PerCycle(values, noise))


@cache
def student_quantile(freedom: float) -> float:
    """Return half of the 95 % interval of a value over its standard error."""
    return float(stdtrit(max(freedom, 1.0), 0.5 + CONFIDENCE / 2.0))


def _half_interval(error: float, freedom: float, bound: float) -> float:
    """Return half of the interval of a standard error and a bound of what is not random."""
    outer, inner = (float(stdtrit(freedom, p)) for p in (0.5 + CONFIDENCE / 2.0, CONFIDENCE))
    if not bound > 0.0 or not error > 0.0:
        return outer * error + bound
    # T(c + 2*b/u) - T(-c) rises with c, from below at the one-sided quantile to above at the two-sided one
    for _ in range(QUANTILE_HALVINGS):
        c = (inner + outer) / 2.0
        if stdtr(freedom, c + 2.0 * bound / error) - stdtr(freedom, -c) < CONFIDENCE:
            inner = c
        else:
            outer = c
    return outer * error + bound


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


def _half_change(function: Function, means: Sequence[Array], moves: Sequence[float]) -> float:
    """Return half of what moves of all inputs together, up and down, change in the quantity."""
    if not any(moves):
        return 0.0
    ends = (function(*(m + sign * move for m, move in zip(means, moves, strict=True))) for sign in (1.0, -1.0))
    high, low = (float(end[0]) for end in ends)
    return abs(high - low) / 2.0


def _pooled(scatter: float, freedom: float, noise: float) -> tuple[float, float]:
    """Return the variance of few cycles with the channels' noise, unless it is more than that noise."""
    if not noise > 0.0 or scatter > noise * float(fdtri(freedom, NOISE_FREEDOM, 1.0 - SCATTER_CHANCE)):
        return scatter, freedom
    together = freedom + NOISE_FREEDOM
    return (freedom * scatter + NOISE_FREEDOM * noise) / together, together


@dataclass(frozen=True)
class Line:
    """A line through values over places: its slope, the variance about it, and the chance of such a slope."""

    slope: ConfidenceInterval
    variance: float
    chance: float


def line_of(values: Array, at: Array | None = None) -> Line | None:
    """Return the line of least squares through values (N,) over places, default their number; None of less than three.

    ``at`` must not be the same place for all.
    """
    count = len(values)
    if count < 3:
        return None
    places = np.arange(count) if at is None else at
    number = places - places.mean()
    power = float(number @ number)
    slope = float(number @ values) / power
    left = values - values.mean() - slope * number
    variance = float(left @ left) / (count - 2)
    error = float(np.sqrt(variance / power))
    half = student_quantile(count - 2.0) * error
    chance = 2.0 * float(stdtr(count - 2, -abs(slope) / error)) if error > 0.0 else float(slope == 0.0)
    return Line(ConfidenceInterval(slope, slope - half, slope + half), variance, chance)


def known(value: float, low: float, high: float, freedom: float = 0.0) -> Estimate:
    """Return an estimate whose interval is known, of no single cycles."""
    return Estimate(value, low, high, freedom, np.array([value]), float("nan"), None, 0.0)
