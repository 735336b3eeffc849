"""The flux model with two exponents against its differential equation, its limit of one exponent, and planted logs."""

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

import mrfit
from mrfit.models import boucwen_flux
from mrfit.models.boucwen_flux_n1n2 import REDUCED, SPEC, derived, response

# z saturates at 1, where both terms of the loop weigh
LOOP = np.array([1.2, 0.0178, 90.0, 30.0, 60.0, 1.3, 2.6, 1.0])


def turning(path: tuple[float, ...], samples: int) -> np.ndarray:
    """A current that goes straight from each value to the next."""
    return np.concatenate(
        [[path[0]], *(np.linspace(a, b, samples + 1)[1:] for a, b in zip(path[:-1], path[1:], strict=True))]
    )


def by_ode(theta: np.ndarray, path: tuple[float, ...], samples: int) -> np.ndarray:
    """The printed equation by an integrator of SciPy, a branch at a time."""
    share, inductance, kappa, beta, gamma, n1, n2, divisor = theta
    z, states = 0.0, [0.0]
    for a, b in zip(path[:-1], path[1:], strict=True):
        sign = np.sign(b - a)

        def rate(i: float, z: np.ndarray, sign: float = sign) -> np.ndarray:
            # di/dt = sign, and the time that passes is sign times di
            return sign * (kappa * sign - beta * sign * np.abs(z) ** n1 - gamma * z * np.abs(z) ** (n2 - 1.0))

        at = np.linspace(a, b, samples + 1)[1:]
        solved = solve_ivp(rate, (a, b), [z], "DOP853", at, rtol=1e-11, atol=1e-13)
        states.extend(solved.y[0])
        z = states[-1]
    i = turning(path, samples)
    return share * inductance * i + (1.0 - share) * inductance / divisor * np.array(states)


@pytest.mark.parametrize("samples", [3, 40, 700])
@pytest.mark.parametrize("exponents", [(1.3, 2.6), (2.5, 1.0), (6.0, 1.1), (1.0, 9.0)])
def test_follows_the_printed_equation_at_any_sampling(samples: int, exponents: tuple[float, float]) -> None:
    theta = LOOP.copy()
    theta[5:7] = exponents
    path = (0.0, 0.08, -0.05, 0.3, 0.27, 0.31, -1.0, 0.01, 0.0)
    wanted = by_ode(theta, path, samples)
    found = response(turning(path, samples)[None], theta[None], 1e-3)[0]
    height = abs(derived(theta[None])[0, 1])
    assert np.abs(found - wanted).max() < 3e-6 * height


def test_with_one_exponent_it_is_the_model_of_one() -> None:
    current = 3.0 * np.sin(np.linspace(0.0, 12.0, 2500))[None]
    for n in (1.0, 1.3, 4.0):
        one = np.array([[1.2, 0.0178, 3.5, 30.0, 60.0, n, 0.05]])
        two = np.insert(one, 6, n, axis=1)
        height = abs(derived(two)[0, 1])
        apart = response(current, two, 1e-3) - boucwen_flux.response(current, one, 1e-3)
        assert np.abs(apart).max() < 1e-6 * height
        assert derived(two)[0, [0, 1, 2, 3, 5]] == pytest.approx(boucwen_flux.derived(one)[0])


def test_the_exponents_do_different_things() -> None:
    current = 3.0 * np.sin(np.linspace(0.0, 12.0, 2500))[None]
    swapped = LOOP.copy()
    swapped[5:7] = LOOP[[6, 5]]
    one, other = (response(current, v[None], 1e-3)[0] for v in (LOOP, swapped))
    assert np.abs(one - other).max() > 0.01 * abs(derived(LOOP[None])[0, 1])


def test_reduced_parameters_come_back_inside_the_bounds() -> None:
    low, high = np.array([[p.low, p.high] for p in SPEC.params]).T
    theta = np.exp(np.random.default_rng(3).uniform(np.log(low), np.log(high), (500, 8)))
    theta[:, 0] = np.where(theta[:, 0] < 1.0, 0.8, 1.2)
    # where one term is next to nothing at saturation its factor is not in the response
    theta = theta[np.abs(REDUCED.reduce(theta)[:, 5]) < 0.999]
    again = REDUCED.restore(REDUCED.reduce(theta))
    assert len(theta) > 100
    assert np.all((again >= low * (1.0 - 1e-6)) & (again <= high * (1.0 + 1e-6)))
    assert derived(again) == pytest.approx(derived(theta), rel=1e-6)


def planted(theta: np.ndarray, seed: int) -> mrfit.Recording:
    time = np.arange(3000) * 1e-3
    current = 0.05 * np.sin(2.0 * np.pi * time)
    flux = response(current[None], theta[None], 1e-3)[0]
    noise = 2e-4 * np.ptp(flux) * np.random.default_rng(seed).normal(size=len(time))
    return mrfit.Recording.from_frame(
        pd.DataFrame({"time (s)": time, "current (A)": current, "flux (Wb)": flux + noise})
    )


def test_two_exponents_are_found_where_they_differ_and_one_does_not_serve() -> None:
    data = planted(np.array([1.2, 0.0178, 90.0, 30.0, 60.0, 1.4, 3.5, 0.5]), 1)
    two = mrfit.fit(data, model="boucwen-flux-n1n2", optimizer="auto", bounds={"A": (1.0, 1.5)}, holdout="none")
    one = mrfit.fit(data, model="boucwen-flux", optimizer="auto", bounds={"A": (1.0, 1.5)}, holdout="none")
    found = two.params["value"]
    assert found["n1"] == pytest.approx(1.4, abs=0.05)
    assert found["n2"] == pytest.approx(3.5, abs=0.05)
    assert float(one.metrics["rmse"].iloc[0]) > 1.5 * float(two.metrics["rmse"].iloc[0])
