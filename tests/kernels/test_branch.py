"""The branch curve against closed forms, quadrature and a tight ODE solver."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

from mrfit.kernels.branch import bouc_wen, normal_form, turning_points


def law(y: float, n: float, rho: float) -> float:
    return 1.0 - y**n if y > 0.0 else 1.0 - rho * (-y) ** n


def solve(x: np.ndarray, rate: float, n: float, rho: float) -> np.ndarray:
    """Integrate y between the corners of a polygonal drive, exactly sampled at its corners."""
    y = [0.0]
    for step in np.diff(x) * rate:
        sign = np.sign(step)
        if step == 0.0:
            y.append(y[-1])
            continue
        found = solve_ivp(
            lambda s, w: [law(w[0], n, rho)],
            (0, abs(step)),
            [sign * y[-1]],
            "DOP853",
            rtol=1e-11,
            atol=1e-13,
            max_step=0.1,
        )
        y.append(sign * found.y[0, -1])
    return np.array(y)


def simulate(x: np.ndarray, rate: float, n: float, rho: float) -> np.ndarray:
    return bouc_wen(np.ascontiguousarray(x, dtype=float), np.array([[0.0, 1.0, rate, n, rho]]))[0]


@settings(max_examples=40, deadline=None)
@given(
    corners=st.lists(st.floats(-2, 2), min_size=2, max_size=8),
    rate=st.floats(0.05, 5),
    n=st.one_of(st.just(1.0), st.floats(1, 10)),
    rho=st.floats(-1, 0.99),
)
def test_agrees_with_a_tight_ode_solver(corners: list[float], rate: float, n: float, rho: float) -> None:
    x = np.array([0.0, *corners])
    assert np.abs(simulate(x, rate, n, rho) - solve(x, rate, n, rho)).max() < 1e-6


@pytest.mark.parametrize("rho", [-0.9, -1 / 3, 0.4])
def test_equals_the_exponential_branches_for_n_1(rho: float) -> None:
    s = np.linspace(0, 6, 500)
    there = simulate(s, 1.0, 1.0, rho)
    assert np.abs(there - (1 - np.exp(-s))).max() < 1e-8
    back = simulate(np.concatenate([s, s[-1] - s[1:]]), 1.0, 1.0, rho)[499:]
    start = 1 - np.exp(-s[-1])
    falling = -((1 - rho * start) * np.exp(rho * s) - 1) / rho
    crossing = np.log(1 - rho * start) / -rho
    assert np.abs(back - falling)[s < crossing].max() < 1e-8
    assert np.abs(back + 1 - np.exp(-(s - crossing)))[s > crossing].max() < 1e-8


@pytest.mark.parametrize(("n", "rho"), [(1.0, -0.5), (1.3, -1 / 3), (2.0, 0.5), (6.0, -0.9)])
def test_steady_loop_area_equals_quadrature_over_the_state(n: float, rho: float) -> None:
    def travel(y: float) -> float:
        below = quad(lambda u: 1 / law(-u, n, rho), 0, 1, epsabs=1e-12)[0]
        return below + quad(lambda u: 1 / law(u, n, rho), 0, y, epsabs=1e-12)[0]

    top = 0.9999
    amplitude = travel(top) / 2
    below = quad(lambda u: -u / law(-u, n, rho), 0, 1, epsabs=1e-12)[0]
    area = 2 * (below + quad(lambda u: u / law(u, n, rho), 0, top, epsabs=1e-12)[0])
    # From rest far down into saturation, then a rising branch as long as the loop is wide; the falling one mirrors it.
    rise = np.linspace(0, 2 * amplitude, 200_001)
    x = np.concatenate([[0.0, -60.0], rise - 60.0])
    y = simulate(x, 1.0, n, rho)[2:]
    assert 2 * np.trapezoid(y, rise) == pytest.approx(area, rel=1e-6)


@given(cycles=st.integers(1, 4), per_quarter=st.integers(12, 500))
@settings(max_examples=20, deadline=None)
def test_does_not_depend_on_sampling(cycles: int, per_quarter: int) -> None:
    forms = np.array([[0.01, 1.0, 3.0, 1.3, -1 / 3], [0.01, 1.0, 0.5, 4.0, 0.5]])
    coarse = np.sin(0.5 * np.pi * np.arange(4 * cycles * per_quarter + 1) / per_quarter)
    factor = 20_000 // (4 * per_quarter)
    fine = np.interp(np.arange(factor * (len(coarse) - 1) + 1) / factor, np.arange(len(coarse)), coarse)
    assert np.abs(bouc_wen(fine, forms)[:, ::factor] - bouc_wen(coarse, forms)).max() < 1e-9


def test_does_not_depend_on_the_speed_of_the_drive() -> None:
    x = np.cumsum(np.random.default_rng(1).normal(size=300))
    slow = np.repeat(x, 3)
    assert np.array_equal(simulate(slow, 0.7, 1.5, -0.2)[::3], simulate(x, 0.7, 1.5, -0.2))


@given(size=st.floats(1e-3, 1e6))
@settings(max_examples=30, deadline=None)
def test_stays_within_saturation_whatever_the_step(size: float) -> None:
    x = size * np.array([0.0, 1.0, -1.0, 0.5, 3.0, -7.0, -7.0, 2.0])
    for n, rho in ((1.0, -1.0), (1.3, -1 / 3), (10.0, 0.99), (3.0, 0.999)):
        assert np.abs(simulate(x, 42.0, n, rho)).max() <= 1.0 + 1e-7


def test_small_loop_inside_a_branch_returns_below_its_start_and_catches_up() -> None:
    s = np.concatenate([np.linspace(0, 0.5, 50), np.linspace(0.5, 0.4, 20)[1:], np.linspace(0.4, 12, 800)[1:]])
    y = simulate(s, 1.0, 1.3, -1 / 3)
    assert y[68] < y[s[:50].searchsorted(0.4)]
    assert y[-1] == pytest.approx(1.0, abs=1e-6)


def test_turning_points_keep_the_direction_over_flat_samples() -> None:
    turns, finite = turning_points(np.array([0.0, 0.0, 1.0, 1.0, 2.0, 1.5, 1.5, 1.0, 3.0]))
    assert turns.tolist() == [2, -5, 8]
    assert finite == 9


def test_is_nan_from_the_first_sample_that_is_not_finite() -> None:
    x = np.array([0.0, 1.0, np.nan, 1.0, 2.0])
    y = simulate(x, 1.0, 1.3, 0.0)
    assert np.isfinite(y[:2]).all()
    assert np.isnan(y[2:]).all()
    assert np.array_equal(y[:2], simulate(x[:2], 1.0, 1.3, 0.0))


@pytest.mark.parametrize("bad", [(np.nan, 1.3, 0.0), (1.0, np.nan, 0.0), (1.0, 1.3, 1.5), (1.0, -1.0, 0.0)])
def test_parameters_without_a_bounded_loop_give_nan_and_leave_the_rest(bad: tuple[float, float, float]) -> None:
    x = np.linspace(0, 1, 20)
    good = [0.0, 1.0, 1.0, 1.3, 0.0]
    y = bouc_wen(x, np.array([[0.0, 1.0, *bad], good]))
    assert np.isnan(y[0]).all()
    assert np.array_equal(y[1], simulate(x, 1.0, 1.3, 0.0))


def test_normal_form_has_zero_growth_at_saturation() -> None:
    kappa, beta, gamma, n = 3.5, 30.0, 60.0, 1.3
    z_max, rate, rho = normal_form(*(np.array([p]) for p in (kappa, beta, gamma, n)))
    assert kappa - (beta + gamma) * z_max[0] ** n == pytest.approx(0.0, abs=1e-12)
    assert rate[0] * z_max[0] == pytest.approx(kappa)
    assert rho[0] == pytest.approx(-1 / 3)
