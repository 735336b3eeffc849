"""Stiffness and yield of a bilinear loop, by two methods that are both named.

    by the slope of unloading (K_0, K_p, F_y, d_y), of steady cycles:
        K_0 slope after a reversal until the force is zero; K_p slope of loading over the last quarter of the stroke;
        Q force at mid-stroke of the line of K_p; the line of K_0 through the middle of the loop meets it at d_y, F_y

    by initial loading and peaks (… initial, … peaks), of cycles whose amplitude grows from rest:
        K_0 slope of the first loading up to half of the first peak force; K_p slope of the line through the peaks of
        the cycles, Q where it meets zero displacement

    d_y = Q/(K_0 - K_p), F_y = K_0*d_y

Source: bilinear idealisation of hysteretic dampers and isolators by whole cycles.
"""

from collections.abc import Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.measure.cycles import Cycles, powers_of
from mrfit.measure.energy import work_of
from mrfit.measure.forces import Forces
from mrfit.measure.intervals import PerCycle, known, line_of
from mrfit.measure.quantity import Quantity, without

UNLOADING = ("K_0", "K_p", "F_y", "d_y")
PEAKS = ("K_0 initial", "K_p peaks", "F_y peaks", "d_y peaks")
UNLOADED_FROM, UNLOADED_UNTIL = 0.9, 0.1
"""Shares of the force at a reversal between which its unloading has the slope K_0."""
LOADING_PART = 0.25
"""Part of the stroke before a reversal over which loading has the slope K_p."""
AREA_TOLERANCE = 0.05
"""Difference in energy of a loop from its bilinear idealisation, as a share, above which it is not bilinear."""
FEWEST_PEAKS = 3


def quantities(cycles: Cycles, forces: Forces) -> list[Quantity]:
    """Return stiffnesses and yield by the slope of unloading; True in ``elastic`` is that after the greatest d."""
    elastic = [_unloading(cycles, forces, greatest) for greatest in (True, False)]
    if elastic[0] is None or elastic[1] is None:
        return without(UNLOADING, "no elastic unloading: the force falls with the velocity, not along the stroke")
    first, gain = _mean(elastic[0], elastic[1]), cycles.gains
    yielding = [_loading(cycles, up) for up in (True, False)]
    post = _mean(yielding[0][1], yielding[1][1])
    force = PerCycle(
        (yielding[0][0].values - yielding[1][0].values) / 2.0, (yielding[0][0].noise + yielding[1][0].noise) / 4.0
    )

    def yield_displacement(k_0: Array, k_p: Array, q: Array, g: Array) -> Array:
        return q * g / (k_0 - k_p)

    inputs = (first, post, force, gain)
    k_0 = cycles.estimate(lambda k, g: k / g, first, gain)
    k_p = cycles.estimate(lambda k, g: k / g, post, gain)
    if not k_0.low > max(k_p.high, 0.0):
        return without(UNLOADING, "unloading is no steeper than loading: the loop is not bilinear")
    d_y = cycles.estimate(yield_displacement, *inputs)
    # a bilinear loop is a parallelogram
    area = 4.0 * force.values.mean() * (cycles.stroke / 2.0 - d_y.value / cycles.gain)
    if abs(area / (work_of(cycles).values.mean() / cycles.gain) - 1.0) > AREA_TOLERANCE:
        return without(UNLOADING, "the loop is not bilinear: its energy is not that of such a loop")
    f_y = cycles.estimate(lambda k, p, q, g: k / g * yield_displacement(k, p, q, g), *inputs)
    return [Quantity(n, e) for n, e in zip(UNLOADING, (k_0, k_p, f_y, d_y), strict=True)]


def _mean(one: PerCycle, other: PerCycle) -> PerCycle:
    return PerCycle((one.values + other.values) / 2.0, (one.noise + other.noise) / 4.0)


