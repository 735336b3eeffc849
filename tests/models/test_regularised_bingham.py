"""Regularised Bingham: its slope at rest, its approach to Bingham, and its loss against quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from mrfit.models.regularised_bingham import response

FY, C_INF, VY = 845.5, 4324.1, 0.003
THETA = np.array([[FY, C_INF, VY, 0.0]])


def test_slope_at_rest_is_the_yield_force_over_its_velocity() -> None:
    force = response(np.array([[-1e-8, 1e-8]]), THETA, 1e-3)[0]
    assert (force[1] - force[0]) / 2e-8 == pytest.approx(FY / VY + C_INF, rel=1e-5)


def test_is_the_bingham_line_beyond_many_yield_velocities() -> None:
    v = np.array([[0.2, -0.2]])
    assert response(v, THETA, 1e-3)[0] == pytest.approx([FY + 0.2 * C_INF, -FY - 0.2 * C_INF], rel=1e-12)


def test_loss_per_cycle_of_a_sine_agrees_with_quadrature() -> None:
    amplitude, omega = 0.002, 6.0

    def power(phase: float) -> float:
        v = amplitude * omega * abs(np.cos(phase))
        return float((FY * (1 - np.exp(-v / VY)) + C_INF * v) * v / omega)

    expected = 4 * quad(power, 0, np.pi / 2, epsabs=1e-12)[0]
    phase = 2 * np.pi * np.arange(4000) / 4000
    velocity = amplitude * omega * np.cos(phase)
    loss = np.mean(response(velocity[None], THETA, 1e-3)[0] * velocity) * 2 * np.pi / omega
    assert loss == pytest.approx(expected, rel=1e-6)
