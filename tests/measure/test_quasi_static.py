"""Stiffness, friction and lost work of slow cycles against what was planted."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.errors import DataError
from mrfit.measure.quasi_static import quasi_static

DT = 0.01


def slow(cycles: float, triangular: bool, stroke: float = 0.02) -> np.ndarray:
    phase = 2.0 * np.pi * np.arange(round(cycles * 600)) / 600
    return 0.005 + stroke * (np.arcsin(np.sin(phase)) * 2.0 / np.pi if triangular else np.sin(phase))


@settings(deadline=None, max_examples=8)
@given(st.floats(-500.0, 5000.0), st.floats(1.0, 200.0), st.floats(-50.0, 50.0), st.booleans(), st.integers(0, 99))
def test_planted_stiffness_and_friction_are_found(
    stiffness: float, friction: float, offset: float, triangular: bool, seed: int
) -> None:
    x = slow(3, triangular)
    # the friction turns over within a millimetre of each reversal
    state, force = 0.0, np.empty(len(x))
    for j, step in enumerate(np.diff(x, prepend=x[0])):
        state = float(np.clip(state + step / 5e-4, -1.0, 1.0))
        force[j] = stiffness * (x[j] - 0.005) + friction * state + offset
    noise = 0.01 * friction * np.random.default_rng(seed).standard_normal(len(x))
    found = quasi_static("a", x, force + noise, DT)
    assert found.friction == pytest.approx(friction, rel=0.01)
    assert found.stiffness == pytest.approx(stiffness, abs=0.005 * friction / 0.02 + 1e-3)
    assert found.offset == pytest.approx(offset, abs=0.01 * friction)
    assert found.loss == pytest.approx(4.0 * 0.02 * friction, rel=0.06)
    assert found.ways >= 4


def test_a_force_without_friction_has_none() -> None:
    x = slow(2, triangular=False)
    found = quasi_static("a", x, 300.0 * x, DT)
    assert found.friction == pytest.approx(0.0, abs=1e-3) and found.stiffness == pytest.approx(300.0, rel=1e-3)


def test_a_stroke_that_does_not_come_back_is_refused() -> None:
    x = np.linspace(0.0, 0.02, 500)
    with pytest.raises(DataError, match="no stroke there and back"):
        quasi_static("a", x, 100.0 * x, DT)


@pytest.mark.parametrize(
    ("size", "text"),
    [(0.0, "the force is constant but for noise"), (1e-300, "the force moves by 2e-300 N, which is no force")],
)
def test_a_force_that_is_none_is_refused(size: float, text: str) -> None:
    x = slow(2, triangular=True)
    with pytest.raises(DataError, match=text):
        quasi_static("a", x, size * np.sign(np.gradient(x)), DT)
