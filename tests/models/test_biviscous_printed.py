"""Biviscous as printed: the jump at yield, the slopes either side, and the continuous form where the lines meet."""

import numpy as np
import pytest

from mrfit.apply.car import Car, Control, Timing, drive, rms
from mrfit.apply.roads import Bump
from mrfit.apply.stepper import Stepper
from mrfit.models import biviscous
from mrfit.models.biviscous_printed import response, start_values

# C0 (N s/m), fy (N), C_inf (N s/m), vy (m/s), f0 (N): the preyield paper's MH row at 1 A
THETA = np.array([[27392.0, 1005.0, 3135.9, 0.0041, -10.0]])


def force_at(*velocities: float) -> np.ndarray:
    return response(np.array([velocities]), THETA, 1e-3)[0] + 10.0


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_force_jumps_to_fy_at_yield(sign: int) -> None:
    c0, fy, _, vy, _ = THETA[0]
    below, above = force_at(sign * vy * (1 - 1e-9), sign * vy * (1 + 1e-9))
    assert [below, above] == pytest.approx([sign * c0 * vy, sign * fy], rel=1e-6)


def test_slopes_are_those_of_both_lines() -> None:
    force = force_at(0.001, 0.002, 0.1, 0.2)
    assert (force[1] - force[0]) / 0.001 == pytest.approx(THETA[0, 0])
    assert (force[3] - force[2]) / 0.1 == pytest.approx(THETA[0, 2])


def test_is_biviscous_where_the_lines_meet() -> None:
    v = np.linspace(-0.2, 0.2, 401)[None]
    fy, c_inf, vy = 800.0, 3000.0, 0.02
    own = response(v, np.array([[fy / vy + c_inf, fy + c_inf * vy, c_inf, vy, 5.0]]), 1e-3)
    np.testing.assert_allclose(own, biviscous.response(v, np.array([[fy, c_inf, vy, 5.0]]), 1e-3), rtol=1e-12)


def test_start_values_find_the_post_yield_line() -> None:
    drive_of = 0.3 * np.cos(2 * np.pi * np.arange(2000) / 1000.0)[None]
    found = start_values(drive_of, response(drive_of, THETA, 1e-3)[0], 1e-3)
    fy, c_inf, vy = (THETA[0, k] for k in (1, 2, 3))
    assert [found["fy"], found["C_inf"]] == pytest.approx([fy - c_inf * vy, c_inf], rel=0.02)


def test_the_printed_parameters_give_the_printed_ride() -> None:
    """Table 4 prints 0.627 for the fit MH; plain Runge-Kutta steps of 0.1 ms, written apart, give 0.6266."""
    from benchmarks.apply_papers import PRINTED_RIDE, ride_damper

    for fit, printed in zip(("LMH", "MH"), PRINTED_RIDE["biviscous-printed"], strict=True):
        damper = ride_damper("biviscous-printed", fit)
        pair = (Control("skyhook-on-off"), Bump())
        ride = drive(Stepper(damper), Car(500.0, 0.0, 78e3), [pair], Timing(4e-4, 1))[0]
        # at the steps: between them the force jumps back and forth
        assert rms(ride.acceleration[::2]) == pytest.approx(printed, rel=0.015)
