import numpy as np
import pytest

from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search.limits import Limits


def shifted_rastrigin(points):
    x = 10.0 * (points - [0.37, 0.58])
    return np.sqrt(x**2 + 10.0 - 10.0 * np.cos(2.0 * np.pi * x))


def test_minimum_is_found_among_a_hundred_others():
    objective = Objective(shifted_rastrigin, np.array([0.9, 0.1]), 0)
    outcome = chain.run("de", objective, np.random.default_rng(0))
    assert outcome.point == pytest.approx([0.37, 0.58], abs=1e-4)


def test_generations_are_batches_and_the_first_holds_the_start():
    batches = []

    def residuals(points):
        batches.append(points.copy())
        return shifted_rastrigin(points)

    chain.run("de", Objective(residuals, np.array([0.9, 0.1]), 0), np.random.default_rng(0), Limits(400))
    assert [len(b) for b in batches] == [40] * 10
    assert batches[0][0] == pytest.approx([0.9, 0.1], abs=1e-12)


def test_agreeing_population_ends_the_search():
    objective = Objective(lambda p: p - [0.3, 0.4], np.array([0.9, 0.1]), 0)
    outcome = chain.run("de", objective, np.random.default_rng(0))
    assert outcome.success
    assert outcome.nfev < 20_000
