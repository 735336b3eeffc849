"""The polynomial power, 2^y and tanh against the mathematical ones."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import exp2, power, tanh


@kernel
def tanh_row(x: np.ndarray) -> np.ndarray:
    out = np.empty_like(x)
    for j in range(len(x)):
        out[j] = tanh(x[j])
    return out


@given(x=st.floats(1e-250, 1e20), n=st.floats(0.01, 12))
def test_agrees_with_pow(x: float, n: float) -> None:
    with np.errstate(under="ignore"):
        expected = np.float64(x) ** n
    assert power(x, n) == pytest.approx(expected, rel=2e-12, abs=1e-290)


def test_vanishes_at_zero_and_stays_finite_beyond_the_range() -> None:
    assert power(0.0, 1.3) < 1e-290
    assert np.isfinite(power(1e300, 12.0))
    assert power(1.0, 7.7) == pytest.approx(1.0, rel=1e-12)


@given(y=st.floats(-1000, 1000))
def test_exp2_agrees_with_powers_of_two(y: float) -> None:
    assert exp2(y) == pytest.approx(2.0**y, rel=4e-13, abs=0.0)


def test_tanh_agrees_with_numpy_at_all_sizes() -> None:
    large = np.logspace(-300, 308, 5000)
    x = np.concatenate([np.linspace(-25, 25, 200_001), large, -large])
    np.testing.assert_allclose(tanh_row(x), np.tanh(x), rtol=0, atol=2e-13)


def test_tanh_of_the_ends_of_the_number_line() -> None:
    x = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, 1e308, 20.0, -20.0])
    expected = [0.0, 0.0, 1.0, -1.0, np.nan, 1.0, 1.0, -1.0]
    np.testing.assert_array_equal(tanh_row(x), expected)
    np.testing.assert_array_equal([tanh(value) for value in x], expected)


def test_tanh_never_exceeds_one() -> None:
    assert np.abs(tanh_row(np.linspace(-40, 40, 100_001))).max() == 1.0
