"""Delay against shifted sines and the loop it opens."""

import numpy as np
import pytest

from mrfit.effects.delay import moved, shape
from mrfit.kernels.filters import held_back, smooth_lag
from mrfit.simulate.assembly import assemble

DT = 1e-3


def seen(x: np.ndarray, tau: float, share: float, dt: float = DT, channel: str = "velocity") -> np.ndarray:
    """Return what is recorded of a force that is the channel itself."""
    theta = np.array([tau, share])
    drive = moved({channel: x}, theta, dt).get(channel, x)
    return shape(drive[None], {}, theta[None], dt)[0]


@pytest.mark.parametrize("tau", [0.0123, -0.0007, 0.05])
def test_sine_comes_late_by_tau(tau: float) -> None:
    t, w = np.arange(3000) * DT, 2 * np.pi * 5
    found = seen(np.sin(w * t), tau, 0.0)
    assert np.abs(found - np.sin(w * (t - tau)))[100:-100].max() <= 1e-6


@pytest.mark.parametrize("part", [0.1, 0.3, 0.5, 0.8])
@pytest.mark.parametrize("channel", ["velocity", "current"])
def test_a_part_of_a_sample_is_as_late_as_its_polynomial_lets_it(channel: str, part: float) -> None:
    # 20 samples a cycle: next order's term of a line through two samples, of a cubic through the last four
    step = 2 * np.pi / 20
    j = np.arange(400.0)
    error = np.abs(seen(np.sin(step * j), part * DT, 0.0, channel=channel) - np.sin(step * (j - part)))[4:].max()
    line = part * (1 - part) / 2 * step**2
    cubic = part * (1 - part) * (2 - part) * (3 - part) / 24 * step**4
    assert 0.9 < error / (line if channel == "current" else cubic) < 1.0


def turning(t: np.ndarray, tau: float, share: float) -> np.ndarray:
    """Return a force that turns within a sample at DT: the speed goes through the knee of the tanh in half of it."""
    model = assemble("tanh+delay")
    values = {"fy": 300.0, "a1": 250.0, "c": 500.0, "delay.tau": tau, "delay.s": share}
    speed = 0.2 * np.sin(2 * np.pi * 6 * t + 0.4)
    drive = np.stack([{"velocity": speed, "displacement": 0 * t}[n] for n in model.spec.inputs])
    theta = np.array([[values.get(n, 0.0) for n in model.spec.names]])
    return model.simulate(drive, theta, float(t[1] - t[0]))[0]


@pytest.mark.parametrize("tau", [1e-4, 3e-4, 7e-4])
def test_a_force_that_turns_within_a_sample_is_late_by_tau(tau: float) -> None:
    t = np.arange(2000) * DT
    wanted = turning(t - tau, 0.0, 0.0)
    assert np.abs(turning(t, tau, 0.0) - wanted)[4:].max() < 1e-3
    # a polynomial through the force cannot know where it turned
    through_force = held_back(turning(t, 0.0, 0.0)[None], np.array([tau / DT]))[0]
    assert np.abs(through_force - wanted)[4:].max() > 10.0


@pytest.mark.parametrize("tau", [5e-4, 2e-3])
def test_a_force_that_turns_within_a_sample_is_filtered_as_it_is_between_samples(tau: float) -> None:
    t, often = np.arange(500) * DT, 40
    wanted = turning(np.arange(500 * often) * DT / often, tau, 1.0)[::often]
    through_samples = smooth_lag(turning(t, 0.0, 0.0)[None], np.array([tau / DT]))[0]
    off, before = (np.sqrt(np.mean((f - wanted)[5:] ** 2)) for f in (turning(t, tau, 1.0), through_samples))
    assert off < 0.3 * before


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_share_of_the_delay_is_a_first_order_lag(share: float) -> None:
    t, w, tau = np.arange(3000) * DT, 2 * np.pi * 5, 0.0123
    late = np.exp(1j * w * (t - (1 - share) * tau)) / (1 + 1j * w * share * tau)
    assert np.abs(seen(np.sin(w * t), tau, share) - late.imag)[300:-100].max() <= 3e-7


def test_uneven_steps_are_late_by_as_much() -> None:
    steps = np.random.default_rng(5).uniform(2e-4, 2e-3, 2000)
    t = np.cumsum(steps) - steps[0]
    w, tau = 2 * np.pi * 5, 7e-4
    theta = np.array([tau, 0.0])
    drive = moved({"velocity": np.sin(w * t), "current": t}, theta, steps)
    assert np.abs(drive["velocity"] - np.sin(w * (t - tau)))[10:].max() <= 1e-6
    assert np.abs(drive["current"] - np.maximum(t - tau, 0.0)).max() <= 1e-12


def test_record_that_is_early_is_so_by_dead_time_alone() -> None:
    wave = np.sin(np.arange(500.0))
    assert np.array_equal(*(seen(wave, -0.003, share) for share in (0.0, 0.7)))


def test_every_row_is_late_by_its_own_delay() -> None:
    model = assemble("bingham+delay")
    theta = np.array([[0.0, 1.0, 0.0, tau, 0.0] for tau in (0.002, -0.002, 0.0005, 0.0)])
    found = model.simulate(np.arange(100.0)[None], theta, DT)
    assert np.allclose(found[:, 50], [48.0, 52.0, 49.5, 50.0])


def test_the_clock_of_a_record_is_not_late() -> None:
    assert list(moved({"velocity": np.ones(9), "time": np.arange(9.0)}, np.array([0.002, 0.0]), DT)) == ["velocity"]


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
