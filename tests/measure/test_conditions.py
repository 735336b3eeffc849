"""Power law, dynamic range and fade of several conditions, against planted ones."""

import numpy as np
import pytest

from mrfit.measure.conditions import ConditionForce, dynamic_range, fade, fade_over_cycles, power_law
from mrfit.measure.intervals import Estimate, PerCycle, estimate


def level(
    velocity: float, value: float, current: float = np.nan, temperature: float = np.nan, error: float = 1e-3
) -> ConditionForce:
    half = error * abs(value)
    name = f"{velocity:g}-{current:g}-{temperature:g}"
    found = Estimate(value, value - half, value + half, 10.0, np.array([value]), half, None, 0.0)
    return ConditionForce(name, velocity, current, temperature, found)


def test_a_power_law_is_found_with_intervals_that_hold_it() -> None:
    held = []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        speeds = np.array([0.03, 0.1, 0.3, 1.0])
        forces = 2000.0 * speeds**0.4 * (1.0 + 1e-3 / 2.228 * rng.standard_normal(4))
        c, alpha = power_law([level(v, f) for v, f in zip(speeds, forces, strict=True)], "+")
        assert c.estimate is not None and alpha.estimate is not None
        held += [c.estimate.low <= 2000.0 <= c.estimate.high, alpha.estimate.low <= 0.4 <= alpha.estimate.high]
    assert 0.93 <= np.mean(held) <= 0.985


def test_two_speeds_are_refused() -> None:
    found = power_law([level(0.1, 100.0), level(0.101, 101.0), level(1.0, 300.0)], "+")
    assert [one.reason for one in found] == ["2 speeds; 3 are needed"] * 2


def test_dynamic_range_is_taken_per_speed() -> None:
    rows = [(level(v, f, i), level(v, -f, i)) for v, i, f in ((0.1, 0.0, 100.0), (0.1, 2.0, 900.0), (0.5, 0.0, 300.0))]
    found = dynamic_range(rows)
    assert found[0][1].estimate is not None and found[0][1].estimate.value == pytest.approx(9.0)
    assert found[1][1].reason == "one current at this speed; two are needed"


def test_fade_is_told_between_temperatures_of_one_speed_and_current() -> None:
    rows = [level(0.1, 100.0, 1.0, 20.0), level(0.1, 90.0, 1.0, 60.0), level(0.5, 50.0, 1.0, 60.0)]
    [(name, found)] = fade(rows, "fade+")
    assert name == rows[1].condition and found.estimate is not None
    assert found.estimate.value == pytest.approx(0.1)


def test_fade_over_cycles_is_that_of_the_line() -> None:
    for sign in (1.0, -1.0):
        values = sign * (100.0 - np.arange(11.0))
        found = fade_over_cycles(estimate(lambda x: x, PerCycle(values, np.full(11, 1e-6))))
        assert found is not None and found.value == pytest.approx(0.1)
