"""The search in the fewest parameters ends where that in the model's own does, sooner, and within their bounds."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.planted import problem
from mrfit.models.boucwen_flux import far_starts
from mrfit.search import coarse_to_fine
from mrfit.search import run as search
from mrfit.search.auto import Auto
from mrfit.search.cube import cube_of
from mrfit.search.limits import Limits
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.result import SearchResult
from mrfit.search.starts import data_starts, to_points
from mrfit.simulate.assembly import assemble

MODELS = ["boucwen", "boucwen-flux", "boucwen-mmf", "hysteretic-biviscous", "spencer", "tanh"]


def posed(model: str, data: str = "") -> LeastSquaresProblem:
    group, assembly, cube = problem(data or model, 1, 6000, np.random.default_rng(1), fitted=model if data else "")
    return LeastSquaresProblem(group.search, np.ones(1), assembly, cube)


def found(at: LeastSquaresProblem, searched: bool = True) -> SearchResult:
    return search.run(at, at.cube.start[None, :], Limits(), np.random.default_rng(0), Auto(own_parameters=not searched))


def cost(at: LeastSquaresProblem, point: np.ndarray) -> float:
    return float(np.sqrt(np.mean(at.residuals(point[None, :]) ** 2)))


@pytest.mark.parametrize("model", MODELS)
def test_the_optimum_is_that_of_the_models_own_parameters(model: str) -> None:
    at = posed(model)
    less, own = found(at), found(at, searched=False)
    assert less.cost <= own.cost * (1 + 1e-4)
    assert cost(at, less.point) == pytest.approx(less.cost, rel=1e-6)
    assert less.success


def test_where_the_optimum_is_outside_the_bounds_the_search_ends_at_these() -> None:
    at = posed("boucwen", "spencer")
    less, own = found(at), found(at, searched=False)
    assert less.cost <= own.cost * (1 + 1e-3)
    assert less.point.min() >= 0.0 and less.point.max() <= 1.0
    assert cost(at, less.point) == pytest.approx(less.cost, rel=1e-6)


def test_a_bound_of_the_search_that_the_model_does_not_have_does_not_hold() -> None:
    group, assembly, cube = problem("tanh", 1, 6000, np.random.default_rng(1))
    drive = group.search[0].drive
    # a loop wider than where the search begins: a2/a1 = 60/s at a drive of 2 Hz
    theta = np.array([[500.0, 20.0, 1200.0, 1000.0, 300.0, 0.0]])
    output = assembly.simulate(drive, theta, group.search[0].dt)[0]
    block = replace(group.search[0], target=group.search[0].at_targets(output[None, :])[0], scatter=0.0)
    at = LeastSquaresProblem([block], np.ones(1), assembly, cube)
    assert found(at).cost < 1e-4 * np.ptp(output)


@pytest.mark.parametrize(
    ("bounds", "fixed"), [({"kappa": (1.0, 5.0)}, {}), ({}, {"n": 1.5})], ids=["narrowed", "fixed"]
)
def test_bounds_and_fixed_values_of_the_user_hold(
    bounds: dict[str, tuple[float, float]], fixed: dict[str, float]
) -> None:
    at = posed("boucwen-flux")
    cube = cube_of(assemble("boucwen-flux").spec, bounds, {"D": 0.05}, fixed)
    theta = cube.to_theta(found(replace(at, cube=cube)).point[None, :])[0]
    values = dict(zip((p.name for p in cube.params), theta, strict=True))
    assert all(low <= values[name] <= high for name, (low, high) in bounds.items())
    assert all(values[name] == value for name, value in fixed.items())


# Flux that saturates on one branch as on the other, and remembers where the current began
KNEE = np.array([[0.8, 0.0167, 0.05, 3000.0, 0.6, 4.6, 0.0112]])


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_flux_that_saturates_without_a_loop_is_found_from_what_the_data_give(seed: int) -> None:
    group, assembly, cube = problem("boucwen-flux", 1, 6000, np.random.default_rng(1))
    block = group.search[0]
    output = assembly.simulate(block.drive, KNEE, block.dt)
    knee = replace(block, target=block.at_targets(output)[0], scatter=0.0)
    at = LeastSquaresProblem([knee], np.ones(1), assembly, cube)
    whole = group.training[0]
    shown = assembly.simulate(whole.drive, KNEE, whole.dt)[0, whole.nodes[:, 0]]
    [given] = far_starts(whole.drive[:, whole.nodes[:, 0]], shown, whole.dt)
    starts = to_points(cube, [{}, given])
    outcome = search.run(at, starts, Limits(), np.random.default_rng(seed), Auto())
    assert outcome.cost < 1e-3 * np.ptp(output)


def test_several_logs_start_at_another_minimum_where_the_widest_hints_at_one() -> None:
    group, assembly, _ = problem("boucwen-flux", 1, 6000, np.random.default_rng(1))
    small = group.training[0]
    shown = assembly.simulate(3.0 * small.drive, KNEE, small.dt)[0, small.nodes[:, 0]]
    wide = replace(small, drive=3.0 * small.drive, target=shown)
    alone, both = (data_starts(blocks, assembly, None, ["n"]) for blocks in ([small], [small, small, wide]))
    assert len(alone) == 1 and alone[0]["A"] > 1.0
    assert [s["A"] < 1.0 for s in both] == [True, False]
    assert all("n" not in s for s in both)


def test_thinned_data_keep_what_a_start_remembers() -> None:
    at = posed("boucwen-flux")
    usual = coarse_to_fine.thin_problem(at, at.cube.start[None, :], 1000)[0]
    remembering = coarse_to_fine.thin_problem(at, at.cube.to_points(KNEE), 1000)[0]
    assert usual.simulated < remembering.simulated


def test_effects_and_dependence_on_current_have_no_reduced_parameters() -> None:
    assert assemble("boucwen-flux").reduced is not None
    assert assemble("boucwen-flux+eddy-current").reduced is None


def test_a_budget_holds() -> None:
    at = posed("boucwen", "spencer")
    for budget in (60, 200, 700):
        outcome = search.run(at, at.cube.start[None, :], Limits(budget), np.random.default_rng(0), Auto())
        assert outcome.nfev <= budget
        assert np.isfinite(outcome.cost)
