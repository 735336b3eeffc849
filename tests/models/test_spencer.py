"""Spencer's model: null directions, energy, start values; its integration is tested in tests/kernels."""

import numpy as np
import pytest

from mrfit.models.spencer import SPEC, derived, response, rough_response, start_values
from mrfit.simulate.assembly import assemble

THETA = SPEC.start


def sine(frequency: float = 2.0, amplitude: float = 0.01) -> tuple[np.ndarray, float]:
    t = np.linspace(0, 2 / frequency, 1001)
    w = 2 * np.pi * frequency
    return amplitude * np.stack([np.sin(w * t), w * np.cos(w * t)]), float(t[1])


def test_null_directions_leave_the_force_and_the_derived_quantities() -> None:
    scaled, s, n = THETA.copy(), 0.4, THETA[8]
    scaled[4:8] *= [1 / s, s, s ** (1 - n), s ** (1 - n)]
    drive, dt = sine()
    pair = np.array([THETA, scaled])
    force = response(drive, pair, dt)
    assert np.abs(force[1] - force[0]).max() < 1e-9 * np.ptp(force[0])
    assert derived(pair)[1] == pytest.approx(derived(pair)[0])


def test_stiffness_and_offset_add_their_printed_terms() -> None:
    drive, dt = sine()
    moved = THETA.copy()
    moved[[2, 9]] += [1000.0, 30.0]
    force = response(drive, np.array([THETA, moved]), dt)
    assert force[1] - force[0] == pytest.approx(1000.0 * drive[0] + 30.0)


def test_loop_dissipates_and_runs_counter_clockwise_in_velocity() -> None:
    drive, dt = sine()
    force = response(drive, THETA[None], dt)[0]
    steady = slice(500, None)
    assert np.trapezoid(force[steady], drive[0, steady]) > 0
    assert np.trapezoid(force[steady], drive[1, steady]) < 0


def test_force_vanishes_as_the_series_damper_does() -> None:
    drive, dt = sine()
    soft = THETA.copy()
    soft[[0, 2, 9]] = [1e-9, 0.0, 0.0]
    assert np.abs(response(drive, soft[None], dt)).max() < 1e-6


def test_published_damping_is_within_the_bounds() -> None:
    c0, c_inf = SPEC.params[:2]
    for published_c0, published_c_inf in ((20_330, 961.25), (162_640, 2401.3)):  # preyield paper Tables 1-2, LMH
        assert c0.low < published_c0 < c0.high
        assert c_inf.low < published_c_inf < c_inf.high


def test_start_values_are_near_the_force_they_came_from() -> None:
    drive, dt = sine(3.0)
    found = start_values(drive, response(drive, THETA[None], dt)[0], dt)
    assert found["alpha"] == pytest.approx(500, rel=0.2)
    assert found["C_inf"] == pytest.approx(2000, rel=0.2)


def test_a_rough_simulation_differs_little_and_effects_act_on_it_too() -> None:
    drive, dt = sine()
    theta = np.array([THETA * np.exp(0.3 * np.random.default_rng(k).standard_normal(10)) for k in range(8)])
    theta[:, 8] = np.maximum(theta[:, 8], 1.0)
    exact, rough = response(drive, theta, dt), rough_response(drive, theta, dt)
    errors = np.abs(rough - exact).max(axis=1) / np.ptp(exact, axis=1)
    assert 0.0 < errors.max() < 1e-4
    whole = assemble("spencer+force-offset")
    assert whole.rough is not None
    pair = np.array([[*THETA, 0.0], [*THETA, 40.0]])
    shifted = whole.rough(drive, pair, dt)
    assert shifted[0] == pytest.approx(rough_response(drive, THETA[None], dt)[0])
    assert np.abs(shifted[1] - shifted[0] - 40.0).max() < 1e-9
    assert assemble("tanh").rough is None
