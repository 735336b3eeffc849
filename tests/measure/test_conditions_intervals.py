"""Quantities across conditions: their intervals, and which conditions are compared with each other."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import t as student

from mrfit.measure.conditions import (
    LAW_SPEEDS,
    WARMER,
    ConditionForce,
    dynamic_range,
    fade,
    fade_over_cycles,
    grouped,
    power_law,
    same_current,
)
from mrfit.measure.intervals import Estimate, PerCycle, estimate
from tests.measure.test_conditions import level

SPEEDS, FREEDOM = np.array([0.03, 0.1, 0.3, 1.0]), 10.0
ERRORS = np.array([0.02, 0.005, 0.01, 0.03])
"""Halves of intervals over the forces."""


def on_a_line(off: np.ndarray, sign: float = 1.0) -> list[ConditionForce]:
    """Forces of 2000*v^0.4, each off by a share, at speeds whose forces are not known alike."""
    forces = sign * 2000.0 * SPEEDS**0.4 * np.exp(off)
    return [level(v, f, error=e) for v, f, e in zip(SPEEDS, forces, ERRORS, strict=True)]


def estimates(levels: list[ConditionForce], sign: str = "+") -> tuple[Estimate, Estimate]:
    c, alpha = (q.estimate for q in power_law(levels, sign))
    assert c is not None and alpha is not None
    return c, alpha


@pytest.mark.parametrize(("size", "fits"), [(0.3, True), (4.0, False)])
def test_a_power_law_is_the_weighted_line_of_numpy_with_the_errors_stated_or_those_about_it(
    size: float, fits: bool
) -> None:
    errors = ERRORS / student.ppf(0.975, FREEDOM)
    levels = on_a_line(size * errors * np.array([1.0, -1.0, 1.0, -1.0]))
    forces = [one.estimate.value for one in levels]
    covariance: bool | str = "unscaled" if fits else True
    line, spread = np.polyfit(np.log(SPEEDS), np.log(forces), 1, w=1.0 / errors, cov=covariance)  # type: ignore[call-overload]
    half = student.ppf(0.975, 4.0 * FREEDOM if fits else 2.0) * np.sqrt(np.diag(spread))
    c, alpha = estimates(levels)
    assert (alpha.value, alpha.low, alpha.high) == pytest.approx((line[0], line[0] - half[0], line[0] + half[0]))
    # the interval of C is that of its logarithm
    assert (c.value, c.low, c.high) == pytest.approx(np.exp([line[1], line[1] - half[1], line[1] + half[1]]))
    assert c.freedom == alpha.freedom == (4.0 * FREEDOM if fits else 2.0)


def test_the_law_of_negative_velocity_takes_negative_forces() -> None:
    c, alpha = estimates(on_a_line(np.zeros(4), -1.0), "-")
    assert (c.value, alpha.value) == pytest.approx((2000.0, 0.4))
    for sign, way in (("+", -1.0), ("-", 1.0)):
        assert [q.reason for q in power_law(on_a_line(np.zeros(4), way), sign)] == ["0 speeds; 3 are needed"] * 2


@pytest.mark.parametrize(("errors", "kept"), [(1.9, False), (2.1, True)])
def test_a_force_within_two_standard_errors_of_zero_has_no_logarithm(errors: float, kept: bool) -> None:
    three = on_a_line(np.zeros(4))[:LAW_SPEEDS]
    half = student.ppf(0.975, FREEDOM) / errors
    three[0] = level(SPEEDS[0], three[0].estimate.value, error=half)
    found = power_law(three, "+")
    assert (found[0].estimate is not None) == kept
    assert kept or found[0].reason == "2 speeds; 3 are needed"


def test_forces_without_any_error_have_a_law_and_no_width() -> None:
    c, alpha = estimates([replace(one, estimate=replace(one.estimate, low=one.estimate.value, high=one.estimate.value))
                          for one in on_a_line(np.zeros(4))])  # fmt: skip
    assert alpha.value == pytest.approx(0.4) and alpha.error < 1e-7 and c.error < 1e-4


@pytest.mark.parametrize(("apart", "speeds"), [(1.04, 3), (1.07, 4)])
def test_speeds_within_a_twentieth_are_one(apart: float, speeds: int) -> None:
    rows = [level(v, 100.0) for v in (0.1, 0.1 * apart, 0.5, 1.0)]
    # one of the four short of the number that is needed tells how many there are
    said = {q.reason for q in power_law(rows[:3], "+")}
    assert said == ({"2 speeds; 3 are needed"} if speeds == 3 else {""})


def pair(velocity: float, force: float, current: float, *, other: float = 0.0) -> tuple[ConditionForce, ConditionForce]:
    """Peak forces of positive and negative velocity, intervals of 1 and of 2 %."""
    return level(velocity, force, current, error=0.01), level(velocity, -(other or force), current, error=0.02)


def test_a_dynamic_range_is_of_means_of_both_directions_with_the_error_of_a_ratio() -> None:
    [(name, found)] = dynamic_range([pair(0.1, 100.0, 0.0, other=140.0), pair(0.1, 900.0, -2.0, other=700.0)])
    assert found.estimate is not None and name == "0.1--2-nan"
    assert found.estimate.value == pytest.approx(800.0 / 120.0)
    # halves of means of two: 4.5 and 7 N of 800 N, 0.5 and 1.4 N of 120 N; quantiles of 10 and of 20 degrees
    share = np.hypot(np.hypot(4.5, 7.0) / 800.0, np.hypot(0.5, 1.4) / 120.0)
    half = share * 800.0 / 120.0 * student.ppf(0.975, 20.0) / student.ppf(0.975, 10.0)
    assert found.estimate.freedom == 20.0
    assert found.estimate.high - found.estimate.value == pytest.approx(half)
    assert found.estimate.value - found.estimate.low == pytest.approx(half)


def test_a_mean_of_two_directions_is_known_as_the_less_known_of_them() -> None:
    low, high = pair(0.1, 100.0, 0.0), pair(0.1, 900.0, 2.0)
    few = (high[0], replace(high[1], estimate=replace(high[1].estimate, freedom=3.0)))
    [(_, found)] = dynamic_range([low, few])
    assert found.estimate is not None and found.estimate.freedom == 13.0


def test_the_greatest_current_is_that_of_either_sign_and_unknown_ones_have_no_range() -> None:
    rows = [pair(0.1, 500.0, 1.0), pair(0.1, 900.0, -2.0), pair(0.1, 100.0, 0.1), pair(0.1, 1.0, np.nan)]
    [(name, found)] = dynamic_range(rows)
    assert name == "0.1--2-nan" and found.estimate is not None and found.estimate.value == pytest.approx(9.0)
    assert dynamic_range([pair(0.1, 100.0, np.nan)]) == []


@pytest.mark.parametrize(("other", "ranges"), [(0.104, 1), (0.106, 2)])
def test_conditions_within_a_twentieth_of_a_speed_have_one_range(other: float, ranges: int) -> None:
    assert len(dynamic_range([pair(0.1, 100.0, 0.0), pair(other, 900.0, 2.0)])) == ranges


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (2.0, 2.09, True),
        (2.0, 2.11, False),
        (-2.0, -2.09, True),
        # small currents differ by less than a twentieth of themselves in nothing but noise
        (0.0, 0.019, True),
        (0.0, 0.021, False),
        (np.nan, np.nan, True),
        (np.nan, 0.0, False),
        (0.0, np.nan, False),
    ],
)
def test_currents_of_one_level(one: float, other: float, same: bool) -> None:
    assert same_current(level(0.1, 1.0, one), level(0.1, 1.0, other)) is same


def test_rows_join_the_group_of_the_first_that_is_like_them() -> None:
    # by the first of a group, not by the last one that has joined it
    assert grouped([1.0, 1.5, 2.0, 2.5, 1.2], lambda a, b: abs(a - b) <= 0.6) == [[1.0, 1.5, 1.2], [2.0, 2.5]]


@pytest.mark.parametrize(("warmer", "told"), [(WARMER, True), (WARMER - 0.1, False)])
def test_a_loss_of_force_is_told_from_five_kelvin_on(warmer: float, told: bool) -> None:
    rows = [level(0.1, 100.0, 1.0, 20.0), level(0.1, 90.0, 1.0, 20.0 + warmer)]
    assert bool(fade(rows, "fade+")) == told


def test_a_fade_has_the_interval_of_the_ratio_whatever_the_sign_and_the_order() -> None:
    rows = [level(0.1, -s, 1.0, t, error=e) for s, t, e in ((90.0, 60.0, 0.02), (100.0, 20.0, 0.01), (0.0, 20.0, 0.01))]
    [(name, found)] = fade(rows[:2], "fade-")
    assert name == rows[0].condition and found.estimate is not None and found.name == "fade-"
    half = 0.9 * np.hypot(0.02, 0.01) * student.ppf(0.975, 20.0) / student.ppf(0.975, 10.0)
    assert (found.estimate.low, found.estimate.value, found.estimate.high) == pytest.approx(
        (0.1 - half, 0.1, 0.1 + half)
    )
    assert found.estimate.freedom == 20.0


def test_a_fade_takes_one_speed_one_current_and_a_known_temperature() -> None:
    cold = level(0.1, 100.0, 1.0, 20.0)
    others = (level(0.1, 50.0, 2.0, 60.0), level(0.2, 50.0, 1.0, 60.0), level(0.1, 50.0, 1.0, np.nan))
    for other in others:
        assert fade([cold, other], "fade+") == []


def test_a_fade_over_cycles_has_the_interval_of_its_slope() -> None:
    rng = np.random.default_rng(3)
    values = 200.0 - 2.0 * np.arange(11.0) + rng.standard_normal(11)
    for sign in (1.0, -1.0):
        peak = estimate(lambda x: x, PerCycle(sign * values, np.full(11, 1.0)))
        found, slope = fade_over_cycles(peak), peak.slope
        assert found is not None and slope is not None
        line = np.polyfit(np.arange(11.0), values, 1)
        assert found.value == pytest.approx(-10.0 * line[0] / line[1])
        assert found.error == pytest.approx(10.0 * (slope.high - slope.low) / 2.0 / line[1])
        assert found.low < found.value < found.high and found.freedom == 9.0


@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_fade_over_cycles_needs_three(count: int) -> None:
    peak = estimate(lambda x: x, PerCycle(100.0 - np.arange(float(count)), np.full(count, 1.0)))
    assert (fade_over_cycles(peak) is not None) == (count == 3)
