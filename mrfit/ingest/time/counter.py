"""A column that counts the samples, as the clock of a log whose rate is stated."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.ingest import series
from mrfit.ingest.table import Column, Table
from mrfit.ingest.time.timebase import TimeFault

COUNTER_NAMES = re.compile(
    r"(?:sample|scan|point|row|record|data ?point|reading|line)s?(?: ?(?:number|no\.?|nr\.?|num|index|idx|id|#))?"
    r"|index|idx|no\.?|nr\.?|n|k|#|num|number|count|counter|nummer|messpunkt|messwert ?nr\.?|abtastwert|lfd\.? ?nr\.?"
    r"|index level \d+",
    re.IGNORECASE,
)
COUNTED = re.compile(r"sa|smpl|samples?(?: ?(?:no|number)\.?)?|pts?|points?|scans?|#", re.IGNORECASE)
"""Units of a clock that counts samples."""
UNNAMED = re.compile(r"(?:unnamed: ?\d+)?", re.IGNORECASE)
"""Names of columns without one; pandas makes up one."""
RISING_SHARE = 0.95
"""Share of the steps of a numbering that rise."""
WRAPS = (2.0**8, 2.0**16, 2.0**32)


def counter_of(columns: Sequence[Column]) -> tuple[series.Values, float] | None:
    """Return the count of every row from the first one, and its usual step; None if nothing counts or none is left out.

    Raises
    ------
    TimeFault
        If a column counts, but repeats or turns back too often to be a clock.
    """
    for column in columns:
        if is_counter(column) and (found := _counted(column)):
            return found
    return None


def counting_samples(table: Table) -> Table:
    """Return a table without a clock where its clock counts samples: its count is a column.

    The unit says so; or it has none, and goes up by one from row to row, where the log states another interval.
    """
    if table.time is None:
        return table
    by_one = not table.time.unit and table.dt not in (None, 1.0) and _goes_up_by_one(table.time.values)
    if not by_one and not COUNTED.fullmatch(table.time.unit or ""):
        return table
    count = replace(table.time, name="sample", unit=None)
    return replace(table, columns=tuple(sorted((*table.columns, count), key=lambda c: c.index)), time=None)


def _goes_up_by_one(values: series.Values) -> bool:
    return all(bool(np.all(step == 1.0)) for _, step in series.steps(values))


def is_counter(column: Column) -> bool:
    """Whether a column is named as a count of samples, or numbers the rows without a name."""
    name = re.sub(r"[\s_]+", " ", column.name.rpartition(".")[2]).strip() or column.name.strip()
    called = (COUNTER_NAMES.fullmatch(name) or not name and column.index == 0) and column.unit in (None, "", "-", "1")
    return bool(called) or numbers_rows(column)


def numbers_rows(column: Column) -> bool:
    """Whether a column without a name numbers the rows: whole numbers that rise, mostly by one, from anywhere."""
    if not UNNAMED.fullmatch(column.name.strip()) or column.unit is not None or len(column.values) < 3:
        return False
    steps = [step[np.isfinite(step)] for _, step in series.steps(column.values)]
    rows = sum(map(len, steps))
    rising, by_one = (sum(int(np.count_nonzero(test(s))) for s in steps) for test in (_rises, lambda s: s == 1.0))
    return 2 * by_one > rows and rising >= RISING_SHARE * rows and not series.count(_is_broken, column.values)


def _is_broken(values: series.Values) -> series.Values:
    return np.asarray(np.isfinite(values) & (values != np.round(values)))


def _counted(column: Column) -> tuple[series.Values, float] | None:
    values = column.values
    if len(values) < 3 or series.count(_is_broken, values):
        return None
    every = [step[np.isfinite(step)] for _, step in series.steps(values)]
    rows = sum(map(len, every))
    up, still = (sum(int(np.count_nonzero(test(s))) for s in every) for test in (_rises, _stays))
    usual = (
        float(np.median(np.concatenate([s[_rises(s)][: series.SERIES_CHUNK // len(every)] for s in every])))
        if up
        else 0.0
    )
    regular = sum(int(np.count_nonzero(s == usual)) for s in every)
    if 2 * up < rows and (4 * up < rows or 2 * regular < up):
        return None  # it counts something else, such as cycles
    if regular == rows == len(values) - 1 and usual == 1.0:
        return None
    if still > max(3, 0.02 * rows) or 2 * regular < rows:
        at = series.places(lambda v, w: ~(w - v == usual), values[:-1], values[1:])
        raise TimeFault(f"'{column.name}' counts the samples, but not evenly", int(at[0]) + 1)
    return series.mapped(lambda v: v - float(values[0]), _unwrapped(values, usual)), usual


def _rises(step: series.Values) -> series.Values:
    return np.asarray(step > 0.0)


def _stays(step: series.Values) -> series.Values:
    return np.asarray(step == 0.0)


def _unwrapped(values: series.Values, usual: float) -> series.Values:
    """Return the counts without the fall to zero of a counter of 8, 16 or 32 bits."""
    if not series.in_memory(values):
        return values
    steps = np.diff(values)
    falls = steps < 0.0
    for period in WRAPS:
        ahead = steps[falls] + period
        if falls.any() and np.nanmax(values) < period and np.all((ahead > 0.0) & (ahead <= max(0.05 * period, usual))):
            return np.asarray(values + period * np.concatenate([[0.0], np.cumsum(falls)]))
    return values
