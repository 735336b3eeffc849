import numpy as np
import pytest

from mrfit.optimizers import pso
from mrfit.optimizers.cost.objective import BudgetSpent, Objective


def search(residuals, start, budget, seed=0):
    batches = []

    def recorded(points):
        batches.append(points.copy())
        return residuals(points)

    objective = Objective(recorded, np.array(start), budget)
    try:
        pso.minimise(objective, np.random.default_rng(seed), pso.SPEC.defaults)
    except BudgetSpent:
        pass
    return objective, batches


def test_coefficients_run_from_the_first_to_the_last_value():
    options = pso.SPEC.defaults | {"w_max": 0.8, "w_min": 0.2, "c1_0": 2.0, "c1_end": 1.0, "c2_0": 0.4, "c2_end": 3.4}
    assert pso.coefficients(options, 0.0) == pytest.approx((0.8, 2.0, 0.4))
    assert pso.coefficients(options, 1.0) == pytest.approx((0.2, 1.0, 3.4))
    assert pso.coefficients(options, 0.5) == pytest.approx((0.5, 1.5, 1.9))


def test_whole_swarm_is_one_batch_and_starts_at_the_start():
    _, batches = search(lambda p: p - 0.3, [0.8, 0.9], 400)
    assert [len(b) for b in batches] == [40] * 10
    assert batches[0][0].tolist() == [0.8, 0.9]


def test_no_particle_moves_faster_than_the_limit():
    _, batches = search(lambda p: p - 0.3, [0.8, 0.9], 2000)
    steps = np.abs(np.diff(np.stack(batches), axis=0))
    assert steps.max() <= pso.SPEC.defaults["v_max"] + 1e-12


def test_swarm_contracts_onto_the_minimum():
    objective, batches = search(lambda p: p - [0.3, 0.6], [0.8, 0.9], 8000)
    assert objective.best_cost < 1e-8
    assert batches[-1].std(axis=0).max() < 0.05 * batches[0].std(axis=0).max()
