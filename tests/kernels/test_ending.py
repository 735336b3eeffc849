"""Which descents go on, and when enough of them agree."""

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.kernels.ending import AGREEING, MANY, decided, enough, going_on

NONE = np.empty(0)


def ends(count: int) -> tuple[Array, Array, Array]:
    """Return that no descent has ended."""
    settled, stuck, given_up = np.zeros((3, count), dtype=bool)
    return settled, stuck, given_up


def test_a_descent_settles_where_next_to_nothing_is_to_be_had_or_promised() -> None:
    marks, squares = ends(4), np.array([4.0, 4.0, 4.0, 4.0])
    predicted, attainable = np.array([0.1, 0.003, 1e-10, 0.1]), np.array([0.5, 0.003, 0.5, 0.5])
    marks[1][3] = True
    active = going_on(marks, np.full(4, 2.0), squares, (predicted, attainable), 1.0, 1e-3)
    assert active.tolist() == [0]
    assert marks[0].tolist() == [False, True, True, False] and not marks[2].any()


@pytest.mark.parametrize(("raised", "attainable", "given_up"), [(8.0, 0.5, True), (4.0, 0.5, False), (8.0, 1.6, False)])
def test_a_descent_that_fails_again_and_again_is_given_up_where_it_does_not_promise_the_least_cost(
    raised: float, attainable: float, given_up: bool
) -> None:
    marks, raises = ends(2), np.array([2.0, raised])
    hoped = np.array([1.0, 0.1]), np.array([1.0, attainable])
    active = going_on(marks, raises, np.array([1.0, 4.0]), hoped, 1.0, 1e-3)
    assert marks[2].tolist() == [False, given_up] and active.tolist() == ([0] if given_up else [0, 1])


def test_one_alone_is_not_given_up() -> None:
    marks = ends(1)
    assert going_on(marks, np.full(1, 64.0), np.array([4.0]), (np.ones(1), np.full(1, 0.1)), 1.0, 1e-3).tolist() == [0]


def test_of_many_descents_fewer_have_to_agree() -> None:
    assert enough(MANY - 1) == AGREEING == enough(5) and enough(MANY) == AGREEING - 1


def test_the_search_is_decided_where_enough_are_at_the_least_cost_and_one_of_them_settled() -> None:
    marks, costs, little = ends(5), np.array([1.0, 1.001, 1.0015, 3.0, 5.0]), np.full(5, 1e-6)
    assert not decided(marks, costs, little, 1.0, (0, NONE))
    marks[0][1] = True
    assert decided(marks, costs, little, 1.0, (0, NONE))
    assert not decided(marks, np.array([1.0, 1.001, 1.01, 3.0, 5.0]), little, 1.0, (0, NONE))
    # those that settled before count, those that ended elsewhere do not
    alone = np.array([1.0, 2.0, 2.0, 3.0, 5.0])
    assert decided(marks, alone, little, 1.0, (5, np.array([1.0005, 1.001, 1.7])))
    assert not decided(marks, alone, little, 1.0, (5, np.array([1.0005, 1.7])))


def test_a_rival_that_promises_less_is_waited_for() -> None:
    marks, costs = ends(4), np.array([1.0, 1.0, 1.0, 1.05])
    marks[0][0] = True
    promises = np.array([0.0, 0.0, 0.0, 0.2])
    assert not decided(marks, costs, promises, 1.0, (0, NONE))
    assert decided(marks, np.array([1.0, 1.0, 1.0, 1.2]), promises, 1.0, (0, NONE))
    marks[2][3] = True
    assert decided(marks, costs, promises, 1.0, (0, NONE))
