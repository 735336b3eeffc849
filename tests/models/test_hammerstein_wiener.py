"""Hammerstein-Wiener: its static map, unit gains, and order of the blocks."""

import numpy as np
import pytest

from mrfit.models.hammerstein_wiener import SPEC, far_starts, response, sensitivities, start_values

C_PRE, C_POST, A, B = 3e4, 1200.0, 0.02, 0.004
THETA = SPEC.start.copy()
THETA[:4] = [C_PRE, C_POST, A, B]
THETA[-1] = -20.0


def static(v: np.ndarray, current: np.ndarray) -> np.ndarray:
    """Return Savaia et al. eq. 2 with its third branch mended."""
    turn = A * current + B
    return np.select(
        [v > turn, v < -turn],
        [C_POST * (v - turn) + C_PRE * turn, C_POST * (v + turn) - C_PRE * turn],
        C_PRE * v,
    )


@pytest.mark.parametrize("v", [-0.3, -0.01, 0.0, 0.015, 0.2])
@pytest.mark.parametrize("current", [0.0, 0.7, 2.0])
def test_force_at_constant_inputs_is_the_static_map_since_both_blocks_have_unit_gain(v: float, current: float) -> None:
    drive = np.stack([np.full(2000, v), np.full(2000, current)])
    drive[:, 0] = 0.0  # so that both filters have to settle
    expected = static(np.array([v]), np.array([current]))[0] - 20.0
    assert response(drive, THETA[None], 1e-3)[0, -1] == pytest.approx(expected, rel=1e-9, abs=1e-6)


def test_fast_blocks_leave_the_static_map() -> None:
    fast = THETA.copy()
    fast[4:14] = [1e4, 1e4, 1e4, 1e4, 1e4, 1.0, 1e4, 1e4, 1e4, 0.0]
    t = np.linspace(0, 2, 2001)
    drive = np.stack([0.2 * np.sin(2 * np.pi * t), 1 + 0.5 * np.cos(2 * np.pi * t)])
    expected = static(*drive) - 20.0
    assert np.abs(response(drive, fast[None], t[1])[0] - expected).max() < 0.01 * np.ptp(expected)


def test_current_step_reaches_the_force_after_the_delay_only() -> None:
    late = THETA.copy()
    late[13] = 0.02
    drive = np.stack([np.full(400, 0.2), np.where(np.arange(400) < 100, 0.0, 1.0)])
    force = response(drive, late[None], 1e-3)[0]
    assert np.ptp(force[:119]) < 1e-9
    assert force[125] > force[118] + 1.0
    assert force[-1] == pytest.approx(static(np.array([0.2]), np.array([1.0]))[0] - 20.0, rel=1e-4)


def test_hysteresis_block_acts_on_the_force_and_widens_the_loop_with_frequency() -> None:
    widths = []
    for frequency in (0.5, 4.0):
        t = np.linspace(0, 2 / frequency, 4001)
        v = 0.2 * np.sin(2 * np.pi * frequency * t)
        force = response(np.stack([v, np.full(4001, 1.0)]), THETA[None], t[1])[0]
        widths.append(-np.trapezoid(force[2000:], v[2000:]))
    assert widths[1] > 3 * widths[0] > 0


def test_start_values_share_out_the_yield_velocity_at_the_mean_current() -> None:
    t = np.linspace(0, 2, 4001)
    drive = np.stack([0.3 * np.sin(2 * np.pi * t), np.full(4001, 0.8)])
    found = start_values(drive, static(*drive) - 20.0, t[1])
    assert found["a"] * 0.8 + found["b"] == pytest.approx(A * 0.8 + B, rel=0.2)
    assert found["c_post"] == pytest.approx(C_POST, rel=0.05)
    assert found["c_pre"] == pytest.approx(C_PRE, rel=0.3)


@pytest.mark.parametrize("frequency", [0.5, 3.0])
def test_far_start_spreads_poles_and_zeros_about_the_frequency_of_the_test(frequency: float) -> None:
    t = np.linspace(0, 2 / frequency, 4001)
    drive = np.stack([0.3 * np.sin(2 * np.pi * frequency * t), np.full(4001, 0.8)])
    [found] = far_starts(drive, static(*drive), t[1])
    shares = np.array([found[name] for name in ("p1", "p2", "p3", "p4", "omega")]) / (2 * np.pi * frequency)
    assert shares == pytest.approx([0.3 if frequency == 3.0 else 1 / np.pi, 1.0, 10.0, 100.0, 0.5], rel=1e-3)
    assert {n: found[n] for n in ("c_pre", "c_post")}.items() <= start_values(drive, static(*drive), t[1]).items()


