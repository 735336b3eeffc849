"""Faults of sensors, converters and loggers that show in the shape of channels.

A rail under noise, a stuck channel, wrap-round, a slower channel held between its values, rows without a record.
"""

from collections.abc import Iterator

import numpy as np

from mrfit.core.channels import ELECTRICAL
from mrfit.core.recording import Finding, Recording
from mrfit.core.specs import Array
from mrfit.ingest.meaning.sanity import Flanks, away_from_the_ends, rectangular
from mrfit.signal.runs import longest_run, runs
from mrfit.signal.stuck import FEWEST_JUDGED, STUCK_KIND, stuck_rows

FEW_OUTSIDE = (0.1, 99.9)
"""Percentiles that stand for the ends of a channel."""
RAIL_WIDTHS = (0.01, 0.03)
"""Width of the rail with its noise, in the range of the channel."""
CROWDED, RAIL_SHARE = 6.0, 0.02
"""So much more often than beside it, and so much of the time, a channel stands at its rail."""
RAIL_CORNER, HOP = 0.2, 0.2
"""A rail is met at this share of the usual speed or more, and not by a hop over this share of the range."""
WRAP, SAME_WRAP, USUAL_STEP = 0.5, 0.1, 0.2
"""Least step of a wrap-round in the range of the channel, how much such steps may differ, and most of usual steps."""
FEWEST_VALUES, LONGEST_HOLD, IN_STEP = 50, 50, 0.99
"""Values of a channel by which it is seen to be held, most rows of each, and share of them that begin in step."""
FEWEST_STANDING, STANDING_SHARE = 8, 0.005
"""Rows, and share of the rows, for which all channels stand still at an end."""


def fault_findings(record: Recording) -> list[Finding]:
    """Return faults of sensors, converters and loggers; ``record`` is in memory."""
    return [*(finding for name in record.channels for finding in _faults(record, name)), *_standing(record)]


def _standing(record: Recording) -> Iterator[Finding]:
    """Yield findings on an end of the record over which all channels stand exactly still, as they do nowhere else."""
    moving = [np.diff(values) != 0.0 for values in record.channels.values() if np.ptp(values)]
    if len(moving) < 2:
        return
    places = np.flatnonzero(np.logical_or.reduce(moving))
    if not len(places) or np.max(np.diff(places), initial=1) > 2:
        return
    fewest = max(FEWEST_STANDING, STANDING_SHARE * record.samples)
    for rows, at, end in ((places[0], 0, "first"), (record.samples - 2 - places[-1], places[-1] + 1, "last")):
        if rows >= fewest:
            text = f"every channel stands exactly still over the {end} {rows + 1} rows: nothing was recorded there"
            yield Finding("standing", "", float(at) * record.dt, f"{text}, unless the machine was at rest")


def _held(values: Array) -> int:
    """Return the rows for which each value of a channel is held; 1 where it is not held in step."""
    changes = np.flatnonzero(np.diff(values)) + 1
    if len(changes) < FEWEST_VALUES:
        return 1
    rows = int(np.median(np.diff(changes)))
    if not 1 < rows <= LONGEST_HOLD or 2 * rows * len(changes) < len(values):
        return 1
    return rows if np.bincount(changes % rows).max() >= IN_STEP * len(changes) else 1


def _faults(record: Recording, name: str) -> Iterator[Finding]:
    values = record.channels[name]
    if len(values) < FEWEST_JUDGED or not (spread := float(np.ptp(values))) or not np.isfinite(spread):
        return
    low, high = np.percentile(values, FEW_OUTSIDE)  # one garbled number must not hide that a channel is a square wave
    spread = float(high - low) or spread
    part = np.clip((values - low) / spread, 0.0, 1.0)
    if wrapped := _wraps(part, record.dt):
        yield Finding("wrap-round", name, wrapped[1], f"{name} {wrapped[0]}")
        return
    flanks = Flanks.of(part, (0.0, 1.0))
    ramps = not flanks.curved if rectangular(part, (0.0, 1.0)) else flanks.straight
    for end, word, height in ((high, "highest", part), (low, "lowest", 1.0 - part)):
        if not ramps and (first := _at_rail(height)) is not None:
            text = f"{name} stays within the noise of its {word} values, about {end:.4g}, again and again: saturated"
            yield Finding("saturated", name, first * record.dt, f"{text}, unless it is held there")
    if name not in ELECTRICAL and (rows := _held(values)) > 1:
        text = f"{name} has a new value in one of {rows} rows only and is held between them, so that it comes late"
        yield Finding("held", name, None, f"{text}; log it at its own rate")
        return
    yield from _stuck(record, name)


def _at_rail(height: Array) -> int | None:
    """Return the sample at which a channel meets its rail first; ``height`` is 1 there; None if it has none."""
    speed = np.abs(height[3:] - height[:-3]) / 3.0
    usual = float(np.percentile(speed, 95.0))
    if not usual:
        return None
    for width in RAIL_WIDTHS:
        inside = away_from_the_ends(height > 1.0 - width)
        beside = max(np.count_nonzero(np.abs(height - 1.0 + (k + 0.5) * width) < 0.5 * width) for k in (1, 2, 3))
        if np.count_nonzero(inside) < max(CROWDED * beside, RAIL_SHARE * len(height)) or longest_run(inside) < 5:
            continue
        first, stop = runs(inside).T
        entries = first[(stop - first >= 5) & (first >= 4)]
        if not len(entries) or np.mean(height[inside] == 1.0) > 0.5:
            continue  # one exact level is said to be clipped
        corner = np.median(speed[entries - 4]) / usual
        if corner >= RAIL_CORNER and np.median(height[entries] - height[entries - 1]) <= HOP:
            return int(entries[0])
    return None


def _stuck(record: Recording, name: str) -> Iterator[Finding]:
    found, code = stuck_rows(record.channels, name)
    if found:
        rows = found[0]
        level, within = float(np.median(record.channels[name][rows])), f"within {code:.2g} of" if code else "at exactly"
        text = f"{name} stands {within} {level:.6g} for {rows.stop - rows.start} samples while the test goes on: stuck"
        more = f", and {len(found) - 1} times more" if len(found) > 1 else ""
        yield Finding(STUCK_KIND, name, rows.start * record.dt, text + more)


def _wraps(part: Array, dt: float) -> tuple[str, float] | None:
    """Return the statement on a channel that wraps round, and the time of the first wrap; ``part`` is between 0 and 1.

    It goes on after the step as it went before, opposite to the step, and steps both ways, which a sawtooth does not.
    """
    steps = np.diff(part)
    at = np.flatnonzero(np.abs(steps) > WRAP)
    at = at[(at >= 3) & (at < len(part) - 5)]
    if len(at) < 2 or len(at) > 0.05 * len(part) or rectangular(part, (0.0, 1.0)):
        return None
    if np.percentile(np.abs(steps), 90.0) > USUAL_STEP:  # noise on a level hops so, too
        return None
    sizes = np.abs(steps[at])
    both = {1.0, -1.0} <= set(np.sign(steps[at]))
    before, after = np.sign(part[at] - part[at - 3]), np.sign(part[at + 4] - part[at + 1])
    goes_on = (before == after) & (before == -np.sign(steps[at]))
    if not both or np.mean(goes_on) < 0.9 or float(np.ptp(sizes)) > SAME_WRAP:
        return None
    text = (
        f"hops {len(at)} times from one end of its range to the other and goes on from there: its converter wraps round"
    )
    return text, float(at[0] + 1) * dt
