"""Stribeck friction: highest at crawling speed, gone above the Stribeck velocity."""

import numpy as np
import pytest

from mrfit.effects.stribeck import term

STRENGTH, VELOCITY = 80.0, 0.02


def force(v: float) -> float:
    return float(term({"velocity": np.array([v])}, np.array([[STRENGTH, VELOCITY]]), 1e-3)[0, 0])


def test_force_at_the_stribeck_velocity_is_one_over_e() -> None:
    assert force(VELOCITY) == pytest.approx(STRENGTH / np.e, rel=1e-9)


def test_force_has_died_away_at_three_times_the_velocity_and_is_odd() -> None:
    assert abs(force(3 * VELOCITY)) <= 2e-4 * STRENGTH
    assert force(-0.01) == -force(0.01)


def test_friction_falls_with_speed_beyond_the_first_millimetres_per_second() -> None:
    speeds = np.linspace(0.005, 0.06, 50)
    forces = term({"velocity": speeds}, np.array([[STRENGTH, VELOCITY]]), 1e-3)[0]
    assert (np.diff(forces) < 0).all()
    assert forces[0] == pytest.approx(STRENGTH * np.exp(-1 / 16), rel=1e-3)
