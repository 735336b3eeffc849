"""Coulomb friction: work per stroke, sticking before it slips, and quiet at rest."""

import numpy as np
import pytest

from mrfit.effects.coulomb_friction import term

REACH = 1e-4


def stroke(frequency: float, cycles: int = 2) -> tuple[np.ndarray, float]:
    t = np.linspace(0, cycles / frequency, 20_001 * cycles)
    return 0.02 * np.sin(2 * np.pi * frequency * t), float(t[1])


@pytest.mark.parametrize("frequency", [1.0, 8.0])
def test_work_per_cycle_is_that_of_slip_over_the_travel_left_after_sticking(frequency: float) -> None:
    x, dt = stroke(frequency)
    force = term({"displacement": x}, np.array([[35.0, REACH]]), dt)[0]
    last = slice(len(x) // 2, None)
    # each of two strokes of 2X: 2r is spent turning over, in which the mean force is zero
    assert np.trapezoid(force[last], x[last]) == pytest.approx(4 * 35.0 * (0.02 - REACH), rel=1e-3)


def test_far_from_reversals_it_is_the_sign_of_the_motion() -> None:
    x, dt = stroke(1.0)
    force = term({"displacement": x}, np.array([[3.0, REACH]]), dt)[0]
    # at the very start the seal is not bent yet, however fast the stroke begins
    fast = (np.abs(np.gradient(x) / dt) > 0.05) & (np.arange(len(x)) * dt > 0.25)
    assert np.allclose(force[fast], 3.0 * np.sign(np.gradient(x))[fast])


def test_noise_of_a_resting_stroke_stays_a_spring() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-6, 5000)
    force = term({"displacement": noise}, np.array([[100.0, REACH]]), 1e-3)[0]
    assert np.allclose(force, 100.0 * noise / REACH)
