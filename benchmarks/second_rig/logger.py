"""The rig's logger: sensors that drift, are quantised and noisy, faults of logs, and the CSV files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from .motions import FINE_RATE
from .physics import Test

FAULTS = ("none", "dropouts", "repeats", "clock", "saturated", "coarse", "wobble")


@dataclass(frozen=True)
class Logger:
    """Settings of the logger, the same for all logs of a specimen; noises and steps in the channel's unit."""

    rate: float
    fault: str
    force_noise: float  # N, root mean square
    colour: float  # coefficient of first order of the coloured part of the force's noise
    coloured_share: float  # share of the noise's power that is coloured
    force_step: float  # N
    stroke_noise: float
    stroke_step: float
    stroke_drift: float
    current_noise: float
    current_step: float
    velocity: bool
    voltage: bool
    temperature: bool


def sample_times(logger: Logger, rng: np.random.Generator, n_fine: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the times (s) that the log states and those at which its samples were really taken."""
    n = int((n_fine / FINE_RATE - 0.01) * logger.rate)
    stated = np.arange(n) / logger.rate
    drift = float(rng.uniform(1e-4, 5e-4)) * rng.choice([-1, 1]) if logger.fault == "clock" else 0.0
    jitter = 0.02 / logger.rate * rng.standard_normal(n) if logger.fault == "clock" else 0.0
    true = stated * (1 + drift) + jitter + float(rng.uniform(0, 1 / logger.rate))
    return stated, np.clip(true, 0.0, (n_fine - 1) / FINE_RATE)


def sample(signal: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Value of a signal of the fine grid at times (s)."""
    return np.interp(times * FINE_RATE, np.arange(signal.size), signal)


def _quantise(signal: np.ndarray, step: float) -> np.ndarray:
    return np.round(signal / step) * step


def force_noise(logger: Logger, rng: np.random.Generator, n: int) -> np.ndarray:
    """Noise of the force (N): white and coloured, of an amplitude that wobbles slowly where that is the fault."""
    innovations = rng.standard_normal(n) * np.sqrt(1 - logger.colour**2)
    coloured = lfilter([1.0], [1.0, -logger.colour], innovations)
    noise = np.sqrt(1 - logger.coloured_share) * rng.standard_normal(n) + np.sqrt(logger.coloured_share) * coloured
    if logger.fault == "wobble":
        t = np.arange(n) / logger.rate
        noise *= 1 + 0.5 * np.sin(2 * np.pi * float(rng.uniform(0.1, 0.4)) * t + float(rng.uniform(0, 6.3)))
    return logger.force_noise * noise


def measure_stroke(logger: Logger, rng: np.random.Generator, x: np.ndarray) -> np.ndarray:
    """Stroke (m) by a sensor whose zero wanders slowly, with noise, quantised."""
    t = np.linspace(0, 1, x.size)
    wander = logger.stroke_drift * np.sin(np.pi * t * float(rng.uniform(0.5, 1.5)) + float(rng.uniform(0, 6.3)))
    return _quantise(x + wander + logger.stroke_noise * rng.standard_normal(x.size), logger.stroke_step)


def derive_velocity(x: np.ndarray, rate: float, points: int) -> np.ndarray:
    """Velocity (m/s) as loggers derive it: central differences, averaged over a few points about each sample."""
    v = np.gradient(x, 1 / rate)
    padded = np.pad(v, points // 2, mode="edge")
    return np.convolve(padded, np.full(points, 1 / points), mode="valid")


def _hold(force: np.ndarray, rng: np.random.Generator, rate: float) -> None:
    """Hold the force for some tens of ms, two to six times."""
    for _ in range(int(rng.integers(2, 7))):
        at, length = int(rng.integers(force.size // 20, force.size - 1)), round(float(rng.uniform(0.02, 0.08)) * rate)
        force[at : at + length] = force[at]


def record_log(
    test: Test, force: np.ndarray, temperature: np.ndarray, logger: Logger, rng: np.random.Generator
) -> tuple[pd.DataFrame, np.ndarray, np.ndarray]:
    """Return the columns of a log in SI units, the true times of its samples, and the noise of its force (N)."""
    stated, times = sample_times(logger, rng, force.size)
    n = stated.size
    x = measure_stroke(logger, rng, sample(test.motion.x, times))
    noise = force_noise(logger, rng, n)
    measured = sample(force, times) + noise
    if logger.fault == "saturated":
        limit = float(rng.uniform(0.95, 0.98)) * np.max(np.abs(force))
        measured = np.clip(measured, -limit, limit)
    measured = _quantise(measured, logger.force_step)
    zero = float(rng.uniform(-1, 1)) * logger.current_noise
    current = sample(test.current, times) + zero + logger.current_noise * rng.standard_normal(n)
    columns = {"time": stated, "displacement": x, "force": measured, "current": _quantise(current, logger.current_step)}
    if logger.velocity:
        columns["velocity"] = derive_velocity(x, logger.rate, 5 if logger.rate > 500 else 3)
    if logger.voltage:
        filtered = lfilter([0.3], [1, -0.7], test.voltage, zi=[0.7 * test.voltage[0]])[0]
        columns["voltage"] = _quantise(sample(filtered, times) + 0.02 * rng.standard_normal(n), 0.01)
    if logger.temperature:
        columns["temperature"] = _quantise(sample(temperature, times) + 0.05 * rng.standard_normal(n), 0.02)
    if logger.fault == "dropouts":
        _hold(columns["force"], rng, logger.rate)
    frame = pd.DataFrame(columns)
    if logger.fault == "repeats":  # a buffer that was late: all channels of a sample once more
        rows = np.sort(rng.choice(np.arange(1, n), size=max(n // 400, 2), replace=False))
        values = frame.drop(columns="time").columns
        frame.loc[rows, values] = frame.loc[rows - 1, values].to_numpy()
    return frame, times, noise


def write_log(path: Path, frame: pd.DataFrame) -> None:
    """Write the columns of a log in the units and with the titles of the rig."""
    titles = {
        "time": ("Time (s)", 1.0, 6),
        "displacement": ("Displacement (mm)", 1e3, 5),
        "force": ("Load (kN)", 1e-3, 6),
        "current": ("Current (A)", 1.0, 4),
        "velocity": ("Velocity (mm/s)", 1e3, 3),
        "voltage": ("Coil voltage (V)", 1.0, 3),
        "temperature": ("Oil temperature (degC)", 1.0, 2),
    }
    written = pd.DataFrame({titles[c][0]: (frame[c] * titles[c][1]).round(titles[c][2]) for c in frame.columns})
    written.to_csv(path, index=False)
