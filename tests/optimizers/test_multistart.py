import numpy as np
import pytest

from mrfit.kernels.ending import AGREEING
from mrfit.optimizers import multistart
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import chain
from mrfit.search.limits import Limits
from tests.optimizers.curve_fits import CERTIFIED, ZERO_MINIMUM

every_certified = pytest.mark.parametrize("problem", CERTIFIED, ids=lambda p: p.name)
every_zero = pytest.mark.parametrize("problem", ZERO_MINIMUM, ids=lambda p: p.name)


def run(residuals, start, seed=0, budget=None, **more):
    batches = []

    def recorded(points):
        batches.append(points.copy())
        return residuals(points)

    outcome = chain.run(
        "multistart", Objective(recorded, start, 0, **more), np.random.default_rng(seed), Limits(budget)
    )
    return outcome, batches


@every_certified
def test_certified_values_are_consistent_with_their_data(problem):
    squares = np.sum(problem.function(problem.certified[None, :]) ** 2)
    assert squares == pytest.approx(problem.squares, rel=1e-8)


@every_certified
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_certified_minimum_is_found(problem, seed):
    outcome, _ = run(problem.residuals, problem.to_cube(problem.start), seed)
    assert outcome.cost == pytest.approx(problem.cost(), rel=1e-6)
    found = problem.low + (problem.high - problem.low) * outcome.point
    assert found == pytest.approx(problem.certified, rel=0.02)


@every_zero
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_zero_minimum_is_found(problem, seed):
    start = problem.to_cube(problem.start)
    first = np.sqrt(np.mean(problem.residuals(start[None, :]) ** 2))
    outcome, _ = run(problem.residuals, start, seed)
    assert outcome.cost < 1e-8 * first


def test_frequency_is_found_among_local_minima():
    t = np.linspace(0.0, 3.0, 200)
    noise = 0.1 * np.random.default_rng(0).standard_normal(200)
    signal = 1.3 * np.sin(9.0 * t + 1.0) + noise

    def residuals(points):
        amplitude, frequency, phase = (points * [5.0, 30.0, 6.4] - [0.0, 0.0, 3.2]).T[:, :, None]
        return amplitude * np.sin(frequency * t + phase) - signal

    outcome, _ = run(residuals, np.array([0.2, 0.1, 0.5]))
    assert outcome.cost <= np.sqrt(np.mean(noise**2))
    assert 30.0 * outcome.point[1] == pytest.approx(9.0, abs=0.1)
    assert outcome.descents[-1].cost > 2.0 * outcome.cost


def test_all_jacobians_of_an_iteration_are_one_batch():
    problem = ZERO_MINIMUM[0]
    _, batches = run(problem.residuals, problem.to_cube(problem.start))
    starts, per_point = multistart.FIRST_WAVE, 3
    assert len(batches[1]) == starts * per_point
    assert all(len(batch) % per_point == 0 for batch in batches[1:])


def test_agreement_of_several_starts_ends_the_search_and_is_told():
    problem = CERTIFIED[1]
    outcome, _ = run(problem.residuals, problem.to_cube(problem.start))
    assert outcome.success
    assert outcome.agreeing >= AGREEING
    assert outcome.links[0].reason == f"{outcome.agreeing} of {len(outcome.descents)} starts agree"
    costs = [d.cost for d in outcome.descents]
    assert costs == sorted(costs)
    assert costs[0] == pytest.approx(outcome.cost, rel=1e-3)
    assert sum(d.settled for d in outcome.descents) >= outcome.agreeing


def test_starts_that_end_in_different_minima_do_not_agree():
    def residuals(points):
        centre = np.round(points * 40.0) / 40.0
        depth = np.sin(1000.0 * centre)
        return np.hstack([points - centre, 2.0 + depth])

    outcome, _ = run(residuals, np.array([0.5, 0.5, 0.5, 0.5]), budget=600)
    assert outcome.agreeing < AGREEING
    assert not outcome.success


