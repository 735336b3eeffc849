"""Hammerstein-Wiener: its static map, unit gains, and order of the blocks."""

import numpy as np
import pytest

from mrfit.models.hammerstein_wiener import SPEC, response, start_values

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
