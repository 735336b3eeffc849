import numpy as np
import pytest

from mrfit.optimizers.woa import swim

PREY = np.array([0.4, 0.6, 0.5])


def test_whales_on_the_prey_stay_there_when_the_coefficient_is_spent():
    whales = np.tile(PREY, (200, 1))
    moved = swim(whales, PREY, 0.0, 1.0, np.random.default_rng(0))
    assert moved == pytest.approx(whales)


def test_half_of_the_whales_encircle_and_half_follow_the_spiral():
    whales = np.random.default_rng(0).random((4000, 3))
    moved = swim(whales, PREY, 0.0, 1.0, np.random.default_rng(1))
    on_prey = np.all(moved == PREY, axis=1)
    assert on_prey.mean() == pytest.approx(0.5, abs=0.03)


def test_spiral_scales_the_distance_by_one_number_per_whale():
    whales = PREY + np.array([[0.1, 0.05, 0.02]]) * np.ones((500, 1))
    moved = swim(whales, PREY, 0.0, 1.0, np.random.default_rng(1))
    inside = np.all((moved > 0.0) & (moved < 1.0), axis=1) & np.any(moved != PREY, axis=1)
    ratios = (moved[inside] - PREY) / [0.1, 0.05, 0.02]
    assert ratios.max(axis=1) == pytest.approx(ratios.min(axis=1))
    assert np.abs(ratios).max() <= np.e
    assert ratios.min() < -0.3


def test_others_are_followed_only_while_the_coefficient_exceeds_one():
    whales = np.full((300, 3), 0.2)
    stray = whales.copy()
    stray[1::2] = 0.9
    for coefficient, same in ((0.99, True), (2.0, False)):
        first = swim(whales, PREY, coefficient, 1.0, np.random.default_rng(3))[::2]
        second = swim(stray, PREY, coefficient, 1.0, np.random.default_rng(3))[::2]
        assert np.array_equal(first, second) == same
