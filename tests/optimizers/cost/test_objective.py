"""An objective that goes on with another problem, and one that is seen in the parameters themselves."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.optimizers.cost.objective import (
    STALL_RTOL,
    BudgetSpent,
    CubeCoordinates,
    InParameters,
    NoProgress,
    Objective,
    TimeSpent,
)


def distance(points: Array) -> Array:
    """Return residuals that are zero in a corner."""
    return points.copy()


def made(budget: int = 100, **more: object) -> Objective:
    return Objective(distance, np.array([0.5, 0.5]), budget, **more)  # type: ignore[arg-type]


def test_another_problem_begins_at_the_best_point_and_with_any_cost() -> None:
    objective = made()
    objective.costs(np.array([[0.3, 0.4]]))
    objective.restate(lambda points: 100.0 + points)
    assert objective.best_cost == np.inf and objective.best_point.tolist() == [0.3, 0.4]
    objective.costs(np.array([[0.9, 0.9], [0.6, 0.6]]))
    assert objective.best_cost == pytest.approx(100.6) and objective.best_point.tolist() == [0.6, 0.6]
    assert objective.evaluations == 3 and objective.history[-1] == (3, objective.best_cost)


def test_evaluations_are_allowed_from_here_on() -> None:
    objective = made(budget=5)
    objective.costs(np.full((4, 2), 0.5))
    assert objective.remaining == 1
    objective.allow(3)
    assert objective.remaining == 3
    with pytest.raises(BudgetSpent):
        objective.costs(np.full((4, 2), 0.5))
    assert (objective.evaluations, objective.remaining) == (7, 0)


def test_no_points_cost_nothing() -> None:
    objective = made()
    assert objective.costs(np.empty((0, 2))).shape == (0,)
    assert objective.evaluations == 0 and objective.history == [] and objective.best_cost == np.inf


@pytest.mark.parametrize(("gain", "ends"), [(0.1 * STALL_RTOL, True), (0.3 * STALL_RTOL, False)])
def test_gains_that_are_too_small_together_are_no_progress(gain: float, ends: bool) -> None:
    """Over the five evaluations without which a search ends they have to reach a millionth."""
    objective = made(budget=1000)
    objective.costs(np.array([[0.8, 0.8]]))
    objective.allow(900, patience=5)
    points = [np.full((1, 2), 0.8 * (1.0 - gain) ** k) for k in range(1, 9)]
    if ends:
        with pytest.raises(NoProgress):
            [objective.costs(p) for p in points]
    else:
        assert len([objective.costs(p) for p in points]) == 8


def test_whatever_ends_a_search_is_caught_as_an_allowance_that_is_spent() -> None:
    assert issubclass(NoProgress, BudgetSpent) and issubclass(TimeSpent, BudgetSpent)
    assert BudgetSpent().ended.reason == "" and BudgetSpent().ended.descents == ()


def test_the_first_point_that_diverged_stays_the_first() -> None:
    objective = Objective(lambda p: np.where(p > 0.5, np.nan, p), np.array([0.1, 0.1]), 100)
    for place in (0.9, 0.7):
        objective.costs(np.full((1, 2), place))
    assert objective.first_nonfinite is not None and objective.first_nonfinite.tolist() == [0.9, 0.9]
    assert objective.nonfinite == 2
    # nothing finite was met: the start is all there is
    assert objective.best_cost == np.inf and objective.best_point.tolist() == [0.1, 0.1]


def test_a_search_takes_what_it_was_given_and_not_a_view_of_it() -> None:
    start = np.array([0.2, 0.3])
    objective = Objective(distance, start, 10)
    start[:] = 0.9
    points = np.array([[0.1, 0.1]])
    objective.costs(points)
    points[:] = 0.7
    assert objective.start.tolist() == [0.2, 0.3] and objective.best_point.tolist() == [0.1, 0.1]


class _Decades:
    """Two parameters, one between 1 and 100 in decades, one between -2 and 2."""

    low, high = np.array([1.0, -2.0]), np.array([100.0, 2.0])

    def to_values(self, points: Array) -> Array:
        return np.column_stack([100.0 ** points[:, 0], 4.0 * points[:, 1] - 2.0])

    def to_points(self, values: Array) -> Array:
        return np.column_stack([np.log(values[:, 0]) / np.log(100.0), (values[:, 1] + 2.0) / 4.0])


def test_in_the_parameters_costs_and_the_best_are_those_of_the_cube() -> None:
    objective = made(budget=9, coordinates=_Decades())
    seen = InParameters(objective)
    costs = seen.costs(np.array([[10.0, 0.0], [1.0, -1.0], [1.0, 5.0]]))
    # what lies outside of the cube is held at its bound
    np.testing.assert_allclose(costs, np.sqrt([(0.25 + 0.25) / 2, 0.0625 / 2, 0.5]))
    assert seen.best_cost == objective.best_cost == pytest.approx(np.sqrt(0.0625 / 2))
    np.testing.assert_allclose(seen.best_values, [1.0, -1.0])
    assert (seen.dimension, seen.remaining) == (2, 6)
    assert seen.low.tolist() == [1.0, -2.0] and seen.high.tolist() == [100.0, 2.0]


def test_parameters_are_drawn_evenly_over_decades() -> None:
    seen = InParameters(made(coordinates=_Decades()))
    drawn = seen.anywhere(4000, np.random.default_rng(0))
    assert drawn.shape == (4000, 2)
    assert np.mean(drawn[:, 0] < 10.0) == pytest.approx(0.5, abs=0.03)
    assert np.mean(drawn[:, 1] < -1.0) == pytest.approx(0.25, abs=0.03)
    again = seen.anywhere(4000, np.random.default_rng(0))
    np.testing.assert_array_equal(drawn, again)


def test_without_parameters_the_cube_is_all_there_is() -> None:
    seen = InParameters(made())
    assert seen.low.tolist() == [0.0, 0.0] and seen.high.tolist() == [1.0, 1.0]
    points = np.array([[0.25, 0.75]])
    cube = CubeCoordinates(2)
    assert cube.to_values(points).tolist() == cube.to_points(points).tolist() == points.tolist()
    np.testing.assert_allclose(seen.costs(points), np.sqrt((0.0625 + 0.5625) / 2))
