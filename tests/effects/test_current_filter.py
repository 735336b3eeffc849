"""The current filter against scipy's simulation of M(s), and its limits."""

import numpy as np
import pytest
from scipy.signal import lsim

from mrfit.effects import current_filter
from mrfit.kernels.filters import lag

DT = 1e-3
CURRENT = np.where(np.arange(1500) % 400 < 200, 0.2, 1.5) + 0.1 * np.sin(np.arange(1500) / 30)


def transformed(*theta: float) -> np.ndarray:
    return np.asarray(current_filter.transform({"current": CURRENT}, np.array(theta), DT)["current"])


def test_it_is_the_transfer_function_with_the_delay() -> None:
    T, second, lead = 0.02, 0.15, 0.3
    system = ([lead * T, 1.0], np.polymul([T, 1.0], [second * T, 1.0]))
    expected = CURRENT[0] + lsim(system, CURRENT - CURRENT[0], DT * np.arange(1500))[1]
    assert transformed(T, second, lead, 0.0) == pytest.approx(expected, abs=1e-7)
    assert transformed(T, second, lead, 0.004)[4:] == pytest.approx(expected[:-4], abs=1e-7)


def test_with_the_zero_on_the_second_pole_it_is_a_first_order_lag() -> None:
    lagged = lag(CURRENT[None], np.array([0.03 / DT]))[0]
    assert transformed(0.03, 0.4, 0.4, 0.0) == pytest.approx(lagged, abs=1e-9)


def test_without_time_constants_it_is_the_delay_alone() -> None:
    assert np.array_equal(transformed(0.0, 0.7, 3.0, 0.0), CURRENT)
    assert transformed(0.0, 0.7, 3.0, 0.006)[6:] == pytest.approx(CURRENT[:-6], abs=1e-12)
    assert transformed(1e-12, 0.7, 3.0, 0.0) == pytest.approx(CURRENT, abs=1e-4)
