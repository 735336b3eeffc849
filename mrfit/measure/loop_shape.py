"""Shape of a loop: widths over velocity, free travel after a reversal, ripple.

    width±       F while the speed rises less F while it falls, at a stated speed, of either direction
    width v      velocity at zero force after the least displacement less that after the greatest one
    free travel  travel between the lines through the force's flanks before and after zero, after a reversal
    ripple       greatest departure of the force from a smooth loop, over the peak force, away from the reversals

The place of the largest ripple is chosen by other cycles than those whose ripple is taken: noise has none on average.
"""

from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.measure.cycles import BRANCH_GRID, WORSE, Cycles, Window, powers_of
from mrfit.measure.forces import Forces
from mrfit.measure.intervals import PerCycle, estimate
from mrfit.measure.quantity import Quantity, without

FLANK_NEAR, FLANK_FAR = 0.05, 0.35
"""Shares of the peak force between which a flank is a line."""
FLANK_POINTS = 5
"""Points of a flank from which on it has a line."""
SMOOTH_WINDOW, RIPPLE_WINDOW = 0.16, 0.03
"""Half of the windows, in shares of a branch, of the smooth loop and of the loop with its ripple."""
CYCLE_GROUPS = 4
"""Groups of cycles by whose scatter the interval of the free travel is found."""
RIPPLE_PLACES = np.linspace(0.22, 0.78, 57)
"""Places of a branch at which a ripple is looked for."""


def quantities(cycles: Cycles, forces: Forces, speed: float | None = None) -> list[Quantity]:
    """Return widths and free travel; widths at a speed in m/s, default: half of the greatest."""
    stated = cycles.peak_velocity / 2.0 if speed is None else speed
    found: list[Quantity] = []
    for name, up in (("width+", True), ("width-", False)):
        found += _width(cycles, name, up, stated)
    return [*found, _velocity_width(cycles), _free_travel(cycles, forces)]


def _difference(one: PerCycle, other: PerCycle) -> PerCycle:
    values, zero = one.values - other.values, one.zero - other.zero
    return PerCycle(values, one.noise + other.noise, one.shared + other.shared, zero)


def _width(cycles: Cycles, name: str, up: bool, speed: float) -> list[Quantity]:
    course = np.abs(cycles.table[up][1])
    top = int(np.argmax(course))
    if not 0.0 < speed < course[top]:
        return without((name,), f"the speed does not reach {speed:.4g} m/s")
    rises = float(np.interp(speed, course[: top + 1], BRANCH_GRID[: top + 1]))
    falls = float(np.interp(-speed, -course[top:], BRANCH_GRID[top:]))
    return [Quantity(name, cycles.estimate(lambda x: x, _difference(cycles.at(up, rises), cycles.at(up, falls))))]


@dataclass(frozen=True)
class _Turn:
    """Mean force about a reversal, with the sign with which it rises there, from half a branch before it.

    ``at`` is the place (B,), below 0 before the reversal, ``way`` the travel in m since it, ``force`` over the peak.
    """

    at: Array
    way: Array
    force: Array

    @property
    def crossing(self) -> int | None:
        """Last point below zero force, that nearest to the reversal; None where the force does not change its sign."""
        rise = np.flatnonzero((self.force[:-1] < 0.0) & (self.force[1:] >= 0.0))
        return int(rise[np.argmin(np.abs(self.at[rise]))]) if len(rise) else None


NO_CROSSING = "the force does not change its sign about a reversal"


def _turn(cycles: Cycles, up: bool, level: float, peak: float, every: slice = slice(None)) -> _Turn:
    """Return the force, less a level and over a peak, about the least displacement (``up``) or the greatest."""
    before, after = cycles.pooled(not up, every), cycles.pooled(up, every)
    end = cycles.moved(up, np.zeros(1))
    way = [-np.abs(cycles.moved(not up, before.at) - end), np.abs(cycles.moved(up, after.at) - end)]
    at = np.concatenate([before.at - 1.0, after.at])
    force = (1.0 if up else -1.0) * (np.concatenate([before.force, after.force]) - level) / peak
    near = np.abs(at) <= 0.5
    return _Turn(at[near], np.concatenate(way)[near], force[near])


