"""Whole cycles of a damper's log: reversals, and forces at places of a branch, as linear functions of the samples.

A cycle goes from the least displacement to the greatest (the branch ``up``, positive velocity) and back (``down``). A
place on a branch is its time since the reversal as a share u of the branch, 0 to 1. The displacement is smoothed
(``mrfit.signal.smoothing``); the force is not: a force at a place is the value of a polynomial of least squares through
the samples about it, of one branch alone, so that a jump at a reversal stays one. It weighs samples, and its noise is
that of these weights.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline
from scipy.special import chdtrc, fdtrc

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.measure.intervals import DRIFTS, Estimate, Function, PerCycle, estimate, line_of
from mrfit.signal.cycles import turning_points
from mrfit.signal.noise import noise_level, white_part
from mrfit.signal.smoothing import smooth

CENTRAL = 0.05
"""Share of the stroke to either side of its middle over which a force at mid-stroke is taken."""
FEWEST_SAMPLES = 16
"""Samples of a cycle below which nothing is read off it."""
GRID = np.linspace(0.0, 1.0, 257)
BINS = 384
WIDE = 0.08
"""Half of a window, in shares of a branch, above which its polynomial has a degree of 4 and not of 2."""
FEWEST_IN = 3.5
"""Samples that a window reaches to either side at least."""
END = 0.08
"""Window at a branch's end, in shares of it, and samples that it has at least."""
END_SAMPLES = 6
ALIKE = 0.01
"""Chance below which what residuals of all cycles have in common is an error of the fit."""
WORSE, WORSE_AT_END = 2.0, 5.0
"""Error of a fit over the RMS of its residual, in the middle of its window and at the end of two half windows."""
ROUNDING = 1e-12
TINY = 1e-300
SHOWN, CORNERS = 64, 5.0
"""Samples of a cycle below which a corner may pass unseen, and its error of the work over the difference of rules."""
BEYOND = 1.0
"""Numbers of the measured cycles before and after them over which their drift is taken to go on."""
FINE = 200
"""Samples of a cycle from which straight lines between them give the work to 0.01 %."""


@dataclass(frozen=True)
class Window:
    """Begin and end of a window on a branch, and the degree of the polynomial that is fitted over it."""

    ends: tuple[float, float]
    degree: int


@dataclass(frozen=True)
class Pooled:
    """Force over place on a branch, of several cycles: means over bins (B,), and the samples of each."""

    at: Array
    force: Array
    counts: Array

    def values(self, places: Array, windows: Sequence[Window]) -> Array:
        """Return the force at places (P,), each by a polynomial over its window."""
        found = np.interp(places, self.at, self.force)
        ends = np.array([window.ends for window in windows])
        inside = (self.at >= ends[:, :1]) & (self.at <= ends[:, 1:])
        about = np.where(inside, self.at - places[:, None], 0.0)
        about /= np.maximum(np.max(np.abs(about), axis=1, keepdims=True), TINY)
        degrees = np.array([window.degree for window in windows])
        for degree in np.unique(degrees):
            rows = np.flatnonzero((degrees == degree) & (inside.sum(axis=1) > degree))
            weighted = inside[rows] * self.counts
            moments = [np.sum(weighted * about[rows] ** k, axis=1) for k in range(2 * degree + 1)]
            level = [np.sum(weighted * about[rows] ** k * self.force, axis=1) for k in range(degree + 1)]
            square = np.stack([np.stack(moments[k : k + degree + 1], axis=1) for k in range(degree + 1)], axis=1)
            found[rows] = np.linalg.solve(square, np.stack(level, axis=1)[:, :, None])[:, 0, 0]
        return found

    def followed(self, window: Window, noise: float) -> bool:
        """Return whether a polynomial over a window leaves no more than white noise of a standard deviation in N."""
        inside = (self.at >= window.ends[0]) & (self.at <= window.ends[1])
        freedom = int(inside.sum()) - window.degree - 1
        if freedom < 1:
            return False
        at, force, roots = self.at[inside], self.force[inside], np.sqrt(self.counts[inside])
        left = (np.polynomial.Polynomial.fit(at, force, window.degree, w=roots)(at) - force) * roots
        return float(chdtrc(freedom, float(left @ left) / noise**2)) > ALIKE if noise > 0.0 else not left.any()


