"""Residual magnetism: what a current leaves behind, at any rate."""

import numpy as np
import pytest

from mrfit.effects.residual_magnetism import transform


def field_of(current: np.ndarray, half_width: float) -> np.ndarray:
    return transform({"current": current}, np.array([half_width]), 1e-3)["current"]


def test_a_current_that_went_back_to_zero_leaves_the_half_width() -> None:
    current = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0, 50)])
    assert field_of(current, 0.07)[-1] == pytest.approx(0.07)


def test_way_up_and_way_down_differ_by_the_full_width() -> None:
    up = np.linspace(0, 1, 1001)
    field = field_of(np.concatenate([up, up[::-1]]), 0.1)
    assert np.allclose(field[400:900], up[400:900] - 0.1)
    assert np.allclose(field[1001 + 300 : 1001 + 900], up[::-1][300:900] + 0.1)


def test_memory_does_not_depend_on_rate_or_holding() -> None:
    current = np.sin(np.linspace(0, 12, 400)) * np.linspace(1, 0.2, 400)
    assert np.array_equal(field_of(np.repeat(current, 5), 0.05)[::5], field_of(current, 0.05))


def test_a_current_that_only_rose_shows_a_shift_and_no_memory() -> None:
    current = np.linspace(0.5, 1.5, 100)
    assert np.allclose(field_of(current, 0.1), current - 0.1)
