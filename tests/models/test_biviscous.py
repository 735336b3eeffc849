"""Biviscous: continuity, slopes either side of yield, the published parameters and the loss per cycle."""

import numpy as np
import pytest

from mrfit.models import bingham
from mrfit.models.biviscous import derived, response

THETA = np.array([[823.5, 4503.7, 0.0058, -10.0]])


def force_at(*velocities: float) -> np.ndarray:
    return response(np.array([velocities]), THETA, 1e-3)[0] + 10.0


@pytest.mark.parametrize("sign", [-1, 1])
def test_force_is_continuous_at_yield(sign: int) -> None:
    vy = sign * THETA[0, 2]
    below, at, above = force_at(vy * (1 - 1e-9), vy, vy * (1 + 1e-9))
    assert at == pytest.approx(sign * THETA[0, 0])
    assert abs(above - below) < 1e-4


def test_slopes_are_the_pre_yield_and_the_post_yield_damping() -> None:
    force = force_at(0.001, 0.002, 0.1, 0.2)
    assert (force[1] - force[0]) / 0.001 == pytest.approx(derived(THETA)[0, 0])
    assert (force[3] - force[2]) / 0.1 == pytest.approx(THETA[0, 1])


def test_derived_pre_yield_damping_agrees_with_the_published_one() -> None:
    # Paper preyield paper Table 2, 1 A, LMH: C0 = 147 230 N s/m beside fy = 823.5 N and vy = 5.8 mm/s, printed with
    # two digits.
    assert derived(THETA)[0, 0] == pytest.approx(147_230, rel=0.04)


def test_becomes_bingham_as_the_yield_velocity_vanishes() -> None:
    v = np.linspace(-0.3, 0.3, 200)[None]
    sharp = response(v, np.array([[800.0, 3000.0, 1e-9, 5.0]]), 1e-3)
    assert np.abs(sharp - bingham.response(v, np.array([[800.0, 3000.0, 5.0]]), 1e-3)).max() < 1e-4