@dataclass(frozen=True, eq=False)
class Cycles:
    """Whole cycles of one condition.

    Attributes
    ----------
    reversals
        Times in s of the reversals (2N + 1,), from a least displacement on.
    time
        Times (S,) in s of the force's samples.
    force
        Force (S,) in N, less the drift of its zero about the middle of the cycles.
    zero
        Drift of the force's zero in N per cycle; 0 where chance explains it.
    motion
        Displacement in m over time in s, smoothed.
    gains
        Amplitude of each cycle's recorded displacement over the smoothed one.
    middles
        Mean of each cycle's recorded displacement less that of the smoothed one (N,), in m.
    noise
        RMS of the force's white noise in N.
    reach
        Cycles from the middle of these to the farther end of the record.
    dt
        Sample interval in s.
    """

    reversals: Array
    time: Array
    force: Array
    zero: float
    motion: CubicHermiteSpline
    gains: PerCycle
    middles: Array
    noise: float
    reach: float
    dt: float

    @property
    def count(self) -> int:
        """Number of cycles N."""
        return len(self.reversals) // 2

    @property
    def period(self) -> float:
        """Mean time of a cycle in s."""
        return float(self.reversals[-1] - self.reversals[0]) / self.count

    @property
    def per_cycle(self) -> float:
        """Samples of a cycle."""
        return self.period / self.dt

    def negated(self) -> "Cycles":
        """Return the cycles with the force of opposite sign."""
        return replace(self, force=-self.force, zero=-self.zero)

    def late_by(self, seconds: float) -> "Cycles":
        """Return the cycles with the force taken as later than the displacement by so many seconds."""
        return replace(self, time=self.time - seconds)

    @cached_property
    def table(self) -> dict[bool, tuple[Array, Array]]:
        """Mean displacement in m and velocity in m/s at ``GRID`` of the branches up (True) and down (False)."""
        found = {}
        for up in (True, False):
            begin, end = self.branch_times(up)
            times = begin[:, None] + GRID * (end - begin)[:, None]
            speed = self.motion(times, 1).mean(axis=0)
            speed[[0, -1]] = 0.0
            found[up] = (self.motion(times).mean(axis=0), speed)
        return found

    @cached_property
    def gain(self) -> float:
        """Mean amplitude of the recorded displacement over the smoothed one."""
        return float(self.gains.values.mean())

    @property
    def low(self) -> float:
        """Least displacement in m."""
        return float((self.table[True][0][0] + self.table[False][0][-1]) / 2.0)

    @property
    def high(self) -> float:
        """Greatest displacement in m."""
        return float((self.table[True][0][-1] + self.table[False][0][0]) / 2.0)

    @property
    def stroke(self) -> float:
        """Travel in m."""
        return self.high - self.low

    @property
    def middle(self) -> float:
        """Displacement in m midway between least and greatest."""
        return (self.high + self.low) / 2.0

    @property
    def peak_velocity(self) -> float:
        """Greatest speed in m/s."""
        return max(float(np.abs(self.table[up][1]).max()) for up in (True, False))

    def branch_times(self, up: bool) -> tuple[Array, Array]:
        """Return begin and end in s of the branches (N,)."""
        first = 0 if up else 1
        return self.reversals[first:-1:2], self.reversals[first + 1 :: 2]

    def places_of(self, up: bool, displacement: float) -> float:
        """Return the place of a branch at which it passes a displacement in m."""
        moved = self.table[up][0]
        return float(np.interp(displacement, moved, GRID) if up else np.interp(-displacement, -moved, GRID))

    def samples(self, up: bool) -> list[slice]:
        """Return the samples of every branch, its reversals excluded."""
        begin, end = self.branch_times(up)
        first, last = np.searchsorted(self.time, begin, side="right"), np.searchsorted(self.time, end, side="left")
        return [slice(int(a), int(b)) for a, b in zip(first, last, strict=True)]

    def window(self, place: float, half: float) -> Window:
        """Return the window about a place that has enough samples, within the branch."""
        step = 2.0 / self.per_cycle
        reach = max(half, FEWEST_IN * step)
        low, high = place - reach, place + reach
        if low < 0.0 or high > 1.0:
            width = max(END, END_SAMPLES * step, min(2.0 * reach, 1.0) if 0.0 < place < 1.0 else 0.0)
            low, high = (0.0, min(width, 1.0)) if low < 0.0 else (max(1.0 - width, 0.0), 1.0)
            return Window((low, high), 2 if width <= 2.0 * WIDE else 3)
        return Window((low, high), 2 if reach <= WIDE else 4)

    def at(self, up: bool, place: float, half: float = CENTRAL / 2.0, slope: bool = False) -> PerCycle:
        """Return the force in N at a place of every branch, or its slope over the place.

        Parameters
        ----------
        up
            Which branch.
        place
            0 to 1; at both ends the force's limit from within the branch.
        half
            Half of the window in shares of the branch, widened where it would have too few samples.
        slope
            Whether the slope is wanted.
        """
        return self.fitted(up, place, self.window(place, half), slope)

    def fitted(self, up: bool, place: float, window: Window, slope: bool = False) -> PerCycle:
        """Return the value or the slope at a place of polynomials of the force over a window of every branch."""
        begin, end = self.branch_times(up)
        low, high = window.ends
        worse = WORSE if low < place < high else WORSE_AT_END
        local = _Local(self.noise, worse, 0.0 if slope else self.zero)
        for k, samples in enumerate(self.samples(up)):
            at = (self.time[samples] - begin[k]) / (end[k] - begin[k])
            ends = int(np.searchsorted(at, low, "left")), int(np.searchsorted(at, high, "right"))
            # windows of few samples are widened by these
            a, b = _widened(*ends, window.degree + 2, len(at))
            at = at[a:b] - place
            scale = float(np.max(np.abs(at))) or 1.0
            basis = np.vander(at / scale, min(window.degree, b - a - 1) + 1, increasing=True)
            local.add(at, basis, self.force[samples][a:b], (int(slope), 1.0 / scale if slope else 1.0))
        return local.found

    def at_reversal(self, greatest: bool) -> PerCycle:
        """Return the force in N at the greatest or the least displacement: the mean of its limits before and after.

        The branch before and the one after are fitted together by even and odd functions of the time since the
        reversal; a jump there, or a slope without bound, is odd and does not move the mean.
        """
        step = 2.0 / self.per_cycle
        width = min(max(END, END_SAMPLES * step), 1.0)
        local = _Local(self.noise, WORSE_AT_END, self.zero)
        before, after = (zip(self.samples(up), *self.branch_times(up), strict=True) for up in (greatest, not greatest))
        for one, other in zip(before, after, strict=True):
            parts = []
            for (samples, begin, end), zero in ((one, 1.0), (other, 0.0)):
                at = (self.time[samples] - begin) / (end - begin) - zero
                near = np.abs(at) <= width
                parts.append((at[near], self.force[samples][near]))
            at, force = (np.concatenate(column) for column in zip(*parts, strict=True))
            local.add(at, _even_and_odd(at / width), force, (0, 1.0))
        return local.found

    @cached_property
    def work(self) -> PerCycle:
        """∫F dd in J over every cycle."""
        up, down = self._work(True), self._work(False)
        return PerCycle(up.values + down.values, up.noise + down.noise, up.shared + down.shared)

    def _work(self, up: bool) -> PerCycle:
        begin, end = self.branch_times(up)
        values, noise, lines = np.empty(self.count), np.empty(self.count), np.empty(self.count)
        for k, samples in enumerate(self.samples(up)):
            time = np.concatenate([[begin[k]], self.time[samples], [end[k]]])
            parts, rate = np.diff(time) / 2.0, self.motion(self.time[samples], 1)
            weights = (parts[1:] + parts[:-1]) * rate
            values[k] = lines[k] = float(weights @ self.force[samples])
            if self.per_cycle < FINE:
                power = np.concatenate([[0.0], self.force[samples] * rate, [0.0]])
                values[k] = float(CubicSpline(time, power).integrate(begin[k], end[k]))
            noise[k] = self.noise**2 * float(weights @ weights)
        apart = abs(float(np.mean(values - lines)))
        # corners that so few samples do not show, at places that are the same in every cycle
        apart *= CORNERS if self.per_cycle < SHOWN else 1.0
        return PerCycle(values, noise, apart)

    def placed(self, up: bool, every: slice = slice(None)) -> tuple[Array, Array, Array]:
        """Return cycle, place and force (S,) of the samples of the branches of some cycles."""
        begin, end = self.branch_times(up)
        chosen = list(enumerate(self.samples(up)))[every]
        which = np.concatenate([np.full(s.stop - s.start, k) for k, s in chosen])
        at = np.concatenate([(self.time[s] - begin[k]) / (end[k] - begin[k]) for k, s in chosen])
        return which, at, np.concatenate([self.force[s] for _, s in chosen])

    def pooled(self, up: bool, every: slice = slice(None)) -> Pooled:
        """Return force over place of the branches of some cycles together."""
        _, at, force = self.placed(up, every)
        which = np.minimum((at * BINS).astype(np.int64), BINS - 1)
        counts = np.bincount(which, minlength=BINS)
        there = counts > 0
        return Pooled(
            np.bincount(which, at, BINS)[there] / counts[there],
            np.bincount(which, force, BINS)[there] / counts[there],
            counts[there].astype(np.float64),
        )

    def estimate(self, function: Function, *inputs: PerCycle) -> Estimate:
        """Return a quantity of what the cycles give, with its interval."""
        return estimate(function, *inputs, reach=self.reach)


