"""The rotary hybrid model: its height at rest, its sign rule and its limits."""

import numpy as np
import pytest

from mrfit.models.rotational_hybrid import response, start_values

THETA = np.array([[0.3, 4.0, 6.0, -1.2, 0.4]])


def test_height_at_rest_is_twice_the_bell_and_its_sign_follows_the_acceleration() -> None:
    up, down = response(np.array([[0.0, 0.0], [1.0, -1.0]]), THETA, 1e-3)[0]
    assert up == pytest.approx(0.3 - 1.2)
    assert down == pytest.approx(0.3 + 1.2)


def test_branches_close_at_high_velocity() -> None:
    up, down = response(np.array([[4.0, 4.0], [1.0, -1.0]]), THETA, 1e-3)[0]
    assert up == pytest.approx(down)
    assert up == pytest.approx(0.3 + 4.0)


def test_loop_area_over_velocity_is_the_bells() -> None:
    phase = np.linspace(0, 2 * np.pi, 200_001)
    omega, acceleration = 3 * np.sin(phase), 3 * np.cos(phase)
    torque = response(np.stack([omega, acceleration]), THETA, 1e-3)[0]
    assert np.trapezoid(torque, omega) == pytest.approx(2 * -1.2 * 0.4 * np.sqrt(2 * np.pi), rel=1e-3)


def test_start_values_give_the_height_at_rest() -> None:
    t = np.linspace(0, 2, 4000)
    drive = np.stack([2 * np.sin(2 * np.pi * t), 4 * np.pi * np.cos(2 * np.pi * t)])
    found = start_values(drive, response(drive, THETA, 5e-4)[0], 5e-4)
    assert found["lambda"] == pytest.approx(-1.2, rel=0.02)
    assert found["epsilon"] == pytest.approx(4.0, rel=0.3)
