"""A clock whose parts stand in columns of their own: hours, minutes and seconds, or seconds and what is below them."""

import re
from collections.abc import Collection, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.ingest.meaning import units
from mrfit.ingest.table import Column, Table

CLOCK_PARTS = (
    (3600.0, 24.0, r"(?:h|hh|hrs?|hours?|stunden?)"),
    (60.0, 60.0, r"(?:m|mi|mins?|minutes?|minuten?)"),
    (1e-3, 1e3, r"(?:time )?(?:ms|msecs?|mseconds?|millis?|millisec(?:ond)?s?|millisekunden)"),
    (1e-6, 1e6, r"(?:time )?(?:us|µs|usecs?|micros?|microsec(?:ond)?s?|mikrosekunden)"),
    (1e-9, 1e9, r"(?:time )?(?:ns|nsecs?|nanos?|nanosec(?:ond)?s?)"),
)
"""Seconds of a part, how many of it there are at most, and what columns of it are called."""
RISING_SHARE = 0.95
"""Share of the steps of a clock that rise."""


def with_clock_parts(table: Table, carry: dict[str, Any]) -> Table:
    """Return a table whose clock has the parts that stand in columns of their own; ``carry`` keeps which do.

    Parts are taken where seconds alone stand still or turn back, and rise with the parts.
    """
    if table.time is None or not len(table.lines):
        return table
    if "clock parts" not in carry:
        carry["clock parts"] = _parts(table)
    found = carry["clock parts"]
    if not found:
        return table
    times = np.array(table.time.values, dtype=np.float64)
    parts = [c for c in table.columns if c.index in found]
    for part in parts:
        times += found[part.index] * part.values
    names = " and ".join(f"'{c.name}'" for c in parts)
    return replace(
        table,
        time=replace(table.time, values=times, unit="s", digits=None),
        columns=tuple(c for c in table.columns if c.index not in found),
        history=(*table.history, f"times of '{table.time.name}' and {names} added up"),
    )


def _parts(table: Table) -> dict[int, float]:
    """Return the seconds of each part of the clock by the place of its column; nothing where the clock is whole."""
    assert table.time is not None
    times = np.asarray(table.time.values, dtype=np.float64)
    unit = table.time.unit or "s"
    in_seconds = units.known(unit) and units.compatible(unit, "s") and units.to_unit(unit, "s").scale == 1.0
    if not in_seconds or not np.isfinite(times).any():
        return {}
    found = {c.index: (scale, c) for c in table.columns for scale, most, name in CLOCK_PARTS if _is_part(c, name, most)}
    below = {k: p for k, p in found.items() if p[0] < 1.0} if _is_whole(times) else {}
    above = {k: p for k, p in found.items() if p[0] > 1.0} if np.nanmax(times) < CLOCK_PARTS[1][1] else {}
    # minutes alone may be anything, unless they go on where the seconds begin again; beside hours they are of the
    # clock, though a block may lie within one
    whole_clock = len({scale for scale, _ in above.values()}) == len(CLOCK_PARTS[:2])
    chosen = {**below, **above}
    if not whole_clock and not all(_turns(times, c.values) for _, c in above.values()):
        chosen = below
    whole = _added(times, chosen)
    better = (whole_clock or _rising(whole) > _rising(times)) and _rising(whole) >= RISING_SHARE
    return {k: scale for k, (scale, _) in chosen.items()} if better else {}


def _added(times: Array, parts: Mapping[int, tuple[float, Column]]) -> Array:
    return times + sum((scale * c.values for scale, c in parts.values()), np.zeros(1))


def _turns(seconds: Array, part: Array) -> bool:
    """Return whether a part changes, and only where the seconds begin again."""
    changes = np.diff(part) != 0.0
    return bool(changes.any()) and bool(np.all(np.diff(seconds)[changes] < 0.0))


def is_below_seconds(name: str) -> bool:
    """Whether a column is called as the milliseconds, or less, of a clock."""
    return any(re.fullmatch(pattern, _plain(name)) for scale, _, pattern in CLOCK_PARTS if scale < 1.0)


def are_seconds_beside(name: str, others: Collection[str]) -> bool:
    """Whether a column called ``s`` is the seconds of a clock, since another is called as its hours or minutes."""
    words = [pattern for scale, _, pattern in CLOCK_PARTS if scale > 1.0]
    if "max" in map(_plain, others):
        return False  # beside which ``min`` is the least value
    return _plain(name) == "s" and any(re.fullmatch(word, _plain(other)) for word in words for other in others)


def _plain(name: str) -> str:
    return re.sub(r"[ _-]+", " ", (name.rpartition(".")[2] or name).strip().lower())


def _is_part(column: Column, name: str, most: float) -> bool:
    if column.unit is not None and not (units.known(column.unit) and units.compatible(column.unit, "s")):
        return False
    values = np.asarray(column.values, dtype=np.float64)
    return (
        bool(re.fullmatch(name, _plain(column.name)))
        and _is_whole(values)
        and bool(np.nanmin(values) >= 0.0 and np.nanmax(values) < most)
    )


def _is_whole(values: Array) -> bool:
    some = values[np.isfinite(values)]
    return bool(len(some)) and bool(np.all(some == np.round(some)))


def _rising(times: Array) -> float:
    """Return the share of the steps of times that rise."""
    steps = np.diff(times[np.isfinite(times)])
    return np.count_nonzero(steps > 0.0) / max(len(steps), 1)