def _widened(first: int, last: int, fewest: int, samples: int) -> tuple[int, int]:
    while last - first < min(fewest, samples):
        first, last = max(first - 1, 0), min(last + 1, samples)
    return first, last


def _even_and_odd(at: Array) -> Array:
    """Return 1, |s|, s², sgn s, sgn s·√|s|, s and s·|s| of times s about a reversal, (S, 7)."""
    size, sign = np.abs(at), np.sign(at)
    return np.stack([np.ones(len(at)), size, at**2, sign, sign * np.sqrt(size), at, at * size], axis=1)


class _Local:
    """Least squares over a window, cycle by cycle: one coefficient of each, and what all of them leave alike."""

    def __init__(self, noise: float, worse: float, zero: float) -> None:
        self.level, self.worse, self.zero = noise, worse, zero
        self.values: list[float] = []
        self.noise: list[float] = []
        self.at: list[Array] = []
        self.left: list[Array] = []
        self.terms = 0

    def add(self, at: Array, basis: Array, force: Array, wanted: tuple[int, float]) -> None:
        """Take a cycle: places (S,), functions there (S, P), force (S,), and which coefficient times what is wanted."""
        term, scale = wanted
        inverse = np.linalg.pinv(basis)
        coefficients = inverse @ force
        self.values.append(scale * float(coefficients[term]))
        self.noise.append((scale * self.level) ** 2 * float(inverse[term] @ inverse[term]))
        self.at.append(at)
        self.left.append(force - basis @ coefficients)
        self.terms = basis.shape[1]

    @property
    def found(self) -> PerCycle:
        """The coefficient of every cycle."""
        return PerCycle(np.array(self.values), np.array(self.noise), self._shared(), self.zero)

    def _shared(self) -> float:
        """Return a bound of the error by what repeats in the residuals: the functions cannot follow it, noise does not.

        Residuals are averaged over places; where these means differ from zero by more than the scatter about them
        explains, the fit has an error of their size.
        """
        at, left = np.concatenate(self.at), np.concatenate(self.left)
        bins = self.terms + 4
        edges = np.quantile(at, np.linspace(0.0, 1.0, bins + 1)[1:-1])
        which = np.searchsorted(edges, at)
        counts = np.bincount(which, minlength=bins)
        there = counts > 0
        means = np.bincount(which, left, bins)[there] / counts[there]
        samples, places = len(left), int(there.sum())
        freedom = samples - places - self.terms
        if places <= self.terms or freedom < 4:
            return 0.0
        between = float(counts[there] @ means**2)
        within = (float(left @ left) - between) / freedom
        ratio = between / (places - self.terms) / within if within > 0.0 else np.inf
        chance = float(fdtrc(places - self.terms, freedom, ratio))
        if chance > ALIKE or between <= ROUNDING * float(np.sum(np.concatenate(self.left) ** 2)):
            return 0.0
        return self.worse * float(np.sqrt(between / samples))


