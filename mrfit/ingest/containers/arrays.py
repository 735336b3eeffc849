"""From named arrays, as MAT, HDF5 and TDMS files hold them, to tables."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mrfit.core.counting import few
from mrfit.core.grouping import grouped
from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.containers.attributes import unit_beside
from mrfit.ingest.containers.memory import Room
from mrfit.ingest.containers.shelf import Shelf
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.layout import DATE_NAMES, TIME_NAMES, name_and_unit, name_and_units
from mrfit.ingest.time.clocks import is_called_clock, is_clock
from mrfit.ingest.time.rate import LONG_BARE, interval, of_kind, rate_missing

INTERVAL_NAMES = (
    *("ts", "dt", "delta_t", "sample_time", "sampletime", "wf_increment"),
    *("sample_interval", "sampling_interval", "sample_period", "sampling_period"),
)
ARRAY_RATE_NAMES = (
    *("fs", "rate", "sample_rate", "samplerate", "sampling_rate", "samplingrate"),
    *("sample_frequency", "sampling_frequency"),
)
DECIMATIONS = ("decimation", "decimation_factor", "decimate", "downsampling", "downsample")
SAME_INTERVAL = 1e-3
"""Relative difference of intervals that are one, printed or computed differently."""
MANY_NUMBERS, SHOWN_ARRAYS = 1e6, 20
"""Numbers that are not unpacked without need, and names shown of those that hold them."""
WIDEST_MATRIX = 64
"""A matrix with more columns than this is no set of channels."""


@dataclass(slots=True)
class Arrays:
    """Named arrays of a file with what it says about them.

    Attributes
    ----------
    signals
        Name -> values, shape (N,).
    units
        Name -> unit text.
    scalars
        Name -> single numbers.
    texts
        Name -> single texts.
    outside
        Names of arrays that the file says lie in another one, which is not opened.
    room
        Asked before numbers are kept in memory.
    shelf
        Where long arrays are put instead.
    findings
        What was odd about arrays, or done to them.
    """

    signals: dict[str, Array] = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    scalars: dict[str, float] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    outside: list[str] = field(default_factory=list)
    room: Room | None = None
    shelf: Shelf | None = None
    findings: list[Finding] = field(default_factory=list)

    def add(self, name: str, value: Any, units: Sequence[str] = ()) -> None:
        """Take a numeric array: a vector as it is, a matrix column by column, one number as a scalar.

        ``units`` are the texts of its unit: one, one for each column, or its letters.
        """
        array = value if isinstance(value, FileArray) else np.asarray(value)
        if array.dtype.kind == "U" and array.size == 1:
            self.texts[name] = str(np.asarray(value).reshape(()))
        if array.dtype.kind not in "fiub" or array.ndim > 2 or array.size == 0:
            return
        if array.size == 1:
            self.scalars[name] = float(np.asarray(value).reshape(()))
            if unit := "".join(units):
                self.units[name] = unit
        elif array.ndim < 2 or 1 in array.shape:
            self._add([name], array.reshape(-1, 1), units)
        elif min(array.shape) <= WIDEST_MATRIX:
            array = array if array.shape[0] >= array.shape[1] else array.T
            self._add([f"{name}[{k}]" for k in range(array.shape[1])], array, units)

    def another(self) -> "Arrays":
        """Return an empty set whose numbers are kept in the same places."""
        return Arrays(room=self.room, shelf=self.shelf)

    def _add(self, names: list[str], array: Any, units: Sequence[str]) -> None:
        """Take the columns of an array of shape (N, number of names)."""
        length = array.shape[0]
        if self.shelf and self.shelf.takes(length):
            columns = self.shelf.put(array, length, len(names))
        else:
            if self.room:
                self.room.take(length * len(names))
            whole = np.array(array[0:length], dtype=np.float64)
            columns = [np.ascontiguousarray(whole[:, k]) for k in range(len(names))]
        self.signals.update(zip(names, columns, strict=True))
        if len(units) == len(names):
            self.units.update((n, u) for n, u in zip(names, units, strict=True) if u)
        elif unit := "".join(units):
            self.units.update(dict.fromkeys(names, unit))


class FileArray:
    """A numeric array that still lies in its file, of which rows are read by slices.

    Parameters
    ----------
    dataset
        What gives ``dataset[begin:end]``, and ``dataset[:, begin:end]`` if it has two axes.
    shape
        Its shape, as it is to be seen.
    flipped
        Whether the rows lie along the dataset's last axis.
    """

    def __init__(self, dataset: Any, shape: tuple[int, ...], flipped: bool = False) -> None:
        self.dataset, self.shape, self.flipped = dataset, shape, flipped
        self.dtype, self.ndim, self.size = dataset.dtype, len(shape), int(np.prod(shape))

    @property
    def T(self) -> "FileArray":  # noqa: N802 (as numpy has it)
        """The array with rows and columns exchanged."""
        return FileArray(self.dataset, self.shape[::-1], not self.flipped)

    def reshape(self, rows: int, columns: int) -> "FileArray":
        """Return a vector as one column, of shape (N, 1)."""
        lengths = self.dataset.shape
        return FileArray(self.dataset, (self.size, 1), len(lengths) > 1 and lengths[0] == 1)

    def __getitem__(self, rows: slice) -> Array:
        part = self.dataset[:, rows].T if self.flipped and len(self.dataset.shape) > 1 else self.dataset[rows]
        return np.asarray(part).reshape(-1, self.shape[1])


def check_times(source: Source, arrays: Sequence[tuple[str, str]], stated: Sequence[str], numbers: float) -> None:
    """Refuse a file whose many numbers would be unpacked for nothing: nothing is named as times, nor as a rate.

    Parameters
    ----------
    arrays
        Names and units of all arrays and scalars; a unit is empty where none is stated.
    stated
        Names of attributes.
    numbers
        How many there are in it.

    Raises
    ------
    Refusal
        If there is no such name or unit, and the channel map says neither times nor a rate.
    """
    if numbers < MANY_NUMBERS or source.rules.dt or source.rules.time:
        return
    for whole, unit in arrays:
        name, bracketed = name_and_unit(re.split(r"[./]", whole)[-1])
        timed = is_called_clock(name, unit or bracketed) or is_called_clock(name, None)
        if timed or name.lower() in {*DATE_NAMES, *INTERVAL_NAMES, *ARRAY_RATE_NAMES}:
            return
    if {name.lower() for name in stated}.isdisjoint({*INTERVAL_NAMES, *ARRAY_RATE_NAMES}):
        raise rate_missing(source.head.path, [excerpt(name) for name, _ in arrays[:SHOWN_ARRAYS]])


def tables_of(arrays: Arrays, source: Source) -> list[Table]:
    """Return one table for every length of arrays; where some have a time vector, those without are left out.

    Raises
    ------
    Refusal
        If there is no array of two numbers.
    """
    if arrays.outside and len(arrays.signals) < 2:
        raise Refusal(source.head.path, _elsewhere(arrays), "copy the numbers into the file (`h5repack` does)")
    if not arrays.signals:
        raise Refusal(source.head.path, "no numeric array of two or more numbers", "save the signals as vectors")
    order = {name: k for k, name in enumerate(arrays.signals)}
    groups = grouped((len(values), name) for name, values in arrays.signals.items())
    wanted = source.rules.time.column if source.rules.time else None
    times = {size: _time(names, arrays, wanted, order) for size, names in groups.items()}
    timed = [size for size, names in groups.items() if times[size] and len(times[size]) < len(names)]
    chosen = timed or list(groups)
    left = [name for size in groups if size not in chosen for name in groups[size]]
    findings = (*arrays.findings, *((_left_out(left, arrays),) if left else ()))
    if arrays.outside:
        findings += (Finding("not-read", "", None, f"{_elsewhere(arrays)}: left out"),)
    return [_table(groups[s], times[s], arrays, order, findings) for s in sorted(chosen, reverse=True)]


def _elsewhere(arrays: Arrays) -> str:
    shown = few([f"'{n}'" for n in arrays.outside], 5)
    return f"the numbers of {shown} lie in other files, which are not opened"


def _left_out(names: Sequence[str], arrays: Arrays) -> Finding:
    shown = ", ".join(f"'{n}' ({len(arrays.signals[n])})" for n in names)
    return Finding("not-read", "", None, f"arrays of another length than the time vector are left out: {shown}")


def _time(names: list[str], arrays: Arrays, wanted: str | int | None, order: Mapping[str, int]) -> list[str]:
    """Return the vectors of a group that are times: named so and rising, but for a few jumps; the first is used."""
    if wanted is not None:
        return [n for n in names if n == wanted or order[n] == wanted]
    for known in (TIME_NAMES, DATE_NAMES):
        called = [n for n in names if name_and_unit(n.rpartition(".")[2])[0].lower() in known]
        if rising := [n for n in called if series.rises(arrays.signals[n])]:
            return rising
    return [n for n in names if is_clock(_column(n, arrays, order[n]))]


def _equal(one: Array, two: Array) -> bool:
    return all(np.array_equal(a, b, equal_nan=True) for a, b in series.chunks(one, two))


def _table(
    names: list[str], times: list[str], arrays: Arrays, order: Mapping[str, int], findings: tuple[Finding, ...]
) -> Table:
    columns = {n: _column(n, arrays, order[n]) for n in names}
    dt, unclear = (None, ()) if times else _stated(names, arrays)
    rows = len(arrays.signals[names[0]])
    copies = {n for n in times if _equal(arrays.signals[n], arrays.signals[times[0]])}
    return Table(
        tuple(columns[n] for n in names if n not in copies),
        series.counted(rows, series.in_memory(arrays.signals[names[0]])),
        time=columns[times[0]] if times else None,
        dt=dt,
        findings=(*findings, *unclear),
    )


def _column(name: str, arrays: Arrays, index: int) -> Column:
    stated = arrays.units.get(name) or unit_beside(name, arrays.texts, ("_", ".")) or None
    bare, unit = (name, stated) if name.endswith("]") else name_and_units(name, stated)
    return Column(bare, unit, arrays.signals[name], index)


def _stated(names: Sequence[str], arrays: Arrays) -> tuple[float | None, tuple[Finding, ...]]:
    """Return the sample interval that scalars state for these arrays, or None, and a finding where they disagree."""
    intervals: dict[str, float] = {}
    bare, odd = list[str](), list[str]()
    for name, value in arrays.scalars.items():
        of, _, word = name.rpartition(".")
        word = word.lower()
        if value <= 0.0 or of in arrays.signals and of not in names:
            continue
        if word in (*INTERVAL_NAMES, *ARRAY_RATE_NAMES):
            written = arrays.units.get(name) or unit_beside(name, arrays.texts, ("_", ".", ""))
            kind = "s" if word in INTERVAL_NAMES else "Hz"
            unit = of_kind(written, kind) or of_kind(written, "s") if written else kind
            text = f"{name} = {value:g} {written}".strip()
            intervals[text] = interval(value, unit) if unit else np.nan
            if not unit:
                odd.append(text)
            if not written and intervals[text] > LONG_BARE:
                bare.append(f"{text} without a unit")
        elif word in DECIMATIONS and value != 1.0:
            intervals[f"{name} = {value:g}"] = np.nan
    if not any(np.isfinite(dt) for dt in intervals.values()):
        text = f"the file states {' and '.join(odd)}: not used"
        return None, (Finding("rate-unclear", "", None, text),) if odd else ()
    first = next(iter(intervals.values()))
    if len(bare) == len(intervals):
        return None, (Finding("rate-unclear", "", None, f"the file states {' and '.join(bare)}: not used"),)
    if all(abs(dt / first - 1.0) < SAME_INTERVAL for dt in intervals.values()):
        return first, ()
    text = f"the file states {' and '.join(intervals)}: not used"
    return None, (Finding("rate-unclear", "", None, text),)
