"""One damped step: Levenberg and Marquardt's inside the cube, downhill at its bounds."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.kernels import descent
from mrfit.kernels.descent import FIRST_RAISE, LONGEST_STEP, keep_better
from mrfit.optimizers.cost.objective import NormalEquations


def damped_steps(points: Array, gradients: Array, curvatures: Array, dampings: Array) -> tuple[Array, Array, Array]:
    """Return steps of descents of which none failed before."""
    count = len(points)
    model = NormalEquations(np.ones(count), gradients, curvatures)
    return descent.damped_steps(points, model, dampings, np.full(count, LONGEST_STEP), np.arange(count), False)


def problem(seed: int, size: int = 3) -> tuple[Array, Array]:
    rng = np.random.default_rng(seed)
    jacobian, residuals = rng.standard_normal((20, size)), 0.02 * rng.standard_normal(20)
    return (jacobian.T @ residuals)[None], (jacobian.T @ jacobian)[None]


@pytest.mark.parametrize("damping", [1e-12, 1e-2, 10.0])
def test_inside_the_cube_the_step_is_marquardts(damping: float) -> None:
    gradient, curvature = problem(0)
    trials, predicted, attainable = damped_steps(np.full((1, 3), 0.5), gradient, curvature, np.array([damping]))
    scaled = curvature[0] + damping * np.diag(np.diag(curvature[0]))
    step = -np.linalg.solve(scaled, gradient[0])
    assert trials[0] - 0.5 == pytest.approx(step)
    assert predicted[0] == pytest.approx(-2.0 * gradient[0] @ step - step @ curvature[0] @ step)
    assert attainable[0] == pytest.approx(gradient[0] @ np.linalg.solve(curvature[0], gradient[0]))


def test_no_step_goes_along_a_direction_without_slope() -> None:
    gradient, curvature = np.array([[0.01, 0.01]]), np.ones((1, 2, 2))
    trials, _, _ = damped_steps(np.array([[0.3, 0.6]]), gradient, curvature, np.array([1e-9]))
    moved = trials[0] - [0.3, 0.6]
    assert moved[0] == pytest.approx(moved[1]) and moved[0] < 0.0


@pytest.mark.parametrize("seed", range(40))
def test_a_step_at_the_bounds_stays_inside_and_promises_a_fall(seed: int) -> None:
    gradient, curvature = problem(seed)
    point = np.random.default_rng(seed).choice([0.0, 0.01, 0.5, 1.0], (1, 3))
    trials, predicted, attainable = damped_steps(point, 30.0 * gradient, curvature, np.array([1e-3]))
    assert trials.min() >= 0.0 and trials.max() <= 1.0
    assert np.abs(trials - point).max() <= LONGEST_STEP + 1e-15
    assert predicted[0] > 0.0 or not attainable[0]


def test_a_step_across_a_bound_ends_on_it_with_the_others_at_their_best() -> None:
    curvature = np.array([[[1.0, 0.9], [0.9, 1.0]]])
    # the minimum of the model is at (-0.04, 0.46), that inside the cube at (0, 0.424)
    point, gradient = np.array([[0.01, 0.4]]), -curvature[0] @ np.array([-0.05, 0.06])
    trials, predicted, _ = damped_steps(point, gradient[None], curvature, np.array([1e-12]))
    assert trials[0] == pytest.approx([0.0, 0.424], abs=1e-6)
    step = trials[0] - point[0]
    assert predicted[0] == pytest.approx(-2.0 * gradient @ step - step @ curvature[0] @ step)


@pytest.mark.parametrize("damping", [1e-9, 1e-2])
def test_a_step_that_follows_a_failed_one_is_shorter_whatever_the_damping_was(damping: float) -> None:
    gradient, curvature = problem(3)
    dampings, reaches = np.array([damping]), np.array([LONGEST_STEP])
    point = np.full((1, 3), 0.5)
    model, one = NormalEquations(np.array([1.0]), gradient, curvature), np.array([0])
    first, promised, _ = descent.damped_steps(point, model, dampings, reaches, one, False)
    failed = NormalEquations(np.array([2.0]), gradient, curvature)
    descents = point, dampings, np.full(1, FIRST_RAISE), reaches, np.zeros(1, dtype=bool)
    keep_better(descents, model, one, (first, promised), failed)
    second, promised, _ = descent.damped_steps(point, model, dampings, reaches, one, False)
    assert np.abs(second - point).max() <= 0.5 * np.abs(first - point).max() + 1e-12
    # the damping that made it so is kept: what follows a step that succeeds is Marquardt's again
    scaled = curvature[0] + dampings[0] * np.diag(np.diag(curvature[0]))
    assert second[0] - 0.5 == pytest.approx(-np.linalg.solve(scaled, gradient[0]))


def test_descents_that_have_ended_take_no_step() -> None:
    gradient, curvature = (np.repeat(part, 3, axis=0) for part in problem(1))
    points, model = np.full((3, 3), 0.5), NormalEquations(np.ones(3), gradient, curvature)
    parts = np.full(3, 1e-2), np.full(3, LONGEST_STEP)
    trials, predicted, attainable = descent.damped_steps(points, model, *parts, np.array([1]), False)
    assert (trials[[0, 2]] == 0.5).all() and (trials[1] != 0.5).all()
    assert predicted[[0, 2]].tolist() == attainable[[0, 2]].tolist() == [0.0, 0.0]


def test_a_point_whose_model_is_not_finite_stays() -> None:
    gradient, curvature = problem(0)
    curvature[0, 1, 1] = np.inf
    trials, predicted, attainable = damped_steps(np.full((1, 3), 0.5), gradient, curvature, np.array([1e-2]))
    assert trials.tolist() == [[0.5, 0.5, 0.5]] and predicted[0] == 0.0 and attainable[0] == np.inf


@pytest.mark.parametrize("seed", range(20))
def test_a_step_that_is_far_too_long_gives_way_to_one_that_promises_most_of_what_can_be_had(seed: int) -> None:
    rng = np.random.default_rng(seed)
    # one direction that the data hardly determine, oblique to the axes, and a slope along it
    across = rng.standard_normal((3, 3))
    curvature = across.T @ np.diag([1.0, 0.3, 1e-7]) @ across
    gradient = 0.3 * curvature @ rng.standard_normal(3) + 1e-3 * rng.standard_normal(3)
    point = rng.uniform(0.25, 0.75, 3)
    trials, predicted, _ = damped_steps(point[None], gradient[None], curvature[None], np.array([1e-9]))
    around = point + rng.uniform(-LONGEST_STEP, LONGEST_STEP, (20_000, 3))
    falls = -2.0 * (around - point) @ gradient - np.einsum("pi,ij,pj->p", around - point, curvature, around - point)
    assert np.abs(trials[0] - point).max() <= LONGEST_STEP + 1e-12
    assert predicted[0] >= 0.05 * falls.max()


def test_steps_that_lower_the_cost_are_taken_and_the_others_damp_more() -> None:
    points, dampings, raises = np.full((3, 2), 0.5), np.full(3, 1e-2), np.full(3, FIRST_RAISE)
    stuck, reaches = np.zeros(3, dtype=bool), np.full(3, LONGEST_STEP)
    model = NormalEquations(np.array([2.0, 2.0, 2.0]), np.zeros((3, 2)), np.zeros((3, 2, 2)))
    gained = NormalEquations(np.array([1.0, 3.0]), np.ones((2, 2)), np.ones((2, 2, 2)))
    trials = points + np.array([[0.1, 0.0], [0.0, 0.1], [0.05, 0.05]])
    active = np.array([0, 2])
    for _ in range(2):
        descents, promised = (points, dampings, raises, reaches, stuck), np.array([3.0, 1.0, 1.0])
        keep_better(descents, model, active, (trials, promised), gained)
        gained[0][0] = 1.0
    assert points.tolist() == [[0.6, 0.5], [0.5, 0.5], [0.5, 0.5]]
    assert model[0].tolist() == [1.0, 2.0, 2.0] and model[1][0].tolist() == [1.0, 1.0]
    # the first brought all that was promised, and then, with nothing left to gain, failed at no length
    assert dampings == pytest.approx([2e-2 / 3, 1e-2, 8e-2])
    assert raises.tolist() == [4.0, 2.0, 8.0]
    assert stuck.tolist() == [True, False, False]


@pytest.mark.parametrize(("share", "factor"), [(0.0, 2.0), (0.25, 1.125), (0.5, 1.0), (0.75, 0.875), (3.0, 1 / 3)])
def test_the_damping_follows_the_share_of_its_promise_that_a_step_keeps(share: float, factor: float) -> None:
    points, dampings, raises = np.full((1, 2), 0.5), np.ones(1), np.full(1, 64.0)
    model = NormalEquations(np.array([2.0]), np.zeros((1, 2)), np.zeros((1, 2, 2)))
    gained = NormalEquations(np.array([1.0]), np.ones((1, 2)), np.ones((1, 2, 2)))
    promised = np.array([3.0 / share if share else 1e9])
    descents = points, dampings, raises, np.full(1, LONGEST_STEP), np.zeros(1, dtype=bool)
    keep_better(descents, model, np.array([0]), (points + 0.1, promised), gained)
    assert dampings == pytest.approx([factor], rel=1e-6)
    assert raises.tolist() == [FIRST_RAISE]


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("damping", [1e-9, 1e-2])
def test_steps_by_factors_are_those_by_eigenvectors(seed: int, damping: float) -> None:
    gradient, curvature = problem(seed, 8)
    rng, count = np.random.default_rng(seed), 1
    point = rng.choice([0.0, 0.01, 0.5, 1.0], (1, 8))
    model, parts = (
        NormalEquations(np.ones(count), 30.0 * gradient, curvature),
        (np.full(count, LONGEST_STEP), np.arange(count), False),
    )
    for reach in (LONGEST_STEP, 1e-3):
        parts = np.full(count, reach), np.arange(count)
        noisy = descent.damped_steps(point, model, np.full(count, damping), *parts, False)
        exact = descent.damped_steps(point, model, np.full(count, damping), *parts, True)
        for one, other in zip(noisy, exact, strict=True):
            assert one == pytest.approx(other, rel=1e-6, abs=1e-12)


def test_exact_derivatives_lead_along_a_direction_that_differences_would_lose() -> None:
    # along the last axis the cost hardly curves, but it falls: in noise of differences there is nothing to be seen
    curvature = np.array([[1.0, 1.0 - 1e-10], [1.0 - 1e-10, 1.0]])
    gradient = -curvature @ np.array([0.05, -0.04])
    model, point = NormalEquations(np.ones(1), gradient[None], curvature[None]), np.full((1, 2), 0.5)
    parts = np.full(1, 1e-14), np.full(1, LONGEST_STEP), np.arange(1)
    exact, _, _ = descent.damped_steps(point, model, *parts, True)
    lost, _, _ = descent.damped_steps(point, model, *parts, False)
    assert exact[0] == pytest.approx([0.55, 0.46], abs=1e-4)
    assert lost[0] == pytest.approx([0.505, 0.505], abs=1e-4)


def test_a_fan_of_steps_is_one_at_every_damping() -> None:
    gradient, curvature = (np.repeat(part, 3, axis=0) for part in problem(4, 5))
    points, model = np.full((3, 5), 0.5), NormalEquations(np.ones(3), gradient, curvature)
    dampings, active = np.array([[1e-3, 0.1, 10.0], [1e-6, 1.0, 1e4]]), np.array([2, 0])
    trials, promised = descent.fanned_steps(points, model, dampings, active)
    for a in range(2):
        for d in range(3):
            parts = np.full(3, dampings[a, d]), np.full(3, LONGEST_STEP), np.array([active[a]])
            step, fall, _ = descent.damped_steps(points, model, *parts, True)
            assert trials[a, d] == pytest.approx(step[active[a]]) and promised[a, d] == pytest.approx(fall[active[a]])
    # the greater the damping, the shorter the step
    assert np.all(np.diff(np.linalg.norm(trials - 0.5, axis=2)) < 0.0)


@pytest.mark.parametrize("short", [1e-15, 1e-9, 1e-6])
def test_a_model_that_rounding_left_short_of_semidefinite_gives_a_step(short: float) -> None:
    curvature = np.array([[1.0, 1.0 + short], [1.0 + short, 1.0]])
    model, point = NormalEquations(np.ones(1), np.array([[0.02, -0.01]]), curvature[None]), np.full((1, 2), 0.5)
    parts = np.full(1, 1e-12), np.full(1, LONGEST_STEP), np.arange(1)
    trials, promised, attainable = descent.damped_steps(point, model, *parts, True)
    assert np.isfinite([*trials[0], promised[0], attainable[0]]).all() and promised[0] > 0.0
    assert trials.min() >= 0.0 and trials.max() <= 1.0
