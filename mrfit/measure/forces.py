"""Forces of whole cycles: at mid-stroke, at both ends of the stroke, and the peak of either direction.

    F0±    force where the displacement passes the middle of the stroke, by the samples within ±5 % of the stroke
    Fd±    force at the greatest and at the least displacement: mean of its limits before and after the reversal
    Fmax±  greatest force of positive velocity, least of negative velocity, in the central part of the stroke; never
           below F0±
    ratio  Fmax of rebound over |Fmax| of compression

Source: definitions as in tests of dampers by whole cycles; see docs/measure_sheet.md.
"""

from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.measure.cycles import BRANCH_GRID, CENTRAL, CORNER_SAMPLES, FEWEST_AT_REVERSAL, Cycles
from mrfit.measure.intervals import PerCycle
from mrfit.measure.quantity import Quantity, without

PEAK_PLACES = np.linspace(0.0, 1.0, 41)
"""Shares of the central part of a branch among which the peak is looked for."""
LOOKED_OVER = (0.2, 0.1, 0.05, CENTRAL / 2.0)
"""Halves of the windows, in shares of a branch, by which its place is found, the first that follow the loop."""


@dataclass(frozen=True)
class Forces:
    """Forces in N of every cycle, by whether velocity or place is positive."""

    at_middle: dict[bool, PerCycle]
    at_ends: dict[bool, PerCycle]
    peaks: dict[bool, PerCycle]


def forces_of(cycles: Cycles, central: float = 1.0, peaks: dict[bool, PerCycle] | None = None) -> Forces:
    """Return the forces of cycles, peaks in a central share of the stroke unless these are known."""
    both = (True, False)
    middle = {up: cycles.at(up, cycles.places_of(up, cycles.middle), _central_half(cycles, up)) for up in both}
    ends = {greatest: cycles.at_reversal(greatest) for greatest in both}
    return Forces(middle, ends, peaks or {up: _greater(_peak(cycles, up, central), middle[up], up) for up in both})


def _greater(peak: PerCycle, middle: PerCycle, up: bool) -> PerCycle:
    """Return the peak, or the force at mid-stroke where noise has put the place of a flat peak beside a greater one."""
    sign = 1.0 if up else -1.0
    return middle if sign * middle.values.mean() > sign * peak.values.mean() else peak


def quantities(cycles: Cycles, forces: Forces, rebound: bool = True) -> list[Quantity]:
    """Return F0, Fd, Fmax and their ratio; ``rebound`` says whether positive velocity is rebound."""
    found = [
        Quantity(name, cycles.estimate(lambda x: x, one))
        for name, one in (
            ("F0+", forces.at_middle[True]),
            ("F0-", forces.at_middle[False]),
            ("Fd+", forces.at_ends[True]),
            ("Fd-", forces.at_ends[False]),
            ("Fmax+", forces.peaks[True]),
            ("Fmax-", forces.peaks[False]),
        )
    ]
    if cycles.per_cycle < FEWEST_AT_REVERSAL:
        found[2:4] = without(("Fd+", "Fd-"), few_at_reversal(cycles))
    least = forces.peaks[not rebound].values.mean()
    if least == 0.0:
        return [*found, *without(("ratio",), "no force in compression")]
    inputs = (forces.peaks[rebound], forces.peaks[not rebound])
    return [*found, Quantity("ratio", cycles.estimate(lambda a, b: np.abs(a) / np.abs(b), *inputs))]


def few_at_reversal(cycles: Cycles) -> str:
    """Return the reason for which forces at the reversals are not given."""
    return f"{cycles.per_cycle:.0f} samples a cycle; {FEWEST_AT_REVERSAL} are needed for the force at a reversal"


def _central_half(cycles: Cycles, up: bool) -> float:
    """Return half of the window at mid-stroke as a share of the branch."""
    inside = np.abs(cycles.moved(up, BRANCH_GRID)) <= CENTRAL * cycles.stroke
    return float(np.ptp(BRANCH_GRID[inside])) / 2.0


def _peak(cycles: Cycles, up: bool, central: float) -> PerCycle:
    """Return the peak force of a direction of every cycle.

    Cycles of even number have the place of the odd ones, those of odd number that of the even ones: a place that is
    chosen by the noise of the same samples would have too high a force.
    """
    half = central * cycles.stroke / 2.0
    first, last = sorted(cycles.places_of(up, cycles.middle + end) for end in (-half, half))
    inside = first + (last - first) * PEAK_PLACES
    folds = [slice(0, None, 2), slice(1, None, 2)] if cycles.count > 1 else [slice(None)]
    places = [_place(cycles, up, inside, fold) for fold in folds]
    values, noise, shared, beside = np.empty(cycles.count), np.empty(cycles.count), 0.0, 0.0
    for fold, place in zip(folds, reversed(places), strict=True):
        found = cycles.at(up, place)
        values[fold], noise[fold] = found.values[fold], found.noise[fold]
        shared = max(shared, found.shared)
        beside = max(beside, _of_degree(cycles, up, place, found))
    return PerCycle(values, noise, shared + beside, cycles.zero)


def _of_degree(cycles: Cycles, up: bool, place: float, found: PerCycle) -> float:
    """Return the change in N of the force found beside a reversal of few samples by a polynomial of a degree less."""
    window = cycles.window(place, CENTRAL / 2.0)
    if cycles.per_cycle >= CORNER_SAMPLES or 0.0 < window.ends[0] and window.ends[1] < 1.0:
        return 0.0
    lower = cycles.fitted(up, place, replace(window, degree=window.degree - 1))
    return abs(float(lower.values.mean() - found.values.mean()))


def _place(cycles: Cycles, up: bool, among: Array, every: slice) -> float:
    """Return the place of the peak: by the widest windows in which polynomials follow the mean loop.

    A flat peak is lost in the noise of narrow ones, and a place beside the peak has too low a force.
    """
    curve = cycles.pooled(up, every)
    sign = 1.0 if up else -1.0
    for half in LOOKED_OVER:
        windows = [cycles.window(p, half) for p in among]
        values = sign * curve.values(among, windows)
        best = int(np.argmax(values))
        if half == LOOKED_OVER[-1] or curve.followed(windows[best], cycles.noise):
            break
    if not 0 < best < len(among) - 1:
        return float(among[best])
    before, here, after = values[best - 1 : best + 2]
    bend = before - 2.0 * here + after
    shift = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(among[best] + np.clip(shift, -0.5, 0.5) * (among[1] - among[0]))
