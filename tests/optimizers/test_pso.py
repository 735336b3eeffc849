import numpy as np
import pytest

from mrfit.objective import BudgetSpent, Objective
from mrfit.optimizers import pso


def search(residuals, start, budget, seed=0):
    batches = []

    def recorded(points):
        batches.append(points.copy())
        return residuals(points)

    objective = Objective(recorded, np.array(start), budget)
    try:
        pso.minimise(objective, np.random.default_rng(seed))
    except BudgetSpent:
        pass
    return objective, batches


def test_coefficients_run_from_the_first_to_the_last_value():
    assert pso.coefficients(0.0) == (pso.INERTIA[0], pso.COGNITIVE[0], pso.SOCIAL[0])
    assert pso.coefficients(1.0) == pytest.approx((pso.INERTIA[1], pso.COGNITIVE[1], pso.SOCIAL[1]))
    middle = [(a + b) / 2 for a, b in (pso.INERTIA, pso.COGNITIVE, pso.SOCIAL)]
    assert pso.coefficients(0.5) == pytest.approx(middle)


def test_whole_swarm_is_one_batch_and_starts_at_the_start():
    _, batches = search(lambda p: p - 0.3, [0.8, 0.9], 400)
    assert [len(b) for b in batches] == [40] * 10
    assert batches[0][0].tolist() == [0.8, 0.9]


def test_no_particle_moves_faster_than_the_limit():
    _, batches = search(lambda p: p - 0.3, [0.8, 0.9], 2000)
    steps = np.abs(np.diff(np.stack(batches), axis=0))
    assert steps.max() <= pso.SPEED_LIMIT + 1e-12


def test_swarm_contracts_onto_the_minimum():
    objective, batches = search(lambda p: p - [0.3, 0.6], [0.8, 0.9], 8000)
    assert objective.best_cost < 1e-8
    assert batches[-1].std(axis=0).max() < 0.05 * batches[0].std(axis=0).max()
