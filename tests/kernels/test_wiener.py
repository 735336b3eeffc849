"""The Hammerstein-Wiener damper's derivatives in one pass, against complex steps through scipy's exponential."""

import numpy as np
import pytest
from scipy.linalg import expm

from mrfit.kernels.wiener import propagator, wiener

EVERY = np.arange(15)
DT = 2e-3
TYPICAL = np.array([3e4, 1e3, 0.02, 0.005, 150, 300, 600, 1200, 400, 0.7, 60, 400, 200, 0.007, 12.0])


def drive(samples: int, current: str = "sine") -> np.ndarray:
    t = DT * np.arange(samples)
    currents = {"sine": 0.5 + np.cos(31 * t), "held": 0.7 + 0 * t, "off": 0 * t, "steps": 1.0 * (t % 0.1 > 0.05)}
    return np.stack([0.1 * np.sin(20 * t + 1) + 0.02 * np.sin(71 * t), currents[current]])


def vectors(count: int, seed: int) -> np.ndarray:
    return TYPICAL * np.random.default_rng(seed).uniform(0.6, 1.6, size=(count, 15))


def cascade(u: np.ndarray, poles: np.ndarray, zeros: tuple[complex, complex]) -> np.ndarray:
    """Return a signal (N,) passed through the lags and zeros, all of which may be complex."""
    order = len(poles)
    system = np.zeros((order + 2, order + 2), dtype=complex)
    system[order, order + 1] = 1.0
    for k, p in enumerate(poles):
        system[k, k], system[k, k - 1 if k else order] = -p * DT, p * DT
    step, state = expm(system)[:order], np.full(order, u[0])
    turn, hold, climb, states = step[:, :order], step[:, order], step[:, order + 1], [state]
    for before, now in zip(u, u[1:], strict=False):
        state = turn @ state + hold * before + climb * (now - before)
        states.append(state)
    inner, last, w = [u, *np.transpose(states)][-3:]
    rate, rate_before = poles[-1] * (last - w), poles[-2] * (inner - last)
    return w + zeros[0] * rate + zeros[1] * poles[-1] * (rate_before - rate)


