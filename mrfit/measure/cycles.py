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
from numpy.polynomial.polynomial import polyvander
from scipy.interpolate import CubicHermiteSpline, InterpolatedUnivariateSpline
from scipy.special import chdtrc, fdtrc

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array, Index, Mask
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
        first, stop = np.searchsorted(self.at, ends[:, 0]), np.searchsorted(self.at, ends[:, 1], side="right")
        number = first[:, None] + np.arange(int(np.max(stop - first)))
        inside, number = number < stop[:, None], np.minimum(number, len(self.at) - 1)
        degrees, tapered = (np.array([getattr(w, name) for w in windows]) for name in ("degree", "tapered"))
        about = np.where(inside, self.at[number] - places[:, None], 0.0)
        about /= np.maximum(np.max(np.abs(about), axis=1, keepdims=True), SMALLEST_SPAN)
        for degree in np.unique(degrees):
            rows = np.flatnonzero((degrees == degree) & (inside.sum(axis=1) > degree))
            weighted = (inside * self.counts[number])[rows] * np.where(
                tapered[rows, None], _taper(about[rows]) ** 2, 1.0
            )
            basis = powers_of(about[rows], degree)
            normal = np.swapaxes(basis * weighted[:, :, None], 1, 2)
            found[rows] = np.linalg.solve(normal @ basis, normal @ self.force[number[rows]][:, :, None])[:, 0, 0]
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
class CycleSamples:
    """Place and force in N of the samples of every cycle, a row each (N, S); where not ``there``, both are zero."""

    at: Array
    force: Array
    there: Mask

    def within(self, inside: Mask) -> "CycleSamples":
        """Return the samples of some places (N, S)."""
        inside = inside & self.there
        columns = np.flatnonzero(inside.any(axis=0))
        some = slice(columns[0], columns[-1] + 1) if len(columns) else slice(0)
        inside = inside[:, some]
        return CycleSamples(inside * self.at[:, some], inside * self.force[:, some], inside)


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
    bounded
        Whether the work needs a bound of its error.
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
    bounded: bool = True

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
        """Return the cycles with the force taken as later by so many seconds; of its work only the value is asked."""
        return replace(self, time=self.time - seconds, bounded=False)

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

    def branches(self, up: bool) -> CycleSamples:
        """Return the samples of every branch; one at a reversal belongs to none."""
        return self._branches[up]

    @cached_property
    def _branches(self) -> dict[bool, CycleSamples]:
        found = {}
        for up in (True, False):
            begin, end = self.branch_times(up)
            number, there = self._numbers(up)
            at = (self.time[number] - begin[:, None]) / (end - begin)[:, None]
            found[up] = CycleSamples(there * at, there * self.force[number], there)
        return found

    def _numbers(self, up: bool) -> tuple[Index, Mask]:
        """Return the numbers of the samples of every branch (N, S), and which of them are there."""
        begin, end = self.branch_times(up)
        edge = AT_REVERSAL * self.dt
        first, last = np.searchsorted(self.time, begin + edge), np.searchsorted(self.time, end - edge)
        number = first[:, None] + np.arange(int(np.max(last - first)))
        return np.minimum(number, len(self.time) - 1), number < last[:, None]

    def moved(self, up: bool, at: Array) -> Array:
        """Return the displacement in m from the middle of the stroke at places (S,) of a branch."""
        return np.interp(at, BRANCH_GRID, self.table[up][0]) - self.middle

    def velocity(self, up: bool, at: Array) -> Array:
        """Return the velocity in m/s at places (S,) of a branch."""
        return np.interp(at, BRANCH_GRID, self.table[up][1])

    def fit(self, samples: CycleSamples, basis: Array, worse: float = 0.0) -> list[PerCycle]:
        """Return the coefficients of least squares of every cycle.

        Parameters
        ----------
        samples
            Of every cycle (N, S).
        basis
            Functions at these (N, S, P); the first is the level of the force.
        worse
            Bound of the first coefficient's error that all cycles share, over the RMS of what repeats in residuals.
        """
        basis = basis * samples.there[:, :, None]
        inverse = np.linalg.pinv(basis)
        values = np.einsum("nps,ns->pn", inverse, samples.force)
        left = samples.force - np.einsum("nsp,pn->ns", basis, values)
        inside = samples.there
        shared = worse * _common_rms(samples.at[inside], left[inside], len(values)) if worse else 0.0
        noise = self.noise**2 * np.sum(inverse**2, axis=2).T
        level, *others = (PerCycle(*one) for one in zip(values, noise, strict=True))
        return [replace(level, shared=shared, zero=self.zero), *others]

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
        whole = self.branches(up)
        at, count = np.where(whole.there, whole.at, np.inf), np.sum(whole.there, axis=1)
        first, last = np.sum(at < low, axis=1), np.sum(at <= high, axis=1)
        # windows of few samples are widened by these
        while (few := last - first < np.minimum(window.degree + 2, count)).any():
            first, last = np.maximum(first - few, 0), np.minimum(last + few, count)
        number = np.arange(at.shape[1])
        inside = (number >= first[:, None]) & (number < last[:, None])
        near = whole.within(inside)
        share = near.there * (near.at - place)
        share = share / np.maximum(np.max(np.abs(share), axis=1, keepdims=True), SMALLEST_SPAN)
        root = _taper(share) if window.tapered else np.ones(share.shape)
        basis = powers_of(share, window.degree) * root[:, :, None]
        weighted = replace(near, force=near.force * root)
        return self.fit(weighted, basis, WORSE if low < place < high else WORSE_AT_END)[0]

    def about_reversal(self, greatest: bool) -> CycleSamples:
        """Return the samples of every cycle about its greatest or least displacement; place is below 0 before it."""
        before, after = self.branches(greatest), self.branches(not greatest)
        at = np.concatenate([before.there * (before.at - 1.0), after.at], axis=1)
        there, force = (
            np.concatenate([getattr(one, n) for one in (before, after)], axis=1) for n in ("there", "force")
        )
        return CycleSamples(at, force, there)

    def at_reversal(self, greatest: bool) -> PerCycle:
        """Return the force in N at the greatest or the least displacement: the mean of its limits before and after.

        The branch before and the one after are fitted together by even and odd functions of the time since the
        reversal; a jump there, or a slope without bound, is odd and does not move the mean.
        """
        step = 2.0 / self.per_cycle
        width = min(max(END_WINDOW, END_SAMPLES * step), 1.0)
        cycles = self.about_reversal(greatest)

        def fit(reach: float, terms: int) -> PerCycle:
            near = cycles.within(np.abs(cycles.at) <= reach)
            return self.fit(near, _even_and_odd(near.at / reach)[:, :, :terms], WORSE_AT_END)[0]

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
        number, there = self._numbers(up)
        force = self.branches(up).force
        # beyond the last sample of a branch the time stands still at its end
        inner = np.where(there, self.time[number], end[:, None])
        time = np.concatenate([begin[:, None], inner, end[:, None]], axis=1)
        parts, rate = np.diff(time, axis=1) / 2.0, self.motion(time, 1)
        weights = there * (parts[:, 1:] + parts[:, :-1]) * rate[:, 1:-1]
        values = np.sum(weights * force, axis=1)
        thin = np.tile(values, (2, 1))
        for k, count in enumerate(np.sum(there, axis=1) if self.per_cycle < SPLINE_SAMPLES else ()):
            # of a noisy motion the velocity at a reversal need not be zero
            power = rate[k, : count + 2] * force[k, np.clip(np.arange(-1, count + 1), 0, count - 1)]
            values[k] = _integral(time[k, : count + 2], power)
            halves = (np.r_[0, first : count + 1 : 2, count + 1] for first in (1, 2))
            thin[:, k] = [_integral(time[k, half], power[half]) for half in halves] if self.bounded else values[k]
        noise = self.noise**2 * np.sum(weights**2, axis=1)
        # corners between samples lie at places that are alike in every cycle: half of the samples show their error
        return PerCycle(values, noise, float(np.max(np.abs(np.mean(values - thin, axis=1)))))

    def placed(self, up: bool, every: slice = slice(None)) -> tuple[Index, Array, Array]:
        """Return cycle, place and force (S,) of the samples of the branches of some cycles."""
        whole = self.branches(up)
        there = whole.there[every]
        which = np.arange(self.count)[every][np.nonzero(there)[0]]
        return which, whole.at[every][there], whole.force[every][there]

    def pooled(self, up: bool, every: slice = slice(None)) -> BranchMean:
        """Return force over place of the branches of some cycles together."""
        key = up, every.indices(self.count)
        if key not in self._pooled:
            self._pooled[key] = self._pool(up, every)
        return self._pooled[key]

    @cached_property
    def _pooled(self) -> dict[tuple[bool, tuple[int, int, int]], BranchMean]:
        return {}

    def _pool(self, up: bool, every: slice) -> BranchMean:
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
    """Return the integral of the cubic spline through points (S,)."""
    spline = InterpolatedUnivariateSpline(time, power, k=min(3, len(time) - 1))  # type: ignore[arg-type]  # stubs ask for a literal
    return float(spline.integral(time[0], time[-1]))


