"""Memory of travel and reversals against closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.kernels.memory import decayed, since_reversal, travel_memory


@settings(deadline=None)
@given(st.floats(1e-4, 1.0), st.integers(2, 200))
def test_a_memory_of_travel_fades_by_the_way_made(length: float, steps: int) -> None:
    # 1 forwards, then 0.5 back: z = 1 - exp(-s/d), then -1 + (z + 1)*exp(-s/d)
    step = np.concatenate([np.full(steps, 1.0 / steps), np.full(steps, -0.5 / steps)])
    z = travel_memory(step, np.array([length]))[0]
    there = 1.0 - np.exp(-1.0 / length)
    assert z[steps - 1] == pytest.approx(there, abs=1e-9)
    assert z[-1] == pytest.approx(-1.0 + (there + 1.0) * np.exp(-0.5 / length), abs=1e-9)


def test_sums_fade_by_one_share_a_sample() -> None:
    rng = np.random.default_rng(0)
    columns, keep = rng.normal(size=(50, 3)), 0.9
    weights = np.tril(keep ** np.subtract.outer(np.arange(50), np.arange(50)))
    np.testing.assert_allclose(decayed(columns, keep), weights @ columns, rtol=1e-12, atol=1e-13)


def test_a_standstill_leaves_the_memory_as_it_is() -> None:
    z = travel_memory(np.array([0.1, 0.1, 0.0, 0.0]), np.array([0.2]))[0]
    assert z[1] == z[2] == z[3] > 0.0


def test_travel_is_counted_from_the_last_turn_and_half_a_stroke_lies_between_two() -> None:
    t = np.linspace(0.0, 3.0, 3001)
    since, half = since_reversal(2.0 * np.cos(2.0 * np.pi * t), 0.01)
    x = 2.0 * np.cos(2.0 * np.pi * t)
    falling = (t % 1.0 > 0.1) & (t % 1.0 < 0.49)
    np.testing.assert_allclose(since[falling], 2.0 - x[falling], atol=1e-3)
    assert np.all(half[t > 1.1] == pytest.approx(2.0, abs=1e-3))
    assert half[0] == 0.0


@pytest.mark.parametrize(("swing", "turns"), [(0.05, 1), (0.2, 0)])
def test_a_small_swing_is_a_turn_only_if_asked(swing: float, turns: int) -> None:
    x = np.concatenate([np.linspace(0, 1, 50), np.linspace(1, 0.9, 10), np.linspace(0.9, 2, 50)])
    since = since_reversal(x, swing)[0]
    assert since[-1] == pytest.approx(1.1 if turns else 2.0)
