"""Response to steps of the current against a first-order answer with dead time."""

import numpy as np
import pytest
from scipy.signal import lfilter, lsim, lti

from mrfit.measure.current_steps import quantities

DT = 1e-3


def record(dead: int, tau: float, sine: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    time = np.arange(12_000) * DT
    current = np.where(time % 1.0 < 0.5, 0.0, 2.0)
    share = 1.0 - np.exp(-DT / tau)
    late = lfilter([share], [1.0, share - 1.0], np.concatenate([np.zeros(dead), current[:-dead]]))
    turn = np.sin(2.0 * np.pi * time / (1.0 if sine else 12.0) + 1e-9)
    velocity = 0.05 * (turn if sine else np.sign(turn))
    force = np.sign(velocity) * (100.0 + 400.0 * late) + 2.0 * np.random.default_rng(0).standard_normal(len(time))
    return current, force, velocity


def test_dead_time_and_rise_are_found_up_and_down() -> None:
    found = {q.name: q.estimate for q in quantities(*record(4, 0.02), DT)}
    for way in ("up", "down"):
        for name, truth in (("dead time", 0.003), ("t63", 0.023), ("t90", 0.003 + 0.02 * np.log(10.0))):
            one = found[f"{name} {way}"]
            assert one is not None and one.value == pytest.approx(truth, abs=3e-4)
        over = found[f"overshoot {way}"]
        assert over is not None and over.value < 0.01


def test_a_sine_is_told_to_be_the_wrong_motion() -> None:
    reasons = {q.reason for q in quantities(*record(4, 0.02, sine=True), DT)}
    assert reasons == {"the speed does not hold while the force answers; move at a constant speed"}


def test_a_constant_current_has_no_step() -> None:
    current, force, velocity = record(4, 0.02)
    assert {q.reason for q in quantities(np.ones(len(current)), force, velocity, DT)} == {"no step of the current"}


def test_a_rest_ends_at_the_reversal_and_an_overshoot_keeps_its_size() -> None:
    time = np.arange(24_000) * DT
    current = np.where(time % 4.0 < 2.0, 0.0, 1.0)
    # a second-order answer of damping ratio 0.4, whose overshoot is exp(-pi*z/sqrt(1 - z²)); turns 1.2 s after steps
    z, omega = 0.4, 90.0
    answer = lti(omega**2, [1.0, 2.0 * z * omega, omega**2])
    late = lsim(answer, current, time)[1]
    velocity = 0.05 * np.where((time - 1.2) % 4.0 < 2.0, 1.0, -1.0)
    force = np.sign(velocity) * (100.0 + 400.0 * late) + 2.0 * np.random.default_rng(1).standard_normal(len(time))
    found = {q.name: q.estimate for q in quantities(current, force, velocity, DT)}
    for way in ("up", "down"):
        over = found[f"overshoot {way}"]
        assert over is not None and over.value == pytest.approx(np.exp(-np.pi * z / np.sqrt(1.0 - z**2)), abs=0.02)
