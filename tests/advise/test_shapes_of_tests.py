"""Shapes of tests: frequencies, cycles, corners, sweeps, levels of current, pauses, and what each costs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.advise.drives import (
    CHANGES,
    CORNER,
    DWELLS,
    FADES,
    LEAST_AMPLITUDE,
    STEADY_SECONDS,
    SWEEP_SECONDS,
    TEST_CYCLES,
    WITHIN,
    RigBench,
    Test,
    least_cycles,
    test_at,
)
from mrfit.core.specs import Array
from tests.advise.test_drives import press

test_at.__test__ = False
SHARE = st.floats(0.0, 1.0)


def at(kind: str, bench: RigBench, *point: float) -> Test:
    """The test at a point whose further coordinates are in the middle."""
    return test_at(kind, np.array([*point, *[0.5] * (5 - len(point))]), bench)


def inner(test: Test) -> Array:
    """The motion without the cycles in which it fades in and out."""
    period = round(1.0 / test.numbers["frequency"] / test.dt)
    return test.motion[:, period + 1 : -period - 1]


@pytest.mark.parametrize(("share", "frequency"), [(0.0, 2.0), (0.5, 4.0), (1.0, 8.0)])
def test_frequencies_are_even_in_their_logarithm(share: float, frequency: float) -> None:
    assert at("sine", press(frequency=[2.0, 8.0]), share).numbers["frequency"] == pytest.approx(frequency)


@settings(deadline=None, max_examples=15)
@given(SHARE, SHARE)
def test_the_amplitude_is_a_share_of_the_largest_that_a_limit_allows(place: float, share: float) -> None:
    bench = press(stroke=0.02, speed=0.1, acceleration=2.0)
    test = at("sine", bench, place, share)
    # of half the stroke, the speed and the acceleration, cycles that fade in and out among them
    used = np.abs(test.motion).max(axis=1) / [0.01, 0.1, 2.0]
    assert used.max() == pytest.approx(WITHIN * (LEAST_AMPLITUDE + (1.0 - LEAST_AMPLITUDE) * share))
    assert test.numbers["amplitude"] == np.abs(test.motion[0]).max()


@pytest.mark.parametrize(
    ("frequency", "seconds", "cycles"),
    [
        # as many as two seconds hold, and never fewer than the least
        (10.0, 30.0, STEADY_SECONDS * 10.0),
        (2.0, 30.0, TEST_CYCLES),
        (10.0, 1.5, 1.5 * 10.0 - FADES),
    ],
)
def test_a_steady_test_is_whole_cycles_beside_those_in_which_it_fades(
    frequency: float, seconds: float, cycles: float
) -> None:
    bench = press(frequency=[frequency, 10.01], seconds=seconds, acceleration=500.0)
    for kind in ("sine", "triangle"):
        test = at(kind, bench, 0.0)
        assert test.seconds == pytest.approx((cycles + FADES) / frequency, abs=2.0 * bench.dt)
    assert least_cycles() == TEST_CYCLES + FADES


def test_a_sine_is_one_and_fades_in_and_out_over_a_period() -> None:
    bench = press(frequency=[2.0, 2.5])
    test = at("sine", bench, 0.0, 1.0)
    x, v, a = inner(test)
    w = 4.0 * math.pi
    assert x**2 + (v / w) ** 2 == pytest.approx(np.full(len(x), np.abs(x).max() ** 2), rel=2e-3)
    assert a == pytest.approx(-(w**2) * x)
    # half of a raised cosine: half of it after half a period
    half = round(0.25 / bench.dt)
    assert abs(test.motion[1, half]) == pytest.approx(0.5 * np.abs(v).max(), rel=0.02)


def test_a_triangle_goes_at_one_speed_but_for_its_corners() -> None:
    test = at("triangle", replace(press(frequency=[1.0, 1.5]), dt=1e-3), 0.0, 1.0)
    x, v, _ = inner(test)
    steady = np.abs(np.abs(v) - np.abs(v).max()) < 1e-9
    # four corners of a period, of which two are one: a turn from one speed to the other
    assert np.mean(steady) == pytest.approx(1.0 - 4.0 * CORNER, abs=0.01)
    # symmetric about the middle, and half as long as without rounded corners less one of them
    assert x.max() == pytest.approx(-x.min(), rel=1e-3)
    assert x.max() == pytest.approx(np.abs(v).max() * (0.25 - 0.5 * CORNER), rel=0.01)


@settings(deadline=None, max_examples=8)
@given(SHARE, SHARE)
def test_a_sweep_goes_from_one_frequency_to_the_other_at_constant_speed(low: float, high: float) -> None:
    bench = replace(press(acceleration=50.0), dt=1e-3)
    test = test_at("sweep", np.array([low, 1.0, 0.5, high, 0.5]), bench)
    first, last = test.numbers["frequency"], test.numbers["to"]
    assert (
        bench.reach.low <= first * (1 + 1e-9)
        and 3.0 * first <= last * (1 + 1e-9)
        and last <= bench.reach.high * 1.000001
    )
    x, v, _ = test.motion
    crossings = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    periods, middles = np.diff(crossings) * bench.dt, (crossings[1:] + crossings[:-1]) / 2.0 * bench.dt
    # the logarithm of the frequency rises evenly over the test
    expected = first * (last / first) ** (middles / test.seconds)
    inside = (middles > 1.0 / first) & (middles < test.seconds - 1.0 / first)
    assert 1.0 / periods[inside] == pytest.approx(expected[inside], rel=0.06)
    fastest = [np.abs(v[a:b]).max() for a, b in zip(crossings, crossings[1:], strict=False)]
    assert np.array(fastest)[inside] == pytest.approx(np.full(inside.sum(), np.abs(v).max()), rel=0.03)


def test_a_sweep_is_long_enough_for_its_slowest_cycles() -> None:
    long = press(frequency=[0.5, 20.0], seconds=60.0)
    assert at("sweep", long, 0.0).seconds == pytest.approx(least_cycles() / 0.5)
    assert at("sweep", press(frequency=[4.0, 20.0], seconds=60.0), 0.0).seconds == pytest.approx(SWEEP_SECONDS)
    assert at("sweep", press(frequency=[2.0, 20.0], seconds=5.0), 0.0).seconds == pytest.approx(5.0)


@settings(deadline=None, max_examples=15)
@given(SHARE, SHARE, SHARE)
def test_a_current_steps_through_three_levels_at_least_a_fifth_of_the_range_apart(
    top: float, bottom: float, pause: float
) -> None:
    bench = press(current=(0.5, 2.5), frequency=[2.0, 2.5], seconds=60.0)
    test = test_at("steps", np.array([0.0, 1.0, top, bottom, pause]), bench)
    high, low = test.numbers["current"], test.numbers["low"]
    assert 0.5 <= low < high <= 2.5 + 1e-9 and high - low >= 0.2 * 2.0 - 1e-9
    assert {*np.round(test.current, 9)} == {*np.round([low, (low + high) / 2.0, high], 9)}
    changes = np.flatnonzero(np.diff(test.current))
    assert len(changes) >= CHANGES - 1
    dwells = np.diff(changes) * bench.dt
    mean = test.numbers["dwell"]
    assert DWELLS[0] <= mean <= DWELLS[1] and np.all(np.abs(dwells / mean - 1.0) <= 0.4 + 2.0 * bench.dt / mean)
    assert np.mean(dwells) == pytest.approx(mean, rel=0.15) and np.std(dwells) > 0.1 * mean


@pytest.mark.parametrize(("share", "level"), [(0.0, 0.5), (1.0, 2.5)])
def test_a_held_current_is_one_level_of_the_range(share: float, level: float) -> None:
    test = at("sine", press(current=(0.5, 2.5)), 0.5, 0.5, share)
    assert test.current == pytest.approx(np.full(len(test.time), level)) and test.numbers["current"] == level


def test_a_current_that_an_amplifier_limits_reaches_its_level_late() -> None:
    bench = press(current=(0.0, 2.0), current_rate=4.0, frequency=[2.0, 2.5])
    slow, free = (test_at("steps", np.array([0.0, 1.0, 1.0, 0.0, 1.0]), replace(bench, rig=rig))
                  for rig in (bench.rig, bench.rig.model_copy(update={"current_rate": None})))  # fmt: skip
    first = int(np.flatnonzero(np.diff(free.current))[0])
    # a step of half the range takes a quarter of a second
    reached = int(np.flatnonzero(slow.current >= free.current[first + 1] - 1e-9)[0])
    assert (reached - first) * bench.dt == pytest.approx(0.25, abs=2.0 * bench.dt)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_a_repeated_test_rests_for_a_share_of_what_the_longest_leaves(share: float) -> None:
    bench = press(frequency=[4.0, 5.0], seconds=20.0)
    test = test_at("repeat", np.array([0.0, 1.0, 0.5, 0.5, share]), bench)
    burst = (STEADY_SECONDS * 4.0 + FADES) / 4.0
    assert test.numbers["wait"] == pytest.approx(share * (20.0 - 2.0 * burst), abs=0.1)
    still = np.flatnonzero(np.all(test.motion == 0.0, axis=0))
    assert len(still) * bench.dt == pytest.approx(test.numbers["wait"], abs=0.1)
    count = (test.motion.shape[1] - round(test.numbers["wait"] / bench.dt)) // 2
    assert test.motion[:, :count] == pytest.approx(test.motion[:, -count:])
    assert test.cost == test.seconds


def test_a_test_that_warms_the_specimen_waits_for_it_and_sets_it_cold_and_warm() -> None:
    bench = press(frequency=[4.0, 5.0], temperature=[20.0, 60.0], warm_up=300.0)
    test = at("warm-up", bench, 0.0)
    half = len(test.time) // 2
    assert test.cost == test.seconds + 300.0 and "wait" not in test.numbers
    assert np.all(test.warmth[:half] == 0.0) and np.all(test.warmth[half:] == 1.0)
    assert test.motion[:, :half] == pytest.approx(test.motion[:, half:])
    assert not len(at("repeat", bench, 0.0).warmth)


def test_two_bursts_of_a_frequency_too_low_for_the_longest_test_are_faster() -> None:
    bench = press(frequency=[1.0, 5.0], seconds=9.0)
    assert at("repeat", bench, 0.0).numbers["frequency"] == pytest.approx(2.0 * least_cycles() / 9.0)
    assert at("sine", bench, 0.0).numbers["frequency"] == pytest.approx(1.0)
