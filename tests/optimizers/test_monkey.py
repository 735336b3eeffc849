import numpy as np
import pytest

from mrfit.optimizers import monkey
from mrfit.optimizers.cost.objective import Objective


def make(residuals, dimension=2):
    return Objective(residuals, np.full(dimension, 0.5), 10**6)


def test_climb_goes_downhill_by_its_step_along_every_axis_of_a_plane():
    monkeys = np.full((5, 1), 0.9)
    climbed = monkey.climb(make(lambda p: p + 1.0, 1), monkeys, 0.01, np.random.default_rng(0))
    assert climbed == pytest.approx(np.full((5, 1), 0.9 - 0.01 * monkey.CLIMB_STEPS))


def test_climb_stays_where_it_is_flat():
    monkeys = np.random.default_rng(1).random((5, 3))
    climbed = monkey.climb(make(lambda p: np.ones((len(p), 2)), 3), monkeys, 0.01, np.random.default_rng(0))
    assert np.array_equal(climbed, monkeys)


def test_climb_leaves_regions_that_cannot_be_simulated():
    def residuals(points):
        return np.where(points > 0.5, np.nan, 1.0)

    climbed = monkey.climb(make(residuals, 1), np.full((5, 1), 0.505), 0.01, np.random.default_rng(0))
    assert climbed.max() < 0.5


def test_watching_never_makes_worse_and_keeps_to_the_eyesight():
    monkeys = np.random.default_rng(1).random((30, 2))
    objective = make(lambda p: p - 0.2)
    before = objective.costs(monkeys)
    jumped = monkey.watch_and_jump(objective, monkeys, np.random.default_rng(0))
    assert np.all(objective.costs(jumped) <= before)
    assert np.abs(jumped - monkeys).max() <= monkey.WATCHES * monkey.EYESIGHT


def test_somersault_goes_along_the_line_through_the_barycentre():
    monkeys = 0.4 + 0.2 * np.random.default_rng(1).random((30, 3))
    thrown = monkey.somersault(monkeys, np.random.default_rng(0))
    arms = monkeys.mean(axis=0) - monkeys
    shares = (thrown - monkeys) / arms
    assert shares.max(axis=1) == pytest.approx(shares.min(axis=1), rel=1e-6)
    assert np.abs(shares).max() <= 1.0
