"""Quantities of several conditions of one damper: law of force over velocity, dynamic range, loss of force by heat.

    C, alpha       F0 = C*sgn(v)*|v|^alpha, by a line of log |F0| over log |v| through three speeds or more
    dynamic range  |Fmax| at the greatest current over that at the least, each a mean of both directions, per speed
    fade           (F_ref - F_T)/F_ref of Fmax: between temperatures where they are logged, else over the cycles

Intervals follow from those of the forces; where the points leave a line by more than these explain, from the residual.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from scipy.special import chdtrc

from mrfit.core.counting import number_of
from mrfit.core.specs import Array
from mrfit.measure.intervals import Estimate, known, student_quantile
from mrfit.measure.quantity import Quantity, without

Row = TypeVar("Row")
LAW_SPEEDS = 3
SAME_SPEED, SAME_CURRENT, LEAST_CURRENT = 0.05, 0.05, 0.02
"""Shares by which speeds and currents (and amperes by which small ones) of one level may differ."""
BEYOND_CHANCE = 0.01
WARMER = 5.0
"""Difference of temperature in K from which a loss of force is that of heat."""


@dataclass(frozen=True)
class ConditionForce:
    """An estimate in a condition: its peak velocity in m/s, current in A and temperature in degC (nan if not known)."""

    condition: str
    velocity: float
    current: float
    temperature: float
    estimate: Estimate

    @property
    def error(self) -> float:
        """Standard error."""
        return self.estimate.error / student_quantile(self.estimate.freedom)


def power_law(levels: Sequence[ConditionForce], sign: str) -> list[Quantity]:
    """Return C and alpha of the forces at mid-stroke of one direction, ``+`` or ``-``, at one current."""
    names = (f"C{sign}", f"alpha{sign}")
    opposing = [one for one in levels if one.estimate.value * (1.0 if sign == "+" else -1.0) > 2.0 * one.error]
    speeds = np.array([one.velocity for one in opposing])
    if _distinct(speeds) < LAW_SPEEDS:
        return without(names, f"{number_of('speed', _distinct(speeds))}; {LAW_SPEEDS} are needed")
    force = np.log(np.abs([one.estimate.value for one in opposing]))
    errors = np.array([one.error / abs(one.estimate.value) for one in opposing])
    errors = np.maximum(errors, 1e-9)
    basis = np.stack([np.ones(len(speeds)), np.log(speeds)], axis=1) / errors[:, None]
    covariance = np.linalg.inv(basis.T @ basis)
    level, alpha = covariance @ basis.T @ (force / errors)
    left = force / errors - basis @ np.array([level, alpha])
    excess, freedom = float(left @ left), len(speeds) - 2
    total = float(sum(one.estimate.freedom for one in opposing))
    if freedom and float(chdtrc(freedom, excess)) < BEYOND_CHANCE:
        covariance, total = covariance * excess / freedom, float(freedom)
    half = student_quantile(total) * np.sqrt(np.diag(covariance))
    c = np.exp([level, level - half[0], level + half[0]])
    return [
        Quantity(names[0], known(float(c[0]), float(c[1]), float(c[2]), total)),
        Quantity(names[1], known(float(alpha), float(alpha - half[1]), float(alpha + half[1]), total)),
    ]


def dynamic_range(levels: Sequence[Sequence[ConditionForce]]) -> list[tuple[str, Quantity]]:
    """Return the dynamic range per speed, with the condition of the greatest current.

    Parameters
    ----------
    levels
        Peak forces of positive and negative velocity of every condition.
    """
    found = []
    known_current = [pair for pair in levels if np.isfinite(pair[0].current)]
    for group in grouped(known_current, lambda one, other: _same_speed(one[0], other[0])):
        ordered = sorted(group, key=lambda pair: abs(pair[0].current))
        low, high = ordered[0], ordered[-1]
        name = high[0].condition
        if same_current(low[0], high[0]):
            found.append((name, Quantity("dynamic range", None, "one current at this speed; two are needed")))
            continue
        top, bottom = (_mean(pair) for pair in (high, low))
        found.append((name, Quantity("dynamic range", _ratio(top, bottom))))
    return found


def fade(levels: Sequence[ConditionForce], name: str) -> list[tuple[str, Quantity]]:
    """Return the loss of peak force from the coldest condition, of one speed and current each."""
    found = []
    for group in grouped([one for one in levels if np.isfinite(one.temperature)], _same):
        coldest = min(group, key=lambda one: one.temperature)
        for one in group:
            if one.temperature - coldest.temperature >= WARMER:
                ratio = _ratio((one.estimate, one.error), (coldest.estimate, coldest.error))
                lost = known(1.0 - ratio.value, 1.0 - ratio.high, 1.0 - ratio.low, ratio.freedom)
                found.append((one.condition, Quantity(name, lost)))
    return found


def fade_over_cycles(peak: Estimate) -> Estimate | None:
    """Return the loss of peak force from the first cycle to the last, by the line through all; None of too few."""
    if peak.slope is None or len(peak.cycles) < LAW_SPEEDS:
        return None
    span = len(peak.cycles) - 1
    first = abs(peak.value) - np.sign(peak.value) * peak.slope.value * span / 2.0
    lost = -np.sign(peak.value) * peak.slope.value * span / first
    half = (peak.slope.high - peak.slope.low) / 2.0 * span / first
    return known(float(lost), float(lost - half), float(lost + half), len(peak.cycles) - 2.0)


def grouped(rows: Iterable[Row], alike: Callable[[Row, Row], bool]) -> list[list[Row]]:
    """Return the rows in groups of those that are like the first of them."""
    groups: list[list[Row]] = []
    for row in rows:
        own = next((group for group in groups if alike(group[0], row)), None)
        groups.append([row]) if own is None else own.append(row)
    return groups


def same_current(one: ConditionForce, other: ConditionForce) -> bool:
    """Return whether two conditions have one current, or none is known of both."""
    if np.isnan(one.current) or np.isnan(other.current):
        return bool(np.isnan(one.current) and np.isnan(other.current))
    return abs(one.current - other.current) <= max(SAME_CURRENT * abs(one.current), LEAST_CURRENT)


def _same(one: ConditionForce, other: ConditionForce) -> bool:
    return same_current(one, other) and _same_speed(one, other)


def _same_speed(one: ConditionForce, other: ConditionForce) -> bool:
    return abs(one.velocity - other.velocity) <= SAME_SPEED * one.velocity


def _distinct(speeds: Array) -> int:
    ordered = np.sort(speeds)
    return int(len(ordered) > 0) + int(np.sum(np.diff(ordered) > SAME_SPEED * ordered[1:]))


def _mean(pair: Sequence[ConditionForce]) -> tuple[Estimate, float]:
    """Return the mean magnitude of both directions as an estimate, and its standard error."""
    value = (abs(pair[0].estimate.value) + abs(pair[1].estimate.value)) / 2.0
    error = float(np.hypot(pair[0].error, pair[1].error)) / 2.0
    return known(value, value, value, min(one.estimate.freedom for one in pair)), error


def _ratio(over: tuple[Estimate, float], under: tuple[Estimate, float]) -> Estimate:
    (a, a_error), (b, b_error) = over, under
    value = abs(a.value) / abs(b.value)
    error = value * float(np.hypot(a_error / a.value, b_error / b.value))
    freedom = a.freedom + b.freedom
    half = student_quantile(freedom) * error
    return known(value, value - half, value + half, freedom)