def powers_of(values: Array, degree: int) -> Array:
    """Return the powers 0 to ``degree`` of values (…), as (…, degree + 1)."""
    return np.asarray(polyvander(values, degree), dtype=np.float64)


def _taper(share: Array) -> Array:
    """Return roots of the weights of samples at shares of half a window, 1 at its middle and 0 at its ends."""
    return np.asarray(1.0 - share**2)


def _even_and_odd(at: Array) -> Array:
    """Return 1, s², sgn s, s, s·|s|, |s| and sgn s·√|s| of times s about a reversal, (N, S, 7)."""
    size, sign = np.abs(at), np.sign(at)
    return np.stack([np.ones(at.shape), at**2, sign, at, at * size, size, sign * np.sqrt(size)], axis=2)


def _common_rms(at: Array, left: Array, terms: int) -> float:
    """Return the RMS of what repeats in residuals (S,) at places: the functions cannot follow it, noise does not.

    Residuals are averaged over places; 0 where these means do not differ from zero by more than the scatter about them
    explains.
    """
    bins = terms + 4
    # their quantiles, which np.quantile finds in ten times the time
    edges = np.interp(np.linspace(0, len(at) - 1, bins + 1)[1:-1], np.arange(len(at)), np.sort(at))
    which = np.searchsorted(edges, at)
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
