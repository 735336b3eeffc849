"""Currents of a test, constant and varying, and how a law depends on them."""

from dataclasses import dataclass

import numpy as np

from benchmarks.law_mismatch.motions import Array, Rng

# Time in which the amplifier makes a step, s
EDGE = 5e-4


@dataclass(frozen=True)
class Stairs:
    """Levels (A) held from one time (s) to the next; constant with one level."""

    times: tuple[float, ...]
    levels: tuple[float, ...]

    def at(self, t: Array) -> Array:
        """Return the current at times (N,)."""
        if len(self.levels) == 1:
            return np.full(len(t), self.levels[0])
        begin = np.array(self.times[1:])
        corners = np.stack([begin, begin + EDGE], 1).ravel()
        held = np.stack([self.levels[:-1], self.levels[1:]], 1).ravel()
        return np.interp(t, corners, held)


@dataclass(frozen=True)
class Sweep:
    """Current between two levels (A), up and down as a triangle of a frequency (Hz) from a phase (turns)."""

    low: float
    high: float
    frequency: float
    phase: float

    def at(self, t: Array) -> Array:
        """Return the current at times (N,)."""
        turn = (self.frequency * t + self.phase) % 1.0
        return self.low + (self.high - self.low) * (1 - np.abs(2 * turn - 1))


Current = Stairs | Sweep


def steps(levels: Array, duration: float, frequency: float, rng: Rng) -> Current:
    """Return a staircase through the levels in any order, each held about a period of the motion."""
    times, chosen = _dwells(duration, rng.uniform(0.6, 1.4) / frequency, rng), []
    for _ in times:
        chosen.append(rng.choice([q for q in levels if not chosen or q != chosen[-1]]))
    return Stairs(tuple(times), tuple(float(q) for q in chosen))


def switched(levels: Array, duration: float, frequency: float, rng: Rng) -> Current:
    """Return a current thrown between two levels several times a period of the motion."""
    low, high = (levels[0], levels[-1]) if rng.random() < 0.5 else np.sort(rng.choice(levels, 2, replace=False))
    times = _dwells(duration, rng.uniform(0.2, 0.5) / frequency, rng)
    return Stairs(tuple(times), tuple(float((low, high)[k % 2]) for k in range(len(times))))


def sweep(levels: Array, duration: float, frequency: float, rng: Rng) -> Current:
    """Return a current sweeping over all levels about once in two periods of the motion."""
    return Sweep(float(levels[0]), float(levels[-1]), frequency * rng.uniform(0.35, 0.8), rng.random())


def _dwells(duration: float, dwell: float, rng: Rng) -> list[float]:
    times = [0.0]
    while times[-1] < duration:
        times.append(times[-1] + dwell * rng.uniform(0.5, 1.5))
    return times


VARYING = {"steps": steps, "sweeps": sweep, "switched": switched}


@dataclass(frozen=True)
class Saturation:
    """Share of the full field at a current: rises from 0 and bends as a core saturates.

    Attributes
    ----------
    form
        ``exponential``, ``tanh``, ``langevin`` or ``power``.
    bend
        Current at which it bends (A).
    top
        Current at which it is 1 (A).
    """

    form: str
    bend: float
    top: float

    def at(self, i: Array) -> Array:
        """Return the share at currents (N,)."""
        return _bent(self.form, np.abs(i) / self.bend) / _bent(self.form, np.array(self.top / self.bend))


def _bent(form: str, u: Array) -> Array:
    if form == "exponential":
        return -np.expm1(-u)
    if form == "tanh":
        return np.tanh(u)
    if form == "langevin":
        safe = np.maximum(u, 1e-3)
        return np.where(u < 1e-3, u / 3, 1 / np.tanh(safe) - 1 / safe)
    return u**1.4 / (1 + u**1.4)


FORMS = ("exponential", "tanh", "langevin", "power")
