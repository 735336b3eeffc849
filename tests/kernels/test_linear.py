"""Bounded weights against scipy's bounded least squares; elimination against the Schur complement."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from mrfit.core.specs import Array
from mrfit.kernels.linear import bounded_weights, eliminate


def weights_of(matrix: Array, target: Array, low: Array, high: Array) -> tuple[Array, Array]:
    weights, free = bounded_weights((matrix.T @ matrix)[None], (-matrix.T @ target)[None], low, high)
    return weights[0], free[0]


@pytest.mark.parametrize("size", [1, 2, 5, 12, 26])
@pytest.mark.parametrize("room", [0.1, 1.0, 1e6])
def test_the_least_square_within_the_bounds_is_found(size: int, room: float) -> None:
    rng = np.random.default_rng(size)
    for _ in range(20):
        matrix = rng.standard_normal((40, size)) * np.exp(3.0 * rng.standard_normal(size))
        target = 10.0 * rng.standard_normal(40)
        low, high = -room * rng.random(size), room * rng.random(size)
        found, free = weights_of(matrix, target, low, high)
        assert np.all((found >= low) & (found <= high))
        assert np.all(free | (found == low) | (found == high))
        best = lsq_linear(matrix, target, (low, high), method="bvls", tol=1e-13)
        assert np.sum((matrix @ found - target) ** 2) <= 2.0 * best.cost * (1 + 1e-9)


def test_weights_that_nothing_determines_stay_at_zero() -> None:
    matrix = np.random.default_rng(0).standard_normal((30, 3))
    matrix[:, 1] = 2.0 * matrix[:, 0]
    target = matrix @ np.array([1.0, 0.0, 3.0])
    found, _ = weights_of(matrix, target, np.full(3, -9.0), np.full(3, 9.0))
    assert found == pytest.approx([1.0, 0.0, 3.0])
    silent, _ = weights_of(0.0 * matrix, target, np.full(3, -9.0), np.full(3, 9.0))
    assert not silent.any()


def test_zero_outside_the_bounds_is_moved_to_the_nearest() -> None:
    found, _ = weights_of(np.zeros((5, 2)), np.ones(5), np.array([1.0, -3.0]), np.array([2.0, -2.0]))
    assert found.tolist() == [1.0, -2.0]


def test_what_is_not_finite_harms_its_own_row_only() -> None:
    gram, slope = np.repeat(np.eye(2)[None], 2, axis=0), np.array([[np.nan, 1.0], [-1.0, -2.0]])
    found, _ = bounded_weights(gram, slope, np.full(2, -5.0), np.full(2, 5.0))
    assert found.tolist() == [[0.0, 0.0], [1.0, 2.0]]


def test_elimination_leaves_the_schur_complement() -> None:
    rows = np.random.default_rng(1).standard_normal((4, 5, 60))
    whole = rows @ rows.transpose(0, 2, 1)
    gone, kept = np.array([1, 3]), np.array([0, 2, 4])
    expected = [
        g[np.ix_(kept, kept)] - g[np.ix_(kept, gone)] @ np.linalg.solve(g[np.ix_(gone, gone)], g[np.ix_(gone, kept)])
        for g in whole
    ]
    eliminate(whole, np.isin(np.arange(5), gone) & np.ones((4, 1), dtype=bool))
    assert whole[:, kept][:, :, kept] == pytest.approx(np.array(expected))


def test_rows_that_the_eliminated_ones_explain_become_zero() -> None:
    rows = np.random.default_rng(1).standard_normal((1, 3, 60))
    rows[0, 2] = 4.0 * rows[0, 0] + 1e-7 * rows[0, 2]
    whole = rows @ rows.transpose(0, 2, 1)
    eliminate(whole, np.array([[True, False, False]]))
    assert not whole[0, 2].any() and not whole[0, :, 2].any()
    assert whole[0, 1, 1] > 0.0
