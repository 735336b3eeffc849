"""Intervals of repeated cycles: coverage, few cycles, drift, errors that all cycles share."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.measure.intervals import PerCycle, estimate, of_values


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


def test_a_shared_error_is_not_averaged_away() -> None:
    rng = np.random.default_rng(1)
    one = drawn(rng, 100)
    plain, shared = (estimate(lambda x: 2.0 * x, PerCycle(one.values, one.noise, s)) for s in (0.0, 3.0))
    assert shared.error == pytest.approx(plain.error + 6.0)


def test_deviations_over_cycles() -> None:
    found = of_values(np.array([10.0, 9.5, 9.0, 9.5]))
    assert found.first_to_third == pytest.approx(0.1)
    assert found.greatest_deviation == pytest.approx(0.5 / 9.5)
