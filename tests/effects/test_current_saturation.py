"""Current saturation on a yield force that is linear in current."""

import numpy as np
import pytest

from mrfit.assembly import assemble
from mrfit.dependence import CurrentDependence

WHOLE = assemble("bingham+current-saturation", CurrentDependence((("fy", 1),), 0.0, 5.0))


def yield_force(current: float, saturation_current: float) -> float:
    """Return the force at 1 m/s; base: 100 N + 200 N/A, damping 10."""
    theta = np.array([[100.0, 1100.0, 10.0, 0.0, 1 / saturation_current**2]])
    return float(WHOLE.simulate(np.array([[1.0, 1.0], [current, current]]), theta, 1e-3)[0, 0]) - 10.0


def test_yield_force_levels_off_at_the_saturation_current() -> None:
    assert yield_force(5.0, 0.5) == pytest.approx(100 + 200 * 0.5, rel=1e-6)


def test_small_currents_are_hardly_changed() -> None:
    assert yield_force(0.1, 2.0) == pytest.approx(100 + 200 * (0.1 - 0.1**3 / 3 / 4), rel=1e-6)


def test_force_at_the_saturation_current_is_tanh_1_of_the_linear_one() -> None:
    assert (yield_force(1.5, 1.5) - 100) / (200 * 1.5) == pytest.approx(np.tanh(1.0), rel=1e-9)
