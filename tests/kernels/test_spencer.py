"""The two-state damper against a tight ODE solver, its limits, and bounded work."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrfit.kernels.spencer import LANES, TOLERANCE, spencer

THETA = np.array([3e4, 2000.0, 500.0, 500.0, 500.0, 5000.0, 2500.0, 2500.0, 2.0, -20.0])


def simulate(x: np.ndarray, v: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    rows = np.atleast_2d(theta)
    return spencer(x, v, np.ascontiguousarray(rows.T)[:, :, None], np.array([dt]), TOLERANCE)


def solve(x: np.ndarray, v: np.ndarray, theta: np.ndarray, dt: float) -> np.ndarray:
    """Integrate the printed equations of y and z, interval by interval, with x and v linear between samples."""
    c0, c_inf, k0, k_inf, alpha, growth, beta, gamma, n, f0 = theta
    z_max = (growth / (beta + gamma)) ** (1 / n)
    state, force = np.array([0.0, 0.0]), []
    for j in range(len(v)):
        if j:
            rise = (v[j] - v[j - 1]) / dt

            def rates(t: float, s: np.ndarray, start: float = v[j - 1], rise: float = rise) -> list[float]:
                velocity = start + rise * t
                inner = (alpha * s[1] + c_inf * velocity + k_inf * s[0]) / (c0 + c_inf)
                u, size = velocity - inner, abs(s[1])
                return [u, growth * u - beta * u * size**n - gamma * abs(u) * np.sign(s[1]) * size**n]

            tight = {"rtol": 1e-10, "atol": [1e-11 * z_max / growth, 1e-11 * z_max]}
            state = solve_ivp(rates, (0, dt), state, "LSODA", **tight).y[:, -1]
        inner = (alpha * state[1] + c_inf * v[j] + k_inf * state[0]) / (c0 + c_inf)
        force.append(c0 * inner + k0 * x[j] + f0)
    return np.array(force)


@pytest.mark.parametrize("seed", range(5))
def test_agrees_with_a_tight_ode_solver(seed: int) -> None:
    rng = np.random.default_rng(seed)
    theta = THETA * np.exp(rng.uniform(-0.8, 0.8, 10))
    theta[8] = rng.uniform(1, 4)
    frequency, per_cycle = rng.uniform(0.5, 5), int(rng.integers(60, 120))
    dt = 1 / frequency / per_cycle
    t = dt * np.arange(int(1.3 * per_cycle))
    x, v = 0.01 * np.stack(
        [np.sin(2 * np.pi * frequency * t), 2 * np.pi * frequency * np.cos(2 * np.pi * frequency * t)]
    )
    expected = solve(x, v, theta, dt)
    assert np.abs(simulate(x, v, theta, dt)[0] - expected).max() < 1e-6 * np.ptp(expected)


def test_lanes_do_not_disturb_each_other() -> None:
    rng = np.random.default_rng(2)
    theta = THETA * np.exp(rng.uniform(-1.5, 1.5, (2 * LANES + 3, 10)))
    theta[:, 8] = rng.uniform(1, 6, len(theta))
    t = 1e-3 * np.arange(500)
    x, v = 0.01 * np.stack([np.sin(9 * t), 9 * np.cos(9 * t)])
    batch = simulate(x, v, theta, 1e-3)
    for row, alone in zip(batch, theta, strict=True):
        assert np.array_equal(row, simulate(x, v, alone, 1e-3)[0])


def test_steady_force_at_constant_velocity_is_yield_and_post_yield_damping() -> None:
    theta = THETA.copy()
    theta[[2, 3, 9]] = [0.0, 1e-9, 0.0]
    v = np.full(4000, 0.1)
    force = simulate(np.zeros(4000), v, theta, 1e-3)[0, -1]
    c0, c_inf, alpha = theta[0], theta[1], theta[4]
    # Saturated z = 1 in series with C0: the inner point moves with (alpha + C_inf*v)/(C0 + C_inf).
    assert force == pytest.approx(c0 * (alpha + c_inf * 0.1) / (c0 + c_inf), rel=1e-6)


@pytest.mark.parametrize("stiff", [1.0, 1e2, 1e5])
def test_stiff_elements_stay_bounded_and_follow_the_quasi_static_force(stiff: float) -> None:
    theta = THETA.copy()
    theta[5:8] *= stiff
    t = 1e-3 * np.arange(1000)
    x, v = 0.01 * np.stack([np.sin(6 * t), 6 * np.cos(6 * t)])
    force = simulate(x, v, theta, 1e-3)[0]
    assert np.isfinite(force).all()
    bound = theta[4] + theta[1] * 0.06 + (theta[2] + theta[3]) * 0.02 + 20
    assert np.abs(force).max() < 1.001 * bound


def test_is_nan_from_the_first_drive_value_that_is_not_finite_and_for_unbounded_elements() -> None:
    v = np.linspace(0, 0.1, 20)
    v[10] = np.nan
    bad = THETA.copy()
    bad[6:8] = -1.0
    force = simulate(np.zeros(20), v, np.stack([THETA, bad]), 1e-3)
    assert np.isfinite(force[0, :10]).all()
    assert np.isnan(force[0, 10:]).all()
    assert np.isnan(force[1]).all()
