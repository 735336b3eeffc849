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
from mrfit.signal.savitzky_golay import WINDOW_MIN, Smoother

RESPONSE_PARTS = ("dead time", "t63", "t90", "overshoot")
RESPONSES = tuple(f"{part} {way}" for way in ("up", "down") for part in RESPONSE_PARTS)
CURRENT_STEP = 0.1
"""Share of the current's range from which a change within a few samples is a step."""
SPEED_TOLERANCE = 0.05
"""Share by which the speed may differ while the force answers; the rest ends where it differs more."""
REST_SAMPLES, REVERSAL_SAMPLES = 12, 2
"""Samples of a rest at least, and samples beside a reversal that do not count."""
OVERSHOOT_NOISE = 3.0
"""Noise over the step above which a maximum beyond the new level is an overshoot."""
LEVEL_PART = 0.3
"""Part of a rest, at its end, that gives the new level."""


def quantities(current: Array, force: Array, velocity: Array, dt: float) -> list[Quantity]:
    """Return the response to the steps of a current (N,) in A of a force (N,) in N at a velocity (N,) in m/s."""
    if not np.ptp(current) > 8.0 * noise_level(current):
        return without(RESPONSES, "no step of the current")
    places = _steps(current)
    if not len(places):
        return without(RESPONSES, "no step of the current that holds before and after")
    answers: dict[str, list[list[float]]] = {"up": [], "down": []}
    moving = False
    for first, at, end in places:
        begin, stop = _range_of_speed(velocity, first, at, end)
        if min(at - begin, stop - at) < REST_SAMPLES:
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
        names = tuple(f"{part} {way}" for part in RESPONSE_PARTS)
        columns = np.array(rows).T
        found += [Quantity(n, of_values(c)) for n, c in zip(names, columns, strict=False)] or without(names, reason)
    return found


def _steps(current: Array) -> list[tuple[int, int, int]]:
    """Return (first sample before, first sample after, end) of the steps that hold before and after."""
    size = CURRENT_STEP * float(np.ptp(current))
    jumps = np.flatnonzero(np.abs(current[2:] - current[:-2]) > size) + 1
    if not len(jumps):
        return []
    groups = np.split(jumps, np.flatnonzero(np.diff(jumps) > 2) + 1)
    ends = [0, *(int(g[-1]) + 1 for g in groups), len(current)]
    found = []
    for k, group in enumerate(groups):
        begin, stop = ends[k], int(groups[k + 1][0]) if k + 1 < len(groups) else len(current)
        before, after = current[begin : group[0]], current[group[-1] + 1 : stop]
        if min(len(before), len(after)) < REST_SAMPLES:
            continue
        half = (np.median(before) + np.median(after)) / 2.0
        crossed = np.flatnonzero((current[group[0] - 1 : group[-1] + 2] > half) == (np.median(after) > half))
        found.append((begin, int(group[0]) - 1 + int(crossed[0]), stop))
    return found


def _range_of_speed(velocity: Array, first: int, at: int, end: int) -> tuple[int, int]:
    """Return the samples about a step, within its rests, over which the speed holds."""
    speed = float(np.median(velocity[max(first, at - REST_SAMPLES // 2) : at + REST_SAMPLES // 2]))
    off = np.abs(velocity[first:end] - speed) > SPEED_TOLERANCE * abs(speed)
    before, after = np.flatnonzero(off[: at - first]), np.flatnonzero(off[at - first :])
    # the samples beside a reversal have a force of either direction
    begin = first + int(before[-1]) + 1 + REVERSAL_SAMPLES if len(before) else first
    return begin, at + int(after[0]) - REVERSAL_SAMPLES if len(after) else end


def _answer(force: Array, at: int, dt: float) -> list[float] | None:
    """Return dead time, t63, t90 in s and overshoot of a force whose current steps at a sample; None without any."""
    after = force[at:]
    old, new = force[max(at - 4 * REST_SAMPLES, 0) : at], after[-max(int(LEVEL_PART * len(after)), 3) :]
    if len(old) < 3 or len(after) < max(REST_SAMPLES, WINDOW_MIN):
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
    return [dead, t63, t90, beyond if beyond > OVERSHOOT_NOISE * noise / abs(way) else 0.0]


def _reached(share: Sequence[float] | Array, part: float) -> float | None:
    """Return the sample, not rounded, from which on a share first stays above a part."""
    above = np.flatnonzero(np.asarray(share) >= part)
    if not len(above):
        return None
    k = int(above[0])
    return 0.0 if k == 0 else k - 1 + float((part - share[k - 1]) / (share[k] - share[k - 1]))
