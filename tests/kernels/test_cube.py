"""Points of the cube as parameters, and their neighbours."""

import numpy as np
import pytest

from mrfit.kernels.cube import spread_out, stencils


def test_free_parameters_go_to_their_columns_and_stay_within_their_bounds() -> None:
    ranges = np.array([[0.0, np.log(10.0)], [2.0, np.log(1000.0)], [0.0, 10.0], [2.0, 1000.0]])
    points = np.array([[0.5, 0.5], [0.0, 1.0], [1.5, -1.0]])
    held = np.array([7.0, 8.0, 9.0])
    theta = spread_out(points, np.array([2, 0]), held, ranges, np.array([False, True]))
    assert theta == pytest.approx(np.array([[100.0, 8.0, 1.0], [1000.0, 8.0, 0.0], [10.0, 8.0, 2.0]]))
    assert theta[1, 0] <= 1000.0


def test_neighbours_differ_in_one_coordinate_and_lie_in_the_cube() -> None:
    points = np.array([[0.0, 1.0, 0.4], [-0.1, 0.9, 1.2]])
    around, steps = stencils(points, 1e-3)
    assert around[:, 0].tolist() == [[0.0, 1.0, 0.4], [0.0, 0.9, 1.0]]
    assert steps.tolist() == [[1e-3, -1e-3, 1e-3], [1e-3, -1e-3, -1e-3]]
    for k in range(3):
        moved = around[:, 1 + k] - around[:, 0]
        assert moved[:, k] == pytest.approx(steps[:, k])
        assert not np.delete(moved, k, axis=1).any()
    assert around.min() >= 0.0 and around.max() <= 1.0
