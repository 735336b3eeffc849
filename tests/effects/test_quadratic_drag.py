"""Quadratic drag: four times the force at twice the speed, and its work per cycle."""

import numpy as np
import pytest

from mrfit.effects.quadratic_drag import term


def test_force_is_odd_and_quadratic() -> None:
    force = term({"velocity": np.array([0.3, 0.6, -0.6])}, np.array([[100.0]]), 1e-3)[0]
    assert force == pytest.approx([9.0, 36.0, -36.0])


def test_work_per_cycle_is_eight_thirds_of_drag_times_speed_squared_times_amplitude() -> None:
    w, stroke = 12.0, 0.03
    angle = np.linspace(0, 2 * np.pi, 20_001)
    force = term({"velocity": stroke * w * np.cos(angle)}, np.array([[150.0]]), 1e-3)[0]
    assert np.trapezoid(force, stroke * np.sin(angle)) == pytest.approx(8 / 3 * 150.0 * w**2 * stroke**3, rel=1e-6)
