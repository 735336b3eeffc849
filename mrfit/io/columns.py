"""Columns that stay on disk: of recordings too long to be held, and of what is made of these meanwhile.

A column is asked for its length and for slices, and each slice is read when it is asked for. So memory does not grow
with the recording. Whatever takes a column whole, as any function of numpy does, gets it whole, after it was said how
much memory that takes where there is too little.
"""

import itertools
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, cast, overload

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.arrow import floats
from mrfit.io.atomic import accessing
from mrfit.io.memory import check_room

# Samples of a recording above which its channels may stay on disk
LONG_SEGMENT = 1 << 21
# Samples that are read together where all of a column is gone through
COLUMN_CHUNK = 1 << 20
# Row groups kept decompressed: two of each of three channels
KEPT_GROUPS = 6
# Samples above which a slice is checked against the memory there is
LARGE = 1 << 24
_numbers = itertools.count()


@dataclass(frozen=True)
class FileColumn:
    """Samples [begin, end) of a column of a file.

    Attributes
    ----------
    path
        A table of a recording, or a file of plain float64.
    name
        The table's column; empty for a file of plain numbers.
    begin, end
        Range of rows.
    scratch
        Folder for what is made of the column and is as long.
    stamp
        Time and size of the table when it was opened: a table that was written again is another one.
    """

    path: Path
    name: str
    begin: int
    end: int
    scratch: Path
    stamp: tuple[int, int] = (0, 0)

    @property
    def shape(self) -> tuple[int]:
        """Length, as of an array."""
        return (len(self),)

    def __len__(self) -> int:
        return self.end - self.begin

    @overload
    def __getitem__(self, rows: int) -> float: ...

    @overload
    def __getitem__(self, rows: slice) -> Array: ...

    def __getitem__(self, rows: int | slice) -> "float | Array":
        if isinstance(rows, slice):
            begin, end, step = rows.indices(len(self))
            return self._read(self.begin + begin, self.begin + max(begin, end))[::step]
        return float(self[rows : rows + 1 or None][0])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        whole = self[:]
        return whole if dtype is None else whole.astype(dtype, copy=False)

    def part(self, begin: int, end: int) -> "FileColumn":
        """Return samples [begin, end) of it, not read."""
        end = min(self.begin + end, self.end)
        return replace(self, begin=min(self.begin + begin, end), end=end)

    def _read(self, begin: int, end: int) -> Array:
        if end - begin > LARGE:
            check_room(f"{self.path}: its {end - begin} samples of {self.name or 'one channel'}", 8.0 * (end - begin))
        if not self.name:
            return np.fromfile(self.path, np.float64, end - begin, offset=8 * begin)
        bounds = _bounds(self.path, self.stamp)
        parts = []
        for group in range(np.searchsorted(bounds, begin, "right") - 1, np.searchsorted(bounds, end)):
            low, high = int(bounds[group]), int(bounds[group + 1])
            rows = _group(self.path, self.stamp, self.name, int(group))
            parts.append(rows[max(begin - low, 0) : min(end, high) - low])
        return parts[0] if len(parts) == 1 else np.concatenate(parts or [np.empty(0)])


@lru_cache(maxsize=8)
def _bounds(path: Path, stamp: tuple[int, int]) -> Array:
    """Return the first row of every row group of a table, and the number of rows."""
    import pyarrow.parquet as pq

    metadata = pq.read_metadata(path)
    rows = [metadata.row_group(k).num_rows for k in range(metadata.num_row_groups)]
    return np.cumsum([0, *rows])


@lru_cache(maxsize=KEPT_GROUPS)
def _group(path: Path, stamp: tuple[int, int], name: str, group: int) -> Array:
    """Return one row group of a column; the samples cannot be changed, since they are kept."""
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(path) as file:
            values = floats(file.read_row_group(group, [name]).column(name))
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: cannot be read ({error}); run `mrfit ingest` on its log again") from error
    values.flags.writeable = False
    return values


def columns_of(path: Path, names: Sequence[str], rows: int, scratch: Path) -> dict[str, Array]:
    """Return columns of a table as the arrays they stand for.

    Parameters
    ----------
    path
        The table.
    names
        Its columns.
    rows
        Its number of rows.
    scratch
        Folder for what is made of them and is as long.
    """
    about = path.stat()
    stamp = (about.st_mtime_ns, about.st_size)
    return {n: cast(Array, FileColumn(path, n, 0, rows, scratch, stamp)) for n in names}


