"""What every registered optimizer must do, whatever it is."""

import pytest

from mrfit.contracts.check import Check, applying
from mrfit.contracts.optimizers import CHECKS
from mrfit.core import registry
<<<<<<< HEAD
from mrfit.core.built_in import own_names
=======
from mrfit.search import chain
from mrfit.search.limits import Limits
from mrfit.search.objective import Objective
>>>>>>> wt-search

NAMES = own_names("optimizer")
CASES = [(name, check) for name in NAMES for check in applying(CHECKS, registry.load("optimizer", name))]


@pytest.mark.parametrize(("name", "check"), CASES, ids=[f"{name} {check.name}" for name, check in CASES])
def test_optimizer_keeps(name: str, check: Check) -> None:
    check.run(registry.load("optimizer", name))


<<<<<<< HEAD
@pytest.mark.parametrize("name", NAMES)
def test_specification_is_named_after_its_file(name: str) -> None:
    assert registry.load("optimizer", name).SPEC.name == name
=======
def rosenbrock(points):
    x = -2.0 + 4.0 * points
    return np.stack([10.0 * (x[:, 1] - x[:, 0] ** 2), 1.0 - x[:, 0]], axis=1)


def recorded(residuals, batches):
    def function(points):
        batches.append(points.copy())
        return residuals(points)

    return function


def run(name, residuals, start, budget=None, seed=0, **more):
    batches = []
    objective = Objective(recorded(residuals, batches), np.asarray(start, dtype=float), 0, **more)
    outcome = chain.run(name, objective, np.random.default_rng(seed), Limits(budget))
    return outcome, batches


@every_optimizer
def test_spec_is_complete(name):
    spec = registry.load("optimizer", name).SPEC
    assert spec.name == name and "-" not in name
    assert spec.title and spec.reference
    assert spec.kind in ("global", "local", "start")
    assert 0 < spec.budget(1, spec.defaults) <= spec.budget(20, spec.defaults) < 1_000_000
    for option in spec.options:
        assert option.low <= option.default <= option.high and option.text
        assert "." not in option.name and "=" not in option.name


@every_optimizer
def test_options_at_their_bounds_still_search_within_the_cube_and_the_budget(name):
    spec = registry.load("optimizer", name).SPEC
    for option in spec.options:
        for value in (option.low, option.high):
            objective = Objective(quadratic(np.full(3, 0.6)), np.full(3, 0.5), 0)
            given = ((option.name, value),)
            outcome = chain.run(name, objective, np.random.default_rng(0), Limits(200), given)
            assert np.isfinite(outcome.cost) and outcome.nfev <= 200, option.name
            assert outcome.point.min() >= 0.0 and outcome.point.max() <= 1.0


@every_optimizer
@pytest.mark.parametrize("target", [0.0, 0.6, 1.0])
def test_points_stay_in_the_cube(name, target):
    _, batches = run(name, quadratic(np.full(3, target)), [0.5, 0.0, 1.0], budget=2000)
    points = np.vstack(batches)
    assert points.min() >= 0.0
    assert points.max() <= 1.0


@every_optimizer
@pytest.mark.parametrize("budget", [1, 4, 39, 40, 41, 997])
def test_budget_is_never_exceeded_and_every_evaluation_counted(name, budget):
    outcome, batches = run(name, rosenbrock, [0.2, 0.7], budget=budget)
    assert outcome.nfev == sum(len(b) for b in batches) <= budget
    assert outcome.links[0].evaluations == outcome.nfev


@every_global_search
@pytest.mark.parametrize("budget", [40, 203])
def test_global_search_uses_its_whole_budget_on_a_problem_that_needs_more(name, budget):
    directions = 60.0 * np.random.default_rng(1).standard_normal((4, 30))

    def rugged(points):
        return 2.0 + np.sin(points @ directions)

    outcome, _ = run(name, rugged, np.full(4, 0.5), budget=budget)
    assert outcome.links[0].ending == "stalled" or budget - 4 <= outcome.nfev <= budget


@every_optimizer
def test_result_is_never_worse_than_the_start(name):
    start = np.array([0.61, 0.58])
    outcome, _ = run(name, quadratic(start), start, budget=60)
    assert outcome.cost <= 1e-8


