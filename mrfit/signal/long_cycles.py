"""Steady cycles of a signal that stays on disk: found window by window, and put together where they go on."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.columns import is_on_disk
from mrfit.signal.cycles import CYCLE_AGREEMENT, PERIOD_TOLERANCE, SteadyCycles, steady_stretches
from mrfit.signal.noise import noise_level

# Samples of a window; the last one takes up to half as many more
CYCLE_WINDOW = 1 << 20
# Cycles at the end of a window and at the begin of the next one whose levels are compared
CYCLES_COMPARED = 8


def stretches_of(
    values: Array, dt: float, levels: Sequence[Array] = (), min_cycles: int = 2, tolerance: float = PERIOD_TOLERANCE
) -> list[SteadyCycles]:
    """Return the stretches in which a signal repeats itself, as ``steady_stretches``; it may stay on disk."""
    if not is_on_disk(values) or len(values) <= CYCLE_WINDOW:
        return steady_stretches(np.asarray(values), dt, [np.asarray(v) for v in levels], min_cycles, tolerance)
    edges = [*range(0, len(values) - CYCLE_WINDOW // 2, CYCLE_WINDOW), len(values)]
    runs: list[list[SteadyCycles]] = []
    for begin, end in zip(edges[:-1], edges[1:], strict=True):
        own = [level[begin:end] for level in levels]
        for one in steady_stretches(values[begin:end], dt, own, min_cycles, tolerance):
            stretch = replace(one, start=one.start + begin, stop=one.stop + begin)
            if runs and _goes_on(runs[-1][-1], stretch, dt, tolerance) and _level(runs[-1][-1], stretch, levels, dt):
                runs[-1].append(stretch)
            else:
                runs.append([stretch])
    return [_joined(run, dt) for run in runs]


def _goes_on(before: SteadyCycles, after: SteadyCycles, dt: float, tolerance: float) -> bool:
    """Tell whether a stretch goes on where another one ends, alike in period, shape and phase."""
    one, other = before.fit, after.fit
    apart = (after.start - before.start) * dt
    if (after.start - before.stop) * dt * one.frequency > 1.0 or abs(other.frequency / one.frequency - 1.0) > tolerance:
        return False
    count = 1 + min(one.harmonics, other.harmonics)
    expected = one.shifted(apart).coefficients[:count]
    departure = float(np.max(np.abs(expected - other.coefficients[:count])))
    return departure <= CYCLE_AGREEMENT * tolerance * max(one.amplitude, other.amplitude)


def _level(before: SteadyCycles, after: SteadyCycles, levels: Sequence[Array], dt: float) -> bool:
    """Tell whether the levels at the end of a stretch are those at the begin of the next."""
    length = int(CYCLES_COMPARED / (before.fit.frequency * dt))
    for level in levels:
        end = level[max(before.stop - length, before.start) : before.stop]
        begin = level[after.start : min(after.start + length, after.stop)]
        least = noise_level(end) + 0.02 * float(np.ptp(np.concatenate([end, begin])))
        then = float(np.mean(end))
        if abs(float(np.mean(begin)) - then) > CYCLE_AGREEMENT * PERIOD_TOLERANCE * abs(then) + least:
            return False
    return True


def _joined(run: Sequence[SteadyCycles], dt: float) -> SteadyCycles:
    """Return one stretch of several that go on, its frequency by the phases of the first and the last."""
    first, last = run[0], run[-1]
    if len(run) == 1:
        return first
    line = 1 + int(np.argmax(np.abs(first.fit.coefficients[1:])))
    centres = [(s.start + s.stop) / 2.0 * dt for s in run]
    phases = [_phase(s, line, at - s.start * dt) for s, at in zip(run, centres, strict=True)]
    turns = 0.0
    for k in range(1, len(run)):
        foreseen = line * (run[k - 1].fit.frequency + run[k].fit.frequency) / 2.0 * (centres[k] - centres[k - 1])
        moved = phases[k] - phases[k - 1]
        turns += moved + round(foreseen - moved)
    frequency = turns / line / (centres[-1] - centres[0])
    samples = np.array([s.stop - s.start for s in run], dtype=np.float64)
    residual = float(np.sqrt(np.average([s.fit.residual**2 for s in run], weights=samples)))
    cycles = int((last.stop - first.start + 0.5) * dt * frequency)
    return SteadyCycles(first.start, last.stop, replace(first.fit, frequency=frequency, residual=residual), cycles)


def _phase(stretch: SteadyCycles, line: int, seconds: float) -> float:
    """Return the phase of one line of a stretch's series, so long after its first sample, in turns."""
    fit = stretch.fit
    value = fit.coefficients[line] if line <= fit.harmonics else 0.0
    return float(np.angle(value)) / (2.0 * np.pi) + line * fit.frequency * seconds
