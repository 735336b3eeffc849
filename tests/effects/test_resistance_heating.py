"""Resistance heating against a coil that warms while its flux is reconstructed with the cold resistance."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from mrfit.effects.resistance_heating import error
from mrfit.signal.smoothing import smooth
from tests.signal.test_smoothing import recording, segment

RISE, FREQUENCY, PER_CYCLE = 0.02, 2.0, 2000
DT = 1 / (FREQUENCY * PER_CYCLE)


def current_over(cycles: int) -> np.ndarray:
    return 3.0 * np.sin(2 * np.pi * FREQUENCY * DT * np.arange(cycles * PER_CYCLE + 1))


def term(current: np.ndarray, time: np.ndarray, before: float = 0.0) -> np.ndarray:
    channels = {"current": current, "time": time, "heat_before": np.full(len(time), before)}
    return error(channels, np.array([[RISE]]), DT)[0]


def test_error_is_what_the_reconstruction_gains_but_for_drift() -> None:
    cold, inductance, current = 5.0, 0.03, current_over(20)
    t = DT * np.arange(len(current))
    heat = cumulative_trapezoid(current**2, dx=DT, initial=0)
    rate = 3.0 * 2 * np.pi * FREQUENCY * np.cos(2 * np.pi * FREQUENCY * t)
    voltage = (cold + RISE * heat) * current + inductance * rate
    gained = cumulative_trapezoid(voltage - cold * current, dx=DT, initial=0) - inductance * current
    found = term(current, t)
    left = gained - found
    left -= np.polyval(np.polyfit(t, left, 1), t)
    assert np.abs(left).max() <= 5e-3 * np.ptp(found)


def test_loops_widen_with_the_heat_since_the_start_of_the_record() -> None:
    current = current_over(10)
    per_cycle_heat = 3.0**2 / 2 / FREQUENCY
    for begun in (0.0, 60.0):
        t = begun + DT * np.arange(len(current))
        found = term(current, t)
        for cycle in (0, 9):
            part = slice(cycle * PER_CYCLE, (cycle + 1) * PER_CYCLE + 1)
            area = np.trapezoid(current[part], found[part])
            resistance = RISE * per_cycle_heat * (FREQUENCY * begun + cycle + 0.5)
            assert area == pytest.approx(resistance * per_cycle_heat, rel=2e-3, abs=1e-3 * per_cycle_heat)


@pytest.mark.parametrize("began", [0.0, 0.5, 2.0])
def test_what_the_current_did_before_the_first_cycle_seen_is_in_the_heat(began: float) -> None:
    """A coil at rest, or at another amplitude, before the cycles that are simulated: drop and linkage are its own."""
    begin, current = 4 * PER_CYCLE, current_over(12)
    current[:begin] *= began
    log = recording(DT, current=current)
    cycles = segment(begin, len(current), 0, FREQUENCY, 8)
    before = smooth(log, cycles, ("heat_before",)).values[0]
    assert np.ptp(before) == 0.0
    heat = cumulative_trapezoid(current**2, dx=DT, initial=0)[begin:]
    wanted = RISE * cumulative_trapezoid(heat * current[begin:], dx=DT, initial=0)
    t = DT * np.arange(begin, len(current))
    left = wanted - term(current[begin:], t, float(before[0]))
    left -= np.polyval(np.polyfit(t, left, 1), t)
    assert np.abs(left).max() <= 5e-3 * np.ptp(wanted)