def _velocity_width(cycles: Cycles) -> Quantity:
    """Return the width over velocity at zero force: by the place where the force crosses zero after each reversal."""
    crossings = []
    for up in (True, False):
        turn = _turn(cycles, up, 0.0, 1.0)
        at, force, k = turn.at, turn.force, turn.crossing
        if k is None:
            return Quantity("width v", None, NO_CROSSING)
        place = float(at[k] - force[k] * (at[k + 1] - at[k]) / (force[k + 1] - force[k]))
        jumps = at[k] < 0.0 <= at[k + 1] and _jumps(cycles, up)
        crossings.append(_at_rest(cycles, up) if jumps else _velocities(cycles, up, place))
    return Quantity("width v", cycles.estimate(lambda x: x, _difference(crossings[0], crossings[1])))


def _jumps(cycles: Cycles, up: bool) -> bool:
    """Return whether the force jumps over zero at a reversal."""
    before, after = (cycles.estimate(lambda x: x, one) for one in (cycles.at(not up, 1.0), cycles.at(up, 0.0)))
    return before.high < 0.0 < after.low if up else after.high < 0.0 < before.low


def _at_rest(cycles: Cycles, up: bool) -> PerCycle:
    """Return no velocity, which is known to half of what it changes between two samples."""
    step = float(np.interp(2.0 / cycles.per_cycle, BRANCH_GRID, np.abs(cycles.table[up][1])))
    return PerCycle(np.zeros(cycles.count), np.zeros(cycles.count), step / 2.0)


def _velocities(cycles: Cycles, up: bool, place: float) -> PerCycle:
    """Return the velocity in m/s at which the force of every cycle is zero, near a place (below 0 before it).

    There the force is taken as a parabola over the velocity, through the reversal.
    """
    half = max(0.02, 3.0 * 2.0 / cycles.per_cycle)
    here = cycles.velocity(not up if place < 0.0 else up, np.array([place + (place < 0.0)]))
    whole = cycles.about_reversal(not up)
    near = whole.within(np.abs(whole.at - place) <= half)
    speeds = np.where(near.at < 0.0, cycles.velocity(not up, near.at + 1.0), cycles.velocity(up, near.at)) - here
    level, slopes, _ = cycles.fit(near, powers_of(speeds, 2), WORSE)
    slope = float(slopes.values.mean())
    speeds = (here - level.values / slope) * cycles.gains.values
    return PerCycle(speeds, level.noise / slope**2, level.shared / abs(slope), -level.zero / slope)


def _free_travel(cycles: Cycles, forces: Forces) -> Quantity:
    """Return the travel after a reversal between the flanks' lines at zero force, mean of both reversals."""
    groups = min(cycles.count, CYCLE_GROUPS)
    peak = (forces.peaks[True].values.mean() - forces.peaks[False].values.mean()) / 2.0
    level = (forces.at_middle[True].values.mean() + forces.at_middle[False].values.mean()) / 2.0
    widths, step = np.zeros(groups), 0.0
    for group in range(groups):
        for up in (True, False):
            turn = _turn(cycles, up, level, peak, slice(group, None, groups))
            if turn.crossing is None:
                return Quantity("free travel", None, NO_CROSSING)
            travel, between = _between_flanks(turn, turn.crossing)
            widths[group] += travel / 2.0
            step = max(step, between)
    found = PerCycle(widths * cycles.gain, np.zeros(groups), step)
    return Quantity("free travel", estimate(lambda x: x, found))


