"""Current saturation on a yield force that is linear in current."""

import numpy as np
import pytest

from mrfit.effects.current_saturation import law
from mrfit.simulate.assembly import assemble
from mrfit.simulate.current_dependence import CurrentDependence

WHOLE = assemble("bingham+current-saturation", CurrentDependence((("fy", 1),), 0.0, 5.0))


def yield_force(current: float, saturation_current: float, sharpness: float) -> float:
    """Return the force at 1 m/s; base: 100 N + 200 N/A, damping 10."""
    theta = np.array([[100.0, 1100.0, 10.0, 0.0, 1 / saturation_current**2, sharpness]])
    return float(WHOLE.simulate(np.array([[1.0, 1.0], [current, current]]), theta, 1e-3)[0, 0]) - 10.0


@pytest.mark.parametrize("sharpness", [2.0, 4.0, 16.0])
def test_yield_force_levels_off_at_the_saturation_current(sharpness: float) -> None:
    assert yield_force(50.0, 0.5, sharpness) == pytest.approx(100 + 200 * 0.5, rel=1e-4)


def test_small_currents_are_hardly_changed() -> None:
    assert yield_force(0.1, 2.0, 2.0) == pytest.approx(100 + 200 * (0.1 - 0.1**3 / 2 / 4), rel=1e-6)


def test_a_sharpness_of_one_is_froehlichs_curve() -> None:
    assert (yield_force(1.5, 1.5, 1.0) - 100) / (200 * 1.5) == pytest.approx(0.5, rel=1e-9)


def test_tanh_lies_between_a_sharpness_of_2_and_one_of_4() -> None:
    for share in (0.3, 1.0, 2.0):
        low, high = ((yield_force(share, 1.0, p) - 100) / 200 for p in (2.0, 4.0))
        assert low < np.tanh(share) < high


def test_the_bend_starts_as_a_cubic_and_ends_at_its_saturation() -> None:
    small = np.linspace(-1e-2, 1e-2, 21)
    assert np.abs(law(small, 0.25, 2.0) - (small - 0.25 * small**3 / 2)).max() <= 0.25**2 * 1e-10
    assert law(100.0, 0.25, 2.0) == pytest.approx(2.0, rel=1e-3)
    assert np.array_equal(law(small, 0.0, 2.0), small)
