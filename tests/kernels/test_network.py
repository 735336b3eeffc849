"""The network's derivatives in one pass, against numpy's layers and complex steps."""

import numpy as np
import pytest

from mrfit.kernels.network import network

EVERY = np.arange(31)


def drive(samples: int) -> np.ndarray:
    t = 1e-3 * np.arange(samples)
    return np.stack([0.2 * np.sin(20 * t) + 0.05 * np.sin(71 * t), 1 + 0.5 * np.cos(33 * t)])


def vectors(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).normal(size=(count, 31)) * np.repeat([2.0, 1.0, 500.0], [12, 15, 4])


def output(u: np.ndarray, ago: int, theta: np.ndarray) -> np.ndarray:
    """Return F of one vector, which may be complex, with a whole number of samples of delay."""
    late = u[:, np.maximum(np.arange(u.shape[1]) - ago, 0)]
    h1 = np.tanh(theta[:12].reshape(3, 4) @ np.vstack([u, late]) + theta[12:15, None])
    h2 = np.tanh(theta[15:24].reshape(3, 3) @ h1 + theta[24:27, None])
    return theta[27:30] @ h2 + theta[30]


def slopes(u: np.ndarray, ago: int, theta: np.ndarray) -> np.ndarray:
    """Return dF/dtheta, (31, N), by complex steps, exact to the last digits."""
    return np.array([output(u, ago, theta + 1e-30j * np.eye(31)[k]).imag / 1e-30 for k in EVERY])


# samples within one chunk, in two, in many with a rest, and one
@pytest.mark.parametrize("samples", [1, 100, 129, 1000])
@pytest.mark.parametrize("seed", range(3))
def test_rows_are_the_output_and_its_exact_derivatives(samples: int, seed: int) -> None:
    u, theta = drive(samples), vectors(3, seed)
    out = network(u, np.array([4.0]), theta, EVERY)
    for p in range(3):
        size = np.abs(theta[p, 27:]).sum()
        np.testing.assert_allclose(out[p, 0], output(u, 4, theta[p]), rtol=0, atol=1e-11 * size)
        np.testing.assert_allclose(out[p, 1:], slopes(u, 4, theta[p]), rtol=0, atol=1e-11 * size)


def test_any_columns_in_any_order_are_rows_of_all_columns() -> None:
    u, theta = drive(300), vectors(2, 7)
    whole = network(u, np.array([2.5]), theta, EVERY)
    rng = np.random.default_rng(8)
    subsets = [rng.permutation(31)[: rng.integers(1, 31)] for _ in range(20)]
    for columns in [*subsets, *EVERY[:, None], np.array([29, 30, 27, 28]), np.array([5, 5]), EVERY[:0]]:
        out = network(u, np.array([2.5]), theta, columns)
        np.testing.assert_array_equal(out, whole[:, np.r_[0, 1 + columns]])


def test_a_vector_stands_alone() -> None:
    u, theta = drive(200), vectors(5, 9)
    together = network(u, np.array([4.0]), theta, EVERY)
    for p in range(5):
        alone = network(u, np.array([4.0]), theta[p : p + 1], EVERY)
        np.testing.assert_array_equal(alone[0], together[p])


@pytest.mark.parametrize("place", EVERY)
def test_a_value_that_is_not_a_number_makes_its_vector_so_and_no_other(place: int) -> None:
    theta = vectors(3, 4)
    theta[1, place] = np.nan
    out = network(drive(150), np.array([4.0]), theta, EVERY)
    assert np.isnan(out[1]).all()
    assert np.isfinite(out[[0, 2]]).all()


def test_saturated_units_pass_no_slope_on() -> None:
    theta = vectors(1, 5)
    theta[0, 12:15] = 1e6
    out = network(drive(150), np.array([4.0]), theta, EVERY[:15])
    assert not out[0, 1:].any()


def test_no_samples_and_no_vectors_give_empty_rows() -> None:
    assert network(drive(0), np.array([4.0]), vectors(2, 0), EVERY).shape == (2, 32, 0)
    assert network(drive(9), np.array([4.0]), vectors(0, 0), EVERY).shape == (0, 32, 9)