def test_a_damper_at_rest_has_no_far_start() -> None:
    assert far_starts(np.stack([np.zeros(100), np.full(100, 0.8)]), np.ones(100), 1e-3) == []


EVERY = np.arange(15)


def log(current: str, samples: int, dt: float) -> np.ndarray:
    t = dt * np.arange(samples)
    currents = {"held": 0.8 + 0 * t, "off": 0 * t, "steps": 1.0 * (t % 0.2 > 0.1), "sine": 0.8 + 0.7 * np.cos(33 * t)}
    return np.stack([0.2 * np.sin(25 * t + 1) + 0.05 * np.sin(71 * t), currents[current]])


def thetas(count: int, seed: int) -> np.ndarray:
    return THETA * np.random.default_rng(seed).uniform(0.6, 1.6, size=(count, 15))


def difference(drive: np.ndarray, theta: np.ndarray, dt: float, column: int) -> np.ndarray:
    """Return the central difference of the response along one parameter, (P, N)."""
    step = np.zeros_like(theta)
    step[:, column] = 1e-5 * np.abs(theta[:, column])
    gap = response(drive, theta + step, dt) - response(drive, theta - step, dt)
    return gap / (2.0 * step[:, column, None])


@pytest.mark.parametrize("current", ["held", "off", "steps", "sine"])
@pytest.mark.parametrize("dt", [2e-4, 1e-3, 7e-3])
@pytest.mark.parametrize("seed", range(3))
def test_sensitivities_are_the_response_and_its_differences(current: str, dt: float, seed: int) -> None:
    drive, theta = log(current, 500, dt), thetas(3, seed)
    out = sensitivities(drive, theta, dt, EVERY)
    expected = response(drive, theta, dt)
    assert np.abs(out[:, 0] - expected).max() <= 1e-9 * np.ptp(expected)
    for k in EVERY:
        slope = difference(drive, theta, dt, k)
        # differences of numbers of this size, over 2e-5 of the parameter
        noise = 1e-12 * np.ptp(expected) / (1e-5 * np.abs(theta[:, k].min()))
        error = np.abs(out[:, 1 + k] - slope).max()
        assert error <= 1e-6 * np.abs(slope).max() + noise, SPEC.names[k]
    np.testing.assert_array_equal(sensitivities(drive, theta, dt, EVERY[::-2])[:, 1:], out[:, :0:-2])


def test_steps_along_linear_parameters_are_exact() -> None:
    drive, theta, columns = log("sine", 300, 1e-3), thetas(2, 5), np.array([14, 0, 1])
    out = sensitivities(drive, theta, 1e-3, columns)
    for c, (column, step) in enumerate(zip(columns, (40.0, 2e4, -700.0), strict=True)):
        moved = theta.copy()
        moved[:, column] += step
        expected = response(drive, moved, 1e-3)
        assert np.abs(out[:, 0] + step * out[:, 1 + c] - expected).max() <= 1e-9 * np.ptp(expected)


def test_sensitivities_to_no_parameter_are_the_response() -> None:
    drive, theta = log("steps", 300, 1e-3), thetas(3, 6)
    out = sensitivities(drive, theta, 1e-3, EVERY[:0])
    assert out.shape == (3, 1, 300)
    expected = response(drive, theta, 1e-3)
    assert np.abs(out[:, 0] - expected).max() <= 1e-9 * np.ptp(expected)


def test_sensitivities_take_views_and_read_only_arrays() -> None:
    drive, theta = log("sine", 200, 1e-3), thetas(3, 7)
    expected = sensitivities(drive, theta, 1e-3, EVERY)
    sealed, wide = drive.copy(), np.repeat(theta, 2, axis=1)[:, ::2]
    sealed.flags.writeable = False
    out = sensitivities(sealed, wide, 1e-3, np.arange(30)[::2] // 2)
    np.testing.assert_array_equal(out, expected)


@pytest.mark.parametrize("place", [k for k in EVERY if SPEC.names[k] != "tau"])
def test_vector_that_is_not_a_number_has_no_response_and_no_sensitivities(place: int) -> None:
    drive, theta = log("sine", 100, 1e-3), thetas(2, 8)
    theta[1, place] = np.nan
    assert not np.isfinite(response(drive, theta, 1e-3)[1, 1:]).any()
    out = sensitivities(drive, theta, 1e-3, EVERY)
    assert not np.isfinite(out[1]).any()
    assert np.isfinite(out[0]).all()
