"""Tests that a rig can run: what moves, how, under which current, how warm; within its limits by construction.

A point of the unit cube is a test. The shape of its motion is made first; its amplitude is a share of the largest one
with which stroke, speed and acceleration stay within their limits, so that no point breaks them.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.advise.rig import ChannelReach, Rig
from mrfit.core.specs import Array

# Cycles of a steady test, and more in as many seconds; a cycle fades in before them and one out behind
TEST_CYCLES, STEADY_SECONDS = 6, 2.0
FADES = 2
# Least amplitude and ends of the time between changes of current, as shares of the largest amplitude and in s
LEAST_AMPLITUDE = 0.1
DWELLS = (0.15, 1.5)
# Changes of current in a test, and the levels between its lowest and highest through which it goes
CHANGES = 12
CURRENT_STEP_LEVELS = (0.0, 0.5, 1.0, 0.5)
# Times between changes differ by this share, so that they fall on all phases of the motion
JITTER = 0.4
GOLDEN = 0.6180339887498949
# Share of a period over which the corner of a triangle is rounded
CORNER = 0.04
# Share of a limit that samples may reach: between them a peak is up to 0.8 % higher
WITHIN = 0.99
# Ends of the band of a sweep are at least this factor apart
SWEEP = 3.0
# Lengths of a sweep and of a repeated test, as shares of the longest test
SWEEP_SECONDS = 8.0
DIMENSIONS = 5


@dataclass(frozen=True)
class Test:
    """One test.

    Attributes
    ----------
    kind
        Key of ``KINDS``.
    dt
        Sample interval in s.
    motion
        The channel that drives the specimen and its derivatives, (3, N), SI.
    current
        Held or stepped beside a motion, (N,) in A; empty where the current is what moves, or none can be set.
    warmth
        How warm the specimen is brought, 0 to 1 of the rig's range, (N,); empty where the test sets none.
    waiting
        Seconds beside the test itself that it takes.
    numbers
        What it is told by: ``frequency``, ``to`` Hz, ``amplitude``, ``current``, ``low`` A, ``dwell``, ``wait`` s.
    point
        The point of the unit cube that it stands for (5,).
    """

    __test__ = False  # not one of pytest's

    kind: str
    dt: float
    motion: Array
    current: Array
    warmth: Array
    waiting: float = 0.0
    numbers: dict[str, float] = field(default_factory=dict)
    point: Array = field(default_factory=lambda: np.empty(0))

    @property
    def seconds(self) -> float:
        """Seconds that the specimen is driven."""
        return len(self.motion[0]) * self.dt

    @property
    def cost(self) -> float:
        """Seconds that the test takes, with what it waits for."""
        return self.seconds + self.waiting

    @property
    def time(self) -> Array:
        """Time in s of the samples (N,)."""
        return np.arange(self.motion.shape[1], dtype=np.float64) * self.dt


@dataclass(frozen=True)
class RigBench:
    """A rig as tests see it.

    Attributes
    ----------
    rig
        Its limits.
    reach
        Those of the channel that drives the specimen.
    current
        Lowest and highest current in A beside a motion; None where the current drives, or cannot be set.
    dt
        Sample interval in s.
    steady
        Seconds that steady cycles take at least, or the whole of a sweep.
    """

    rig: Rig
    reach: ChannelReach
    current: tuple[float, float] | None
    dt: float
    steady: float = STEADY_SECONDS

    @property
    def kinds(self) -> tuple[str, ...]:
        """Kinds of test that the rig can run."""
        kinds = ["sine", "triangle", "repeat"]
        if self.reach.high >= SWEEP * self.reach.low:
            kinds.append("sweep")
        if self.current is not None:
            kinds.append("steps")
        if self.rig.temperature is not None:
            kinds.append("warm-up")
        twice = 2.0 * least_cycles() / self.rig.seconds <= self.reach.high
        return tuple(k for k in kinds if twice or k not in ("repeat", "warm-up"))


def least_cycles() -> int:
    """Return the fewest cycles of a test."""
    return TEST_CYCLES + FADES


def test_at(kind: str, point: Array, bench: RigBench) -> Test:
    """Return the test of a kind at a point (5,) of the unit cube.

    The coordinates are the frequency, on a logarithmic scale, the share of the largest amplitude, the current (of steps
    the highest), its lowest level or the upper end of a sweep, and the time between changes or of waiting.
    """
    frequency = _log(bench.reach.low, bench.reach.high, float(point[0]))
    if kind == "sweep":
        shape, numbers = _sweep(point, bench)
    elif kind in ("repeat", "warm-up"):
        shape, numbers = _twice(kind, frequency, float(point[4]), bench)
    else:
        shape, numbers = _steady(kind, frequency, bench.rig.seconds, bench), {"frequency": frequency}
    share = LEAST_AMPLITUDE + (1.0 - LEAST_AMPLITUDE) * float(point[1])
    motion = share * _largest(shape, bench.reach) * shape
    current, levels = _current(kind, point, motion.shape[1], bench)
    warm = np.empty(0)
    waiting = 0.0
    if kind == "warm-up":
        half = motion.shape[1] // 2
        warm, waiting = (np.arange(motion.shape[1]) >= half).astype(np.float64), bench.rig.warm_up
    numbers |= {"amplitude": float(np.abs(motion[0]).max())} | levels
    return Test(kind, bench.dt, motion, current, warm, waiting, numbers, point)


def lengthened(test: Test, factor: float, bench: RigBench) -> Test:
    """Return a test that lasts so many times as long, as far as the longest one allows: more cycles, a slower sweep."""
    steady = min(factor * test.seconds, bench.rig.seconds)
    if test.kind in ("repeat", "warm-up") or steady <= test.seconds:
        return test
    return test_at(test.kind, test.point, replace(bench, steady=steady))


def _times(seconds: float, dt: float) -> Array:
    return np.arange(round(seconds / dt), dtype=np.float64) * dt


def _log(low: float, high: float, share: float) -> float:
    return float(low * (high / low) ** share)


def _largest(shape: Array, reach: ChannelReach) -> float:
    """Return the factor on a shape (3, N) with which a limit of the rig is just kept."""
    peaks = np.abs(shape).max(axis=1)
    limits = np.array([reach.amplitude, reach.speed, reach.acceleration])
    return WITHIN * float(np.min(limits[peaks > 0.0] / peaks[peaks > 0.0]))


def _steady(kind: str, frequency: float, longest: float, bench: RigBench) -> Array:
    """Return whole cycles of a sine or triangle (3, N), no longer than allowed where the least number fits."""
    cycles = max(TEST_CYCLES, math.ceil(bench.steady * frequency))
    cycles = max(TEST_CYCLES, min(cycles, math.floor(longest * frequency) - FADES))
    time = _times((cycles + FADES) / frequency, bench.dt)
    whole = _triangle(time, frequency) if kind == "triangle" else _sine(time, frequency)
    return _faded(whole, time, 1.0 / frequency)


def _sine(time: Array, frequency: float) -> Array:
    w = 2.0 * np.pi * frequency
    return np.stack([np.sin(w * time), w * np.cos(w * time), -(w**2) * np.sin(w * time)])


def _triangle(time: Array, frequency: float) -> Array:
    """Return a triangle that turns at a constant acceleration, its position, speed and acceleration."""
    period = 1.0 / frequency
    phase = np.mod(time, period)
    corner = CORNER * period
    half = 0.5 * period
    # speed 1 up, -1 down, straight in between, about the corners at a quarter and three quarters of the period
    at = np.mod(phase + 0.25 * period, period)
    sign = np.where(at < half, 1.0, -1.0)
    within = np.mod(at, half)
    edge = np.minimum(within, half - within)
    speed = sign * np.minimum(edge / corner, 1.0)
    acceleration = sign * np.where(edge < corner, np.where(within < 0.5 * half, 1.0, -1.0) / corner, 0.0)
    rising = np.where(within < corner, 0.5 * within**2 / corner, within - 0.5 * corner)
    left = half - within
    whole = half - corner
    travelled = np.where(left < corner, whole - 0.5 * left**2 / corner, rising)
    return np.stack([sign * (travelled - 0.5 * whole), speed, acceleration])


def _sweep(point: Array, bench: RigBench) -> tuple[Array, dict[str, float]]:
    """Return a sweep of constant speed over a band, its frequency rising by the same factor in the same time."""
    reach = bench.reach
    low = _log(reach.low, reach.high / SWEEP, float(point[0]))
    high = _log(SWEEP * low, reach.high, float(point[3]))
    seconds = min(bench.rig.seconds, max(SWEEP_SECONDS, least_cycles() / low, bench.steady))
    time = _times(seconds, bench.dt)
    growth = math.log(high / low) / seconds
    w = 2.0 * np.pi * low * np.exp(growth * time)
    phase = (w - w[0]) / growth
    # x = sin(phase)/w, with all that comes of w rising
    x, sine, cosine = np.sin(phase) / w, np.sin(phase), np.cos(phase)
    speed = cosine - growth * x
    acceleration = -w * sine - growth * speed
    whole = np.stack([x, speed, acceleration])
    return _faded(whole, time, 1.0 / low), {"frequency": low, "to": high}


def _twice(kind: str, frequency: float, share: float, bench: RigBench) -> tuple[Array, dict[str, float]]:
    """Return a sine, a standstill and the same sine; where it is to be warmed in between it stands still no longer."""
    longest = bench.rig.seconds
    frequency = max(frequency, 2.0 * least_cycles() / longest)
    burst = _steady("sine", frequency, 0.5 * longest, bench)
    room = max(longest - 2 * burst.shape[1] * bench.dt, 0.0)
    wait = share * room if kind == "repeat" else 0.0
    still = np.zeros((3, round(wait / bench.dt)))
    numbers = {"frequency": frequency} | ({"wait": wait} if kind == "repeat" else {})
    return np.hstack([burst, still, burst]), numbers


def _faded(motion: Array, time: Array, period: float) -> Array:
    """Return a motion (3, N) that grows from rest over a period and dies away over the last one."""
    end = time[-1] + (time[1] - time[0])
    rise = np.clip(np.minimum(time, end - time) / period, 0.0, 1.0)
    direction = np.where(time < 0.5 * end, 1.0, -1.0)
    moving = (rise < 1.0) * np.pi / period
    factor = 0.5 - 0.5 * np.cos(np.pi * rise)
    slope = 0.5 * moving * direction * np.sin(np.pi * rise)
    bend = 0.5 * moving**2 * np.cos(np.pi * rise)
    x, v, a = motion
    return np.stack([factor * x, factor * v + slope * x, factor * a + 2.0 * slope * v + bend * x])


def _current(kind: str, point: Array, samples: int, bench: RigBench) -> tuple[Array, dict[str, float]]:
    """Return the current beside a motion (N,), and the numbers it is told by."""
    if bench.current is None:
        return np.empty(0), {}
    low, high = bench.current
    level = low + (high - low) * float(point[2])
    if kind != "steps":
        return np.full(samples, level), {"current": level}
    # at least a fifth of the range apart
    top = low + (high - low) * (0.2 + 0.8 * float(point[2]))
    bottom = low + (top - low - 0.2 * (high - low)) * float(point[3])
    dwell = min(_log(*DWELLS, float(point[4])), samples * bench.dt / CHANGES)
    count = math.ceil(samples * bench.dt / (dwell * (1.0 - JITTER))) + 1
    dwells = dwell * (1.0 + JITTER * (2.0 * np.mod(GOLDEN * np.arange(1, count + 1), 1.0) - 1.0))
    begins = np.cumsum(dwells)
    time = np.arange(samples) * bench.dt
    place = np.searchsorted(begins, time, side="right")
    wanted = bottom + (top - bottom) * np.array(CURRENT_STEP_LEVELS)[place % len(CURRENT_STEP_LEVELS)]
    return _limited(wanted, bench), {"current": top, "low": bottom, "dwell": dwell}


def _limited(wanted: Array, bench: RigBench) -> Array:
    """Return a current (N,) that follows what is wanted no faster than the amplifier can."""
    most = bench.rig.current_rate
    if most is None or not np.any(np.abs(np.diff(wanted)) > most * bench.dt):
        return wanted
    current = wanted.copy()
    for n in range(1, len(current)):
        current[n] = current[n - 1] + np.clip(wanted[n] - current[n - 1], -most * bench.dt, most * bench.dt)
    return current