def force(u: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return the force of one vector, which may be complex, straight from the equations."""
    pre, post, a, b, *_, zero, tau, offset = theta
    (velocity, current), late = u, tau / DT
    k = np.maximum(np.arange(len(current)) - int(np.floor(late.real)) - 1, -1)
    share = 1 - (late - np.floor(late.real))
    following = current[k + 1]
    delayed = np.where(k < 0, current[0], current[k] + share * (following - current[k]))
    m = cascade(delayed, theta[10:12], (1 / zero, 0))
    corner = a * m + b
    corner = np.where(corner.real > 0, corner, 0)
    before = np.where(np.abs(velocity) <= corner.real, velocity, np.sign(velocity) * corner)
    omega, xi = theta[8:10]
    whole = cascade(pre * before + post * (velocity - before), theta[4:8], (2 * xi / omega, 1 / omega**2))
    return whole + offset


def slopes(u: np.ndarray, theta: np.ndarray) -> np.ndarray:
    """Return dF/dtheta, (15, N), by complex steps, exact to the last digits."""
    return np.array([force(u, theta + 1e-30j * np.eye(15)[k]).imag / 1e-30 for k in EVERY])


def assert_exact(u: np.ndarray, theta: np.ndarray, tolerance: float) -> None:
    out = wiener(u, theta, DT, EVERY)
    for p, vector in enumerate(theta):
        expected = force(u, vector + 0j).real
        np.testing.assert_allclose(out[p, 0], expected, rtol=0, atol=1e-10 * np.abs(expected).max())
        for k, column in enumerate(slopes(u, vector)):
            room = tolerance * np.abs(column).max() + 1e-14 * np.abs(expected).max() / TYPICAL[k]
            np.testing.assert_allclose(out[p, 1 + k], column, rtol=0, atol=room, err_msg=f"column {k}")


@pytest.mark.parametrize(
    "poles",
    [[150.0, 300.0, 600.0, 1200.0], [60.0, 400.0], [80.0] * 4, [1.0, 1e4, 1e4, 1.0], [1e4, 9999.0], [1e-3, 2.0]],
)
@pytest.mark.parametrize("dt", [1e-5, 1e-3, 0.1])
def test_propagator_is_the_exponential_of_the_cascade_with_lags_behind(poles: list[float], dt: float) -> None:
    order = len(poles)
    size = 2 * order + 2
    system = np.zeros((size, size))
    system[1, 0] = 1.0
    for k, p in enumerate([*poles, *poles], start=2):
        system[k, k], system[k, min(k - 1, order + 1)] = -p * dt, p * dt
    step, short = np.full((size, size), 7.0), np.full((order + 2, order + 2), 7.0)
    propagator(np.array(poles), dt, True, step)
    propagator(np.array(poles), dt, False, short)
    np.testing.assert_allclose(step, expm(system), rtol=0, atol=1e-11)
    np.testing.assert_array_equal(short, step[: order + 2, : order + 2])


@pytest.mark.parametrize("current", ["sine", "held", "off", "steps"])
@pytest.mark.parametrize("seed", range(2))
def test_rows_are_the_force_and_its_exact_derivatives(current: str, seed: int) -> None:
    assert_exact(drive(120, current), vectors(2, seed), 1e-10)


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_are_exact_over_four_decades_of_poles_and_zeros(seed: int) -> None:
    theta, rng = vectors(1, seed), np.random.default_rng(seed)
    theta[:, [4, 5, 6, 7, 8, 10, 11, 12]] = 10.0 ** rng.uniform(0, 4, size=8)
    assert_exact(drive(120), theta, 1e-6)


def test_derivatives_are_exact_where_poles_are_equal() -> None:
    theta = vectors(1, 0)
    theta[:, 4:8], theta[:, 10:12] = 250.0, 90.0
    assert_exact(drive(120), theta, 1e-10)


@pytest.mark.parametrize("delay", [0.0, 0.5, 1.0, 3.0, 118.5, 119.0, 400.0])
def test_derivative_along_the_delay_is_exact_up_to_the_record_s_end_and_at_whole_samples(delay: float) -> None:
    theta = vectors(1, 1)
    theta[:, 13] = delay * DT
    assert_exact(drive(120), theta, 1e-9)


def test_corner_that_current_closes_has_no_derivative_there() -> None:
    theta = vectors(1, 2)
    theta[:, 2], theta[:, 3] = 0.02, -0.01
    assert_exact(drive(200), theta, 1e-10)
    out = wiener(drive(200, "off"), theta, DT, EVERY[2:4])
    assert not out[:, 1:].any()


def test_any_columns_in_any_order_are_rows_of_all_columns() -> None:
    rng, theta = np.random.default_rng(8), vectors(2, 7)
    for current in ("sine", "held"):
        u = drive(150, current)
        whole = wiener(u, theta, DT, EVERY)
        subsets = [rng.permutation(15)[: rng.integers(1, 15)] for _ in range(20)]
        for columns in [*subsets, *EVERY[:, None], np.array([14, 0, 1]), np.array([5, 5]), EVERY[:0]]:
            out = wiener(u, theta, DT, columns)
            np.testing.assert_array_equal(out, whole[:, np.r_[0, 1 + columns]])


# one sample, one short of a block of samples, a block, one more, and many
@pytest.mark.parametrize("samples", [1, 2, 47, 48, 49, 97, 300])
def test_a_record_s_beginning_is_the_record_that_ends_there(samples: int) -> None:
    u, theta = drive(400), vectors(2, 3)
    whole = wiener(u, theta, DT, EVERY)
    out = wiener(np.ascontiguousarray(u[:, :samples]), theta, DT, EVERY)
    np.testing.assert_array_equal(out, whole[:, :, :samples])


def test_a_constant_current_is_one_that_has_not_moved_yet() -> None:
    held, theta = drive(200, "held"), vectors(2, 4)
    moved = held.copy()
    moved[1, -1] += 1.0
    expected = wiener(moved, theta, DT, EVERY)[:, :, :-1]
    out = wiener(held, theta, DT, EVERY)[:, :, :-1]
    size = np.maximum(np.abs(expected).max(axis=(0, 2)), 1e-300)[None, :, None]
    np.testing.assert_allclose(out / size, expected / size, rtol=0, atol=1e-12)
    assert not out[:, 11:15].any()


def test_a_vector_stands_alone() -> None:
    u, theta = drive(100), vectors(5, 9)
    together = wiener(u, theta, DT, EVERY)
    for p in range(5):
        alone = wiener(u, theta[p : p + 1], DT, EVERY)
        np.testing.assert_array_equal(alone[0], together[p])


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", EVERY)
def test_a_value_that_is_not_finite_makes_its_vector_nan_and_no_other(place: int, value: float) -> None:
    theta = vectors(3, 4)
    theta[1, place] = value
    for current in ("sine", "held"):
        out = wiener(drive(100, current), theta, DT, EVERY)
        assert np.isnan(out[1]).all()
        assert np.isfinite(out[[0, 2]]).all()


def test_a_drive_that_is_not_a_number_does_not_pass_for_one() -> None:
    for row in range(2):
        u = drive(100)
        u[row, 50] = np.nan
        out = wiener(u, vectors(2, 4), DT, EVERY)
        assert np.isfinite(out[:, :, :50]).all()
        # the offset alone acts whatever the drive is
        assert np.isnan(out[:, 0, 70:]).all() and (out[:, -1] == 1.0).all()


def test_values_outside_all_bounds_are_survived() -> None:
    for place in EVERY:
        for value in (0.0, -1.0, 1e300, -1e300, 1e18):
            theta = vectors(1, 4)
            theta[0, place] = value
            assert wiener(drive(100), theta, DT, EVERY).shape == (1, 16, 100)


def test_no_samples_and_no_vectors_give_empty_rows() -> None:
    assert wiener(drive(0), vectors(2, 0), DT, EVERY).shape == (2, 16, 0)
    assert wiener(drive(9), vectors(0, 0), DT, EVERY).shape == (0, 16, 9)
