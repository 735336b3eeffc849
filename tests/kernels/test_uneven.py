"""Operators at uneven steps: those at equal steps where steps are equal, closed forms where they are not."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.core.specs import Array
from mrfit.kernels import filters, friction, lti, uneven
from mrfit.kernels.spencer import TOLERANCE, spencer

STEPS = np.random.default_rng(7).uniform(1e-4, 3e-3, 400)
TIMES = uneven.times_of(STEPS)
EQUAL = np.full(400, 1.3e-3)
RANDOM = np.cumsum(np.random.default_rng(8).normal(size=(2, 400)), axis=1)


def column(*values: float) -> Array:
    return np.array(values)


def test_equal_steps_give_what_the_operators_at_equal_steps_give() -> None:
    dt, tau = EQUAL[0], column(0.0, 0.007)
    one = RANDOM[0]
    pairs = [
        (uneven.smooth_lag(RANDOM, tau, EQUAL), filters.smooth_lag(RANDOM, tau / dt)),
        (uneven.chord_lag(one, one, one**3, 0.2, EQUAL), filters.chord_lag(one, one, one**3, 0.2 / dt)),
        (uneven.released(one, 0.04, EQUAL), filters.released(one, 0.04 / dt)),
        (uneven.smooth_play(one, 0.3, EQUAL), filters.smooth_play(one, 0.3)),
        (uneven.level(one, EQUAL), filters.level(one)),
        (uneven.delayed(one, column(0.0, 0.0101), EQUAL), lti.delayed(one, column(0.0, 0.0101) / dt)),
        *(
            (uneven.shifted(RANDOM, column(-late, late), EQUAL), filters.shifted(RANDOM, column(-late, late) / dt))
            for late in (0.0, 4e-4, 0.0111, 9.0)
        ),
        *(
            (uneven.held_back(RANDOM, column(0.0, late), EQUAL), filters.held_back(RANDOM, column(0.0, late) / dt))
            for late in (4e-4, 0.0111, 9.0)
        ),
    ]
    poles, zeros = np.array([[50.0, 300.0, 900.0], [20.0, 30.0, 40.0]]), np.array([[1e-3, 1e-6], [0.0, 0.0]])
    pairs.append((uneven.unit_gain_filter(RANDOM, poles, zeros, EQUAL), lti.unit_gain_filter(RANDOM, poles, zeros, dt)))
    for found, expected in pairs:
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-11 * np.ptp(RANDOM))


def test_a_lag_of_a_ramp_and_of_a_parabola_is_their_closed_form() -> None:
    tau = 0.02
    decay = np.exp(-TIMES / tau)
    ramp = TIMES - tau * (1.0 - decay)
    np.testing.assert_allclose(uneven.lag(TIMES[None], column(tau), STEPS)[0], ramp, atol=1e-15)
    parabola = TIMES**2 - 2.0 * tau * ramp
    lines = uneven.lag(TIMES[None] ** 2, column(tau), STEPS)[0]
    found = uneven.smooth_lag(TIMES[None] ** 2, column(tau), STEPS)[0]
    # at the first sample no second derivative is known: half a step's bend, which is forgotten
    settled = TIMES > 0.3
    assert np.abs(found - parabola)[settled].max() < 1e-3 * np.abs(lines - parabola)[settled].max()


def test_delays_are_exact_for_the_polynomials_they_pass_through() -> None:
    late = 0.0123
    inside = TIMES > late + 4 * STEPS.max()
    ago = TIMES - late
    np.testing.assert_allclose(uneven.delayed(3.0 * TIMES, column(late), STEPS)[0][inside], 3.0 * ago[inside])
    cubic = TIMES**3 - TIMES**2
    for moved in (uneven.held_back, uneven.shifted):
        for age in (2e-5, late):
            back = TIMES - age
            got = moved(cubic[None], column(age), STEPS)[0]
            body = slice(5, -3)
            np.testing.assert_allclose(got[body][inside[body]], (back**3 - back**2)[body][inside[body]], atol=1e-13)


def test_held_back_knows_nothing_of_later_samples() -> None:
    x = RANDOM[:1].copy()
    changed = x.copy()
    changed[0, 200:] += 5.0
    for age in (1e-5, 1e-3, 0.02):
        before, after = (uneven.held_back(v, column(age), STEPS)[0] for v in (x, changed))
        assert np.array_equal(before[:200], after[:200]) and not np.array_equal(before, after)


def test_a_play_turns_at_the_vertex_between_samples() -> None:
    # a parabola that turns between samples: the play has seen its vertex, wherever samples lie
    middle = 0.5 * TIMES[-1]
    x = -((TIMES - middle) ** 2)
    width = 1e-9
    after = uneven.smooth_play(x, width, STEPS)
    k = int(np.searchsorted(TIMES, middle)) + 1
    assert x.max() < -width  # no sample on the vertex itself
    narrow = uneven.smooth_play(x, 0.5 * abs(x[k]), STEPS)
    assert narrow[k] == pytest.approx(-0.5 * abs(x[k]), rel=1e-9)
    np.testing.assert_allclose(after, np.clip(after, x - width, x + width))


def test_the_level_of_a_sine_is_its_middle() -> None:
    times = np.sort(np.random.default_rng(3).uniform(0.0, 1.0, 4000))
    steps = np.diff(times, prepend=times[0] - 1e-3)
    assert abs(uneven.level(7.0 + np.sin(2 * np.pi * 12.3 * times), steps) - 7.0) < 1e-3
    # the mean of the samples, crowded in one half, would not be
    crowded = np.concatenate([np.linspace(0, 0.5, 2001), np.linspace(0.5, 1.0, 101)[1:]])
    x = np.sin(2 * np.pi * crowded)
    steps = np.diff(crowded, prepend=-1e-3)
    assert abs(uneven.level(x, steps)) < 5e-3 and abs(filters.level(x)) > 0.1


def test_a_filter_with_extra_samples_on_the_line_between_is_the_same() -> None:
    """Linear blocks are exact for straight inputs: samples may be added on the lines between."""
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(1e-3, 4e-3, 60))
    u = rng.normal(size=60)
    every = np.sort(np.concatenate([times, rng.uniform(times[0], times[-1], 200)]))
    more, at = np.interp(every, times, u), np.searchsorted(every, times)
    coarse, fine = (np.diff(t, prepend=t[0] - 1e-3) for t in (times, every))
    poles, zeros = np.array([[50.0, 300.0, 900.0, 1200.0]]), np.array([[1e-3, 1e-6]])
    for f in (
        lambda x, h: uneven.unit_gain_filter(x[None], poles, zeros, h)[0],
        lambda x, h: uneven.lag(x[None], column(0.004), h)[0],
        lambda x, h: uneven.delayed(x, column(0.0), h)[0],
    ):
        np.testing.assert_allclose(f(more, fine)[at], f(u, coarse), atol=1e-12)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000))
def test_lugre_and_spencer_do_not_feel_samples_added_on_a_line(seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(1e-3, 4e-3, 30))
    v = 0.1 * rng.normal(size=30)
    every = np.sort(np.concatenate([times, rng.uniform(times[0], times[-1], 60)]))
    more, at = np.interp(every, times, v), np.searchsorted(every, times)
    coarse, fine = (np.diff(t, prepend=t[0] - 1e-3) for t in (times, every))
    lugre = np.array([1e5, 50.0, 20.0, 400.0, 0.0, 0.01, 3.0])[:, None, None]
    off = friction.lugre(more, lugre, fine)[0, at] - friction.lugre(v, lugre, coarse)[0]
    assert np.abs(off).max() < 1e-9 * 400.0
    damper = np.array([1e4, 800.0, 0.0, 500.0, 500.0, 150.0, 80.0, 70.0, 2.0, 0.0])[:, None, None]
    one, both = (spencer(np.zeros_like(w), w, damper, h, TOLERANCE)[0] for w, h in ((v, coarse), (more, fine)))
    assert np.abs(both[at] - one).max() < 1e-4 * 500.0
