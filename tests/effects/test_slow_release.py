"""Slow release: a field that rises with the current at once, and falls behind it."""

import numpy as np
import pytest

from mrfit.effects.slow_release import transform

DT = 1e-3


def field_of(current: np.ndarray, h: float, tau: float, dt: float = DT) -> np.ndarray:
    return transform({"current": current}, np.array([h, tau]), dt)["current"]


def test_a_current_that_only_rises_is_followed_at_once() -> None:
    current = np.linspace(0.2, 1.5, 300) ** 2
    assert np.array_equal(field_of(current, 0.7, 0.05), current)


def test_behind_a_step_down_the_share_decays_exponentially() -> None:
    current = np.concatenate([np.full(50, 2.0), np.full(400, 0.5)])
    field = field_of(current, 0.4, 0.08)
    late = np.arange(400) * DT
    # the step is a ramp of one sample: what is left at its end is the mean of an exponential over it
    left = 1.5 * (0.08 / DT) * (1.0 - np.exp(-DT / 0.08))
    assert field[50:] == pytest.approx(0.5 + 0.4 * left * np.exp(-late / 0.08), rel=1e-12)


def test_a_ramp_down_is_followed_by_the_share_of_its_rate_times_the_time_constant() -> None:
    current = 5.0 - 2.0 * DT * np.arange(2000)
    field = field_of(current, 0.3, 0.04)
    assert field[1000:] - current[1000:] == pytest.approx(0.3 * 2.0 * 0.04, rel=1e-9)


def test_a_rise_that_meets_what_is_left_ends_the_release() -> None:
    current = np.concatenate([np.full(10, 1.0), np.linspace(0.0, 2.0, 201)])
    field = field_of(current, 1.0 - 0.02, 10.0)
    assert np.all(field[10:80] > current[10:80] + 0.1)
    assert np.array_equal(field[130:], current[130:])


def test_a_current_of_the_other_sign_makes_the_opposite_field() -> None:
    current = np.sin(np.linspace(0, 20, 700)) * np.linspace(1, 0.3, 700)
    assert np.array_equal(field_of(-current, 0.5, 0.03), -field_of(current, 0.5, 0.03))


def test_samples_in_between_change_nothing() -> None:
    current = np.array([0.0, 1.0, 0.4, 0.9, 0.1, 0.0, 0.0, 1.2, 0.3])
    fine = np.interp(np.arange(8 * 20 + 1) / 20, np.arange(9), current)
    assert field_of(fine, 0.6, 0.002, DT / 20)[::20] == pytest.approx(field_of(current, 0.6, 0.002), abs=1e-12)
