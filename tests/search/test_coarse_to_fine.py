"""Thinned data lead to the optimum of all data, faster; where they do not, all data are searched."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.planted import PER_CYCLE, problem
from mrfit.core.specs import Array
from mrfit.optimizers import multistart
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search import run as search
from mrfit.search.auto import Auto
from mrfit.search.coarse_to_fine import shortened, thinned
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.result import SearchResult
from tests.fit.toy import block, linear_model


def posed(model: str, samples: int = 10_000, seed: int = 1) -> LeastSquaresProblem:
    group, assembly, cube = problem(model, 1, samples, np.random.default_rng(seed))
    return LeastSquaresProblem(group.search, np.ones(1), assembly, cube)


def found(at: LeastSquaresProblem, budget: int | None = None) -> SearchResult:
    return search.run(at, at.cube.start[None, :], Limits(budget), np.random.default_rng(0), Auto(own_parameters=True))


@pytest.mark.parametrize("model", ["boucwen-flux", "guo", "rotational-erf", "spencer"])
def test_the_optimum_is_that_of_all_data(model: str) -> None:
    at = posed(model)
    objective = Objective(at.residuals, at.cube.start, budget=0)
    full = chain.run("multistart", objective, np.random.default_rng(0))
    assert found(at).cost < full.cost * (1 + 1e-4)


def test_a_thinned_cycle_has_the_cost_of_the_full_one_near_the_optimum() -> None:
    at = posed("boucwen-flux")
    thin = LeastSquaresProblem(thinned(at.blocks), at.weights, at.assembly, at.cube)
    assert thin.blocks[0].drive.shape[1] * 8 == at.blocks[0].drive.shape[1]
    point = found(at).point[None, :]
    costs = [np.sqrt(np.mean(p.residuals(point) ** 2)) for p in (at, thin)]
    # on the line between two bins there is less noise than in one
    assert 0.95 * costs[0] < costs[1] < 1.01 * costs[0]


@pytest.mark.parametrize(("period", "step"), [(4000.0, 16), (100.0, 8), (3.0, 1)])
def test_a_drive_is_thinned_as_far_as_its_wiggles_allow(period: float, step: int) -> None:
    time = np.arange(40_000)
    drive = np.sin(2 * np.pi * time / period)[None, :]
    (thin,) = thinned([block(drive, drive[0])])
    assert len(time) / len(thin.target) == step
    assert np.allclose(thin.drive[0, thin.nodes[:, 0]], thin.target)
    assert thin.samples == len(time)


def test_a_channel_that_is_switched_does_not_keep_a_record_from_being_thinned() -> None:
    time = np.arange(40_000)
    drive = np.stack([np.sin(2 * np.pi * time / 4000.0), (time // 300 % 2).astype(np.float64)])
    (thin,) = thinned([block(drive, drive[0])])
    assert len(time) / len(thin.target) == 16


def test_many_records_are_thinned_further_than_one() -> None:
    drive = np.sin(2 * np.pi * np.arange(6000) / 1500.0)[None, :]
    record = block(drive, drive[0])
    assert len(thinned([record])[0].target) == 3000
    assert len(thinned([record] * 12)[11].target) == 750


def test_what_a_model_forgets_is_not_simulated() -> None:
    at = posed("tanh")
    lead = int(at.blocks[0].nodes.min())
    assert lead > 0
    alone = shortened(at, at.cube.probes(), 1e-12, (0.0, 0.5))
    assert alone.simulated == at.simulated - lead
    assert alone.residuals(at.cube.probes()) == pytest.approx(at.residuals(at.cube.probes()), abs=1e-12)
    # a point that cannot be simulated says nothing
    lost = np.full_like(at.cube.probes(), np.nan)
    assert shortened(at, np.vstack([lost, at.cube.probes()]), 1e-12, (0.0, 0.5)).simulated == alone.simulated
    assert shortened(at, lost, 1e-12, (0.0, 0.5)).simulated == at.simulated


def test_a_lead_that_a_model_remembers_stays() -> None:
    at = posed("boucwen")
    points = at.cube.probes()[:1]
    none, half = (shortened(at, points, 1e-6, leads).simulated for leads in ((0.0,), (0.0, 0.5)))
    assert none == at.simulated > half
    # a loop of which nothing saturates remembers where it began
    slow = at.cube.to_points(np.array([[1000.0, 1000.0, 0.0, 500.0, 10.0, 5.0, 5.0, 2.0]]))
    assert shortened(at, slow, 1e-9, (0.0, 0.5)).simulated == at.simulated


def test_of_a_short_periodic_record_one_cycle_is_enough_to_begin_with() -> None:
    drive = np.sin(2 * np.pi * np.arange(600) / 150.0)[None, :]
    short = replace(block(drive, drive[0], cycles=4), cycle=150)
    (thin,) = thinned([short])
    assert np.array_equal(thin.target, drive[0, :150]) and thin.drive.shape == (1, 150)
    group, _, _ = problem("boucwen-flux", 1, 6000, np.random.default_rng(1))
    assert [b.cycle for b in group.training] == [PER_CYCLE]


def test_short_records_are_left_as_they_are() -> None:
    assembly, cube = linear_model("")
    drive = np.sin(np.arange(1000.0))[None, :]
    outcome = found(LeastSquaresProblem([block(drive, 0.3 * drive[0])], np.ones(1), assembly, cube))
    assert len(outcome.links) == 1
    assert cube.to_theta(outcome.point[None, :])[0] == pytest.approx([0.3])


def test_a_budget_holds_for_both_searches_together() -> None:
    at = posed("boucwen-flux")
    for budget in (150, 400):
        assert found(at, budget).nfev <= budget


@pytest.mark.parametrize("budget", [1, 2, 3, 5, 8])
def test_few_evaluations_still_find_a_point(budget: int) -> None:
    assert np.isfinite(found(posed("boucwen-flux"), budget).cost)


def test_evaluations_in_the_history_rise_over_both_searches() -> None:
    outcome = found(posed("guo"))
    counts = [e for link in outcome.links for e, _ in link.history]
    assert counts == sorted(counts)
    assert counts[-1] == outcome.nfev


@pytest.mark.parametrize("model", ["guo", "boucwen-flux", "tanh"])
def test_costs_on_thinned_data_are_marked_and_those_on_all_data_only_fall(model: str) -> None:
    first, last = found(posed(model)).links
    assert (first.preliminary, last.preliminary) == (True, False)
    costs = [cost for _, cost in last.history]
    # where the lead before the samples is made longer once more, the same cost comes back to 1e-7
    assert all(b <= a * (1.0 + 1e-6) for a, b in zip(costs, costs[1:], strict=False))


def test_refinement_ends_at_a_minimum_and_says_so() -> None:
    def bowl(points: Array) -> Array:
        return np.column_stack([points[:, 0] - 0.3, np.sin(points[:, 1] - 0.6), np.full(len(points), 0.1)])

    objective = Objective(bowl, np.array([0.4, 0.5]), budget=200)
    assert multistart.refine(objective, np.array([[0.9, 0.1], [0.4, 0.5]]))
    assert objective.best_point == pytest.approx([0.3, 0.6], abs=1e-6)


def test_refinement_without_evaluations_does_not_claim_an_end() -> None:
    objective = Objective(lambda points: np.cos(9.0 * points) + 2.0, np.array([0.1, 0.2]), budget=5)
    assert not multistart.refine(objective, objective.start[None, :])
    assert objective.evaluations <= 5


def test_refinement_follows_a_rival_that_ends_below_the_best() -> None:
    def narrow_and_wide(points: Array) -> Array:
        x = points[:, 0]
        return np.column_stack([1.0 + np.minimum(5.0 * np.abs(x - 0.2), 0.8 + 0.5 * (x - 0.8))])

    starts = np.array([[0.9], [0.37]])
    objective = Objective(narrow_and_wide, starts[0], budget=400)
    multistart.refine(objective, starts)
    assert objective.best_point == pytest.approx([0.2], abs=0.05)
