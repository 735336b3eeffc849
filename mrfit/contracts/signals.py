"""Channels that drive models and effects in the checks, in sizes usual for dampers and coils."""

import numpy as np

from mrfit.core.recording import FLUX_RESISTANCE, HEAT_BEFORE
from mrfit.core.specs import Array

CONTRACT_SAMPLES = 600
DT = 2e-3


def _wave() -> tuple[Array, Array, Array, Array]:
    """Return time and a sum of two sines with its exact derivatives."""
    t = DT * np.arange(CONTRACT_SAMPLES, dtype=np.float64)
    x, v, a = np.zeros(CONTRACT_SAMPLES), np.zeros(CONTRACT_SAMPLES), np.zeros(CONTRACT_SAMPLES)
    for frequency, share, phase in ((2.0, 0.8, 0.0), (5.3, 0.2, 0.7)):
        w = 2 * np.pi * frequency
        x += share * np.sin(w * t + phase)
        v += share * w * np.cos(w * t + phase)
        a -= share * w**2 * np.sin(w * t + phase)
    return t, x, v, a


def for_models() -> dict[str, Array]:
    """Return every channel a model may have for input."""
    t, x, v, a = _wave()
    current = 0.8 + 0.4 * np.sin(2 * np.pi * 1.3 * t)
    return {
        "displacement": 0.01 * x,
        "velocity": 0.01 * v,
        "acceleration": 0.01 * a,
        "angle": 0.3 * x,
        "angular_velocity": 0.3 * v,
        "angular_acceleration": 0.3 * a,
        "current": current,
        "voltage": 5.0 * current,
        "flux": 0.03 * x,
        "temperature": 25.0 + 10.0 * t / t[-1],
    }


def for_effects() -> dict[str, Array]:
    """Return every channel an effect may need; current and temperature move."""
    t, x, v, a = _wave()
    return {
        "displacement": 0.02 * x,
        "velocity": 0.02 * v,
        "acceleration": 0.02 * a,
        "flux": 0.03 * x,
        "angle": 0.3 * x,
        "angular_velocity": 0.3 * v,
        "current": 0.8 + 0.7 * np.sin(2 * np.pi * 1.7 * t),
        "temperature": 25.0 + 30.0 * t / t[-1],
        "time": 3.0 + t,
        FLUX_RESISTANCE: np.full(CONTRACT_SAMPLES, 2.1),
        HEAT_BEFORE: np.full(CONTRACT_SAMPLES, -0.4),
    }