def _between_flanks(turn: _Turn, crossing: int) -> tuple[float, float]:
    """Return the travel in m between the zeros of the flanks' lines, and the travel between points that bounds it."""
    force, way = turn.force, turn.way
    last, first = crossing, crossing + 1
    while last > 0 and force[last] > -FLANK_NEAR:
        last -= 1
    while first < len(force) - 1 and force[first] < FLANK_NEAR:
        first += 1
    begin, end = last, first
    while begin > 0 and -FLANK_FAR <= force[begin - 1] <= force[last]:
        begin -= 1
    while end < len(force) - 1 and force[first] <= force[end + 1] <= FLANK_FAR:
        end += 1
    one = _zero_of(way[begin : last + 1], force[begin : last + 1])
    other = _zero_of(way[first : end + 1], force[first : end + 1])
    travel = max(other - one, 0.0) if first - last > 1 else 0.0
    # a jump lies anywhere between the points before and after it, and a flank without a line anywhere between both
    between = float(np.max(np.diff(way)[[last, first - 1]]))
    lines = min(last + 1 - begin, end + 1 - first) >= FLANK_POINTS
    return travel, between if lines else max(between, travel)


def _zero_of(way: Array, force: Array) -> float:
    """Return the place at which the line of a flank meets zero force; its end where it is too steep for a line."""
    if len(way) < FLANK_POINTS or np.ptp(force) < FLANK_NEAR:
        return float(way[np.argmin(np.abs(force))])
    return float(np.polyfit(force, way, 1)[1])


def ripple(cycles: Cycles, forces: Forces) -> Quantity:
    """Return the largest ripple over the smooth loop; a force that is recorded late hardly changes it."""
    step = 2.0 / cycles.per_cycle
    if RIPPLE_SAMPLES * step > RIPPLE_WINDOW:
        return Quantity(
            "ripple",
            None,
            f"{cycles.per_cycle:.0f} samples a cycle; {2.0 * RIPPLE_SAMPLES / RIPPLE_WINDOW:.0f} are needed",
        )
    if cycles.count < 2:
        return Quantity("ripple", None, "one cycle; two are needed to tell a ripple from noise")
    peak = (forces.peaks[True].values.mean() - forces.peaks[False].values.mean()) / 2.0
    folds = (slice(0, None, 2), slice(1, None, 2))
    values, noise = np.empty(cycles.count), np.empty(cycles.count)
    for chosen, other in (folds, folds[::-1]):
        up, place, sign = _largest(cycles, other)
        narrow, smooth = (cycles.fitted(up, place, window) for window in _windows(cycles, place))
        values[chosen] = sign * (narrow.values - smooth.values)[chosen] / peak
        noise[chosen] = (narrow.noise + smooth.noise)[chosen] / peak**2
    return Quantity("ripple", cycles.estimate(lambda x: x, PerCycle(values, noise)))


RIPPLE_SAMPLES = 1.5
"""Samples that the narrow window of a ripple reaches to either side at least."""


def _largest(cycles: Cycles, every: slice) -> tuple[bool, float, float]:
    """Return branch, place and sign of the largest departure from the smooth loop, of some cycles."""
    best = (True, 0.5, 1.0)
    largest = -1.0
    windows = list(zip(*(_windows(cycles, p) for p in RIPPLE_PLACES), strict=True))
    for up in (True, False):
        curve = cycles.pooled(up, every)
        narrow, smooth = (curve.values(RIPPLE_PLACES, own) for own in windows)
        k = int(np.argmax(np.abs(narrow - smooth)))
        departure = float(narrow[k] - smooth[k])
        if abs(departure) > largest:
            largest, best = abs(departure), (up, float(RIPPLE_PLACES[k]), float(np.sign(departure)) or 1.0)
    return best


def _windows(cycles: Cycles, place: float) -> tuple[Window, Window]:
    """Return the windows about a place that show a ripple and that smooth it."""
    half = float(np.clip(2.0 * RIPPLE_SAMPLES * 2.0 / cycles.per_cycle, RIPPLE_WINDOW / 3.0, RIPPLE_WINDOW))
    ends = [(place - reach, place + reach) for reach in (half, SMOOTH_WINDOW)]
    return Window(ends[0], 2), Window(ends[1], 4, tapered=True)
