"""What effects with memory give at a sample does not hang on samples after it: the exported C can be the same map."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.effects import coulomb_friction, current_lag, delay, eddy_current, stribeck, velocity_hysteresis
from mrfit.kernels.filters import chord_lag, held_back, lag

DT = 1e-3
Effect = Callable[[np.ndarray], np.ndarray]


def friction(x: np.ndarray) -> np.ndarray:
    channels = {"displacement": 0.01 * x, "velocity": np.full(len(x), 0.01)}
    return coulomb_friction.term(channels, np.array([[60.0, 5e-4, 0.5, 3e-4]]), DT)[0]


def falling(x: np.ndarray) -> np.ndarray:
    channels = {"displacement": 0.01 * x, "velocity": np.full(len(x), 0.01)}
    return stribeck.term(channels, np.array([[40.0, 0.03, 1.5, 5e-4, 0.5, 3e-4]]), DT)[0]


def play(x: np.ndarray) -> np.ndarray:
    return velocity_hysteresis.transform({"displacement": 0 * x, "velocity": x}, np.array([0.0, 0.2]), DT)["velocity"]


def late(tau: float, share: float) -> Effect:
    theta = np.array([tau, share])

    def seen(x: np.ndarray) -> np.ndarray:
        # a motion and a current, of which the one goes through a cubic and the other along a line
        drive = delay.moved({"velocity": x, "current": x}, theta, DT)
        return delay.shape((drive["velocity"] + drive["current"])[None], {}, theta[None], DT)[0]

    return seen


def lagging(tau: float, t_d: float) -> Effect:
    return lambda x: current_lag.transform({"current": x}, np.array([tau, t_d]), DT)["current"]


def eddy(x: np.ndarray) -> np.ndarray:
    return eddy_current.closed(lambda i: 0.03 * np.arcsinh(i), x, np.array([0.4]), DT)


EFFECTS: dict[str, Effect] = {
    "coulomb friction": friction,
    "stribeck": falling,
    "play": play,
    "delay": late(0.0123, 0.3),
    "short delay": late(4e-4, 0.0),
    "lag": late(0.008, 0.9),
    "current lag": lagging(0.02, 0.0043),
    "short current lag": lagging(0.02, 3e-4),
    "prompt current lag": lagging(0.02, 0.0),
    "eddy currents": eddy,
}


# the first call compiles
@pytest.mark.parametrize("name", EFFECTS)
@settings(max_examples=15, deadline=None)
@given(st.integers(4, 60), st.integers(0, 2**31))
def test_a_sample_knows_none_after_it(name: str, samples: int, seed: int) -> None:
    x = np.cumsum(np.random.default_rng(seed).normal(size=80))
    whole, part = EFFECTS[name](x)[:samples], EFFECTS[name](x[:samples])
    np.testing.assert_allclose(part, whole, rtol=0, atol=1e-9 * np.ptp(x))


def test_a_record_that_is_early_does() -> None:
    x = np.sin(0.2 * np.arange(80.0))
    early = late(-0.003, 0.0)
    assert np.abs(early(x[:40]) - early(x)[:40]).max() > 0.01


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 9.0))
def test_holding_back_moves_cubics_exactly(shift: float) -> None:
    j = np.arange(40.0)
    cubic = lambda t: 0.01 * t**3 - 0.4 * t**2 + 3 * t - 5  # noqa: E731
    moved = held_back(cubic(j)[None], np.array([shift]))[0]
    assert np.abs(moved - cubic(j - shift))[13:].max() <= 1e-9


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 50.0))
def test_a_lag_along_one_chord_is_a_lag(ratio: float) -> None:
    x = np.sin(0.1 * np.arange(200.0))
    fixed = lag(x[None], np.array([ratio]))[0]
    np.testing.assert_allclose(chord_lag(x, x, 0.5 * ratio * x, 2.0, np.ones(1))[0], fixed, rtol=0, atol=1e-9)
