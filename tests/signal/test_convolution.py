"""Convolution in blocks gives what scipy's gives, to the last digit; a series correlates as it is defined."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import oaconvolve

from mrfit.signal.convolution import autocorrelation, correlated, correlation_time


@settings(deadline=None, max_examples=200)
@given(st.integers(2, 400), st.integers(0, 6000), st.integers(0, 2**32 - 1))
def test_blocks_give_the_numbers_of_the_library(width: int, more: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values, kernel = rng.normal(size=width + more), rng.normal(size=width)
    np.testing.assert_array_equal(correlated(values, kernel), oaconvolve(values, kernel[::-1], mode="valid"))


@pytest.mark.parametrize("samples", [24, 25, 47, 48, 49, 130, 131, 99_990, 100_000, 100_003])
def test_lengths_about_whole_blocks_too(samples: int) -> None:
    rng = np.random.default_rng(samples)
    values = np.cumsum(rng.normal(size=samples))
    for width in (2, 3, 24):
        kernel = rng.normal(size=width)
        np.testing.assert_array_equal(correlated(values, kernel), oaconvolve(values, kernel[::-1], mode="valid"))


def test_sums_are_those_of_the_definition() -> None:
    rng = np.random.default_rng(3)
    values, kernel = rng.normal(size=1000), rng.normal(size=31)
    written_out = [kernel @ values[i : i + 31] for i in range(970)]
    np.testing.assert_allclose(correlated(values, kernel), written_out, atol=1e-12)


def test_a_series_correlates_with_itself_as_the_definition_says() -> None:
    series = np.random.default_rng(5).normal(size=57)
    expected = [float(series[: len(series) - k] @ series[k:]) for k in range(len(series))]
    np.testing.assert_allclose(autocorrelation(series), expected, rtol=0, atol=1e-12)


def test_the_correlation_time_of_a_first_order_process_is_known() -> None:
    rng, rho, series = np.random.default_rng(0), 0.9, np.zeros(100_000)
    kicks = rng.standard_normal(len(series))
    for k in range(1, len(series)):
        series[k] = rho * series[k - 1] + kicks[k]
    assert correlation_time(series, 0.0) == pytest.approx((1 + rho) / (1 - rho), rel=0.1)


def test_nothing_is_not_correlated() -> None:
    assert correlation_time(np.zeros(40), 0.05) == 1.0
