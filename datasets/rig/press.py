"""The press and what it is told to do: motions as sums of sines, currents held or stepped, oil warm or cold."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from datasets.rig.damper import Motion
from datasets.rig.envelope import Envelope
from datasets.rig.stop import Array

RATE = 500.0
SECONDS = 10.0
OVERSAMPLING = 4
DRIVER_LAG = 0.002
WARM_OIL = 25.0


@dataclass(frozen=True, slots=True)
class Programme:
    """One log of the damper: amplitudes (m), frequencies (Hz), phases (rad) of the motion; current and oil.

    ``envelope`` is the factor on the motion over the cycles of its first frequency.
    """

    name: str
    motion: tuple[Array, Array, Array]
    current: Callable[[Array], Array]
    oil: float
    envelope: Envelope | None = None


def sine(frequency: float, amplitude: float, phase: float = 0.0) -> tuple[Array, Array, Array]:
    """Return a single sine."""
    return np.array([amplitude]), np.array([frequency]), np.array([phase])


def triangle(frequency: float, amplitude: float) -> tuple[Array, Array, Array]:
    """Return a triangle whose corners are rounded: its first twelve odd harmonics, tapered."""
    order = 2 * np.arange(12) + 1
    taper = np.sinc(order / 25.0)
    return amplitude * 8 / np.pi**2 * (-1.0) ** np.arange(12) / order**2 * taper, frequency * order, np.zeros(12)


def random(low: float, high: float, rms: float, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Return 30 sines of equal speed and random phase over a band in Hz, with the given rms displacement in m."""
    frequency = np.sort(rng.uniform(low, high, 30))
    amplitude = 1.0 / frequency
    amplitude *= rms * np.sqrt(2.0 / np.sum(amplitude**2))
    return amplitude, frequency, rng.uniform(0, 2 * np.pi, 30)


def held(level: float) -> Callable[[Array], Array]:
    """Return a constant current."""
    return lambda time: np.full_like(time, level)


def steps(levels: tuple[float, ...], dwell: tuple[float, float], rng: np.random.Generator) -> Callable[[Array], Array]:
    """Return random steps between current levels, each held for a random time, with the driver's own 2 ms lag."""
    count = int(2 * SECONDS / dwell[0]) + 2
    ends = np.cumsum(rng.uniform(*dwell, count))
    order = [int(rng.integers(len(levels)))]
    for _ in range(count):
        order.append((order[-1] + int(rng.integers(1, len(levels)))) % len(levels))
    values = np.array(levels)[order]

    def programme(time: Array) -> Array:
        jumps = np.diff(values)
        since = time[:, None] - ends[None, : len(jumps)]
        risen = np.where(since > 0, -np.expm1(-np.maximum(since, 0.0) / DRIVER_LAG), 0.0)
        total: Array = np.maximum(values[0] + risen @ jumps, 0.0)
        return total

    return programme


def stairs(top: float, count: int, dwell: float) -> Callable[[Array], Array]:
    """Return a stair of current up to ``top`` and down again, over and over."""
    levels = top * np.concatenate([np.arange(count), np.arange(count, 0, -1)]) / count

    def programme(time: Array) -> Array:
        here = levels[np.floor(time / dwell).astype(int) % len(levels)]
        before = levels[(np.floor(time / dwell).astype(int) - 1) % len(levels)]
        return here + (before - here) * np.exp(-(time % dwell) / DRIVER_LAG)

    return programme


def motion_of(tests: list[Programme]) -> Motion:
    """Return the press's motion at the solver's rate; position, speed, acceleration in closed form."""
    time = np.arange(int(SECONDS * RATE) * OVERSAMPLING) / (RATE * OVERSAMPLING)
    position, speed, acceleration = (np.zeros((len(tests), len(time))) for _ in range(3))
    for row, test in enumerate(tests):
        for amplitude, frequency, phase in zip(*test.motion, strict=True):
            w = 2 * np.pi * frequency
            position[row] += amplitude * np.sin(w * time + phase)
            speed[row] += amplitude * w * np.cos(w * time + phase)
            acceleration[row] -= amplitude * w**2 * np.sin(w * time + phase)
        if test.envelope is not None:
            rows = position[row], speed[row], acceleration[row]
            position[row], speed[row], acceleration[row] = _modulated(rows, test.envelope, test.motion[1][0], time)
    current = np.array([test.current(time) for test in tests])
    oil = np.array([test.oil for test in tests])
    return Motion(1.0 / (RATE * OVERSAMPLING), position, speed, acceleration, current, oil)


