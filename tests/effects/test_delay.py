"""Delay against shifted sines and the loop it opens."""

import numpy as np
import pytest

from mrfit.effects.delay import shape
from mrfit.simulate.assembly import assemble

DT = 1e-3


@pytest.mark.parametrize("tau", [0.0123, -0.0007, 0.05])
def test_sine_comes_late_by_tau(tau: float) -> None:
    t, w = np.arange(3000) * DT, 2 * np.pi * 5
    found = shape(np.sin(w * t)[None], {}, np.array([[tau, 0.0]]), DT)[0]
    assert np.abs(found - np.sin(w * (t - tau)))[100:-100].max() <= 1e-6


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_share_of_the_delay_is_a_first_order_lag(share: float) -> None:
    t, w, tau = np.arange(3000) * DT, 2 * np.pi * 5, 0.0123
    found = shape(np.sin(w * t)[None], {}, np.array([[tau, share]]), DT)[0]
    late = np.exp(1j * w * (t - (1 - share) * tau)) / (1 + 1j * w * share * tau)
    assert np.abs(found - late.imag)[300:-100].max() <= 3e-7


def test_record_that_is_early_is_so_by_dead_time_alone() -> None:
    wave = np.sin(np.arange(500.0))[None]
    assert np.array_equal(*(shape(wave, {}, np.array([[-0.003, share]]), DT) for share in (0.0, 0.7)))


def test_every_row_is_shifted_by_its_own_delay() -> None:
    ramp = np.tile(np.arange(100.0), (3, 1))
    found = shape(ramp, {}, np.array([[0.002, 0.0], [-0.002, 0.0], [0.0005, 0.0]]), DT)
    assert np.allclose(found[:, 50], [48.0, 52.0, 49.5])


@pytest.mark.parametrize("frequency", [1.0, 2.0, 4.0])
def test_loop_in_force_and_velocity_is_as_wide_as_acceleration_times_delay(frequency: float) -> None:
    w, stroke, tau = 2 * np.pi * frequency, 0.01, 2e-3
    t = np.arange(4000) * 1e-4
    v = stroke * w * np.cos(w * t)
    whole = assemble("bingham+delay")
    force = whole.simulate(v[None], np.array([[1.0, 1000.0, 0.0, tau, 0.0]]), 1e-4)[0] - np.sign(np.cos(w * (t - tau)))
    at = 0.25 / frequency + tau
    crossing = np.interp(at, t, force)
    assert abs(crossing) <= 0.01 * 1000 * stroke * w
    # velocity where the force passes 0: half the loop's width, growing with the square of frequency
    assert np.interp(at, t, v) == pytest.approx(-stroke * w**2 * tau, rel=0.01)
