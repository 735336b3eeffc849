"""Guo: zero force at the critical velocity, slope at rest, post-yield line."""

import numpy as np
import pytest

from mrfit.models.guo import response, start_values

# Paper preyield paper Table 2, 1 A, LMH; width of the loop chosen.
FY, C_INF, C0, OMEGA = 855.8, 4293.8, 222.0, 0.4
THETA = np.array([[FY, C_INF, C0, OMEGA, 7.0]])


def test_force_is_the_offset_where_velocity_and_displacement_balance() -> None:
    assert response(np.array([[0.01], [-OMEGA * 0.01]]), THETA, 1e-3)[0, 0] == pytest.approx(7.0)


def test_slope_at_the_balance_is_that_of_both_dampers() -> None:
    force = response(np.array([[0.0, 0.0], [-1e-7, 1e-7]]), THETA, 1e-3)[0]
    assert (force[1] - force[0]) / 2e-7 == pytest.approx(FY * C0 + C_INF, rel=1e-6)


def test_loop_area_in_displacement_of_a_fast_sine_is_coulomb_and_viscous() -> None:
    amplitude, omega = 0.01, 2 * np.pi * 10  # far beyond yield nearly all the time
    phase = 2 * np.pi * np.arange(20_000) / 20_000
    x, v = amplitude * np.sin(phase), amplitude * omega * np.cos(phase)
    force = response(np.stack([x, v]), THETA, 1e-3)[0]
    area = np.mean(force * v) * 2 * np.pi / omega
    assert area == pytest.approx(4 * FY * amplitude + np.pi * C_INF * omega * amplitude**2, rel=2e-3)


def test_start_values_give_width_and_yield_force() -> None:
    t = np.linspace(0, 2, 4000, endpoint=False)
    x, v = 0.01 * np.sin(6 * np.pi * t), 0.01 * 6 * np.pi * np.cos(6 * np.pi * t)
    found = start_values(np.stack([x, v]), response(np.stack([x, v]), THETA, 5e-4)[0], 5e-4)
    assert found["Omega"] == pytest.approx(OMEGA, rel=0.05)
    assert found["fy"] == pytest.approx(FY, rel=0.05)
    assert found["C0"] == pytest.approx(C0, rel=0.6)
