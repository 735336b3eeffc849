"""Find stretches of steady cycles in a signal: turning points, cycles between crossings, runs of cycles that agree."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.signal.convolution import autocorrelation
from mrfit.signal.harmonics import HarmonicFit, harmonic_fit
from mrfit.signal.noise import noise_level

# Swings below these shares of the signal's range are passed over, in turn, coarse first: large cycles are found without
# regard to noise, small ones in what is left.
SCALES = (0.4, 0.2, 0.1, 0.05, 0.025, 0.0125)
NOISE_SWING = 8.0
# A stretch ends where the signal leaves its Fourier series by this share of its amplitude; neighbouring cycles agree
# in period and extremes within some times that.
PERIOD_TOLERANCE = 0.02
CYCLE_AGREEMENT = 2.5
# Shorter runs amid many more reversals of like size are chance.
CHANCE_CYCLES = 5
REPEATED = 0.9
CORRELATED_SAMPLES = 1 << 16


@dataclass(frozen=True, slots=True)
class SteadyCycles:
    """Steady cycles of a signal.

    Attributes
    ----------
    start, stop
        Sample range [start, stop) in which the signal follows its series.
    fit
        Fourier series of the stretch, with t = 0 at sample ``start``.
    cycles
        Whole cycles in it.
    """

    start: int
    stop: int
    fit: HarmonicFit
    cycles: int

    def boundaries(self, dt: float) -> Array:
        """Return where its whole cycles begin and end, in samples of the signal, not rounded; shape (cycles + 1,)."""
        return self.start + np.arange(self.cycles + 1) / (self.fit.frequency * dt)


@dataclass(frozen=True, slots=True)
class _Cycle:
    """One cycle from a rising crossing to the next: where, how long (samples), its extremes and its levels."""

    start: float
    period: float
    low: float
    high: float
    levels: tuple[float, ...]


def turning_points(values: Array, swing: float) -> Index:
    """Return the indices of the alternating extremes left when swings below ``swing`` are taken out, smallest first.

    The first and the last point are kept as ends of their swings, unless those swings are too small.
    """
    steps = np.flatnonzero(np.diff(values))
    if not len(steps):
        return np.empty(0, dtype=np.int64)
    moved = np.concatenate([steps, [steps[-1] + 1]])
    signs = np.sign(np.diff(values[moved]))
    points = moved[np.concatenate([[True], signs[1:] != signs[:-1], [True]])]
    while len(points) > 2:
        swings = np.abs(np.diff(values[points]))
        padded = np.concatenate([[np.inf], swings, [np.inf]])
        least = (swings < swing) & (swings < padded[:-2]) & (swings <= padded[2:])
        if not least.any():
            break
        gone = np.zeros(len(points), dtype=bool)
        gone[:-1] |= least
        gone[1:] |= least
        # At an end only the outer point goes: the inner one is the extreme.
        gone[1] &= not least[0] or least[1]
        gone[-2] &= not least[-1] or least[-2]
        points = points[~gone]
    if len(points) == 2 and abs(values[points[1]] - values[points[0]]) < swing:
        return np.empty(0, dtype=np.int64)
    kept: Index = points.astype(np.int64)
    return kept


def without_small_swings(values: Array, swing: float) -> Array:
    """Return a signal (N,) that is monotone between the ends of swings of at least ``swing``: no other reversals."""
    signs = np.sign(np.diff(values))
    moves = np.flatnonzero(signs)
    turns = moves[1:][signs[moves[1:]] != signs[moves[:-1]]]
    points = np.unique(np.concatenate([[0], turning_points(values, swing), [len(values) - 1]]))
    inside = np.searchsorted(turns, points[1:]) - np.searchsorted(turns, points[:-1], side="right")
    found = values.copy()
    for k in np.flatnonzero(inside > 0):
        branch = values[points[k] : points[k + 1] + 1]
        sign = 1.0 if branch[-1] >= branch[0] else -1.0
        above, below = np.maximum.accumulate(sign * branch), np.minimum.accumulate(sign * branch[::-1])[::-1]
        found[points[k] : points[k + 1] + 1] = sign * (above + below) / 2.0
    return found


def steady_stretches(
    values: Array, dt: float, levels: Sequence[Array] = (), min_cycles: int = 2, tolerance: float = PERIOD_TOLERANCE
) -> list[SteadyCycles]:
    """Return the stretches in which a signal repeats itself, in order of time; they do not overlap.

    Parameters
    ----------
    values
        Signal (N,).
    dt
        Sample interval in s.
    levels
        Channels (N,) whose mean over a cycle must not change within a stretch, such as the current of a damper test.
    min_cycles
        Fewest whole cycles of a stretch.
    tolerance
        Departure from the stretch's Fourier series, in shares of its amplitude, at which a stretch ends.
    """
    span = float(np.ptp(values)) if len(values) else 0.0
    search = _CycleSearch(values, dt, noise_level(values), min_cycles, tolerance)
    level_noise = [noise_level(level) + 0.02 * float(np.ptp(level)) for level in levels]
    found: list[SteadyCycles] = []
    for scale in SCALES if span > 0.0 else ():
        swing = scale * span
        if swing <= NOISE_SWING * search.noise:
            break
        for limits in gaps(found, len(values)):
            cycles = _cycles(values, limits, swing, levels)
            runs = _runs(cycles, CYCLE_AGREEMENT * tolerance, max(search.noise, 0.002 * swing), level_noise)
            found += search.refined([r for r in runs if len(r) >= min_cycles and not _chance(r, runs)], limits)
    if span > NOISE_SWING * search.noise:
        for limits in gaps(found, len(values)):
            found += search.by_correlation(limits, 0.1 * span)
    return _without_transients(sorted(found, key=lambda s: s.start), dt, 4 * CYCLE_AGREEMENT * tolerance)


def gaps(stretches: Sequence[SteadyCycles], samples: int) -> list[tuple[int, int]]:
    """Return the sample ranges that no stretch covers."""
    ordered = sorted(stretches, key=lambda s: s.start)
    edges = [0, *(edge for s in ordered for edge in (s.start, s.stop)), samples]
    return [(a, b) for a, b in zip(edges[0::2], edges[1::2], strict=True) if b - a > 4]


def _without_transients(stretches: list[SteadyCycles], dt: float, near: float) -> list[SteadyCycles]:
    """Return the stretches but for short ones that run into a longer one of nearly the same cycles: its transients."""

    def runs_into(short: SteadyCycles, long: SteadyCycles) -> bool:
        apart = max(short.start, long.start) - min(short.stop, long.stop)
        return (
            2 * short.cycles <= long.cycles
            and apart * dt * long.fit.frequency < 1.0
            and abs(short.fit.frequency / long.fit.frequency - 1) < near / 4
            and abs(short.fit.amplitude / long.fit.amplitude - 1) < near
            and abs(short.fit.coefficients[0] - long.fit.coefficients[0]) < near * long.fit.amplitude
        )

    return [s for s in stretches if not any(runs_into(s, other) for other in stretches)]


def _cycles(values: Array, limits: tuple[int, int], swing: float, levels: Sequence[Array]) -> list[_Cycle]:
    points = turning_points(values[limits[0] : limits[1]], swing) + limits[0]
    if len(points) < 3:
        return []
    crossings = _crossings(values, points)
    rising = np.flatnonzero(values[points[1:]] > values[points[:-1]])
    sums = [np.concatenate([[0.0], np.cumsum(level)]) for level in levels]
    cycles = []
    for first, last in zip(rising[:-1], rising[1:], strict=True):
        start, stop = float(crossings[first]), float(crossings[last])
        a, b = int(start), max(int(stop), int(start) + 1)
        means = tuple(float((total[b] - total[a]) / (b - a)) for total in sums)
        cycles.append(_Cycle(start, stop - start, float(values[points[last]]), float(values[points[first + 1]]), means))
    return cycles


def _crossings(values: Array, points: Index) -> Array:
    """Return where each swing crosses its middle, in samples: by counting, so that noise averages out."""
    middle = (values[points[:-1]] + values[points[1:]]) / 2
    lengths = np.diff(points)
    window = values[points[0] : points[-1]]
    rising = values[points[1:]] > values[points[:-1]]
    before = (window < np.repeat(middle, lengths)) == np.repeat(rising, lengths)
    count = np.add.reduceat(before.astype(np.int64), points[:-1] - points[0])
    after = np.clip(points[:-1] + count, points[:-1] + 1, points[1:])
    step = values[after] - values[after - 1]
    share = np.divide(middle - values[after - 1], step, out=np.full(len(step), 0.5), where=step != 0)
    crossings: Array = after - 1 + np.clip(share, 0.0, 1.0)
    return crossings


def _runs(cycles: list[_Cycle], agreement: float, noise: float, level_noise: Sequence[float]) -> list[list[_Cycle]]:
    """Return maximal runs of cycles that agree with the mean of their run so far."""
    runs: list[list[_Cycle]] = []
    for cycle in cycles:
        if runs and _agrees(cycle, runs[-1], agreement, noise, level_noise):
            runs[-1].append(cycle)
        else:
            runs.append([cycle])
    return runs


def _agrees(cycle: _Cycle, run: list[_Cycle], agreement: float, noise: float, level_noise: Sequence[float]) -> bool:
    recent = run[-8:]
    period, low, high = (float(np.mean([getattr(c, n) for c in recent])) for n in ("period", "low", "high"))
    margin = agreement * (high - low) + 4 * noise
    if abs(cycle.start - run[-1].start - run[-1].period) > 1.0 or abs(cycle.period - period) > agreement * period + 0.5:
        return False
    if abs(cycle.high - high) > margin or abs(cycle.low - low) > margin:
        return False
    # The first cycle of a run may straddle a change of level: it then agrees with none.
    return all(
        abs(now - then) <= agreement * abs(then) + limit
        for now, then, limit in zip(cycle.levels, recent[-1].levels, level_noise, strict=True)
    )


def _chance(run: list[_Cycle], runs: list[list[_Cycle]]) -> bool:
    """Tell whether a short run stands amid so many cycles that agree with none that its own agreement is chance."""
    if len(run) >= CHANCE_CYCLES:
        return False
    reach = 5 * (run[-1].start + run[-1].period - run[0].start)
    swing = run[0].high - run[0].low
    near = [r[0] for r in runs if len(r) == 1 and abs(r[0].start - run[0].start) < reach]
    return sum(c.high - c.low > swing / 4 for c in near) > max(2, len(run))


@dataclass(frozen=True, slots=True)
class _CycleSearch:
    """Turns runs of agreeing cycles into stretches of one signal."""

    values: Array
    dt: float
    noise: float
    min_cycles: int
    tolerance: float

    def refined(self, runs: list[list[_Cycle]], limits: tuple[int, int]) -> list[SteadyCycles]:
        """Return the stretches of runs, widened or narrowed to where the signal follows the run's series."""
        found: list[SteadyCycles] = []
        for k, run in enumerate(runs):
            begin = found[-1].stop if found else limits[0]
            end = int(runs[k + 1][0].start) if k + 1 < len(runs) else limits[1]
            start, stop = max(int(np.ceil(run[0].start)), begin), min(int(run[-1].start + run[-1].period) + 1, end)
            period = (run[-1].start + run[-1].period - run[0].start) / len(run)
            stretch = self._stretch((start, stop), period, (begin, end)) if stop - start > period else None
            found += [stretch] if stretch else []
        return found

    def by_correlation(self, limits: tuple[int, int], least_swing: float) -> list[SteadyCycles]:
        """Return the stretch of a signal that repeats a pattern of several reversals, if it does."""
        window = self.values[limits[0] : limits[1]]
        if len(window) < 16 or np.ptp(window) < least_swing:
            return []
        lag = _repeat_lag(window, self.min_cycles)
        if not lag or _swings(window, lag, least_swing) < self.min_cycles:
            return []
        stretch = self._stretch(limits, lag, limits)
        return [stretch] if stretch else []

    def _stretch(self, run: tuple[int, int], period: float, limits: tuple[int, int]) -> SteadyCycles | None:
        start, stop = run
        fit = harmonic_fit(self.values[start:stop], self.dt, 1.0 / (period * self.dt))
        for _ in range(2):
            period = 1.0 / (fit.frequency * self.dt)
            begin, end = max(limits[0], int(start - 1.5 * period)), min(limits[1], int(stop + 1.5 * period) + 1)
            departure = self.values[begin:end] - fit.evaluate(
                (np.arange(begin, end, dtype=np.float64) - start) * self.dt
            )
            middle = (start + stop) // 2 - begin
            first, last = self._follows(departure, middle, period, fit.amplitude)
            start, stop = begin + first, begin + last
            if stop - start < self.min_cycles * period - 1:
                return None
            fit = harmonic_fit(self.values[start:stop], self.dt, fit.frequency)
        cycles = int((stop - start + 0.5) * self.dt * fit.frequency)
        return SteadyCycles(start, stop, fit, cycles) if cycles >= self.min_cycles else None

    def _follows(self, departure: Array, middle: int, period: float, amplitude: float) -> tuple[int, int]:
        """Return the range round ``middle`` in which the departure, averaged over a 20th of a cycle, stays small."""
        width = max(1, min(int(period / 20), len(departure) // 4))
        running = np.concatenate([[0.0], np.cumsum(departure)])
        middles = np.arange(len(departure)) - width // 2
        first, last = np.maximum(middles, 0), np.minimum(middles + width, len(departure))
        averaged = np.abs(running[last] - running[first]) / (last - first)
        cycle = averaged[max(0, middle - int(period / 2)) : middle + int(period / 2) + 1]
        # What a series of 40 harmonics cannot follow, as the edges of a square wave, is no transient …
        usual = min(1.5 * float(np.max(cycle)), 0.15 * amplitude)
        # … while in a very steady signal a departure well within the tolerance already is one.
        inner = averaged[len(averaged) // 4 : -(len(averaged) // 4) or None]
        least, most = self.tolerance * amplitude / 10, self.tolerance * amplitude
        limit = float(np.clip(4.0 * np.quantile(inner, 0.95), least, most)) + 4.0 * self.noise / np.sqrt(width)
        limit = max(limit, usual)
        beyond = np.flatnonzero(averaged > limit)
        before, after = beyond[beyond < middle], beyond[beyond >= middle]
        begin = int(before[-1]) + 1 if len(before) else 0
        return begin, int(after[0]) if len(after) else len(departure)


def _swings(values: Array, lag: float, swing: float) -> int:
    """Return how many cycles of length ``lag`` hold at least one swing."""
    return min(len(turning_points(values, swing)) // 2, int(len(values) / lag + 0.02))


def _repeat_lag(values: Array, min_cycles: int) -> float:
    """Return the shortest lag in samples at which a signal correlates with itself by 0.9, or 0."""
    block = -(-len(values) // CORRELATED_SAMPLES)
    count = len(values) // block
    signal = values[: count * block].reshape(count, block).mean(axis=1)
    signal = signal - np.mean(signal)
    products = autocorrelation(signal)
    energy = np.concatenate([[0.0], np.cumsum(signal**2)])
    heads, tails = energy[count - np.arange(count)], energy[-1] - energy[np.arange(count)]
    correlation = products / np.maximum(np.sqrt(heads * tails), 1e-300 + 1e-9 * energy[-1])
    below = np.flatnonzero(correlation < 0.5)
    longest = int(count / min_cycles * 1.02)
    if not len(below) or below[0] >= longest:
        return 0.0
    tail = correlation[below[0] : longest]
    if np.max(tail) < REPEATED:
        return 0.0
    near = np.flatnonzero(tail >= np.max(tail) - 0.02)
    last = near[0] + int(np.argmax(np.diff(near) > 1)) if np.any(np.diff(near) > 1) else near[-1]
    return float(block * (below[0] + near[0] + np.argmax(tail[near[0] : last + 1])))


def last_event(events: Index, samples: int) -> Index:
    """Return for each sample the last of the ascending sample numbers ``events`` (E,) up to it, 0 before the first."""
    return np.concatenate([[0], events])[np.searchsorted(events, np.arange(samples), side="right")]
