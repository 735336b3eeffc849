"""Hysteretic regularised Bingham: its two branches are the regularised one shifted, counter-clockwise for vh > 0."""

import numpy as np
import pytest

from mrfit.models import regularised_bingham
from mrfit.models.hysteretic_regularised_bingham import response

VH = 0.0162
THETA = np.array([[1099.9, 2436.5, 0.0163, VH, 3.0]])


@pytest.mark.parametrize(("a", "shift"), [(1.0, VH), (-1.0, -VH)])
def test_each_branch_is_the_regularised_curve_shifted(a: float, shift: float) -> None:
    v = np.linspace(-0.3, 0.3, 101)
    base = regularised_bingham.response((v - shift)[None], np.delete(THETA, 3, axis=1), 1e-3)
    assert response(np.stack([v, np.full(101, a)]), THETA, 1e-3) == pytest.approx(base)


@pytest.mark.parametrize(("vh", "counter_clockwise"), [(VH, True), (-VH, False)])
def test_loop_runs_counter_clockwise_for_a_positive_half_width(vh: float, counter_clockwise: bool) -> None:
    theta = THETA.copy()
    theta[0, 3] = vh
    phase = np.linspace(0, 2 * np.pi, 20_001)
    force = response(0.3 * np.stack([np.sin(phase), np.cos(phase)]), theta, 1e-3)[0]
    assert bool(np.trapezoid(force, 0.3 * np.sin(phase)) < 0) is counter_clockwise
