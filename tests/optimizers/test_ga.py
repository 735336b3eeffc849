import numpy as np
import pytest

from mrfit.optimizers import ga
from mrfit.optimizers.cost.objective import Objective


def test_children_of_equal_parents_equal_them_without_mutation():
    parents = np.full((40, 3), 0.3)
    children = ga.breed(parents, np.ones(40), np.random.default_rng(0), mutation=0.0)
    assert children == pytest.approx(parents)


def test_children_stay_in_the_cube():
    rng = np.random.default_rng(0)
    children = ga.breed(rng.random((400, 5)).round(), rng.random(400), rng, mutation=0.5)
    assert children.min() >= 0.0
    assert children.max() <= 1.0


def test_cheap_parents_are_preferred():
    points = np.concatenate([np.full((20, 2), 0.2), np.full((20, 2), 0.8)])
    costs = np.concatenate([np.zeros(20), np.ones(20)])
    children = ga.breed(points, costs, np.random.default_rng(0), mutation=0.0)
    assert np.mean(children < 0.5) > 0.6


def test_one_component_mutates_on_average():
    parents = np.full((4000, 5), 0.5)
    children = ga.breed(parents, np.ones(4000), np.random.default_rng(0), mutation=0.1)
    assert np.mean(np.abs(children - parents) > 1e-12) == pytest.approx(1 / 5, abs=0.02)


def test_best_two_survive():
    batches = []

    def residuals(points):
        batches.append(points.copy())
        return points - [0.31, 0.62]

    objective = Objective(residuals, np.array([0.5, 0.5]), 40 * 20)
    ga.minimise(objective, np.random.default_rng(0), ga.SPEC.defaults)
    assert [len(b) for b in batches] == [40] * 20
    assert objective.best_cost < 0.02