@every_optimizer
def test_same_seed_gives_the_same_bytes_and_global_random_state_is_untouched(name):
    np.random.seed(1)  # noqa: NPY002
    state = np.random.get_state()[1].copy()
    first = np.vstack(run(name, rosenbrock, [0.2, 0.7], budget=700, seed=5)[1])
    assert np.array_equal(np.random.get_state()[1], state)
    np.random.seed(2)  # noqa: NPY002
    second = np.vstack(run(name, rosenbrock, [0.2, 0.7], budget=700, seed=5)[1])
    assert first.tobytes() == second.tobytes()


@every_optimizer
def test_another_seed_searches_elsewhere(name):
    first = np.vstack(run(name, rosenbrock, [0.2, 0.7], budget=100, seed=5)[1])
    second = np.vstack(run(name, rosenbrock, [0.2, 0.7], budget=100, seed=6)[1])
    assert np.array_equal(first, second) != (KINDS[name] == "global")


@every_optimizer
def test_progress_is_told_after_every_batch(name):
    told = []
    outcome, batches = run(
        name, rosenbrock, [0.2, 0.7], budget=500, on_progress=lambda evaluations, cost: told.append((evaluations, cost))
    )
    assert len(told) == len(batches)
    assert [e for e, _ in told] == list(np.cumsum([len(b) for b in batches]))
    assert told[-1] == (outcome.nfev, outcome.cost)


@every_optimizer
def test_best_so_far_falls_monotonously_and_belongs_to_the_point(name):
    outcome, _ = run(name, rosenbrock, [0.2, 0.7], budget=1500)
    costs = [cost for _, cost in outcome.links[0].history]
    assert all(b <= a for a, b in zip(costs, costs[1:], strict=False))
    assert outcome.cost == np.sqrt(np.mean(rosenbrock(outcome.point[None, :]) ** 2))


@every_search
@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_simulations_that_diverge_in_a_part_of_the_cube_cost_only_themselves(name, bad):
    def residuals(points):
        values = quadratic(np.array([0.3, 0.4]))(points)
        values[points[:, 0] > 0.62] = bad
        return values

    outcome, _ = run(name, residuals, [0.6, 0.6], budget=4000)
    assert outcome.cost < 1e-2
    if KINDS[name] == "global":
        assert outcome.nonfinite > 0
        assert outcome.first_nonfinite[0] > 0.62


@every_optimizer
@pytest.mark.parametrize("dimension", [1, 3])
def test_all_simulations_diverging_is_reported_not_raised(name, dimension):
    outcome, _ = run(name, lambda p: np.full((len(p), 4), np.nan), np.full(dimension, 0.5), budget=500)
    assert outcome.cost == np.inf
    assert outcome.nonfinite == outcome.nfev > 0
    assert outcome.first_nonfinite.shape == (dimension,)
    assert not any(d.settled for d in outcome.descents)


@every_optimizer
def test_flat_objective_ends_quietly(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        outcome, _ = run(name, lambda p: np.ones((len(p), 5)), np.full(3, 0.5), budget=1000)
    assert outcome.cost == 1.0
    assert np.isfinite(outcome.point).all()


@every_search
@pytest.mark.parametrize(("dimension", "share"), [(1, 1e-4), (20, 0.1)])
def test_quadratic_is_minimised_in_one_and_twenty_dimensions(name, dimension, share):
    target = np.linspace(0.3, 0.6, dimension)
    start = np.full(dimension, 0.9)
    residuals = quadratic(target)
    first = np.sqrt(np.mean(residuals(start[None, :]) ** 2))
    outcome, _ = run(name, residuals, start, budget=16000)
    assert outcome.cost < share * first
    if dimension == 1:
        assert outcome.point == pytest.approx(target, abs=1e-3)


@every_search
def test_curved_valley_is_followed_to_its_end(name):
    outcome, _ = run(name, rosenbrock, [0.2, 0.75], budget=16000)
    assert outcome.cost < 0.05
    assert outcome.point == pytest.approx([0.75, 0.75], abs=0.01)


@every_search
def test_minimum_on_the_boundary_is_reached(name):
    outcome, _ = run(name, quadratic(np.array([1.4, 0.4, -0.5])), [0.5, 0.5, 0.5], budget=16000)
    assert outcome.point == pytest.approx([1.0, 0.4, 0.0], abs=5e-3)
>>>>>>> wt-search
