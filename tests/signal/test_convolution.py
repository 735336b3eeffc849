"""Convolution in blocks gives what scipy's gives, to the last digit."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import oaconvolve

from mrfit.signal.convolution import correlated


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