def _unloading(cycles: Cycles, forces: Forces, greatest: bool) -> PerCycle | None:
    """Return the slope in N/m after a reversal until the force is zero; None where it does not follow the stroke."""
    up = not greatest
    at_end = float(forces.at_ends[greatest].values.mean())
    curve = cycles.pooled(up)
    share = curve.force / at_end if at_end else np.zeros(1)
    below = np.flatnonzero(share < UNLOADED_UNTIL)
    if not len(below) or np.max(share[: below[0] + 1], initial=0.0) < UNLOADED_FROM:
        return None
    last = int(below[0])
    first = int(np.flatnonzero(share[: last + 1] >= UNLOADED_FROM)[-1])
    if last - first < 3:
        return None
    return _line(cycles, up, (float(curve.at[first]), float(curve.at[last])))[1]


def _loading(cycles: Cycles, up: bool) -> tuple[PerCycle, PerCycle]:
    """Return force in N at mid-stroke and slope in N/m of the line of loading over the last part of the stroke."""
    far = (cycles.high if up else cycles.low) - (1.0 if up else -1.0) * 0.02 * cycles.stroke
    near = far - (1.0 if up else -1.0) * LOADING_PART * cycles.stroke
    places = cycles.places_of(up, near), cycles.places_of(up, far)
    return _line(cycles, up, (min(places), max(places)))


def _line(cycles: Cycles, up: bool, window: tuple[float, float]) -> tuple[PerCycle, PerCycle]:
    """Return value at mid-stroke and slope of straight lines of force over displacement, cycle by cycle."""
    whole = cycles.branches(up)
    inside = whole.there & (whole.at >= window[0]) & (whole.at <= window[1])
    off = np.where(whole.there, np.abs(whole.at - (window[0] + window[1]) / 2.0), np.inf)
    nearest = off <= np.sort(off, axis=1)[:, :3][:, -1:]
    near = whole.within(np.where(np.sum(inside, axis=1, keepdims=True) < 3, nearest, inside))
    level, slope = cycles.fit(near, powers_of(cycles.moved(up, near.at), 1))
    return level, slope


def by_peaks(displacement: Array, force: Array, turns: Sequence[int]) -> list[Quantity]:
    """Return stiffnesses and yield by the initial loading and by the peaks of cycles of growing amplitude.

    Parameters
    ----------
    displacement, force
        The record from rest on, (N,).
    turns
        Samples of its reversals.
    """
    ends = [k for k in turns if abs(displacement[k] - displacement[0]) > 0.0]
    moved, peaks = np.abs(displacement[ends] - displacement[0]), np.abs(force[ends] - force[0])
    if len(ends) < FEWEST_PEAKS or np.ptp(moved) < 0.2 * moved.max():
        return without(PEAKS, f"needs {FEWEST_PEAKS} reversals of growing amplitude from rest on")
    x, f = displacement[: ends[0] + 1] - displacement[0], force[: ends[0] + 1] - force[0]
    beyond = np.flatnonzero(np.abs(f) > 0.5 * peaks[0])
    stop = int(beyond[0]) if len(beyond) else len(x)
    if stop < 4 or np.ptp(x[:stop]) == 0.0:
        return without(PEAKS, "too few samples of the initial loading")
    grown = moved >= 0.5 * moved.max()
    if int(grown.sum()) < FEWEST_PEAKS:
        grown = np.argsort(moved)[-FEWEST_PEAKS:]
    first, through = line_of(f[:stop], x[:stop]), line_of(peaks[grown], moved[grown])
    assert first and through
    k_0, k_p = first.slope.value, through.slope.value
    q = float(np.mean(peaks[grown]) - k_p * np.mean(moved[grown]))
    if not k_0 > max(k_p, 0.0) or q <= 0.0:
        return without(PEAKS, "the peaks do not lie on a line flatter than the initial loading")
    d_y = q / (k_0 - k_p)
    # no interval of yield is known from one loading
    unknown = ((value, -np.inf, np.inf) for value in (k_0 * d_y, d_y))
    slopes = ((one.slope.value, one.slope.low, one.slope.high) for one in (first, through))
    return [Quantity(n, known(*v)) for n, v in zip(PEAKS, (*slopes, *unknown), strict=True)]
