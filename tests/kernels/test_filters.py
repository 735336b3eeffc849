"""Operators against closed forms: first-order lag, delayed cubics and sines, the play, leakage of a Hann window."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrfit.kernels.filters import (
    lag,
    level,
    play,
    play_step,
    running_integral,
    shifted,
    smooth_lag,
)

SIGNALS = arrays(np.float64, st.integers(1, 40), elements=st.floats(-1e6, 1e6))


# the first call compiles
@settings(deadline=None)
@given(SIGNALS)
def test_operators_are_the_identity_at_the_value_that_makes_them_vanish(x: np.ndarray) -> None:
    assert np.array_equal(lag(x[None], np.zeros(1))[0], x)
    assert np.array_equal(smooth_lag(x[None], np.zeros(1))[0], x)
    assert np.array_equal(shifted(x[None], np.zeros(1))[0], x)
    assert np.array_equal(play(x, 0.0), x)


@pytest.mark.parametrize("ratio", [1e-6, 0.3, 1.0, 40.0, 1e6])
def test_lag_follows_a_ramp_at_the_distance_of_its_time_constant(ratio: float) -> None:
    j = np.arange(200.0)
    expected = j - ratio * -np.expm1(-j / ratio)
    assert np.abs(lag(j[None], np.array([ratio]))[0] - expected).max() <= 1e-9 * max(1.0, ratio**0.5)


@pytest.mark.parametrize("ratio", [0.02, 0.3, 4.0, 99.0, 101.0])
def test_smooth_lag_of_a_parabola_is_exact_once_its_start_is_forgotten(ratio: float) -> None:
    j = np.arange(5000.0)
    steady = j**2 - 2 * ratio * j + 2 * ratio**2
    found = smooth_lag(1e-6 * j[None] ** 2, np.array([ratio]))[0]
    assert np.abs(found - 1e-6 * steady)[4000:-1].max() <= 1e-10


def test_lag_of_a_sine_has_the_gain_and_phase_of_a_first_order_system() -> None:
    n, ratio, w = 200_000, 300.0, 2 * np.pi / 2000
    steady = lag(np.sin(w * np.arange(n))[None], np.array([ratio]))[0, -2000:]
    j = np.arange(n)[-2000:]
    expected = np.sin(w * j - np.arctan(w * ratio)) / np.hypot(1, w * ratio)
    assert np.abs(steady - expected).max() <= 1e-6


# the first call compiles
@settings(deadline=None)
@given(st.floats(-8.0, 8.0))
def test_shift_moves_cubics_exactly(shift: float) -> None:
    j = np.arange(40.0)
    cubic = lambda t: 0.01 * t**3 - 0.4 * t**2 + 3 * t - 5  # noqa: E731
    moved = shifted(cubic(j)[None], np.array([shift]))[0]
    assert np.abs(moved - cubic(j - shift))[11:29].max() <= 1e-10


@pytest.mark.parametrize("shift", [3, -3])
def test_shift_by_whole_samples_copies_samples_and_holds_the_end(shift: int) -> None:
    x = np.random.default_rng(1).normal(size=50)
    moved = shifted(x[None], np.array([float(shift)]))[0]
    kept = moved[3:] if shift > 0 else moved[:-3]
    assert np.array_equal(kept, x[:-3] if shift > 0 else x[3:])
    assert np.array_equal(moved[:3] if shift > 0 else moved[-3:], np.full(3, x[0] if shift > 0 else x[-1]))


@pytest.mark.parametrize("shift", [1e3, -1e3, 1e300, -1e300])
def test_shift_beyond_the_record_holds_its_end(shift: float) -> None:
    x = np.arange(7.0)
    assert np.array_equal(shifted(x[None], np.array([shift]))[0], np.full(7, 0.0 if shift > 0 else 6.0))


# the first call compiles
@settings(deadline=None)
@given(SIGNALS, st.floats(0.0, 100.0))
def test_play_stays_within_its_half_width_and_moves_only_when_pushed(x: np.ndarray, width: float) -> None:
    y = play(x, width)
    slack = width * (1 + 1e-12) + 1e-12 * np.abs(x)
    assert (np.abs(y - x) <= slack).all()
    before = np.concatenate([[0.0], y[:-1]])
    free = np.abs(x - before) < width
    assert np.array_equal(y[free], before[free])


@pytest.mark.parametrize("per_cycle", [41.3, 83.33, 500.0])
def test_play_step_turns_where_the_signal_does_between_its_samples(per_cycle: float) -> None:
    j, width = np.arange(2000), 0.01
    x, y = np.sin(2 * np.pi * j / per_cycle), np.zeros(2000)
    chord = (0.0, 0.0)
    for k in range(1, 2000):
        y[k], *chord = play_step(y[k - 1], tuple(chord), x[k - 1], x[k], width, 1.0)
    # the falling branch hangs at the crest less the half-width until the signal has turned by the whole width
    crest = np.arccos(1.0 - 2 * width) * per_cycle / (2 * np.pi)
    hanging = (j > per_cycle / 4) & (((j - per_cycle / 4) % per_cycle) < crest)
    assert np.abs(y[hanging] - (1.0 - width)).max() <= 0.01 * (2 * np.pi / per_cycle) ** 2 / 8 + 1e-12


def test_play_of_a_sine_encloses_its_parallelogram() -> None:
    t = np.linspace(0, 4 * np.pi, 40_001)
    x, width = np.sin(t), 0.2
    y = play(x, width)
    last = slice(20_000, None)
    area = np.trapezoid(y[last], x[last])
    assert abs(area) == pytest.approx(4 * width * (1 - width), rel=1e-3)
    assert area < 0


@pytest.mark.parametrize("cycles", [3.0, 5.3, 10.5])
def test_level_is_hardly_moved_by_an_unfinished_cycle(cycles: float) -> None:
    phase = 2 * np.pi * cycles * (np.arange(4000) + 0.5) / 4000
    for wave in (np.sin(phase), np.cos(phase)):
        assert abs(level(7.0 + wave) - 7.0) <= 0.5 / cycles**3


def test_running_integral_of_a_line_is_its_parabola() -> None:
    t = np.arange(100) * 0.01
    assert np.allclose(running_integral(t, 0.01), t**2 / 2, rtol=0, atol=1e-14)
