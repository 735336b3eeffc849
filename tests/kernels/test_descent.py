"""One damped step: Levenberg and Marquardt's inside the cube, downhill at its bounds."""

import numpy as np
import pytest

from mrfit.kernels.descent import damped_steps
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
