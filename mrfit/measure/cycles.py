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
from mrfit.measure.intervals import DRIFT_CHANCE, Estimate, Function, PerCycle, estimate, line_of
from mrfit.signal.cycles import turning_points
from mrfit.signal.noise import noise_level, white_part
from mrfit.signal.smoothing import smooth

CENTRAL = 0.05
"""Share of the stroke to either side of its middle over which a force at mid-stroke is taken."""
CYCLE_SAMPLES = 16
"""Samples of a cycle below which nothing is read off it."""
BRANCH_GRID = np.linspace(0.0, 1.0, 257)
BRANCH_BINS = 384
QUARTIC_WINDOW = 0.08
"""Half of a window, in shares of a branch, above which its polynomial has a degree of 4 and not of 2."""
WINDOW_SAMPLES = 3.5
"""Samples that a window reaches to either side at least."""
END_WINDOW = 0.08
"""Window at a branch's end, in shares of it, and samples that it has at least."""
END_SAMPLES = 6
COMMON_CHANCE = 0.01
"""Chance below which what residuals of all cycles have in common is an error of the fit."""
WORSE, WORSE_AT_END = 2.0, 5.0
"""Error of a fit over the RMS of its residual, in the middle of its window and at the end of two half windows."""
COMMON_ROUNDING = 1e-12
SMALLEST_SPAN = 1e-300
CORNER_SAMPLES = 96
"""Samples of a cycle below which a corner beside a reversal may pass unseen."""
FEWEST_AT_REVERSAL = 32
"""Samples of a cycle below which a corner beside a reversal is not told from a jump at it."""
AT_REVERSAL = 1e-3
"""Share of a sample interval within which a sample is at a reversal: a spline through both would have no bounds."""
DRIFT_BEYOND = 1.0
"""Numbers of the measured cycles before and after them over which their drift is taken to go on."""
SPLINE_SAMPLES = 200
"""Samples of a cycle from which straight lines between them give the work to 0.01 %."""


@dataclass(frozen=True)
class Window:
    """Begin and end of a window on a branch, degree of its polynomial, and whether samples at its ends weigh less."""

    ends: tuple[float, float]
    degree: int
    tapered: bool = False


