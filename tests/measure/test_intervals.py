"""Intervals of repeated cycles: coverage, few cycles, drift, errors that all cycles share."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import linregress
from scipy.stats import t as student

from mrfit.measure.intervals import PerCycle, estimate, line_of, of_values


def drawn(rng: np.random.Generator, count: int, sigma: float = 1.0, mean: float = 50.0) -> PerCycle:
    return PerCycle(mean + sigma * rng.standard_normal(count), np.full(count, sigma**2))


@pytest.mark.parametrize("count", [1, 2, 4, 8, 30])
def test_intervals_of_a_ratio_hold_it_in_95_of_100_cases(count: int) -> None:
    rng = np.random.default_rng(count)
    held = []
    for _ in range(600):
        found = estimate(lambda a, b: a / b, drawn(rng, count), drawn(rng, count, 1.0, 25.0))
        held.append(found.low <= 2.0 <= found.high)
    assert 0.925 <= np.mean(held) <= 0.985


def test_of_few_cycles_scatter_beyond_the_noise_counts() -> None:
    values = np.array([10.0, 14.0, 6.0])
    quiet, noisy = (estimate(lambda x: x, PerCycle(values, np.full(3, level))) for level in (1e-4, 16.0))
    assert quiet.freedom == 2.0 and noisy.freedom > 20.0 and noisy.error < quiet.error


@settings(deadline=None, max_examples=20)
@given(st.floats(0.5, 5.0), st.integers(8, 30))
def test_a_drift_reaches_to_the_end_of_the_record(slope: float, count: int) -> None:
    rng = np.random.default_rng(count)
    values = 100.0 + slope * np.arange(count) + 0.05 * rng.standard_normal(count)
    found = estimate(lambda x: x, PerCycle(values, np.full(count, 0.05**2)), reach=count / 2.0 + 2.0)
    assert found.slope is not None and found.slope.value == pytest.approx(slope, abs=0.05)
    assert found.drift == pytest.approx(slope * (count - 1), rel=0.1)
    assert found.low <= 100.0 - slope * 2.0 and found.high >= 100.0 + slope * count


@pytest.mark.parametrize("bound", [1.0, *(pytest.param(b, marks=pytest.mark.slow) for b in (0.1, 30.0))])
def test_a_truth_at_the_bound_of_a_shared_error_is_held_in_95_of_100_cases(bound: float) -> None:
    rng = np.random.default_rng(7)
    held = []
    for _ in range(1500):
        one = drawn(rng, 10)
        found = estimate(lambda x: 2.0 * x, replace(one, values=one.values + bound, shared=bound))
        held.append(found.low <= 100.0 <= found.high)
    assert np.mean(held) == pytest.approx(0.95, abs=0.017)


def test_a_drift_of_the_zero_is_a_bound_that_cancels_in_a_difference() -> None:
    one = replace(drawn(np.random.default_rng(1), 12), zero=2.0)
    alone, apart = estimate(lambda x: x, one, reach=8.0), estimate(lambda x, y: x - y, one, one, reach=8.0)
    assert alone.error > 16.0 and apart.error == 0.0
    assert alone.cycles[-1] - one.values[-1] == pytest.approx(11.0) and alone.drift == pytest.approx(22.0, abs=2.0)


def test_deviations_over_cycles() -> None:
    found = of_values(np.array([10.0, 9.5, 9.0, 9.5]))
    assert found.first_to_third == pytest.approx(0.1)
    assert found.greatest_deviation == pytest.approx(0.5 / 9.5)


@settings(deadline=None, max_examples=30)
@given(st.integers(3, 40), st.floats(-3.0, 3.0), st.integers(0, 1000))
def test_a_line_over_the_cycles_is_that_of_scipy(count: int, slope: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    number = np.arange(count) if seed % 2 else np.sort(rng.uniform(0.0, count, count))
    values = 7.0 + slope * number + rng.standard_normal(count)
    found, known = line_of(values, None if seed % 2 else number), linregress(number, values)
    assert found is not None
    half = student.ppf(0.975, count - 2) * known.stderr
    ours = (found.slope.value, found.slope.low, found.slope.high, found.chance)
    assert ours == pytest.approx(
        (known.slope, known.slope - half, known.slope + half, known.pvalue), rel=1e-7, abs=1e-12
    )
    left = values - known.intercept - known.slope * number
    assert found.variance == pytest.approx(left @ left / (count - 2), rel=1e-7)


def test_a_line_takes_three_values() -> None:
    assert line_of(np.array([1.0, 2.0])) is None
