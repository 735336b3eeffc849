"""Rows of statistics above or below the samples: greatest, least, mean and total values."""

from collections.abc import Iterator
from functools import partial

import numpy as np

from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.table import RejectedRows, Table

STATISTICS_ROW = "row of statistics"
MOST_STATISTICS = 8
ROWS_BESIDE = 1000
"""Rows beside them by which a jump is told from a step."""
STATISTICS_JUMP = 3.0
"""Least step into the rows of statistics, in greatest steps of the rows beside them."""
SAME_STATISTIC = 1e-3
"""Departure of a printed statistic, in the range of its channel."""


def without_statistics(table: Table) -> Table:
    """Return a table without first or last rows that jump away and hold, in every column, one statistic of the others.

    They are refused. One column alone shows them only where there are several such rows.
    """
    for at_end in (True, False):
        with np.errstate(over="ignore", invalid="ignore"):  # a garbled number may be 1e300
            number = _rows(table, at_end)
        if not number:
            continue
        rows = np.arange(number) + (len(table.lines) - number if at_end else 0)
        lost = RejectedRows(table.refused)
        lost.add([STATISTICS_ROW] * number, [int(table.lines[k]) for k in rows])
        table = table.cut(partial(series.without, drop=rows), lost)
    return table


def _rows(table: Table, at_end: bool) -> int:
    """Return the number of rows of statistics at one end."""
    columns = [c.values for c in (*table.columns, *([table.time] if table.time else []))]
    total = len(table.lines)
    if total < 4 * MOST_STATISTICS:
        return 0
    edge = np.column_stack(
        [c[total - ROWS_BESIDE :] if at_end else c[:ROWS_BESIDE][::-1] for c in columns if len(c) == total]
    )
    if total < ROWS_BESIDE:
        edge = np.column_stack([c[:] if at_end else c[:][::-1] for c in columns])
    most = [k for k in range(MOST_STATISTICS, 0, -1) if _jumps(edge, k)]
    for number in most:
        others = slice(0, total - number) if at_end else slice(number, total)
        found = [list(_of(series.part(c, others))) for c in columns]
        kinds = [_kind(row, found) for row in edge[len(edge) - number :]]
        if all(k is not None for k in kinds) and (len(columns) > 1 or len(set(kinds)) > 1):
            return number
    return 0


def _jumps(edge: Array, number: int) -> bool:
    """Whether the last rows lie off the last one before them by more than rows there ever step."""
    before, last = edge[: len(edge) - number], edge[len(edge) - number :]
    with np.errstate(invalid="ignore"):
        steps = np.nanmax(np.abs(np.diff(before, axis=0)), axis=0, initial=0.0)
        rows = np.arange(1.0, number + 1.0)[:, np.newaxis]  # a clock is so many steps on by itself
        return bool(np.any(np.abs(last - before[-1]) > STATISTICS_JUMP * steps * rows + 1e-12))


def _of(values: series.Values) -> Iterator[tuple[float, float]]:
    """Yield statistics of a column: value, and by how much a printed one may be off."""
    total = count = square = 0.0
    low, high = np.inf, -np.inf
    for (part,) in series.chunks(values):
        sound = part[np.isfinite(part)]
        if len(sound):
            low, high = min(low, float(sound.min())), max(high, float(sound.max()))
        total, square, count = total + float(sound.sum()), square + float(sound @ sound), count + len(sound)
    mean, off = total / max(count, 1.0), SAME_STATISTIC * max(high - low, 0.0)
    variance = max(square / max(count, 1.0) - mean * mean, 0.0)
    yield from ((high, off), (low, off), (mean, off), (total, off * max(count, 1.0)), (variance**0.5, off))
    yield from (((square / max(count, 1.0)) ** 0.5, off), (high - low, off), (max(high, -low), off))
    yield count, 0.0


def _kind(row: Array, statistics: list[list[tuple[float, float]]]) -> int | None:
    """Return the index of the statistic that a row holds of all columns; None if there is none."""
    for kind in range(len(statistics[0])):
        pairs = [s[kind] for s in statistics]
        if all(abs(v - value) <= off for v, (value, off) in zip(row, pairs, strict=True)):
            return kind
    return None
