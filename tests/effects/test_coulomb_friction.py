"""Coulomb friction: work per stroke, sticking before it slips, and quiet at rest."""

import numpy as np
import pytest

from mrfit.effects.coulomb_friction import term
from mrfit.kernels.filters import play

REACH, TURN = 1e-4, 1e-5


def stroke(frequency: float, cycles: int = 2) -> tuple[np.ndarray, float]:
    t = np.linspace(0, cycles / frequency, 20_001 * cycles)
    return 0.02 * np.sin(2 * np.pi * frequency * t), float(t[1])


def moving(x: np.ndarray, dt: float) -> dict[str, np.ndarray]:
    return {"displacement": x, "velocity": np.gradient(x, dt)}


@pytest.mark.parametrize("frequency", [1.0, 8.0])
def test_work_per_cycle_is_that_of_slip_over_the_travel_left_after_sticking(frequency: float) -> None:
    x, dt = stroke(frequency)
    force = term(moving(x, dt), np.array([[35.0, REACH, TURN]]), dt)[0]
    last = slice(len(x) // 2, None)
    # each of two strokes of 2X: 2r is spent turning over, in which the mean force is zero
    assert np.trapezoid(force[last], x[last]) == pytest.approx(4 * 35.0 * (0.02 - REACH), rel=1e-3)


def test_far_from_reversals_it_is_the_sign_of_the_motion() -> None:
    x, dt = stroke(1.0)
    force = term(moving(x, dt), np.array([[3.0, REACH, TURN]]), dt)[0]
    # at the very start the seal is not bent yet, however fast the stroke begins
    fast = (np.abs(np.gradient(x) / dt) > 0.05) & (np.arange(len(x)) * dt > 0.25)
    assert np.allclose(force[fast], 3.0 * np.sign(np.gradient(x))[fast])


def test_noise_of_a_resting_stroke_stays_a_spring() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-6, 5000)
    force = term(moving(noise, 1e-3), np.array([[100.0, REACH, TURN]]), 1e-3)[0]
    assert np.allclose(force, 100.0 * noise / REACH)


@pytest.mark.parametrize("width", [5e-4, 5e-3])
def test_a_seal_that_floats_follows_the_velocity(width: float) -> None:
    t = np.arange(5000) * 2e-4
    channels = {"displacement": 0.02 * np.sin(12.0 * t), "velocity": 0.24 * np.cos(12.0 * t)}
    force = term(channels, np.array([[50.0, 1e-9, width]]), 2e-4)[0]
    gap = np.abs(force - 50.0 * np.tanh(channels["velocity"] / width))
    # about v = 0 it is out by the creep below which friction does not fade
    assert gap[1:].max() <= 50.0 * 2e-4 / width


def test_travel_lost_between_samples_at_a_turn_is_made_up_for() -> None:
    fine = np.arange(40_001) * 1e-4
    x = 0.01 * np.sin(2 * np.pi * 4.03 * fine)
    theta = np.array([[100.0, 3e-5, TURN]])
    exact = term(moving(x, 1e-4), theta, 1e-4)[0][::20]
    sampled = term({"displacement": x[::20], "velocity": np.gradient(x, 1e-4)[::20]}, theta, 2e-3)[0]
    plain = 100.0 * (x[::20] - play(x[::20], 3e-5)) / 3e-5
    assert np.abs(sampled - exact).max() <= 0.03 * np.abs(plain - exact).max()
