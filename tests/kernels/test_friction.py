"""Stepped friction laws against closed forms, the branch curve and a tight ODE solver."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrfit.kernels.branch import bouc_wen
from mrfit.kernels.friction import bouc_wen_step, combine, hysteresis
from mrfit.models import dahl, lugre


def column(*values: float) -> np.ndarray:
    return np.array(values)[:, None]


def test_dahl_is_bouc_wen_with_n_1_and_rho_minus_1() -> None:
    x = np.cumsum(np.random.default_rng(0).normal(size=500))
    expected = bouc_wen(x, np.array([[0.0, 1.0, 0.7, 1.0, -1.0]]))
    assert np.abs(dahl_state(x, 0.7) - expected).max() < 1e-7


def dahl_state(x: np.ndarray, rate: float) -> np.ndarray:
    return dahl.response(np.stack([x, 0.0 * x]), np.array([[0.0, 1.0, rate, 0.0]]), 1.0)


def test_dahl_rises_exponentially_and_does_not_depend_on_sampling() -> None:
    x = np.linspace(0, 3, 31)
    assert dahl_state(x, 1.3)[0] == pytest.approx(1 - np.exp(-1.3 * x), abs=1e-14)
    assert dahl_state(x[::10].copy(), 1.3)[0] == pytest.approx(dahl_state(x, 1.3)[0, ::10], abs=1e-14)


def lugre_theta(sigma0: float, fc: float, more: float, vs: float, sigma1: float = 0.0) -> np.ndarray:
    return np.array([[sigma0, sigma1, 0.0, fc, more, vs, 0.0]])


@pytest.mark.parametrize(
    ("sigma0", "extra", "vs", "speed"),
    [(3e5, 285.0, 3e-3, 0.17), (9e6, 220.0, 0.03, 0.15), (1e4, 226.0, 0.011, 0.03), (1e6, 0.0, 0.01, 0.1)],
)
def test_lugre_agrees_with_a_tight_ode_solver(sigma0: float, extra: float, vs: float, speed: float) -> None:
    per_cycle, fc = 60, 400.0
    dt = 0.5 / per_cycle
    v = speed * np.sin(2 * np.pi * np.arange(per_cycle + per_cycle // 2) / per_cycle + 0.3)
    z, expected = lugre.response(v[None], lugre_theta(sigma0, fc, extra, vs), dt)[0] / sigma0, [0.0]
    for j in range(1, len(v)):

        def rate(t: float, s: np.ndarray, start: float = v[j - 1], end: float = v[j]) -> list[float]:
            now = start + (end - start) * t / dt
            return [now - sigma0 * abs(now) * s[0] / (fc + extra * np.exp(-((now / vs) ** 2)))]

        zero = dt * v[j - 1] / (v[j - 1] - v[j]) if v[j - 1] * v[j] < 0 else dt
        state = expected[-1:]
        for span in ((0.0, zero), (zero, dt)):
            if span[1] > span[0]:
                state = solve_ivp(rate, span, state, "Radau", rtol=1e-9, atol=1e-11 * fc / sigma0).y[:, -1]
        expected.append(float(state[0]))
    assert np.abs(z - expected).max() < 1e-5 * np.ptp(expected)


def test_lugre_without_stribeck_is_dahl_with_the_force_fc() -> None:
    t = np.linspace(0, 1, 2001)
    x, v = 0.01 * np.sin(7 * t), 0.07 * np.cos(7 * t)
    elastic = lugre.response(v[None], lugre_theta(5e5, 400.0, 0.0, 0.01), t[1])[0]
    assert np.abs(elastic / 400.0 - dahl_state(x, 5e5 / 400.0)[0]).max() < 1e-4
    damped = lugre.response(v[None], lugre_theta(5e5, 400.0, 0.0, 0.01, 30.0), t[1])[0]
    assert damped - elastic == pytest.approx(30.0 * (v - np.abs(v) * elastic / 400.0))


def test_lugre_deflection_at_constant_speed_is_stribecks_curve() -> None:
    v = np.full(4000, 0.004)
    z = lugre.response(v[None], lugre_theta(1e6, 400.0, 200.0, 0.01), 1e-3)[0]
    assert z[-1] == pytest.approx(400 + 200 * np.exp(-0.16), rel=1e-9)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(rate=st.floats(0.05, 50), n=st.floats(1, 10), rho=st.floats(-1, 0.99), seed=st.integers(0, 100))
def test_steps_of_bouc_wen_follow_the_branch_curve(rate: float, n: float, rho: float, seed: int) -> None:
    x = np.cumsum(np.random.default_rng(seed).normal(size=60))
    shape = (rate, 0.5 * rate * (1.0 + rho), 0.5 * rate * (1.0 - rho), n)
    stepped = [0.0]
    for travel in np.diff(x):
        stepped.append(bouc_wen_step(stepped[-1], travel, shape, shape))
    # the curve is good to 3e-7
    assert np.abs(stepped - hysteresis(x, column(rate), column(n), column(rho))[0]).max() < 1e-6


@pytest.mark.parametrize("n", [1.0, 1.3, 2.0])
def test_a_soft_knee_is_stepped_as_its_curve_to_nine_digits(n: float) -> None:
    t = np.arange(2000) * 1e-3
    x = 0.01 * np.sin(9 * t) + 0.004 * np.sin(31 * t)
    z, shape = [0.0], (800.0, 300.0, 500.0, n)
    for travel in np.diff(x):
        z.append(bouc_wen_step(z[-1], travel, shape, shape))
    assert np.abs(z - hysteresis(x, column(800.0), column(n), column(-0.25))[0]).max() < 2e-8


@pytest.mark.parametrize("gamma", [500.0, -500.0, -100.0])
@pytest.mark.parametrize("moves", [0.0, 0.1])
@pytest.mark.parametrize("travel", [1e-5, -3e-4, 8e-4])
@pytest.mark.parametrize("z", [0.0, 1e-3, 0.4, -0.7])
def test_a_step_agrees_with_a_tight_ode_solver_whatever_the_signs(
    gamma: float, moves: float, travel: float, z: float
) -> None:
    then = np.array([1000.0, 300.0, gamma, 1.4])
    here = then * (1.0 + moves * np.array([1.0, -1.0, 0.5, -0.3]))

    def rate(share: float, state: np.ndarray) -> list[float]:
        kappa, beta, own, n = then + share * (here - then)
        return [travel * (kappa - (beta + own * np.sign(travel * state[0])) * abs(state[0]) ** n)]

    expected = solve_ivp(rate, (0.0, 1.0), [z], "DOP853", rtol=1e-12, atol=1e-13, max_step=0.02).y[0, -1]
    # where z passes 0 the equation has a kink
    assert bouc_wen_step(z, travel, tuple(then), tuple(here)) == pytest.approx(expected, abs=1e-7)


def test_saturated_travel_of_any_length_ends_at_saturation() -> None:
    shape = (40.0, 14.0, 26.0, 1.3)
    for travel in (1.0, 10.0, -10.0):
        assert bouc_wen_step(0.3, travel, shape, shape) == pytest.approx(np.sign(travel), abs=1e-8)


@pytest.mark.parametrize("n", [1.2, 8.0])
@pytest.mark.parametrize("size", [3.0, -3.0])
def test_an_element_that_a_change_of_parameters_leaves_above_saturation_comes_down_to_it(n: float, size: float) -> None:
    shape = (700.0, 200.0, 500.0, n)
    z = size
    for travel in np.full(40, 1e-4):
        following = bouc_wen_step(z, travel, shape, shape)
        assert abs(following) <= abs(z) or z > -1.0
        z = following
    assert bouc_wen_step(1.5 * size, 0.2, shape, shape) == pytest.approx(1.0, abs=1e-9)
    assert np.isnan(bouc_wen_step(np.nan, 1e-4, shape, shape))


@pytest.mark.parametrize("n", [1.5, 4.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_growth_without_bounds_within_a_step_ends_at_infinity(n: float, side: float) -> None:
    hardens = (50.0, -120.0, -130.0, n)
    assert bouc_wen_step(0.9 * side, 1.0 * side, hardens, hardens) == side * np.inf


@pytest.mark.parametrize("samples", [1, 5])
def test_combination_is_the_weighted_sum(samples: int) -> None:
    rng = np.random.default_rng(0)
    state, signals = rng.normal(size=(3, 5)), rng.normal(size=(2, 5))
    gain, weights = rng.normal(size=(3, samples)), rng.normal(size=(2, 3, samples))
    expected = gain * state + weights[0] * signals[0] + weights[1] * signals[1]
    combine(state, gain, weights, signals)
    assert state == pytest.approx(expected)
