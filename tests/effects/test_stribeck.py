"""Stribeck friction: highest at crawling speed, gone above the Stribeck velocity."""

import numpy as np
import pytest

from mrfit.effects.stribeck import term

STRENGTH, VELOCITY, REACH, BREADTH, TURN = 80.0, 0.02, 1e-5, 0.5, 1e-5


def force(speeds: np.ndarray, power: float = 2.0) -> np.ndarray:
    """Friction of a seal that has slipped one way for long, at these speeds."""
    sign = np.sign(speeds[-1])
    channels = {"displacement": sign * (1.0 + np.arange(len(speeds))), "velocity": speeds}
    return term(channels, np.array([[STRENGTH, VELOCITY, power, REACH, BREADTH, TURN]]), 1e-3)[0]


@pytest.mark.parametrize("power", [0.5, 1.0, 2.0])
def test_force_at_the_stribeck_velocity_is_one_over_e(power: float) -> None:
    assert force(np.array([VELOCITY]), power)[0] == pytest.approx(STRENGTH / np.e, rel=1e-9)


def test_power_of_one_is_the_exponential_law() -> None:
    assert force(np.array([3 * VELOCITY]), 1.0)[0] == pytest.approx(STRENGTH * np.exp(-3.0), rel=1e-9)


def test_force_has_died_away_at_three_times_the_velocity_and_is_odd() -> None:
    assert abs(force(np.array([3 * VELOCITY]))[0]) <= 2e-4 * STRENGTH
    assert force(np.array([-0.01]))[0] == -force(np.array([0.01]))[0]


def test_friction_falls_with_speed() -> None:
    speeds = np.linspace(0.005, 0.06, 50)
    forces = force(speeds)
    assert (np.diff(forces) < 0).all()
    assert forces[0] == pytest.approx(STRENGTH * np.exp(-1 / 16), rel=1e-3)