def _modulated(motion: tuple[Array, Array, Array], envelope: Envelope, frequency: float, time: Array) -> list[Array]:
    """Return position, speed and acceleration times an envelope, by the product rule."""
    x, v, a = motion
    m, rate, bend = (frequency**order * envelope(frequency * time, order) for order in range(3))
    return [m * x, m * v + rate * x, m * a + 2 * rate * v + bend * x]


def rich(rng: np.random.Generator) -> list[Programme]:
    """Return twelve logs that show every effect: frequencies, strokes, currents held and stepped, oil cold and warm."""
    oil = rng.permutation(np.linspace(18.0, 52.0, 12))
    levels = (0.0, 0.4, 0.8, 1.3, 1.8, 2.3, 2.8)
    plans = [
        ("sine_1Hz_20mm_0A", sine(1, 0.020), held(0.0)),
        ("sine_2Hz_10mm_0.7A", sine(2, 0.010), held(0.7)),
        ("sine_4Hz_6mm_1.4A", sine(4, 0.006), held(1.4)),
        ("sine_1Hz_20mm_1.4A", sine(1, 0.020), held(1.4)),
        ("sine_2Hz_14mm_2.8A", sine(2, 0.014), held(2.8)),
        ("sine_6Hz_5mm_0.7A", sine(6, 0.005), held(0.7)),
        ("sine_0.5Hz_25mm_0.7A", sine(0.5, 0.025), held(0.7)),
        ("random_1.4A", random(0.4, 7, 0.006, rng), held(1.4)),
        ("random_steps", random(0.4, 7, 0.006, rng), steps(levels, (0.25, 0.9), rng)),
        ("sine_2Hz_12mm_steps", sine(2, 0.012), steps(levels, (0.25, 0.9), rng)),
        ("triangle_0.8Hz_20mm_stairs", triangle(0.8, 0.020), stairs(2.8, 7, 0.35)),
        ("sine_4Hz_5mm_steps", sine(4, 0.005), steps(levels, (0.25, 0.9), rng)),
    ]
    return [Programme(n, m, i, float(t)) for (n, m, i), t in zip(plans, oil, strict=True)]


def constant_current(rng: np.random.Generator) -> list[Programme]:
    """Return sines at constant currents only: they cannot show a magnetic lag."""
    oil = rng.permutation(np.linspace(18.0, 52.0, 12))
    plans = [(f, x, i) for f, x in ((1, 20), (2, 10), (4, 6), (6, 4)) for i in (0.0, 0.7, 1.4)]
    return [
        Programme(f"sine_{f}Hz_{x}mm_{i:g}A", sine(f, x / 1e3), held(i), float(t))
        for (f, x, i), t in zip(plans, oil, strict=True)
    ]


def one_frequency(rng: np.random.Generator) -> list[Programme]:
    """Return sines of one frequency and one stroke at four currents, three times each, oil always warm."""
    plans = [(k, i) for k in "abc" for i in (0.0, 0.7, 1.4, 2.1)]
    return [Programme(f"sine_2Hz_10mm_{i:g}A_{k}", sine(2, 0.010), held(i), WARM_OIL) for k, i in plans]


def one_log(rng: np.random.Generator) -> list[Programme]:
    """Return a single log of a single condition."""
    return [Programme("sine_2Hz_10mm_0.7A", sine(2, 0.010), held(0.7), WARM_OIL)]


def two_logs(rng: np.random.Generator) -> list[Programme]:
    """Return two conditions that differ in current only."""
    return [Programme(f"sine_2Hz_10mm_{i:g}A", sine(2, 0.010), held(i), WARM_OIL) for i in (0.7, 1.4)]


PROGRAMMES: dict[str, Callable[[np.random.Generator], list[Programme]]] = {
    "rich": rich,
    "constant-current": constant_current,
    "one-frequency": one_frequency,
    "one-log": one_log,
    "two-logs": two_logs,
}
