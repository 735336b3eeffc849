"""Dahl against its loop area and its limit."""

import numpy as np
import pytest

from mrfit.models import bingham
from mrfit.models.dahl import response


def sine(amplitude: float, omega: float) -> np.ndarray:
    phase = 2 * np.pi * np.arange(60_001) / 20_000
    return amplitude * np.stack([np.sin(phase), omega * np.cos(phase)])


def test_loop_area_is_that_of_dahls_exponential_branches() -> None:
    c, fy, rho, amplitude, omega = 900.0, 400.0, 800.0, 0.003, 5.0
    drive = sine(amplitude, omega)
    force = response(drive, np.array([[c, fy, rho, 10.0]]), 1e-3)[0]
    last = slice(40_000, None)
    area = np.trapezoid(force[last], drive[0, last])
    s = rho * amplitude
    # Steady branch 1 - (1 + y1)*exp(-s), y1 = tanh(s): area 4*(s - tanh(s))*fy/rho.
    assert area == pytest.approx(4 * fy / rho * (s - np.tanh(s)) + np.pi * c * omega * amplitude**2, rel=1e-5)


def test_is_bingham_where_friction_turns_over_at_once() -> None:
    drive = sine(0.01, 4.0)
    force = response(drive, np.array([[900.0, 400.0, 1e6, 10.0]]), 1e-3)
    expected = bingham.response(drive[1:], np.array([[400.0, 900.0, 10.0]]), 1e-3)
    moving = np.abs(drive[1]) > 1e-2
    assert np.abs(force - expected)[0, moving][100:].max() < 1e-3