@dataclass(frozen=True)
class BranchMean:
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
        about /= np.maximum(np.max(np.abs(about), axis=1, keepdims=True), SMALLEST_SPAN)
        degrees, tapered = (np.array([getattr(w, name) for w in windows]) for name in ("degree", "tapered"))
        for degree in np.unique(degrees):
            rows = np.flatnonzero((degrees == degree) & (inside.sum(axis=1) > degree))
            weighted = inside[rows] * self.counts * np.where(tapered[rows, None], _taper(about[rows]) ** 2, 1.0)
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
        return float(chdtrc(freedom, float(left @ left) / noise**2)) > COMMON_CHANCE if noise > 0.0 else not left.any()


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
        """Mean displacement in m and velocity in m/s at ``BRANCH_GRID`` of the branches up (True) and down (False)."""
        found = {}
        for up in (True, False):
            begin, end = self.branch_times(up)
            times = begin[:, None] + BRANCH_GRID * (end - begin)[:, None]
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
        return float(
            np.interp(displacement, moved, BRANCH_GRID) if up else np.interp(-displacement, -moved, BRANCH_GRID)
        )

    def samples(self, up: bool) -> list[slice]:
        """Return the samples of every branch; one at a reversal belongs to none."""
        begin, end = self.branch_times(up)
        edge = AT_REVERSAL * self.dt
        first, last = np.searchsorted(self.time, begin + edge), np.searchsorted(self.time, end - edge)
        return [slice(int(a), int(b)) for a, b in zip(first, last, strict=True)]

    def branches(self, up: bool) -> list[tuple[Array, Array]]:
        """Return place and force (S,) of the samples of every branch."""
        return self._placed[up]

    @cached_property
    def _placed(self) -> dict[bool, list[tuple[Array, Array]]]:
        return {
            up: [
                ((self.time[s] - begin) / (end - begin), self.force[s])
                for s, begin, end in zip(self.samples(up), *self.branch_times(up), strict=True)
            ]
            for up in (True, False)
        }

    def moved(self, up: bool, at: Array) -> Array:
        """Return the displacement in m from the middle of the stroke at places (S,) of a branch."""
        return np.interp(at, BRANCH_GRID, self.table[up][0]) - self.middle

    def velocity(self, up: bool, at: Array) -> Array:
        """Return the velocity in m/s at places (S,) of a branch."""
        return np.interp(at, BRANCH_GRID, self.table[up][1])

    def regression(self, rows: Sequence[tuple[Array, Array]]) -> list[PerCycle]:
        """Return the coefficients of least squares of every cycle, from its functions (S, P) and forces (S,)."""
        values, powers, _ = _least_squares(rows)
        return [PerCycle(*one) for one in zip(values.T, self.noise**2 * powers.T, strict=True)]

    def local_fit(self, places: Sequence[Array], rows: Sequence[tuple[Array, Array]], worse: float) -> PerCycle:
        """Return the first coefficient of least squares of every cycle, with a bound of what all of them share.

        Parameters
        ----------
        places
            Of the samples of every cycle (S,).
        rows
            Functions at these places (S, P) and forces (S,) of every cycle.
        worse
            Error of the fit over the RMS of what repeats in its residuals.
        """
        values, powers, left = _least_squares(rows)
        shared = worse * _common_rms(np.concatenate(places), left, values.shape[1])
        return PerCycle(values[:, 0], self.noise**2 * powers[:, 0], shared, self.zero)

    def window(self, place: float, half: float) -> Window:
        """Return the window about a place that has enough samples, within the branch."""
        step = 2.0 / self.per_cycle
        reach = max(half, WINDOW_SAMPLES * step)
        low, high = place - reach, place + reach
        if low < 0.0 or high > 1.0:
            width = max(END_WINDOW, END_SAMPLES * step, min(2.0 * reach, 1.0) if 0.0 < place < 1.0 else 0.0)
            low, high = (0.0, min(width, 1.0)) if low < 0.0 else (max(1.0 - width, 0.0), 1.0)
            return Window((low, high), 2 if width <= 2.0 * QUARTIC_WINDOW else 3)
        return Window((low, high), 2 if reach <= QUARTIC_WINDOW else 4)

    def at(self, up: bool, place: float, half: float = CENTRAL / 2.0) -> PerCycle:
        """Return the force in N at a place of every branch.

        Parameters
        ----------
        up
            Which branch.
        place
            0 to 1; at both ends the force's limit from within the branch.
        half
            Half of the window in shares of the branch, widened where it would have too few samples.
        """
        return self.fitted(up, place, self.window(place, half))

    def fitted(self, up: bool, place: float, window: Window) -> PerCycle:
        """Return the value at a place of polynomials of the force over a window of every branch."""
        low, high = window.ends
        places, rows = [], []
        for at, force in self.branches(up):
            ends = int(np.searchsorted(at, low, "left")), int(np.searchsorted(at, high, "right"))
            # windows of few samples are widened by these
            a, b = _widened(*ends, window.degree + 2, len(at))
            at = at[a:b] - place
            share = at / (float(np.max(np.abs(at))) or 1.0)
            root = _taper(share) if window.tapered else np.ones(len(at))
            places.append(at)
            rows.append((np.vander(share, window.degree + 1, increasing=True) * root[:, None], force[a:b] * root))
        return self.local_fit(places, rows, WORSE if low < place < high else WORSE_AT_END)

    def about_reversal(self, greatest: bool) -> list[tuple[Array, Array]]:
        """Return place, below 0 before the greatest or least displacement, and force (S,) of every cycle."""
        pairs = zip(self.branches(greatest), self.branches(not greatest), strict=True)
        return [(np.concatenate([a - 1.0, b]), np.concatenate([f, g])) for (a, f), (b, g) in pairs]

    def at_reversal(self, greatest: bool) -> PerCycle:
        """Return the force in N at the greatest or the least displacement: the mean of its limits before and after.

        The branch before and the one after are fitted together by even and odd functions of the time since the
        reversal; a jump there, or a slope without bound, is odd and does not move the mean.
        """
        step = 2.0 / self.per_cycle
        width = min(max(END_WINDOW, END_SAMPLES * step), 1.0)
        cycles = self.about_reversal(greatest)

        def fit(reach: float, terms: int) -> PerCycle:
            near = [(at[inside], force[inside]) for at, force in cycles for inside in (np.abs(at) <= reach,)]
            rows = [(_even_and_odd(at / reach)[:, :terms], force) for at, force in near]
            return self.local_fit([at for at, _ in near], rows, WORSE_AT_END)

        found = fit(width, 7)
        if self.per_cycle >= CORNER_SAMPLES:
            return found
        other = fit(width * 2.0 / 3.0, 5)
        apart = float(np.mean(found.values - other.values))
        chance = 2.0 * float(np.sqrt(np.mean(found.noise + other.noise) / self.count))
        return replace(found, shared=max(found.shared, WORSE * (abs(apart) - chance)))

    @cached_property
    def work(self) -> PerCycle:
        """∫F dd in J over every cycle."""
        up, down = self._work(True), self._work(False)
        return PerCycle(up.values + down.values, up.noise + down.noise, up.shared + down.shared)

    def _work(self, up: bool) -> PerCycle:
        begin, end = self.branch_times(up)
        values, noise, thin = np.empty(self.count), np.empty(self.count), np.empty((2, self.count))
        for k, samples in enumerate(self.samples(up)):
            time, force = np.concatenate([[begin[k]], self.time[samples], [end[k]]]), self.force[samples]
            parts, rate = np.diff(time) / 2.0, self.motion(time, 1)
            weights = (parts[1:] + parts[:-1]) * rate[1:-1]
            values[k] = thin[:, k] = float(weights @ force)
            if self.per_cycle < SPLINE_SAMPLES:
                # of a noisy motion the velocity at a reversal need not be zero
                power = rate * np.concatenate([force[:1], force, force[-1:]])
                values[k] = _integral(time, power)
                halves = (np.r_[0, first : len(time) - 1 : 2, len(time) - 1] for first in (1, 2))
                thin[:, k] = [_integral(time[half], power[half]) for half in halves]
            noise[k] = self.noise**2 * float(weights @ weights)
        # corners between samples lie at places that are alike in every cycle: half of the samples show their error
        return PerCycle(values, noise, float(np.max(np.abs(np.mean(values - thin, axis=1)))))

    def placed(self, up: bool, every: slice = slice(None)) -> tuple[Array, Array, Array]:
        """Return cycle, place and force (S,) of the samples of the branches of some cycles."""
        chosen = list(enumerate(self.branches(up)))[every]
        which = np.concatenate([np.full(len(at), k) for k, (at, _) in chosen])
        at, force = (np.concatenate(column) for column in zip(*(one for _, one in chosen), strict=True))
        return which, at, force

    def pooled(self, up: bool, every: slice = slice(None)) -> BranchMean:
        """Return force over place of the branches of some cycles together."""
        _, at, force = self.placed(up, every)
        which = np.minimum((at * BRANCH_BINS).astype(np.int64), BRANCH_BINS - 1)
        counts = np.bincount(which, minlength=BRANCH_BINS)
        there = counts > 0
        return BranchMean(
            np.bincount(which, at, BRANCH_BINS)[there] / counts[there],
            np.bincount(which, force, BRANCH_BINS)[there] / counts[there],
            counts[there].astype(np.float64),
        )

    def estimate(self, function: Function, *inputs: PerCycle) -> Estimate:
        """Return a quantity of what the cycles give, with its interval."""
        return estimate(function, *inputs, reach=self.reach)


