"""Strokes as sums of sines with exact derivatives, and currents that hold levels or switch between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WAVES = ("sine", "triangle", "sweep", "road", "random")
RISE = 0.03  # s, of a current that switches
Triple = tuple[np.ndarray, np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Motion:
    """Stroke x = sum A sin(w t + r t²/2 + p).

    Amplitudes A (m), frequencies w (rad/s) and phases p (rad) of the sines, and the rate r (rad/s²) of a sweep.
    """

    wave: str
    amplitudes: np.ndarray
    frequencies: np.ndarray
    phases: np.ndarray
    rate: float = 0.0

    def at(self, t: np.ndarray) -> Triple:
        """Return stroke (m), velocity (m/s) and acceleration (m/s²) at times (s)."""
        turning = self.frequencies + self.rate * t[:, None]
        phase = (self.frequencies + self.rate / 2 * t[:, None]) * t[:, None] + self.phases
        sine, cosine = np.sin(phase), np.cos(phase)
        x, v = sine @ self.amplitudes, (turning * cosine) @ self.amplitudes
        return x, v, (self.rate * cosine - turning**2 * sine) @ self.amplitudes


def make_motion(wave: str, rng: np.random.Generator, seconds: float, stroke: float, speed: float) -> Motion:
    """Make a motion within a stroke (m) and a speed (m/s); it reaches at least one of them."""
    base, rate = speed / stroke, 0.0
    if wave == "sine":
        amplitudes, frequencies, phases = np.ones(1), np.array([base]), rng.uniform(0, 6.28, 1)
    elif wave == "sweep":
        amplitudes, frequencies, phases = np.ones(1), np.array([0.15 * base]), np.zeros(1)
        rate = 0.85 * base / seconds
    elif wave == "triangle":  # the series of a triangle, smoothed by Lanczos' factors
        orders = np.arange(1, 12, 2)
        frequencies, phases = orders * base * np.pi / 2, orders * rng.uniform(0, 6.28)
        amplitudes = (-1.0) ** (orders // 2) / orders**2 * np.sinc(orders / 13)
    else:
        low, high, count, slope = (0.3, 4.0, 40, 1.5) if wave == "road" else (0.3, 1.6, 14, 0.0)
        frequencies = base * np.geomspace(low, high, count) * rng.uniform(0.97, 1.03, count)
        amplitudes, phases = frequencies**-slope, rng.uniform(0, 6.28, count)
    motion = Motion(wave, amplitudes, frequencies, phases, rate)
    x, v, _ = motion.at(np.arange(0, seconds, 1e-3))
    scale = min(stroke / np.max(np.abs(x)), speed / np.max(np.abs(v)))
    return Motion(wave, scale * amplitudes, frequencies, phases, rate)


@dataclass(frozen=True)
class Drive:
    """One test: motion, length (s), current (A) by levels and times of switching (s), and temperature (degC)."""

    motion: Motion
    seconds: float
    levels: np.ndarray
    switches: np.ndarray
    start: float = 25.0
    warming: float = 0.0

    def current(self, t: np.ndarray) -> np.ndarray:
        """Return the current (A) at times (s); it goes from level to level along a ramp."""
        times = np.ravel([self.switches, self.switches + RISE], order="F")
        return np.interp(t, times, np.repeat(self.levels, 2)[1:-1]) if times.size else np.full(t.size, self.levels[0])

    def temperature(self, t: np.ndarray) -> np.ndarray:
        """Return the temperature (degC) at times (s)."""
        return self.start - self.warming * np.expm1(-t / 4.0)