def test_a_search_in_which_many_starts_bring_nothing_better_ends_and_says_so():
    def residuals(points):
        centre = np.round(points * 40.0) / 40.0
        return np.hstack([points - centre, 2.0 + np.sin(1000.0 * centre)])

    outcome, _ = run(residuals, np.full(6, 0.5))
    link = outcome.links[0]
    assert link.ending == "stalled" and link.reason.startswith("none of the last")
    assert outcome.agreeing < AGREEING and link.evaluations < link.allowed
    assert len(outcome.descents) > multistart.IDLE


def test_descents_that_go_nowhere_are_given_up_for_the_sake_of_others():
    def residuals(points):
        x = points[:, :1]
        # a plain bowl, and from 0.6 on a slope that leads down ever so slowly
        return np.where(x < 0.6, 10.0 * (x - 0.3) + 0.01, 50.0 - 1e-2 * x) * np.ones((1, 3))

    problem = Objective(residuals, np.array([0.95]), budget=10**6)
    outcome = chain.run("multistart", problem, np.random.default_rng(0))
    assert outcome.point == pytest.approx([0.299], abs=1e-3)
    assert outcome.success and outcome.nfev < 400


def test_given_starts_are_descended_from():
    def residuals(points):
        near = np.exp(-((points - 0.9137) ** 2).sum(axis=1, keepdims=True) / 2e-4)
        return np.hstack([1.0 + 0.1 * points, 3.0 - 3.0 * near])

    start, hint = np.full(3, 0.5), np.full((1, 3), 0.92)
    without, _ = run(residuals, start, budget=1500)
    outcome, batches = run(residuals, start, budget=1500, starts=hint)
    assert batches[0][:2].tolist() == [start.tolist(), hint[0].tolist()]
    assert outcome.cost < 0.7 * without.cost


@pytest.mark.parametrize("seed", range(5))
def test_undetermined_parameters_stay_where_they_started(seed):
    t = np.linspace(0.0, 1.0, 50)
    noise = 0.01 * np.random.default_rng(1).standard_normal(50)

    def residuals(points):
        rate, level = points[:, :1] + points[:, 1:2], points[:, 2:]
        return np.exp(-3.0 * rate * t) + level - np.exp(-3.0 * 0.8 * t) - 0.4 - noise

    start = np.array([0.55, 0.35, 0.5])
    outcome, batches = run(residuals, start, seed)
    assert outcome.cost <= np.sqrt(np.mean(noise**2))
    differences = {round(float(p[0] - p[1]), 4) for p in batches[1][::4]}
    inside = [d.point for d in outcome.descents if 0.0 < d.point[:2].min() and d.point[:2].max() < 1.0]
    assert inside
    for point in inside:
        assert min(abs(point[0] - point[1] - d) for d in differences) < 1e-3


def test_minimum_at_a_bound_settles_there():
    def residuals(points):
        x, y = points.T
        return np.stack([x + y - 2.5, x - y - 0.4, 0.1 * y], axis=1)

    outcome, _ = run(residuals, np.array([0.3, 0.3]))
    # on the edge x = 1 the squares (y - 1.5)² + (0.6 - y)² + 0.01 y² are least at y = 2.1 / 2.01, beyond the corner
    assert outcome.point == pytest.approx([1.0, 1.0], abs=1e-9)
    assert outcome.success


def test_curved_residuals_at_a_bound_are_minimised_along_it():
    def residuals(points):
        x, y = points.T
        return np.stack([x - 1.6, np.exp(y) - 1.5 * x, 0.3 + 0.0 * x], axis=1)

    outcome, _ = run(residuals, np.array([0.2, 0.9]))
    assert outcome.point == pytest.approx([1.0, np.log(1.5)], abs=1e-5)


def test_descents_are_recorded_even_if_the_budget_ends_first():
    problem = CERTIFIED[4]
    outcome, _ = run(problem.residuals, problem.to_cube(problem.start), budget=200)
    assert outcome.links[0].ending == "budget"
    assert len(outcome.descents) == multistart.FIRST_WAVE
    assert outcome.agreeing == 0
