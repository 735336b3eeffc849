"""Columns longer than memory: on disk or computed from others, read by slices and gone through in chunks.

Whatever looks at a whole column does so chunk by chunk, for a column in memory as for one on disk, so that a long log
gives what a short one would.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

Values = NDArray[Any]

SERIES_CHUNK = 1 << 20
"""Rows looked at together."""


class Series:
    """A column known by its slices.

    Parameters
    ----------
    length
        Number of values N.
    read
        read(begin, end) gives values begin … end-1, shape (end - begin,).
    """

    def __init__(self, length: int, read: Callable[[int, int], Any]) -> None:
        self.length = length
        self.read = read

    def __len__(self) -> int:
        return self.length

    def __getitem__(self, key: int | slice) -> Any:
        if isinstance(key, slice):
            begin, end, step = key.indices(self.length)
            return self.read(begin, max(begin, end))[::step]
        place = key + self.length if key < 0 else key
        if not 0 <= place < self.length:
            raise IndexError(key)
        return self.read(place, place + 1)[0]


class StoredSeries(Series):
    """A column that lies in a file of bare numbers; it can be sent to another process.

    Parameters
    ----------
    path
        The file.
    length
        Number of values N.
    kind
        Their type.
    """

    def __init__(self, path: Path, length: int, kind: type = np.float64) -> None:
        size = np.dtype(kind).itemsize
        super().__init__(length, lambda a, b: np.fromfile(path, kind, b - a, offset=a * size))
        self.given = path, length, kind

    def __reduce__(self) -> tuple[type["StoredSeries"], tuple[Path, int, type]]:
        """Pickle by what it was made of."""
        return StoredSeries, self.given


class RowNumbers(Series):
    """Whole numbers 1, 2, …, N; they can be sent to another process.

    Parameters
    ----------
    length
        How many.
    """

    def __init__(self, length: int) -> None:
        super().__init__(length, lambda a, b: np.arange(a + 1, b + 1, dtype=np.int64))

    def __reduce__(self) -> tuple[type["RowNumbers"], tuple[int]]:
        """Pickle by what it was made of."""
        return RowNumbers, (self.length,)


def counted(length: int, in_memory: bool) -> Values:
    """Return 1 … N, in memory or computed where they are asked for."""
    return np.arange(1, length + 1, dtype=np.int64) if in_memory else cast(Values, RowNumbers(length))


def stored(path: Path, length: int, kind: type = np.float64) -> Values:
    """Return a column that lies in a file of bare numbers.

    It stands for an array wherever only slices, single values and the length are asked for.
    """
    return cast(Values, StoredSeries(path, length, kind))


def _column(length: int, read: Callable[[int, int], Any]) -> Values:
    return cast(Values, Series(length, read))


def ordinals(length: int) -> Values:
    """Return 0 … N-1 as floats, computed where they are asked for."""
    return _column(length, lambda a, b: np.arange(a, b, dtype=np.float64))


def in_memory(values: Values) -> bool:
    """Whether a column is an array."""
    return isinstance(values, np.ndarray)


def spans(length: int) -> Iterator[tuple[int, int]]:
    """Yield (begin, end) of the chunks of a column."""
    for begin in range(0, length, SERIES_CHUNK):
        yield begin, min(begin + SERIES_CHUNK, length)


def chunks(*columns: Values) -> Iterator[tuple[Values, ...]]:
    """Yield the columns' values chunk by chunk, side by side."""
    return (values for _, values in _numbered(*columns))


def equal(one: Values, two: Values) -> bool:
    """Return whether two columns of one length hold the same numbers, with gaps in the same places."""
    return all(np.array_equal(a, b, equal_nan=True) for a, b in chunks(one, two))


def steps(values: Values) -> Iterator[tuple[int, Values]]:
    """Yield (k, differences) chunk by chunk; the first difference is value k+1 less value k."""
    for begin, end in spans(len(values) - 1):
        yield begin, np.diff(values[begin : end + 1])


def mapped(function: Callable[..., Values], *columns: Values) -> Values:
    """Return function(values, …), value by value."""
    if all(in_memory(c) for c in columns):
        return function(*columns)
    return _column(len(columns[0]), lambda a, b: function(*(c[a:b] for c in columns)))


def part(values: Values, rows: slice) -> Values:
    """Return a stretch of a column."""
    if in_memory(values):
        return values[rows]
    begin, end, _ = rows.indices(len(values))
    return _column(end - begin, lambda a, b: values[begin + a : begin + b])