def is_long(samples: int) -> bool:
    """Return whether the channels of a recording of so many samples may stay on disk."""
    return samples > LONG_SEGMENT


class SampleTimes:
    """Sample times k·dt, computed slice by slice."""

    def __init__(self, samples: int, dt: float) -> None:
        self.samples, self.dt = samples, dt

    def __len__(self) -> int:
        return self.samples

    def __getitem__(self, rows: slice) -> Array:
        begin, end, _ = rows.indices(self.samples)
        return np.arange(begin, end, dtype=np.float64) * self.dt


def is_on_disk(values: object) -> bool:
    """Return whether values stay on disk."""
    return isinstance(values, FileColumn)


def part_of(values: Array, begin: int, end: int) -> Array:
    """Return samples [begin, end) of a channel (N,); those of a column on disk are not read."""
    return cast(Array, values.part(begin, end)) if isinstance(values, FileColumn) else values[begin:end]


def chunks(values: Array) -> Iterator[Array]:
    """Yield a channel (N,) that stays on disk in pieces of ``COLUMN_CHUNK`` samples, any other as it is."""
    if not isinstance(values, FileColumn):
        yield values
        return
    for begin in range(0, len(values), COLUMN_CHUNK):
        yield values[begin : begin + COLUMN_CHUNK]


def extent(values: Array) -> tuple[float, float]:
    """Return the least and the greatest value of a channel (N,)."""
    ends = [(float(np.min(part)), float(np.max(part))) for part in chunks(values)]
    return min(low for low, _ in ends), max(high for _, high in ends)


def span(values: Array) -> float:
    """Return the range that a channel (N,) takes."""
    low, high = extent(values)
    return high - low


def mean_and_deviation(values: Array) -> tuple[float, float]:
    """Return the mean and the standard deviation of a channel (N,)."""
    if not isinstance(values, FileColumn):
        return float(np.mean(values)), float(np.std(values))
    mean = sum(float(np.sum(part)) for part in chunks(values)) / len(values)
    power = sum(float(np.sum((part - mean) ** 2)) for part in chunks(values)) / len(values)
    return mean, float(np.sqrt(power))


def laid_beside(values: Array, made: Array) -> Array:
    """Return a channel made of values; on disk where these are, so that none of it stays in memory.

    Parameters
    ----------
    values
        A channel.
    made
        What was made of it or a part of it (M,).
    """
    return _kept(values.scratch, [made]) if isinstance(values, FileColumn) else made


def changed(values: Array, change: Callable[[Array], Array]) -> Array:
    """Return the results of a function on a channel's chunks; on disk where this is and where it is long as well."""
    if not isinstance(values, FileColumn):
        return change(values)
    parts = map(change, chunks(values))
    first = next(parts, np.empty(0))
    if is_long(len(first) * (len(values) // COLUMN_CHUNK)):
        return _kept(values.scratch, itertools.chain([first], parts))
    return np.concatenate([first, *parts])


def _kept(scratch: Path, parts: Iterable[Array]) -> Array:
    """Return arrays, one after the other, as a column of a file of plain numbers."""
    with accessing(scratch):
        scratch.mkdir(parents=True, exist_ok=True)
        path = scratch / f"{os.getpid()}-{next(_numbers)}.f64"
        with path.open("wb") as file:
            count = sum(file.write(np.ascontiguousarray(part, dtype=np.float64).data) for part in parts) // 8
    return cast(Array, FileColumn(path, "", 0, count, scratch))


class LazyArrays(Sequence[Array]):
    """Arrays, each read when it is looked at if it stays on disk."""

    def __init__(self, members: Sequence[Array]) -> None:
        self.members = list(members)

    def __len__(self) -> int:
        return len(self.members)

    @overload
    def __getitem__(self, place: int) -> Array: ...

    @overload
    def __getitem__(self, place: slice) -> "LazyArrays": ...

    def __getitem__(self, place: int | slice) -> "Array | LazyArrays":
        if isinstance(place, slice):
            return LazyArrays(self.members[place])
        return np.asarray(self.members[place])
