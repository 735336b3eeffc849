"""Rows at which a sensor or a logger is stuck: a channel stands at one number while the test goes on."""

from collections.abc import Iterator, Mapping

import numpy as np

from mrfit.core.channels import ELECTRICAL, WARMTH
from mrfit.core.specs import Array
from mrfit.signal.runs import runs

STUCK_KIND = "stuck"
"""Kind of the finding on a stuck channel."""
FEWEST_JUDGED = 100
"""A shorter channel is not judged."""
STUCK, LONGER = 20, 5.0
"""Steps of a run of one number, and how many times longer than other runs it is."""
NEVER_BY_CHANCE, ALIKE = 8, 0.008
"""Steps of such a run where hardly two neighbours are alike, and share of all steps at which a few may be."""
TURNING = 0.3
"""Least share of bends in noise that follow another."""
MOST_CODES = 2.0**32
"""Codes over which no converter steps."""
WHOLE_CODE = 0.01
"""Largest departure of a value from whole codes, in codes."""
MOVING = 0.7
"""Least share of steps that are not zero elsewhere in a channel that is stuck."""
OTHERS_MOVE = 0.3
"""Least part of its range through which another channel moves meanwhile."""
OF_A_LEVEL, RETURNS = 0.01, 0.05
"""Part of its range within which a current is at a level, and least share of the other samples at one that is held."""


def stuck_rows(channels: Mapping[str, Array], name: str) -> tuple[list[slice], float]:
    """Return the rows at which one of the channels (N,) of a record is stuck, and within how much it stands there."""
    for still, code in _still(channels[name]):
        if found := _held_rows(channels, name, still, code):
            return found, code
    return [], 0.0


def _still(values: Array) -> Iterator[tuple[np.ndarray, float]]:
    """Yield the samples at which a channel stands still: exactly, then within one code of its converter, and that."""
    steps = np.abs(np.diff(values))
    yield steps == 0.0, 0.0
    code = float(steps[steps > 0.0].min())
    if float(steps.max()) > MOST_CODES * code:
        return
    codes = (values - values.min()) / code
    if codes.max() < FEWEST_JUDGED or np.max(np.abs(codes - np.round(codes))) > WHOLE_CODE:
        return
    for shift in range(3):
        yield np.diff((np.round(codes) + shift) // 3) == 0.0, code


def _held_rows(channels: Mapping[str, Array], name: str, still: np.ndarray, code: float) -> list[slice]:
    """Return the rows over which a channel stands far longer than elsewhere; ``code`` is by how much it moves."""
    values = channels[name]
    first, stop = runs(still).T
    lengths = stop - first
    bends = np.diff(values, 2)
    noisy = not code and float(np.mean(bends[1:] * bends[:-1] < 0.0)) > TURNING
    short = lengths[lengths < NEVER_BY_CHANCE]
    certain = noisy and (_usual(short) <= 1.0 or int(short.sum()) <= ALIKE * len(still))
    fewest = NEVER_BY_CHANCE if certain else STUCK
    long = np.flatnonzero(lengths >= fewest)
    elsewhere = len(still) - int(lengths[long].sum())
    if not len(long) or elsewhere < STUCK or len(still) - int(lengths.sum()) < MOVING * elsewhere:
        return []
    step = float(np.percentile(np.abs(np.diff(values))[~still], 99.5))
    found = []
    if not certain:
        long = long[lengths[long] >= LONGER * _usual(lengths[lengths < STUCK])]
    for k in long:
        begin, end = int(first[k]), int(stop[k]) + 1
        level = float(np.median(values[begin:end]))
        off = name in ELECTRICAL and (begin == 0 or abs(level) <= code)
        at_end = min(level - float(values.min()), float(values.max()) - level) <= 2.0 * code
        jumps = end < len(values) and abs(float(values[end] - level)) > 3.0 * step
        if off or (at_end and not jumps):  # a rail is left as smoothly as it is met
            continue
        if name in ELECTRICAL and _returns_to(values, level, slice(begin, end)):
            continue
        # before a machine starts, and after it was switched off, a channel stands still by right
        goes_on = begin > 0 and (jumps or (certain and end < len(values)))
        if goes_on or _another_moves(channels, name, slice(begin, end)):
            found.append(slice(begin, end))
    return found


def _usual(lengths: np.ndarray) -> float:
    """Return the usual length of runs, of which nine of ten are no longer; 1 where there are none."""
    return float(np.percentile(lengths, 90.0)) if len(lengths) else 1.0


def _returns_to(values: Array, level: float, rows: slice) -> bool:
    """Return whether a channel (N,) is often at a level outside some rows, where a controller holds it."""
    near = np.abs(values - level) <= OF_A_LEVEL * np.ptp(values)
    outside = len(values) - (rows.stop - rows.start)
    return bool(near.sum() - near[rows].sum() > RETURNS * outside)


def _another_moves(channels: Mapping[str, Array], name: str, rows: slice) -> bool:
    """Return whether another channel moves meanwhile; before a machine starts, a current and a temperature may."""
    at_rest = (*ELECTRICAL, WARMTH) if rows.start == 0 else ()
    others = [v for n, v in channels.items() if n != name and n not in at_rest and np.ptp(v)]
    return any(np.ptp(v[rows]) > OTHERS_MOVE * np.ptp(v) for v in others)
