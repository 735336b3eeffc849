"""Linear blocks against their closed forms and scipy's simulation."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.signal import lsim

from mrfit.kernels.lti import cascade_step, delayed, exponential, unit_gain_filter
from mrfit.kernels.past import RESERVED, begun


@given(seed=st.integers(0, 1000), size=st.floats(1e-6, 50.0))
@settings(max_examples=40, deadline=None)
def test_exponential_agrees_with_scipy(seed: int, size: float) -> None:
    matrix = size * np.tril(np.random.default_rng(seed).normal(size=(5, 5)) - np.eye(5))
    expected = expm(matrix)
    assert np.abs(exponential(matrix) - expected).max() <= 1e-10 * np.abs(expected).max()


def test_delay_of_a_ramp_is_exact_and_holds_the_first_value() -> None:
    ramp = 3.0 + np.arange(50.0)
    out = delayed(ramp, np.array([0.0, 2.5, 7.0]))
    assert np.array_equal(out[0], ramp)
    assert out[1, 10:] == pytest.approx(ramp[10:] - 2.5)
    assert out[1, :2].tolist() == [3.0, 3.0]
    assert np.array_equal(out[2, 7:], ramp[:-7])


POLES = np.array([[40.0, 40.0, 300.0, 1500.0]])
ZEROS = np.array([[2 * 0.6 / 200.0, 1 / 200.0**2]])


def test_gain_at_rest_is_one_whatever_poles_and_zeros() -> None:
    u = np.full((1, 4000), 2.0)
    u[0, 0] = -1.0
    assert unit_gain_filter(u, POLES, ZEROS, 1e-3)[0, -1] == pytest.approx(2.0, rel=1e-12)
    assert unit_gain_filter(np.full((1, 9), 5.0), POLES, ZEROS, 1e-3)[0].tolist() == [5.0] * 9


@pytest.mark.parametrize(
    ("poles", "zeros"),
    [(POLES, ZEROS), (np.array([[60.0, 400.0]]), np.array([[1 / 200.0, 0.0]])), (POLES * 3.7, ZEROS * [[1, 0]])],
)
def test_agrees_with_scipys_simulation_of_the_transfer_function(poles: np.ndarray, zeros: np.ndarray) -> None:
    t = 2e-3 * np.arange(300)
    u = np.random.default_rng(4).normal(size=300)
    u[0] = 0.0
    numerator = np.array([zeros[0, 1], zeros[0, 0], 1.0]) * poles.prod()
    expected = lsim((np.trim_zeros(numerator, "f"), np.poly(-poles[0])), u, t)[1]
    assert np.abs(unit_gain_filter(u[None], poles, zeros, 2e-3)[0] - expected).max() < 1e-7 * np.abs(expected).max()


def test_amplitude_of_a_slow_sine_is_that_of_the_transfer_function() -> None:
    w, dt = 30.0, 1e-4
    t = dt * np.arange(40_000)
    out = unit_gain_filter(np.sin(w * t)[None], POLES, ZEROS, dt)[0, 20_000:]
    s = 1j * w
    gain = (1 + ZEROS[0, 0] * s + ZEROS[0, 1] * s**2) * np.prod(POLES[0] / (s + POLES[0]))
    basis = np.exp(-s * t[20_000:])
    whole = int(2 * np.pi / w / dt) * 9
    assert 2 * np.abs(np.mean((out * basis)[:whole])) == pytest.approx(abs(gain), rel=2e-3)


@given(places=st.lists(st.tuples(st.integers(0, 2), st.integers(0, 2)), min_size=3, max_size=12))
@settings(max_examples=40, deadline=None)
def test_a_step_of_a_cascade_is_the_same_whatever_it_has_kept(places: list[tuple[int, int]]) -> None:
    states, kept = (0.3, -0.2, 0.1, 0.4), _past(28)
    for k, m in places:
        poles, dt = tuple(POLES[0] * (1.0 + k)), (0.0, 1e-3, 1.5e-3)[m]
        fresh = cascade_step(states, poles, (1.0, 2.0), dt, _past(28), 0)
        assert cascade_step(states, poles, (1.0, 2.0), dt, kept, 0) == fresh
        assert dt > 0.0 or fresh == states
        states = fresh


def _past(own: int) -> np.ndarray:
    past = np.full(RESERVED + own, np.nan)
    begun(past, 0, 0, own)
    return past
