"""Coulomb friction: work per stroke, sticking before it slips, and quiet at rest."""

import numpy as np
import pytest

from mrfit.effects.coulomb_friction import term
from mrfit.kernels.filters import play

REACH, TURN = 1e-4, 1e-5
# shares of the stops of a seal, and their widths as multiples of r
STOPS = ((0.3, 0.3), (0.45, 0.9), (0.25, 2.02))


def stroke(frequency: float, cycles: int = 2) -> tuple[np.ndarray, float]:
    t = np.linspace(0, cycles / frequency, 20_001 * cycles)
    return 0.02 * np.sin(2 * np.pi * frequency * t), float(t[1])


def moving(x: np.ndarray, dt: float) -> dict[str, np.ndarray]:
    return {"displacement": x, "velocity": np.gradient(x, dt)}


@pytest.mark.parametrize(("frequency", "breadth"), [(1.0, 1.0), (8.0, 0.5), (8.0, 0.0)])
def test_work_per_cycle_is_that_of_slip_over_the_travel_left_after_sticking(frequency: float, breadth: float) -> None:
    x, dt = stroke(frequency)
    force = term(moving(x, dt), np.array([[35.0, REACH, breadth, TURN]]), dt)[0]
    last = slice(len(x) // 2, None)
    # each of two strokes of 2X: 2r is spent turning over, in which the mean force is zero
    assert np.trapezoid(force[last], x[last]) == pytest.approx(4 * 35.0 * (0.02 - REACH), rel=1e-3)


def test_far_from_reversals_it_is_the_sign_of_the_motion() -> None:
    x, dt = stroke(1.0)
    force = term(moving(x, dt), np.array([[3.0, REACH, 1.0, TURN]]), dt)[0]
    # at the very start the seal is not bent yet, however fast the stroke begins
    fast = (np.abs(np.gradient(x) / dt) > 0.05) & (np.arange(len(x)) * dt > 0.25)
    assert np.allclose(force[fast], 3.0 * np.sign(np.gradient(x))[fast])


def test_noise_of_a_resting_stroke_stays_a_spring() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-6, 5000)
    force = term(moving(noise, 1e-3), np.array([[100.0, REACH, 1.0, TURN]]), 1e-3)[0]
    stiffness = 100.0 / REACH * sum(share / width for share, width in STOPS)
    assert np.allclose(force, stiffness * noise)


def test_a_turn_is_dahls() -> None:
    x = np.concatenate([np.linspace(0.0, 0.01, 10_001), np.linspace(0.01, 0.0, 10_001)])
    force = term({"displacement": x, "velocity": np.full(len(x), 0.1)}, np.array([[1.0, REACH, 1.0, TURN]]), 1e-3)[0]
    travel = (0.01 - x)[10_001:]
    assert np.abs(force[10_001:] + np.tanh(0.1 / TURN) * (1.0 - 2.0 * np.exp(-travel / REACH))).max() < 0.08


def test_one_stop_turns_along_a_straight_line() -> None:
    x = np.concatenate([np.linspace(0.0, 0.01, 10_001), np.linspace(0.01, 0.0, 10_001)])
    force = term({"displacement": x, "velocity": np.full(len(x), 0.1)}, np.array([[1.0, REACH, 0.0, TURN]]), 1e-3)[0]
    travel = (0.01 - x)[10_001:]
    assert np.allclose(force[10_001:], np.maximum(1.0 - travel / REACH, -1.0), atol=2e-3)


def test_small_turns_close_their_loops() -> None:
    trembling = 1e-5 * (np.cos(np.linspace(0.0, 100 * np.pi, 10_001)) - 1.0)
    x = np.concatenate([np.linspace(0.0, 0.01, 2001), 0.01 + trembling])
    force = term({"displacement": x, "velocity": np.full(len(x), 0.1)}, np.array([[1.0, REACH, 1.0, TURN]]), 1e-3)[0]
    crests = force[2001::200]
    # Dahl's equation would come to rest at the middle of the loop
    assert np.ptp(crests) < 1e-9
    assert crests[0] > 0.98
    assert force[2101] < 0.9


@pytest.mark.parametrize("width", [5e-4, 5e-3])
def test_a_seal_that_floats_follows_the_velocity(width: float) -> None:
    t = np.arange(5000) * 2e-4
    channels = {"displacement": 0.02 * np.sin(12.0 * t), "velocity": 0.24 * np.cos(12.0 * t)}
    force = term(channels, np.array([[50.0, 1e-9, 0.5, width]]), 2e-4)[0]
    gap = np.abs(force - 50.0 * np.tanh(channels["velocity"] / width))
    # about v = 0 it is out by the creep below which friction does not fade
    assert gap[1:].max() <= 50.0 * 2e-4 / width


def test_travel_lost_between_samples_at_a_turn_is_made_up_for() -> None:
    fine = np.arange(40_001) * 1e-4
    x = 0.01 * np.sin(2 * np.pi * 4.03 * fine)
    theta = np.array([[100.0, 3e-5, 1.0, TURN]])
    exact = term(moving(x, 1e-4), theta, 1e-4)[0][::20]
    sampled = term({"displacement": x[::20], "velocity": np.gradient(x, 1e-4)[::20]}, theta, 2e-3)[0]
    plain = sum(100.0 * w * (x[::20] - play(x[::20], h * 3e-5)) / (h * 3e-5) for w, h in STOPS)
    assert np.abs(sampled - exact).max() <= 0.03 * np.abs(plain - exact).max()
