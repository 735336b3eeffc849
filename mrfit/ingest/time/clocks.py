"""Several time columns in one table: channels brought on one clock where each has its own."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import FILE_NAME, Rules
from mrfit.ingest.meaning.chosen import clocks_meant, ignored_places, mapped_places
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, RejectedRow, Table
from mrfit.ingest.text.layout import TIME_NAMES, aliases_of, words_of
from mrfit.ingest.text.side_by_side import COPY_MARK
from mrfit.ingest.time.counter import is_counter
from mrfit.ingest.time.epoch import counts_since
from mrfit.ingest.time.timebase import FILL_AT_MOST

STAMP_NAME = "ts"
"""Name of times, or of an interval, a steady temperature or another quantity where it does not rise."""
OFF = 0.05
"""Samples by which two clocks may differ and are one."""
OTHER_UNITS = (1e3, 1e6, 1e9, 86400.0)
"""Ratios of steps that only say that one clock has no unit written."""


def on_one_clock(table: Table, rules: Rules, path: str) -> Table:
    """Return a table with one clock: of several that differ, each is that of the channels behind it.

    Channels of the slower clocks are interpolated linearly at the times of the quickest one. A map that names one clock
    means it for all channels; where several are called so, each is that of its own.

    Raises
    ------
    Refusal
        If it cannot be told which channels a clock belongs to, or the clocks have no time in common.
    """
    if table.time is None:
        return table
    left_out, mapped = ignored_places(rules, table.columns), mapped_places(rules, table.columns)
    meant = _meant(table.time, table.columns, rules)
    clocks = [c for c in table.columns if c.index not in left_out | mapped]
    clocks = [c for c in clocks if is_clock(c) or (c.index in meant and _rises(c))]
    channels = [c for c in table.columns if c not in clocks and c.index not in left_out]
    remedy = f"write time = COLUMN in a channel map ({FILE_NAME} or --map)"
    if len(meant) > 1:
        remedy = f"write time = {table.time.index} or another place from 0 in {rules.where}"
    every = sorted([table.time, *clocks], key=lambda c: c.index)
    if rules.time is not None and rules.time.unit is not None and _is_of_time(rules.time.unit):
        if len({c.unit for c in every if c.index in meant} - {None}) > 1:
            raise Refusal(path, f"the columns {rules.time.column!r} have different units, and a map gives one", remedy)
        every = [replace(c, unit=rules.time.unit) if c.index in meant else c for c in every]
    first = next(c for c in every if c.index == table.time.index)
    owned = _owned(channels, every)
    others = [c for c in every if c is not first and _differs(first, c, owned is not None)]
    if not others:
        return table
    shown = " and ".join(f"'{c.name}' (column {c.index})" for c in [first, *others])
    if len(meant) == 1:
        text = f"{shown} are times that differ: the channel map takes column {first.index} for all channels"
        return table if owned is None else table.finding("two-clocks", text)
    if owned is None:
        raise Refusal(path, f"{shown} are times that differ, and which holds cannot be told", remedy)
    if not series.in_memory(table.time.values):
        what = f"{shown} are times that differ, in a log read block by block"
        raise Refusal(path, what, f"cut it into shorter logs, or {remedy}")
    return _on_the_quickest(table, every, owned, shown, remedy, path)


def _on_the_quickest(
    table: Table, every: Sequence[Column], owned: Sequence[Sequence[Column]], shown: str, remedy: str, path: str
) -> Table:
    """Return a table whose channels, each of its own clock, are at the times of the quickest of them.

    ``shown`` and ``remedy`` name the clocks that differ and what to do in a refusal.
    """
    own = [(_seconds(clock), channels) for clock, channels in zip(every, owned, strict=True)]
    quickest = min(range(len(own)), key=lambda k: _step(own[k][0]))
    grid = own[quickest][0]
    begin, end = max(np.nanmin(t) for t, _ in own), min(np.nanmax(t) for t, _ in own)
    within = (grid >= begin) & (grid <= end)
    if np.count_nonzero(within) < 2:
        raise Refusal(path, f"{shown} are times that differ, and have no stretch in common", remedy)
    apart = [RejectedRow("no time of every clock", int(n)) for n in table.lines[~within]]
    columns = []
    for k, (times, of_clock) in enumerate(own):
        for c in of_clock:
            if k != quickest and not _rise_throughout(times, c):
                what = f"the times of '{c.name}' differ from the others, and do not rise throughout"
                raise Refusal(path, what, f"export it as a log of its own, or {remedy}")
            columns.append(replace(c, values=(c.values if k == quickest else _at(grid, times, c))[within]))
    owners = "; ".join(
        f"column {clock.index} is that of {' and '.join(repr(c.name) for c in of_clock)}"
        for clock, of_clock in zip(every, owned, strict=True)
    )
    text = f"{shown} are times that differ: {owners}; all are brought on column "
    text += f"{every[quickest].index} by linear interpolation"
    time = replace(every[quickest], values=every[quickest].values[within], digits=None)
    return replace(
        table,
        columns=tuple(sorted(columns, key=lambda c: c.index)),
        time=time,
        dt=None,
        lines=table.lines[within],
        refused=tuple(sorted((*table.refused, *apart), key=lambda r: r.line)),
        findings=(*table.findings, Finding("two-clocks", "", None, text)),
        history=(*table.history, f"interpolated linearly on the times of column {every[quickest].index}"),
    )


def _meant(time: Column, columns: Sequence[Column], rules: Rules) -> list[int]:
    """Return the places of the columns that a map calls the time; none without a map of the time."""
    names = {c.index: c.name for c in (time, *columns)}
    return clocks_meant(rules.time.column, names) if rules.time is not None else []


def _is_of_time(unit: str) -> bool:
    return units.known(unit) and units.compatible(unit, "s")


def is_clock(column: Column) -> bool:
    """Whether a column is named or measured as a time, and rises."""
    return is_called_clock(column.name, column.unit) and _rises(column)


def _rises(column: Column) -> bool:
    steps = [step[np.isfinite(step)] for _, step in series.steps(column.values)]
    rising = sum(int(np.count_nonzero(s > 0.0)) for s in steps)
    return rising > 0.9 * max(sum(map(len, steps)), 1)


def is_stamp(name: str, values: Array) -> bool:
    """Whether a column (N,) is called a stamp, and counts times since a date."""
    return name == STAMP_NAME and counts_since(values)


def is_called_clock(name: str, unit: str | None) -> bool:
    """Whether a column is named or measured as a time."""
    if unit is not None:
        return _is_of_time(unit)
    name = COPY_MARK.sub("", name.strip())
    called = name.rpartition(".")[2].strip().lower() or name.lower()
    word = re.sub(r"\d+$", "", re.split(r"[\s_.]+", called)[0])
    return bool({word, re.sub(r"[\s_.]*\d+$", "", called)} & TIME_NAMES)


def _owned(channels: Sequence[Column], clocks: Sequence[Column]) -> list[list[Column]] | None:
    """Return the channels that each clock is named after, or those behind it and before the next.

    None if a clock has none, or some channels have no clock.
    """
    if (owned := _named_after(channels, clocks)) is not None:
        return owned
    edges = [*(c.index for c in clocks), np.inf]
    before = [c for c in channels if c.index < edges[0]]
    if before and all(map(is_counter, before)):
        edges[0] = -1  # the rows are numbered before their first clock
    owned = [[c for c in channels if a < c.index < b] for a, b in zip(edges, edges[1:], strict=False)]
    return owned if all(owned) and sum(map(len, owned)) == len(channels) else None


def _named_after(channels: Sequence[Column], clocks: Sequence[Column]) -> list[list[Column]] | None:
    """Return the channels of ``time_force``, ``Time disp``; a clock with no such word has what is left.

    None if a clock has none, or a channel none or several.
    """
    words = [words_of(c.name.rpartition(".")[2])[1:] for c in clocks]
    rest = [k for k, w in enumerate(words) if not w]
    if len(rest) > 1 or len(rest) == len(clocks):
        return None
    owned: list[list[Column]] = [[] for _ in clocks]
    for channel in channels:
        name = channel.name.rpartition(".")[2]
        own = [k for k, w in enumerate(words) if w and _is_called(name, " ".join(w))] or rest
        if len(own) != 1:
            return None
        owned[own[0]].append(channel)
    return owned if all(owned) else None


def _is_called(name: str, word: str) -> bool:
    """Whether a channel has a name, or means the same quantity."""
    return " ".join(words_of(name)) == word or bool({*aliases_of(name)} & {*aliases_of(word)})


def _seconds(clock: Column) -> Array:
    scale = units.to_unit(clock.unit, "s").scale if clock.unit is not None and _is_of_time(clock.unit) else 1.0
    return np.asarray(scale * clock.values[:], dtype=np.float64)


def _step(times: Array) -> float:
    steps = np.diff(times)
    return float(np.median(steps[np.isfinite(steps) & (steps > 0.0)]))


def _differs(one: Column, two: Column, paired: bool) -> bool:
    """Whether two clocks tell different times, or, where each may have channels of its own, times apart."""
    some = slice(0, series.SERIES_CHUNK)
    first, second = (_seconds(replace(c, values=c.values[some])) for c in (one, two))
    if not np.any(np.diff(first) > 0.0):
        return False
    step, ratio = _step(first), _step(second) / _step(first)
    if any(abs(r * u - 1.0) < OFF for u in OTHER_UNITS for r in (ratio, 1.0 / ratio)):
        return False
    if abs(ratio - 1.0) > OFF:
        return True
    apart = second - first
    spread = float(np.nanmax(apart) - np.nanmin(apart))
    if paired and np.nanmax(np.abs(apart)) < step * len(first):
        return bool(np.nanmax(np.abs(apart)) > OFF * step) or not np.array_equal(np.isnan(first), np.isnan(second))
    restarts = bool(np.any(np.diff(first) < 0.0) or np.any(np.diff(second) < 0.0))
    return spread > max(step, 1e-3 * step * len(first)) and not restarts


def _rise_throughout(times: Array, column: Column) -> bool:
    kept = times[np.isfinite(times) & np.isfinite(column.values)]
    return len(kept) > 1 and bool(np.all(np.diff(kept) > 0.0))


def _at(grid: Array, times: Array, column: Column) -> Array:
    """Return a channel at other times; nan within its gaps."""
    kept = np.isfinite(times) & np.isfinite(column.values)
    times, values = times[kept], column.values[kept]
    steps = np.diff(times)
    wide = np.flatnonzero(steps > (FILL_AT_MOST + 1.5) * float(np.median(steps)))
    found = np.interp(grid, times, values)
    for k in wide:
        found[(grid > times[k]) & (grid < times[k + 1])] = np.nan
    return np.asarray(found)
