"""Channels on which nothing can be measured, on both sides of what tells them."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.measure.usable import MOVING_NOISE, RANGE_LEAST, RANGE_MOST, unusable

SINE = np.sin(2.0 * np.pi * np.arange(2000) / 500.0)


@settings(deadline=None, max_examples=10)
@given(st.integers(0, 99), st.floats(-1e3, 1e3), st.floats(1e-6, 1e3))
def test_noise_about_a_level_is_no_motion_whatever_its_size(seed: int, level: float, size: float) -> None:
    noise = level + size * np.random.default_rng(seed).uniform(-1.0, 1.0, 2000)
    # a uniform distribution reaches two times √3 standard deviations, fewer than those of a motion
    assert 2.0 * np.sqrt(3.0) < MOVING_NOISE
    assert unusable("force", noise) == "the force is constant but for noise; check that column and its unit"


@pytest.mark.parametrize(("size", "moves"), [(0.5, False), (8.0, True)])
def test_a_motion_is_told_from_noise_by_its_range(size: float, moves: bool) -> None:
    noise = np.random.default_rng(1).uniform(-1.0, 1.0, 2000)
    assert (unusable("displacement", size * SINE + noise) == "") is moves


@pytest.mark.parametrize("values", [np.zeros(2000), np.full(2000, 7.5)])
def test_a_level_is_no_motion(values: np.ndarray) -> None:
    assert "constant" in unusable("displacement", values)


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (0.4 * RANGE_LEAST, "the displacement moves by 8e-101 m, which is no displacement"),
        (0.6 * RANGE_LEAST, ""),
        (0.4 * RANGE_MOST, ""),
        (0.6 * RANGE_MOST, "the displacement moves by 1.2e+100 m, which is no displacement"),
    ],
)
def test_numbers_whose_squares_are_lost_are_no_quantity_of_a_test(size: float, said: str) -> None:
    found = unusable("displacement", size * SINE)
    assert found.startswith(said) and bool(found) == bool(said)
