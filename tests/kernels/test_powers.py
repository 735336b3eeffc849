"""The polynomial power against the mathematical one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.kernels.powers import power


@given(x=st.floats(1e-250, 1e20), n=st.floats(0.01, 12))
def test_agrees_with_pow(x: float, n: float) -> None:
    with np.errstate(under="ignore"):
        expected = np.float64(x) ** n
    assert power(x, n) == pytest.approx(expected, rel=2e-12, abs=1e-290)


def test_vanishes_at_zero_and_stays_finite_beyond_the_range() -> None:
    assert power(0.0, 1.3) < 1e-290
    assert np.isfinite(power(1e300, 12.0))
    assert power(1.0, 7.7) == pytest.approx(1.0, rel=1e-12)
