"""Response of a damper's force to steps of the current, at a speed that is held.

    dead time  of a first-order answer through the times to 28.3 % and 63.2 % of the step: t63 - 1.5*(t63 - t28)
    t63, t90   from the step of the current to 63.2 % and to 90 % of the force's step, for the last time below
    overshoot  beyond the new level, over the step

The force before a step and at the end of the rest after it give the step; while it answers, the speed has to hold.

Source: two-point method for first-order processes with dead time, Sundaresan and Krishnaswamy, Can. J. Chem. Eng. 56
(1978) 257.
"""

from collections.abc import Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.measure.intervals import of_values
from mrfit.measure.quantity import Quantity, without
from mrfit.signal.noise import noise_level
from mrfit.signal.savitzky_golay import NARROWEST, Smoother

PARTS = ("dead time", "t63", "t90", "overshoot")
NAMES = tuple(f"{part} {way}" for way in ("up", "down") for part in PARTS)
STEP = 0.1
"""Share of the current's range from which a change within a few samples is a step."""
HELD = 0.05
"""Share by which the speed may differ while the force answers."""
FEWEST = 12
"""Samples of a rest."""
REST = 0.3
"""Part of a rest, at its end, that gives the new level."""


def quantities(current: Array, force: Array, velocity: Array, dt: float) -> list[Quantity]:
    """Return the response to the steps of a current (N,) in A of a force (N,) in N at a velocity (N,) in m/s."""
    if not np.ptp(current) > 8.0 * noise_level(current):
        return without(NAMES, "no step of the current")
    places = _steps(current)
    if not len(places):
        return without(NAMES, "no step of the current that holds before and after")
    answers: dict[str, list[list[float]]] = {"up": [], "down": []}
    moving = False
    for begin, at, stop in places:
        if not _holds(velocity[max(begin, at - FEWEST) : stop]):
            moving = True
            continue
        answer = _answer(force[begin:stop] * np.sign(np.median(velocity[begin:stop])), at - begin, dt)
        if answer is not None:
            answers["up" if abs(current[stop - 1]) > abs(current[begin]) else "down"].append(answer)
    reason = (
        "the speed does not hold while the force answers; move at a constant speed"
        if moving
        else ("no step to which the force answers and comes to rest")
    )
    found = []
    for way, rows in answers.items():
        names = tuple(f"{part} {way}" for part in PARTS)
        columns = np.array(rows).T
        found += [Quantity(n, of_values(c)) for n, c in zip(names, columns, strict=False)] or without(names, reason)
    return found


def _steps(current: Array) -> list[tuple[int, int, int]]:
    """Return (first sample before, first sample after, end) of the steps that hold before and after."""
    size = STEP * float(np.ptp(current))
    jumps = np.flatnonzero(np.abs(current[2:] - current[:-2]) > size) + 1
    if not len(jumps):
        return []
    groups = np.split(jumps, np.flatnonzero(np.diff(jumps) > 2) + 1)
    ends = [0, *(int(g[-1]) + 1 for g in groups), len(current)]
    found = []
    for k, group in enumerate(groups):
        begin, stop = ends[k], int(groups[k + 1][0]) if k + 1 < len(groups) else len(current)
        before, after = current[begin : group[0]], current[group[-1] + 1 : stop]
        if min(len(before), len(after)) < FEWEST:
            continue
        half = (np.median(before) + np.median(after)) / 2.0
        crossed = np.flatnonzero((current[group[0] - 1 : group[-1] + 2] > half) == (np.median(after) > half))
        found.append((begin, int(group[0]) - 1 + int(crossed[0]), stop))
    return found


def _holds(speeds: Array) -> bool:
    middle = float(np.median(speeds))
    return middle != 0.0 and float(np.max(np.abs(speeds - middle))) <= HELD * abs(middle)


def _answer(force: Array, at: int, dt: float) -> list[float] | None:
    """Return dead time, t63, t90 in s and overshoot of a force whose current steps at a sample; None without any."""
    after = force[at:]
    old, new = force[max(at - 4 * FEWEST, 0) : at], after[-max(int(REST * len(after)), 3) :]
    if len(old) < 3 or len(after) < max(FEWEST, NARROWEST):
        return None
    level, noise = float(np.mean(old)), noise_level(force)
    way = float(np.mean(new)) - level
    if abs(way) < 8.0 * noise or abs(float(np.mean(new[: len(new) // 2]) - np.mean(new[len(new) // 2 :]))) > 0.05 * abs(
        way
    ):
        return None
    share = (Smoother(after).smoothed(0).values - level) / way
    times = [_reached(share, part) for part in (0.283, 0.632, 0.9)]
    if any(t is None for t in times):
        return None
    t28, t63, t90 = (float(t) * dt for t in times if t is not None)
    dead = max(t63 - 1.5 * (t63 - t28), 0.0)
    beyond = float(np.max(share)) - 1.0
    return [dead, t63, t90, max(beyond - 2.0 * noise / abs(way), 0.0)]


def _reached(share: Sequence[float] | Array, part: float) -> float | None:
    """Return the sample, not rounded, from which on a share first stays above a part."""
    above = np.flatnonzero(np.asarray(share) >= part)
    if not len(above):
        return None
    k = int(above[0])
    return 0.0 if k == 0 else k - 1 + float((part - share[k - 1]) / (share[k] - share[k - 1]))
