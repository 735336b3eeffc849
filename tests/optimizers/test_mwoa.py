import numpy as np
import pytest

from mrfit.objective import Objective
from mrfit.optimizers import mwoa


def test_rare_costs_are_cloned_most():
    # differences: |1-2| + |1-4| = 4, 1 + 2 = 3, 3 + 2 = 5
    assert mwoa.selection_probabilities(np.array([1.0, 2.0, 4.0])) == pytest.approx(np.array([4, 3, 5]) / 12)


@pytest.mark.parametrize("costs", [[2.0, 2.0, 2.0, 2.0], [0.0] * 4, [np.inf] * 4])
def test_equal_costs_are_cloned_alike(costs):
    assert mwoa.selection_probabilities(np.array(costs)) == pytest.approx(np.full(4, 0.25))


def test_infinite_costs_count_as_the_largest_finite_one():
    with_infinity = mwoa.selection_probabilities(np.array([1.0, 2.0, np.inf]))
    assert with_infinity == pytest.approx(mwoa.selection_probabilities(np.array([1.0, 2.0, 2.0])))


def test_immune_operation_replaces_the_worst_by_clones_of_the_best():
    rng = np.random.default_rng(0)
    whales, costs = rng.random((40, 3)), np.arange(40.0)[::-1].copy()
    stirred = mwoa.immune_operation(whales, costs, rng)
    assert np.array_equal(stirred[10:], whales[10:])
    best = whales[30:]
    for clone in stirred[:10]:
        assert np.linalg.norm(best - clone, axis=1).min() < 6 * mwoa.MUTATION
    assert stirred.min() >= 0.0
    assert stirred.max() <= 1.0


def test_a_single_whale_is_left_alone():
    whale = np.array([[0.2, 0.3]])
    assert np.array_equal(mwoa.immune_operation(whale, np.array([1.0]), np.random.default_rng(0)), whale)


def test_immune_operation_comes_after_thirty_idle_iterations(monkeypatch):
    called = []
    monkeypatch.setattr(mwoa, "immune_operation", lambda whales, costs, rng: (called.append(1), whales)[1])
    objective = Objective(lambda p: np.ones((len(p), 2)), np.array([0.5, 0.5]), 40 * 100)
    mwoa.minimise(objective, np.random.default_rng(0))
    assert len(called) == 3
