import numpy as np
import pytest

from mrfit.optimizers import mwoa
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search.limits import Limits


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
    stirred = mwoa.immune_operation(whales, costs, 10, np.full(3, 0.05), rng)
    assert np.array_equal(stirred[10:], whales[10:])
    best = whales[30:]
    for clone in stirred[:10]:
        assert np.linalg.norm(best - clone, axis=1).min() < 6 * 0.05


def test_a_single_whale_is_left_alone():
    whale = np.array([[0.2, 0.3]])
    assert np.array_equal(
        mwoa.immune_operation(whale, np.array([1.0]), 10, np.full(2, 0.05), np.random.default_rng(0)), whale
    )


@pytest.mark.parametrize(("given", "count"), [((), 3), ((("N_d", 9.0),), 11)])
def test_immune_operation_comes_after_idle_iterations(given, count, monkeypatch):
    called = []
    monkeypatch.setattr(mwoa, "immune_operation", lambda whales, *rest: (called.append(1), whales)[1])
    objective = Objective(lambda p: np.ones((len(p), 2)), np.array([0.5, 0.5]), 0)
    chain.run("mwoa", objective, np.random.default_rng(0), Limits(40 * 100, stall=1.0), given)
    assert len(called) == count


@pytest.mark.parametrize(("given", "count"), [((), 10), ((("M", 3.0),), 3), ((("M", 30.0),), 20)])
def test_as_many_are_replaced_as_there_are_antibodies(given, count):
    options = mwoa.SPEC.defaults | dict(given)
    rng = np.random.default_rng(0)
    whales, costs = rng.random((40, 3)), np.arange(40.0)
    stirred = mwoa.immune_operation(whales, costs, int(options["M"]), np.full(3, 0.05), rng)
    assert np.any(stirred != whales, axis=1).sum() == count
