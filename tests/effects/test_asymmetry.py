"""Asymmetry: a gain in one direction only."""

import numpy as np
import pytest

from mrfit.effects.asymmetry import factors
from mrfit.simulate.assembly import assemble


def test_force_of_one_direction_is_larger_by_the_gain() -> None:
    whole = assemble("bingham+asymmetry")
    force = whole.simulate(np.array([[0.2, -0.2]]), np.array([[300.0, 500.0, 0.0, 0.35, 0.35, 1e-3]]), 1e-3)[0]
    assert force == pytest.approx([400.0 * 1.35, -400.0])


def test_difference_grows_with_the_force_where_that_of_an_offset_does_not() -> None:
    asymmetric, offset = assemble("bingham+asymmetry"), assemble("bingham+force-offset")
    v = np.array([[0.2, -0.2]])
    for model, extra, ratio in ((asymmetric, (0.5, 0.0, 1e-3), 2.0), (offset, (50.0,), 1.0)):
        theta = np.array([[200.0, 0.0, 0.0, *extra], [400.0, 0.0, 0.0, *extra]])
        weak, strong = model.simulate(v, theta, 1e-3).sum(1)
        assert strong / weak == pytest.approx(ratio)


def test_yield_force_and_damping_differ_each_by_its_own_share_and_springs_by_none() -> None:
    whole = assemble("tanh+asymmetry")
    theta = np.array([[500.0, 60.0, 0.0, 1000.0, 800.0, 20.0, 0.3, -0.2, 1e-3]])
    force = whole.simulate(np.array([[0.01, 0.01], [0.4, -0.4]]), theta, 1e-3)[0]
    assert force == pytest.approx([28.0 + 1.3 * 500.0 + 0.8 * 400.0, 28.0 - 500.0 - 400.0])


def test_directions_change_over_within_the_velocity_given() -> None:
    v = np.array([-0.05, -0.02, 0.0, 0.02, 0.05])
    gain = factors({"velocity": v}, np.array([[0.4, 0.0, 0.02]]), 1e-3)
    assert gain["yield"][0] == pytest.approx(1.0 + 0.2 * (1.0 + np.tanh(v / 0.02)))
    assert np.array_equal(gain["viscous"], np.ones((1, 5)))
