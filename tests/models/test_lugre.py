"""LuGre against its steady friction curve and its presliding stiffness."""

import numpy as np
import pytest

from mrfit.models.lugre import response

SIGMA0, SIGMA1, SIGMA2, FC, DF, VS, F0 = 1e6, 200.0, 900.0, 400.0, 150.0, 0.01, -5.0
THETA = np.array([[SIGMA0, SIGMA1, SIGMA2, FC, DF, VS, F0]])


@pytest.mark.parametrize("v", [0.002, -0.008, 0.1])
def test_steady_force_is_stribecks_curve_and_the_viscous_one(v: float) -> None:
    force = response(np.full((1, 6000), v), THETA, 1e-3)[0, -1]
    expected = np.copysign(FC + DF * np.exp(-((v / VS) ** 2)), v) + SIGMA2 * v + F0
    assert force == pytest.approx(expected, rel=1e-9)


def test_presliding_is_a_spring_with_both_dampers() -> None:
    dt = 1e-4
    v = 1e-6 * np.sin(2 * np.pi * 5 * dt * np.arange(4000))
    x = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1])) * dt])
    force = response(v[None], THETA, dt)[0]
    assert force == pytest.approx(SIGMA0 * x + (SIGMA1 + SIGMA2) * v + F0, rel=1e-3, abs=1e-4)


def test_friction_dissipates() -> None:
    t = np.linspace(0, 2, 4001)
    v = 0.05 * np.cos(2 * np.pi * t)
    force = response(v[None], THETA, t[1])[0]
    loss = np.trapezoid(force[2000:] * v[2000:], t[2000:])
    assert loss > 4 * 0.05 / (2 * np.pi) * FC