def cycles_of(recording: Recording, segment: Segment, skew: float = 0.0) -> Cycles:
    """Return the whole cycles of a segment of a log with displacement and force.

    Parameters
    ----------
    recording
        The log, in SI.
    segment
        A periodic one.
    skew
        Seconds by which the force is recorded later than the displacement.

    Raises
    ------
    DataError
        If there is no whole cycle, or too few samples a cycle; the message does not name the log.
    """
    drive = smooth(recording, segment, ["displacement", "velocity"])
    begin = segment.start - drive.warm_up
    period = segment.samples / segment.cycles
    if period < FEWEST_SAMPLES:
        raise DataError(f"{period:.0f} samples a cycle; at least {FEWEST_SAMPLES} are needed")
    time = recording.dt * np.arange(begin, segment.stop, dtype=np.float64)
    stroke = np.ascontiguousarray(drive.values[0])
    motion = CubicHermiteSpline(time, stroke, drive.values[1])
    reversals = _reversals(motion, time, stroke)
    # the first cycle may begin within the one by which the test settles
    first = (segment.start - period) * recording.dt
    rising = motion(reversals[:-1]) < motion(reversals[1:])
    begins = np.flatnonzero(rising & (reversals[:-1] > first))
    count = min((len(reversals) - 1 - begins[0]) // 2, segment.cycles) if len(begins) else 0
    if count < 1:
        raise DataError("no whole cycle from least to least displacement; log more cycles")
    start = begins[0] + 2 * max((len(reversals) - 1 - begins[0]) // 2 - count, 0)
    return _cut(recording, reversals[start : start + 2 * count + 1], motion, skew)


def _cut(recording: Recording, reversals: Array, motion: CubicHermiteSpline, skew: float) -> Cycles:
    force = recording.channels["force"]
    a, b = (int(reversals[k] / recording.dt) for k in (0, -1))
    late = int(np.ceil(abs(skew) / recording.dt)) + 1
    first, last = max(a - late, 0), min(b + late + 2, len(force))
    count = len(reversals) // 2
    middle, cycle = (reversals[0] + reversals[-1]) / 2.0, (reversals[-1] - reversals[0]) / count
    ends = max(middle, len(force) * recording.dt - middle) / cycle
    gains, middles = _recorded(recording, reversals, motion)
    window = np.asarray(force[first:last], dtype=np.float64)
    found = Cycles(
        reversals=reversals,
        time=recording.dt * np.arange(first, last, dtype=np.float64) - skew,
        force=window,
        zero=0.0,
        motion=motion,
        gains=gains,
        middles=middles,
        noise=white_part(window),
        reach=min(ends, count * (0.5 + BEYOND)),
        dt=recording.dt,
    )
    zero = _zero_drift(found)
    return replace(found, force=window - zero * (found.time - middle) / cycle, zero=zero) if zero else found


def _zero_drift(cycles: Cycles) -> float:
    """Return the drift of the force's zero in N per cycle; 0 where chance explains it.

    Every sample is compared with those of the other cycles at the same place. A whole cycle has ten times as many as
    a force at one place, so that a drift is told from noise before it matters to one.
    """
    course = np.zeros(cycles.count)
    total = 0
    bins = int(np.clip(cycles.per_cycle / 2.0, 4, BINS))
    for up in (True, False):
        which, at, force = cycles.placed(up)
        bin_of = np.minimum((at * bins).astype(np.int64), bins - 1)
        means = np.bincount(bin_of, force, bins) / np.maximum(np.bincount(bin_of, minlength=bins), 1)
        course += np.bincount(which, force - means[bin_of], cycles.count)
        total += len(force)
    line = line_of(course * cycles.count / max(total, 1))
    return line.slope.value if line is not None and line.chance < DRIFTS else 0.0


def _reversals(motion: CubicHermiteSpline, time: Array, stroke: Array) -> Array:
    """Return the times of the reversals, where the velocity of the smoothed motion is zero."""
    turns = turning_points(stroke, 0.4 * float(np.ptp(stroke)))
    turns = turns[(turns > 0) & (turns < len(stroke) - 1)]
    at, step = time[turns], time[1] - time[0]
    for _ in range(4):
        bend = motion(at, 2)
        move = np.divide(-motion(at, 1), bend, out=np.zeros(len(at)), where=bend != 0.0)
        at = np.clip(at + np.clip(move, -step, step), time[turns] - step, time[turns] + step)
    return np.asarray(at)


def _recorded(recording: Recording, reversals: Array, motion: CubicHermiteSpline) -> tuple[PerCycle, Array]:
    """Return the recorded over the smoothed motion's amplitude, and how far their means are apart, cycle by cycle."""
    values = recording.channels["displacement"]
    count = len(reversals) // 2
    level, middles = noise_level(np.asarray(values[: 1 << 20])), np.empty(count)
    gains, noise = np.empty(count), np.empty(count)
    for k in range(count):
        a, b = (int(np.ceil(reversals[j] / recording.dt)) for j in (2 * k, 2 * k + 2))
        shape = motion(np.arange(a, b) * recording.dt)
        middles[k] = float(np.mean(values[a:b] - shape))
        shape = shape - shape.mean()
        power = float(shape @ shape)
        gains[k] = float(shape @ values[a:b]) / power
        noise[k] = level**2 / power
    return PerCycle(gains, noise), middles
