"""End stop: silent inside its gap, a spring beyond."""

import numpy as np
import pytest

from mrfit.effects.end_stop import term

STIFFNESS, GAP = 2e5, 0.02


def test_force_is_zero_inside_and_linear_beyond() -> None:
    x = np.array([-0.025, -0.02, 0.0, 0.0199, 0.021, 0.03])
    force = term({"displacement": x}, np.array([[STIFFNESS, GAP, 0.0, 1.0]]), 1e-3)[0]
    assert force == pytest.approx([-1000.0, 0.0, 0.0, 0.0, 200.0, 2000.0])


def test_compression_stores_the_energy_of_a_spring_and_returns_it() -> None:
    x = 0.03 * np.sin(np.linspace(0, np.pi, 10_001))
    force = term({"displacement": x}, np.array([[STIFFNESS, GAP, 0.0, 1.0]]), 1e-3)[0]
    assert np.trapezoid(force[:5001], x[:5001]) == pytest.approx(STIFFNESS * 0.01**2 / 2, rel=1e-5)
    assert abs(np.trapezoid(force, x)) <= 1e-9


def test_rubber_grows_by_a_power_and_only_the_stop_within_reach_acts() -> None:
    x = np.array([-0.025, 0.0, 0.021, 0.024])
    force = term({"displacement": x}, np.array([[STIFFNESS, 0.03, -0.01, 1.5]]), 1e-3)[0]
    assert force == pytest.approx([0.0, 0.0, STIFFNESS * 1e-3, STIFFNESS * 1e-3 * 4.0**1.5])
