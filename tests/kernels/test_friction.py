"""Stepped friction laws against closed forms, the branch curve and a tight ODE solver."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from mrfit.kernels.branch import bouc_wen
from mrfit.kernels.friction import combine, dahl, hysteresis, lugre, varying_bouc_wen


def column(*values: float) -> np.ndarray:
    return np.array(values)[:, None]


def test_dahl_is_bouc_wen_with_n_1_and_rho_minus_1() -> None:
    x = np.cumsum(np.random.default_rng(0).normal(size=500))
    expected = bouc_wen(x, np.array([[0.0, 1.0, 0.7, 1.0, -1.0]]))
    assert np.abs(dahl(x, column(0.7)) - expected).max() < 1e-7


def test_dahl_rises_exponentially_and_does_not_depend_on_sampling() -> None:
    x = np.linspace(0, 3, 31)
    assert dahl(x, column(1.3))[0] == pytest.approx(1 - np.exp(-1.3 * x), abs=1e-14)
    assert dahl(x[::10].copy(), column(1.3))[0] == pytest.approx(dahl(x, column(1.3))[0, ::10], abs=1e-14)


def lugre_theta(sigma0: float, fc: float, more: float, vs: float, sigma1: float = 0.0) -> np.ndarray:
    return np.array([sigma0, sigma1, 0.0, fc, more, vs, 0.0])[:, None, None]


@pytest.mark.parametrize(
    ("sigma0", "extra", "vs", "speed"),
    [(3e5, 285.0, 3e-3, 0.17), (9e6, 220.0, 0.03, 0.15), (1e4, 226.0, 0.011, 0.03), (1e6, 0.0, 0.01, 0.1)],
)
def test_lugre_agrees_with_a_tight_ode_solver(sigma0: float, extra: float, vs: float, speed: float) -> None:
    per_cycle, fc = 60, 400.0
    dt = 0.5 / per_cycle
    v = speed * np.sin(2 * np.pi * np.arange(per_cycle + per_cycle // 2) / per_cycle + 0.3)
    z, expected = lugre(v, lugre_theta(sigma0, fc, extra, vs), np.array([dt]))[0] / sigma0, [0.0]
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
    elastic = lugre(v, lugre_theta(5e5, 400.0, 0.0, 0.01), t[1:2])[0]
    assert np.abs(elastic / 400.0 - dahl(x, column(5e5 / 400.0))[0]).max() < 1e-4
    damped = lugre(v, lugre_theta(5e5, 400.0, 0.0, 0.01, 30.0), t[1:2])[0]
    assert damped - elastic == pytest.approx(30.0 * (v - np.abs(v) * elastic / 400.0))


def test_lugre_deflection_at_constant_speed_is_stribecks_curve() -> None:
    v = np.full(4000, 0.004)
    z = lugre(v, lugre_theta(1e6, 400.0, 200.0, 0.01), np.array([1e-3]))[0]
    assert z[-1] == pytest.approx(400 + 200 * np.exp(-0.16), rel=1e-9)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(rate=st.floats(0.05, 50), n=st.floats(1, 10), rho=st.floats(-1, 0.99), seed=st.integers(0, 100))
def test_varying_bouc_wen_follows_the_branch_curve_where_nothing_varies(
    rate: float, n: float, rho: float, seed: int
) -> None:
    x = np.cumsum(np.random.default_rng(seed).normal(size=60))
    # another rate at the sample before the first step: no rest, during which the curve itself would be read
    rates = np.full((1, 60), rate)
    rates[0, 0] *= 2.0
    stepped = varying_bouc_wen(x, rates, np.full((1, 60), n), np.full((1, 60), rho))
    assert np.abs(stepped - bouc_wen(x, np.array([[0.0, 1.0, rate, n, rho]]))).max() < 1e-5


def test_hysteresis_takes_the_exact_curve_unless_its_parameters_vary() -> None:
    x = np.cumsum(np.random.default_rng(3).normal(size=60))
    constant = hysteresis(x, column(0.8), column(2.0), column(0.1))
    assert np.array_equal(constant, hysteresis(x, *(np.full((1, 60), value) for value in (0.8, 2.0, 0.1))))
    rate = np.full((1, 60), 0.8)
    rate[0, 30:] = 1.6
    varied = hysteresis(x, rate, column(2.0), column(0.1))
    assert np.array_equal(varied[0, :30], constant[0, :30])
    assert np.abs(varied - constant)[0, 30:].max() > 1e-3


def test_saturated_travel_of_any_length_ends_at_saturation() -> None:
    x = np.array([0.0, 1e6, 0.0])
    rates = np.array([[80.0, 40.0, 40.0]])
    for rate in (rates, np.full((1, 3), 40.0)):
        y = varying_bouc_wen(x, rate, *(np.full((1, 3), value) for value in (1.3, -0.3)))
        assert y[0] == pytest.approx([0.0, 1.0, -1.0], abs=1e-9)


def test_each_vector_leaves_the_curve_where_its_own_parameters_first_vary() -> None:
    x = np.cumsum(np.random.default_rng(5).normal(size=60))
    rate = np.full((3, 60), 0.8)
    rate[1, 20:], rate[2, 0] = 1.6, 1.6
    both = [np.broadcast_to(column(v), (3, 60)).copy() for v in (2.0, 0.1)]
    together = varying_bouc_wen(x, rate, *both)
    for k in range(3):
        assert np.array_equal(together[k], varying_bouc_wen(x, rate[k : k + 1], *(v[:1] for v in both))[0])
    assert np.array_equal(together[0, :20], together[1, :20]) and not np.array_equal(together[0, :20], together[2, :20])


@pytest.mark.parametrize("samples", [1, 5])
def test_combination_is_the_weighted_sum(samples: int) -> None:
    rng = np.random.default_rng(0)
    state, signals = rng.normal(size=(3, 5)), rng.normal(size=(2, 5))
    gain, weights = rng.normal(size=(3, samples)), rng.normal(size=(2, 3, samples))
    expected = gain * state + weights[0] * signals[0] + weights[1] * signals[1]
    combine(state, gain, weights, signals)
    assert state == pytest.approx(expected)