def _integral(time: Array, power: Array) -> float:
    return float(CubicSpline(time, power).integrate(time[0], time[-1]))


def _widened(first: int, last: int, fewest: int, samples: int) -> tuple[int, int]:
    while last - first < min(fewest, samples):
        first, last = max(first - 1, 0), min(last + 1, samples)
    return first, last


def _taper(share: Array) -> Array:
    """Return roots of the weights of samples at shares of half a window, 1 at its middle and 0 at its ends."""
    return np.asarray(1.0 - share**2)


def _even_and_odd(at: Array) -> Array:
    """Return 1, s², sgn s, s, s·|s|, |s| and sgn s·√|s| of times s about a reversal, (S, 7)."""
    size, sign = np.abs(at), np.sign(at)
    return np.stack([np.ones(len(at)), at**2, sign, at, at * size, size, sign * np.sqrt(size)], axis=1)


def _least_squares(rows: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, Array]:
    """Return coefficients (N, P), sums of their squared weights (N, P), and the residuals of all rows together."""
    samples = [len(force) for _, force in rows]
    bases = np.zeros((len(rows), max(samples), rows[0][0].shape[1]))
    forces = np.zeros(bases.shape[:2])
    # rows of zeros beyond the last sample of a cycle change nothing
    for k, (basis, force) in enumerate(rows):
        bases[k, : len(force)], forces[k, : len(force)] = basis, force
    inverse = np.linalg.pinv(bases)
    values = np.einsum("nps,ns->np", inverse, forces)
    left = forces - np.einsum("nsp,np->ns", bases, values)
    return values, np.sum(inverse**2, axis=2), left[np.arange(left.shape[1]) < np.array(samples)[:, None]]


