import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.optimizers.cost import objective as module
from mrfit.optimizers.cost.objective import BudgetSpent, NoProgress, Objective, TimeSpent


def curve(points):
    """Residuals with a Jacobian known in closed form: r_m = exp(a t_m) + b² - 1."""
    return np.exp(points[:, :1] * TIMES) + points[:, 1:] ** 2 - 1.0


def curve_jacobian(point):
    return np.stack([TIMES * np.exp(point[0] * TIMES), np.full_like(TIMES, 2.0 * point[1])], axis=1)


TIMES = np.linspace(0.0, 1.0, 7)


def make(residuals=curve, start=(0.5, 0.5), budget=1000, **more):
    return Objective(residuals, np.array(start), budget, **more)


def test_costs_are_rms_of_residuals():
    points = np.array([[0.1, 0.2], [0.7, 0.9]])
    assert make().costs(points) == pytest.approx(np.sqrt(np.mean(curve(points) ** 2, axis=1)), rel=1e-14)


def test_best_point_is_kept():
    objective = make()
    objective.costs(np.array([[0.5, 0.1], [0.0, 0.0], [0.9, 0.9]]))
    assert objective.best_cost == 0.0
    assert objective.best_point.tolist() == [0.0, 0.0]


def test_points_outside_are_clipped_and_the_start_too():
    seen = []
    objective = make(lambda p: (seen.append(p.copy()), curve(p))[1], start=(-1.0, 3.0))
    objective.costs(np.array([[-0.3, 1.4]]))
    assert objective.start.tolist() == [0.0, 1.0]
    assert seen[0].tolist() == [[0.0, 1.0]]
    assert objective.best_point.tolist() == [0.0, 1.0]


def test_budget_evaluates_what_it_covers_and_then_ends():
    objective = make(budget=3)
    with pytest.raises(BudgetSpent):
        objective.costs(np.full((5, 2), 0.5))
    assert objective.evaluations == 3
    assert objective.remaining == 0
    for call in (objective.residuals, objective.jacobian):
        with pytest.raises(BudgetSpent):
            call(np.array([0.5, 0.5]))
    assert objective.evaluations == 3


@pytest.mark.parametrize("budget", [1, 2])
def test_jacobian_needs_a_budget_of_one_more_than_parameters(budget):
    objective = make(budget=budget)
    with pytest.raises(BudgetSpent):
        objective.jacobian(np.array([0.5, 0.5]))
    assert objective.evaluations == 0


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_jacobian_agrees_with_the_closed_form(a, b):
    objective = make()
    point = np.array([a, b])
    residuals, jacobian = objective.linearise(point)
    assert np.allclose(jacobian, curve_jacobian(point), atol=3e-5)
    assert np.allclose(residuals, curve(point[None, :])[0], rtol=1e-14)
    assert objective.evaluations == 3


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), min_size=1, max_size=6))
def test_normal_equations_agree_with_jacobians(points):
    points = np.array(points)
    calls = []
    objective = make(lambda p: (calls.append(len(p)), curve(p))[1])
    costs, gradients, curvatures = objective.normal_equations(points)
    assert calls == [3 * len(points)]
    for k, point in enumerate(points):
        residuals, jacobian = make().linearise(point)
        assert costs[k] == pytest.approx(np.sqrt(np.mean(residuals**2)))
        assert np.allclose(gradients[k], residuals @ jacobian / len(TIMES), rtol=1e-9, atol=1e-12)
        assert np.allclose(curvatures[k], jacobian.T @ jacobian / len(TIMES), rtol=1e-9, atol=1e-12)


def test_normal_equations_of_long_records_are_made_in_blocks(monkeypatch):
    monkeypatch.setattr(module, "BLOCK_NUMBERS", 2 * 3 * len(TIMES))
    points = np.random.default_rng(0).random((5, 2))
    calls = []
    objective = make(lambda p: (calls.append(len(p)), curve(p))[1])
    objective.costs(points[:1])
    blocked = objective.normal_equations(points)
    assert calls == [1, 6, 6, 3]
    monkeypatch.undo()
    for part, whole in zip(blocked, make().normal_equations(points), strict=True):
        assert np.array_equal(part, whole)


def test_normal_equations_of_points_beyond_the_budget_are_infinite():
    objective = make(budget=7)
    costs = objective.normal_equations(np.full((4, 2), 0.3)).costs
    assert np.isfinite(costs).tolist() == [True, True, False, False]
    assert objective.evaluations == 6
    with pytest.raises(BudgetSpent):
        objective.normal_equations(np.full((4, 2), 0.3))


def test_nonfinite_simulations_cost_infinity_and_the_first_is_kept():
    def residuals(points):
        values = curve(points)
        values[points[:, 0] > 0.5] = np.nan
        return values

    objective = make(residuals)
    costs = objective.costs(np.array([[0.2, 0.0], [0.8, 0.1], [0.9, 0.2]]))
    assert np.isfinite(costs).tolist() == [True, False, False]
    assert objective.nonfinite == 2
    assert objective.first_nonfinite.tolist() == [0.8, 0.1]
    assert objective.best_point.tolist() == [0.2, 0.0]


def test_overflowing_squares_count_as_nonfinite():
    objective = make(lambda p: np.full((len(p), 3), 1e200))
    assert objective.costs(np.array([[0.5, 0.5]])).tolist() == [np.inf]


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_parameters_whose_step_diverges_have_a_zero_column(bad):
    point = np.array([0.4, 0.3])

    def residuals(points):
        values = curve(points)
        values[points[:, 1] > 0.3 + 1e-9] = bad
        return values

    jacobian = make(residuals).jacobian(point)
    assert np.allclose(jacobian[:, 0], curve_jacobian(point)[:, 0], atol=1e-4)
    assert not jacobian[:, 1].any()
    model = make(residuals).normal_equations(point[None, :])
    assert np.isfinite(model.costs).all()
    assert model.gradients[0, 1] == 0.0
    assert model.curvatures[0, 0, 0] > 0.0
    assert not model.curvatures[0, 1].any()


def test_progress_is_told_after_every_batch():
    told = []
    objective = make(on_progress=lambda *news: told.append(news))
    objective.costs(np.array([[0.5, 0.5], [0.2, 0.2]]))
    objective.costs(np.array([[0.9, 0.9]]))
    assert [e for e, _ in told] == [2, 3]
    assert told[0][1] == told[1][1] == objective.best_cost
    assert objective.history == told


def test_deadline_lets_the_first_batch_pass_and_no_other():
    objective = make()
    objective.allow(1000, deadline=time.monotonic() - 1.0)
    objective.costs(np.array([[0.5, 0.5]]))
    with pytest.raises(TimeSpent):
        objective.costs(np.array([[0.4, 0.4]]))
    assert objective.evaluations == 1


def test_patience_ends_a_search_without_progress():
    objective = make()
    objective.allow(1000, patience=10)
    objective.costs(np.array([[0.5, 0.5]]))
    with pytest.raises(NoProgress):
        for _ in range(100):
            objective.costs(np.array([[0.6, 0.6]]))
    assert 10 <= objective.evaluations <= 13


def test_patience_starts_anew_with_every_gain():
    objective = make()
    objective.allow(1000, patience=5)
    for step in range(60):
        objective.costs(np.array([[0.9, 0.9 - 0.01 * step]]))
    assert objective.evaluations == 60


def test_patience_begins_anew_with_every_allowance():
    objective = make()
    objective.allow(1000, patience=5)
    for _ in range(20):
        objective.allow(1000, patience=5)
        objective.costs(np.array([[0.6, 0.6]]))
    assert objective.evaluations == 20
