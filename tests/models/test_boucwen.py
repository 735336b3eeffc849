"""The mechanical Bouc-Wen damper against its equation solved in time, its loop area and its null directions."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mrfit.models.boucwen import SPEC, derived, response, start_values

THETA = np.array([1500.0, 2000.0, 0.01, 400.0, 800.0, 300.0, 600.0, 1.6])


def sine(amplitude: float, omega: float, samples: int, cycles: int = 2) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0, cycles * 2 * np.pi / omega, samples)
    return t, np.stack([amplitude * np.sin(omega * t), amplitude * omega * np.cos(omega * t)])


def test_agrees_with_the_printed_equation_solved_in_time() -> None:
    c, k, x0, alpha, kappa, beta, gamma, n = THETA
    amplitude, omega = 0.004, 2 * np.pi
    t, drive = sine(amplitude, omega, 401)

    def growth(t: float, z: np.ndarray) -> list[float]:
        v, size = amplitude * omega * np.cos(omega * t), abs(z[0])
        return [kappa * v - beta * v * size**n - gamma * abs(v) * z[0] * size ** (n - 1)]

    z = solve_ivp(growth, (0, t[-1]), [0.0], "DOP853", rtol=1e-10, atol=1e-12, max_step=2e-3, t_eval=t).y[0]
    expected = c * drive[1] + k * (drive[0] - x0) + alpha * z
    yield_force = derived(THETA[None])[0, 0]
    assert np.abs(response(drive, THETA[None], t[1])[0] - expected).max() < 1e-6 * yield_force


def test_loses_per_cycle_the_viscous_loss_and_the_coulomb_loss_of_a_sharp_element() -> None:
    theta = THETA.copy()
    theta[4:] = [1e5, 1e4, 9e4, 1.0]  # turns over within 10 um: a Coulomb element of yield force alpha
    amplitude, omega = 0.02, 4.0
    _, drive = sine(amplitude, omega, 80_001)
    force = response(drive, theta[None], 1e-3)[0]
    loss = np.trapezoid(force[40_000:], drive[0, 40_000:])
    viscous = np.pi * theta[0] * omega * amplitude**2
    turnover = derived(theta[None])[0, 2]
    assert loss == pytest.approx(viscous + 4 * theta[3] * amplitude, rel=3 * turnover / amplitude)


def test_null_directions_leave_the_force_and_the_derived_quantities() -> None:
    scaled, s, n = THETA.copy(), 0.3, THETA[7]
    scaled[3:7] *= [1 / s, s, s ** (1 - n), s ** (1 - n)]
    _, drive = sine(0.01, 3.0, 900)
    pair = np.array([THETA, scaled])
    force = response(drive, pair, 1e-3)
    assert np.abs(force[1] - force[0]).max() < 1e-11 * np.ptp(force[0])
    assert derived(pair)[1] == pytest.approx(derived(pair)[0])


def test_parameters_of_the_loop_may_vary_along_the_samples() -> None:
    _, drive = sine(0.01, 3.0, 900)
    held = np.repeat(THETA[None, :, None], 900, axis=2)
    held[0, 3, 450:] *= 2.0  # alpha alone leaves the loop's shape, so the exact curve still holds
    constant, scaled = response(drive, THETA[None], 1e-3)[0], response(drive, held, 1e-3)[0]
    spring = THETA[0] * drive[1] + THETA[1] * (drive[0] - THETA[2])
    assert scaled[450:] - spring[450:] == pytest.approx(2 * (constant - spring)[450:], rel=1e-9)
    held[0, 4:7, 450:] *= 1.01
    assert np.abs(response(drive, held, 1e-3)[0] - scaled)[:450].max() < 1e-5 * np.ptp(scaled)


def test_start_values_are_near_the_force_they_came_from() -> None:
    _, drive = sine(0.05, 20.0, 4000)
    theta = THETA.copy()
    theta[1:3] = [1000.0, -0.05]
    found = start_values(drive, response(drive, theta[None], 1e-3)[0], 1e-3)
    started = derived(np.array([[found.get(name, start) for name, start in zip(SPEC.names, SPEC.start, strict=True)]]))[
        0
    ]
    assert started[0] == pytest.approx(derived(theta[None])[0, 0], rel=0.05)
    assert found["c"] == pytest.approx(1500, rel=0.05)
    assert -found["k"] * found["x0"] == pytest.approx(50.0, abs=5.0)
