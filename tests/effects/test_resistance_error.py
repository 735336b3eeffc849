"""Resistance error against a flux that was reconstructed with the wrong resistance."""

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from mrfit.effects.resistance_error import error

ERROR = 0.4


def sine(frequency: float, cycles: float, phase: float = 0.0) -> tuple[np.ndarray, float]:
    dt = 1 / (2000 * frequency)
    return 2.0 * np.sin(2 * np.pi * frequency * dt * np.arange(int(2000 * cycles) + 1) + phase), dt


def test_error_is_what_the_reconstruction_gains() -> None:
    frequency, resistance, inductance = 5.0, 6.0, 0.03
    current, dt = sine(frequency, 6, phase=0.4)
    w = 2 * np.pi * frequency
    rate = 2.0 * w * np.cos(w * dt * np.arange(len(current)) + 0.4)
    voltage = resistance * current + inductance * rate
    wrong = cumulative_trapezoid(voltage - (resistance + ERROR) * current, dx=dt, initial=0)
    gained = wrong - inductance * current
    gained -= gained[:-1].mean()
    found = error({"current": current}, np.array([[ERROR]]), dt)[0]
    assert np.abs(found - gained).max() <= 2e-3 * np.ptp(gained)


def test_loop_area_falls_with_frequency() -> None:
    for frequency in (1.0, 5.0, 10.0):
        current, dt = sine(frequency, 3)
        cycle = slice(2000, 4001)
        area = np.trapezoid(current[cycle], error({"current": current}, np.array([[ERROR]]), dt)[0][cycle])
        assert area == pytest.approx(-ERROR * 2.0**2 / (2 * frequency), rel=1e-4)


@pytest.mark.parametrize("cycles", [5.3, 10.5])
def test_an_unfinished_cycle_leaves_hardly_any_drift(cycles: float) -> None:
    current, dt = sine(2.0, cycles)
    found = error({"current": current}, np.array([[ERROR]]), dt)[0]
    amplitude = ERROR * 2.0 / (2 * np.pi * 2.0)
    expected = amplitude * np.cos(2 * np.pi * 2.0 * dt * np.arange(len(current)))
    assert np.abs(found - expected).max() <= 0.03 * amplitude


def test_a_direct_current_leaves_nothing() -> None:
    assert np.abs(error({"current": np.full(500, 3.0)}, np.array([[5.0]]), 1e-3)).max() <= 1e-12
