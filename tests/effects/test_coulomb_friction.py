"""Coulomb friction: work per stroke, and quiet at rest."""

import numpy as np
import pytest

from mrfit.effects.coulomb_friction import term


@pytest.mark.parametrize("frequency", [1.0, 8.0])
def test_work_per_cycle_is_four_times_friction_times_amplitude_at_any_frequency(frequency: float) -> None:
    t = np.linspace(0, 1 / frequency, 20_001)
    x, v = 0.02 * np.sin(2 * np.pi * frequency * t), 0.04 * np.pi * frequency * np.cos(2 * np.pi * frequency * t)
    work = np.trapezoid(term({"velocity": v}, np.array([[35.0]]), t[1])[0], x)
    assert work == pytest.approx(4 * 35.0 * 0.02, rel=1e-3)


def test_noise_of_a_resting_velocity_does_not_chatter() -> None:
    noise = np.random.default_rng(0).normal(0, 1e-5, 5000)
    assert np.std(term({"velocity": noise}, np.array([[100.0]]), 1e-3)) <= 0.011 * 100.0


def test_force_is_odd_in_velocity() -> None:
    v = np.linspace(-0.01, 0.01, 101)
    force = term({"velocity": v}, np.array([[3.0]]), 1e-3)[0]
    assert np.allclose(force, -force[::-1], atol=1e-14)