def without(values: Values, drop: Values) -> Values:
    """Return a column without the rows ``drop``, which ascend."""
    if in_memory(values):
        return np.delete(values, drop)
    before = drop - np.arange(len(drop))  # rows kept before each dropped one

    def read(a: int, b: int) -> Values:
        first, last = a + bisect_right(before, a), b + bisect_left(before, b)
        inside = drop[bisect_left(drop, first) : bisect_left(drop, last)] - first
        return np.delete(values[first:last], inside)

    return _column(len(values) - len(drop), read)


def at(values: Values, rows: Values) -> Values:
    """Return the values of some rows, which ascend."""
    parts = [values[0:0]]
    for begin, end in spans(len(values)):
        inside = rows[bisect_left(rows, begin) : bisect_left(rows, end)]
        parts += [values[begin:end][inside - begin]] if len(inside) else []
    return np.concatenate(parts)


def blanked(values: Values, rows: Values) -> Values:
    """Return a column of floats with nan in some rows, which ascend."""

    def read(a: int, b: int) -> Values:
        part = np.array(values[a:b], dtype=np.float64)
        part[rows[bisect_left(rows, a) : bisect_left(rows, b)] - a] = np.nan
        return part

    return read(0, len(values)) if in_memory(values) else _column(len(values), read)


def thinned(values: Values, step: int) -> Values:
    """Return every ``step``-th value, from the first, in memory."""
    # copies, since a view would keep its whole chunk in memory
    picked = [chunk[-begin % step :: step].copy() for begin, (chunk,) in _numbered(values)]
    return np.concatenate(picked) if picked else np.empty(0)


def _numbered(*columns: Values) -> Iterator[tuple[int, tuple[Values, ...]]]:
    """Yield the first row and the columns' values of chunk after chunk."""
    for begin, end in spans(len(columns[0])):
        yield begin, tuple(c[begin:end] for c in columns)


def places(mask: Callable[..., Values], *columns: Values) -> Values:
    """Return the rows at which ``mask(values, …)`` is true."""
    found = [begin + np.flatnonzero(mask(*values)) for begin, values in _numbered(*columns)]
    return np.concatenate(found) if found else np.empty(0, dtype=np.int64)


def count(mask: Callable[..., Values], *columns: Values) -> int:
    """Return the number of rows at which ``mask(values, …)`` is true."""
    return sum(int(np.count_nonzero(mask(*values))) for values in chunks(*columns))


def extremes(values: Values) -> tuple[float, float]:
    """Return the lowest and the highest value."""
    ends = [(float(v.min()), float(v.max())) for (v,) in chunks(values)]
    return min(e[0] for e in ends), max(e[1] for e in ends)


def mean(values: Values) -> float:
    """Return the mean."""
    return sum(float(np.sum(v)) for (v,) in chunks(values)) / len(values)


class Places(Series):
    """Whole numbers 0, 1, 2, … that leave some out.

    Parameters
    ----------
    length
        How many there are.
    rows, left_out
        Before which rows numbers are left out, ascending, and how many.
    """

    def __init__(self, length: int, rows: Values, left_out: Values) -> None:
        super().__init__(length, self._between)
        self.rows = rows
        self.shift = np.concatenate([[0.0], np.cumsum(left_out)])

    def unbroken(self, begin: int, end: int) -> bool:
        """Whether nothing is left out between two of these rows."""
        return bisect_left(self.rows, begin + 1) == bisect_left(self.rows, end)

    def _between(self, begin: int, end: int) -> Values:
        numbers: Values = np.arange(begin, end, dtype=np.float64)
        if self.unbroken(begin, end):
            numbers += self.shift[bisect_left(self.rows, begin + 1)]
        else:
            numbers += self.shift[np.searchsorted(self.rows, np.arange(begin, end), side="right")]
        return numbers


def interpolated(position: Values, values: Values, length: int) -> Values:
    """Return values at 0 … length-1, linear between those at the ascending ``position``."""
    if in_memory(values):
        return np.interp(np.arange(length, dtype=np.float64), position[:], values)
    size = SERIES_CHUNK
    marks = [float(position[k]) for k in range(0, len(position), size)]

    def read(a: int, b: int) -> Values:
        begin = max(bisect_right(marks, a) - 1, 0) * size
        end = min(bisect_left(marks, b - 1) * size + 1, len(position))
        if isinstance(position, Places) and position.unbroken(begin, end):
            shift = begin - int(position[begin])
            return values[a + shift : b + shift]
        return np.interp(np.arange(a, b, dtype=np.float64), position[begin:end], values[begin:end])

    return _column(length, read)


def rises(values: Values) -> bool:
    """Whether a series rises from value to value, but for a few jumps."""
    up = sum(int(np.count_nonzero(step > 0.0)) for _, step in steps(values))
    return up > 10 * sum(int(np.count_nonzero(step < 0.0)) for _, step in steps(values))
