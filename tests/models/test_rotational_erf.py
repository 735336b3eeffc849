"""The rotary erf model at the published generalised parameters."""

import math

import numpy as np
import pytest

from mrfit.models.rotational_erf import SPEC, response, start_values


def published(current: float) -> list[float]:
    """Return rotary-stiffness paper eqs. 20-24."""
    return [
        -10.41 + 28.48 * current,
        0.2324 + 2.061 * current,
        0.7702 + 4.971 * current,
        18.51,
        0.4547 + 0.2669 * current,
        0,
    ]


@pytest.mark.parametrize("current", [0.0, 1.0, 2.0])
def test_torque_is_the_printed_sum_with_angular_velocity_inside_erf(current: float) -> None:
    k, c, alpha, beta, gamma, _ = theta = published(current)
    points = [(0.1, 0.02), (-0.2, 0.02), (0.1, -1.0), (0.0, 0.05)]
    torque = response(np.array(points).T, np.array([theta]), 1e-3)[0]
    for (angle, omega), value in zip(points, torque, strict=True):
        sign = (angle > 0) - (angle < 0)
        assert value == pytest.approx(k * angle + c * omega + alpha * math.erf(beta * omega + gamma * sign))


@pytest.mark.parametrize("current", [0.0, 0.5, 2.0])
def test_bounds_enclose_the_published_values(current: float) -> None:
    for p, value in zip(SPEC.params, published(current), strict=True):
        assert p.low < value < p.high


def test_offset_starts_at_the_middle_of_the_torque() -> None:
    t = np.linspace(0, 2, 2000)
    drive = 0.3 * np.stack([np.sin(2 * np.pi * t), 2 * np.pi * np.cos(2 * np.pi * t)])
    torque = response(drive, np.array([published(1.0)]), 1e-3)[0] + 0.7
    found = start_values(drive, torque, 1e-3)
    assert found["T0"] == pytest.approx(0.7, abs=0.02)
    assert found["alpha"] == pytest.approx(published(1.0)[2], rel=0.3)
