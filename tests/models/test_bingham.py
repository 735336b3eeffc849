"""Bingham against its loop area."""

import numpy as np
import pytest

from mrfit.models.bingham import response


def test_loop_area_is_the_coulomb_and_the_viscous_loss() -> None:
    fy, c_inf, f0 = 800.0, 3000.0, -50.0
    amplitude, omega = 0.02, 2 * np.pi * 1.5
    phase = 2 * np.pi * np.arange(20_000) / 20_000
    velocity = amplitude * omega * np.cos(phase)
    force = response(velocity[None], np.array([[fy, c_inf, f0]]), 1e-3)[0]
    area = np.mean(force * velocity) * 2 * np.pi / omega
    assert area == pytest.approx(4 * fy * amplitude + np.pi * c_inf * omega * amplitude**2, rel=1e-6)


def test_force_at_rest_is_the_offset() -> None:
    assert response(np.zeros((1, 3)), np.array([[800.0, 3000.0, -50.0]]), 1e-3).tolist() == [[-50.0] * 3]
