"""What columns without names may be is guessed from motions and forces of known units."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrfit.ingest.guesses import guesses, size_unit
from mrfit.ingest.table import Column

DT = 0.002
TIME = np.arange(4000) * DT


def columns(*signals: np.ndarray) -> list[Column]:
    return [Column("", None, values, place) for place, values in enumerate(signals)]


def press(frequency: float, amplitude: float, friction: float, noise: float = 0.0) -> tuple[np.ndarray, ...]:
    """Return displacement, velocity, force and current of a press in SI."""
    phase, rng = 2.0 * np.pi * frequency * TIME, np.random.default_rng(1)
    x, v = amplitude * np.sin(phase), amplitude * 2.0 * np.pi * frequency * np.cos(phase)
    force = friction * np.tanh(50.0 * v) + 900.0 * v
    signals = (x, v, force, np.full(len(TIME), 1.5))
    return tuple(s + noise * np.ptp(s) * rng.standard_normal(len(TIME)) for s in signals)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(0.5, 5.0),
    st.floats(0.003, 0.02),
    st.floats(50.0, 2000.0),
    st.sampled_from(
        [(1e3, 1e3, "mm", "mm/s"), (1e3, 1.0, "mm", "m/s"), (1.0, 1e3, "m", "mm/s"), (1.0, 1.0, "m", "m/s")]
    ),
    st.permutations(range(4)),
    st.sampled_from([0.0, 1e-3]),
)
def test_motion_force_and_current_are_told_in_any_order_and_unit(
    frequency: float,
    amplitude: float,
    friction: float,
    units: tuple[float, float, str, str],
    order: list[int],
    noise: float,
) -> None:
    x, v, force, current = press(frequency, amplitude, friction, noise)
    signals = (units[0] * x, units[1] * v, force, current)
    found = guesses(columns(*(signals[k] for k in order)), DT)
    told = {order[place]: (guess.channel, guess.unit) for place, guess in found.items()}
    expected = {0: ("displacement", units[2]), 1: ("velocity", units[3]), 2: ("force", "N"), 3: ("current", "A")}
    assert told == expected


def test_no_column_is_the_slope_of_one_that_it_is_not() -> None:
    x, _, force, _ = press(2.0, 0.01, 300.0)
    found = guesses(columns(1e3 * x, force), DT)
    assert {place: guess.channel for place, guess in found.items()} == {0: "displacement", 1: "force"}
    rng = np.random.default_rng(2)
    noise = guesses(columns(*rng.standard_normal((3, 500))), DT)
    assert "velocity" not in {guess.channel for guess in noise.values()}


def test_without_a_rate_no_slope_is_taken() -> None:
    x, v, force, _ = press(2.0, 0.01, 300.0)
    assert "velocity" not in {guess.channel for guess in guesses(columns(x, v, force), None).values()}


def test_columns_of_no_numbers_are_passed_over() -> None:
    x, v, _, _ = press(2.0, 0.01, 300.0)
    broken = np.full(len(TIME), np.nan)
    assert {*guesses(columns(broken, x, v), DT)} == {1, 2} and guesses(columns(broken), DT) == {}


@pytest.mark.parametrize(
    ("channel", "swing", "unit"),
    [
        ("displacement", 25.0, "mm"),
        ("displacement", 0.02, "m"),
        ("velocity", 80.0, "mm/s"),
        ("velocity", 0.3, "m/s"),
        ("force", 900.0, "N"),
        ("force", 1.4, "kN"),
        ("current", 2.0, "A"),
        ("current", 800.0, "mA"),
        ("flux", 1.0, ""),
    ],
)
def test_the_size_tells_the_unit(channel: str, swing: float, unit: str) -> None:
    assert size_unit(channel, swing * np.sin(TIME)) == unit
