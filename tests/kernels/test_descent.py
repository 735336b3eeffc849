"""One damped step: Levenberg and Marquardt's inside the cube, downhill at its bounds."""

import numpy as np
import pytest

from mrfit.kernels.descent import FIRST_RAISE, damped_steps, keep_better
from mrfit.specs import Array


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
    assert np.abs(trials - point).max() <= 0.1 + 1e-15
    assert predicted[0] > 0.0 or not attainable[0]


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
    point = rng.uniform(0.15, 0.85, 3)
    trials, predicted, _ = damped_steps(point[None], gradient[None], curvature[None], np.array([1e-9]))
    around = point + rng.uniform(-0.1, 0.1, (20_000, 3))
    falls = -2.0 * (around - point) @ gradient - np.einsum("pi,ij,pj->p", around - point, curvature, around - point)
    assert np.abs(trials[0] - point).max() <= 0.1 + 1e-12
    assert predicted[0] >= 0.05 * falls.max()


def test_steps_that_lower_the_cost_are_taken_and_the_others_damp_more() -> None:
    points, dampings, raises = np.full((3, 2), 0.5), np.full(3, 1e-2), np.full(3, FIRST_RAISE)
    stuck = np.zeros(3, dtype=bool)
    model = np.array([2.0, 2.0, 2.0]), np.zeros((3, 2)), np.zeros((3, 2, 2))
    gained = np.array([1.0, 3.0]), np.ones((2, 2)), np.ones((2, 2, 2))
    trials = points + np.array([[0.1, 0.0], [0.0, 0.1], [0.05, 0.05]])
    active = np.array([0, 2])
    for _ in range(2):
        keep_better((points, dampings, raises, stuck), model, active, (trials, np.array([3.0, 1.0, 1.0])), gained)
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
    model = np.array([2.0]), np.zeros((1, 2)), np.zeros((1, 2, 2))
    gained = np.array([1.0]), np.ones((1, 2)), np.ones((1, 2, 2))
    promised = np.array([3.0 / share if share else 1e9])
    descents = points, dampings, raises, np.zeros(1, dtype=bool)
    keep_better(descents, model, np.array([0]), (points + 0.1, promised), gained)
    assert dampings == pytest.approx([factor], rel=1e-6)
    assert raises.tolist() == [FIRST_RAISE]