def _common_rms(at: Array, left: Array, terms: int) -> float:
    """Return the RMS of what repeats in residuals (S,) at places: the functions cannot follow it, noise does not.

    Residuals are averaged over places; 0 where these means do not differ from zero by more than the scatter about them
    explains.
    """
    bins = terms + 4
    which = np.searchsorted(np.quantile(at, np.linspace(0.0, 1.0, bins + 1)[1:-1]), at)
    counts = np.bincount(which, minlength=bins)
    there = counts > 0
    means = np.bincount(which, left, bins)[there] / counts[there]
    samples, places = len(left), int(there.sum())
    freedom = samples - places - terms
    if places <= terms or freedom < 4:
        return 0.0
    between, whole = float(counts[there] @ means**2), float(left @ left)
    within = (whole - between) / freedom
    ratio = between / (places - terms) / within if within > 0.0 else np.inf
    chance = float(fdtrc(places - terms, freedom, ratio))
    return 0.0 if chance > COMMON_CHANCE or between <= COMMON_ROUNDING * whole else float(np.sqrt(between / samples))


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
    if abs(skew) >= 0.5 * period * recording.dt:
        raise DataError(f"a skew of {skew:g} s is half a cycle of {period * recording.dt:.3g} s or more")
    if period < CYCLE_SAMPLES:
        raise DataError(f"{period:.0f} samples a cycle; at least {CYCLE_SAMPLES} are needed")
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
        reach=min(ends, count * (0.5 + DRIFT_BEYOND)),
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
    bins = int(np.clip(cycles.per_cycle / 2.0, 4, BRANCH_BINS))
    for up in (True, False):
        which, at, force = cycles.placed(up)
        bin_of = np.minimum((at * bins).astype(np.int64), bins - 1)
        means = np.bincount(bin_of, force, bins) / np.maximum(np.bincount(bin_of, minlength=bins), 1)
        course += np.bincount(which, force - means[bin_of], cycles.count)
        total += len(force)
    line = line_of(course * cycles.count / max(total, 1))
    return line.slope.value if line is not None and line.chance < DRIFT_CHANCE else 0.0


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
