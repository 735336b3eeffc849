"""From named arrays, as MAT, HDF5 and TDMS files hold them, to tables."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrfit.core.counting import few
from mrfit.core.grouping import grouped
from mrfit.core.recording import Finding
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.containers.attributes import unit_beside
from mrfit.ingest.containers.labels import LONGEST_LABEL, MOST_LABELS, is_name_list, labels_of
from mrfit.ingest.containers.memory import Room
from mrfit.ingest.containers.rates import StatedNumber, kind_of, may_tell, stated_rate
from mrfit.ingest.containers.runs import conditions_in, history_of, only_logs, split_in_tests
from mrfit.ingest.containers.shelf import Shelf
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.chosen import columns_meant
from mrfit.ingest.meaning.naming import OF_CONTAINERS
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.layout import DATE_NAMES, is_called_time, name_and_unit, name_and_units
from mrfit.ingest.time.clocks import is_called_clock, is_clock, is_stamp
from mrfit.ingest.time.rate import rate_missing

MANY_NUMBERS, SHOWN_ARRAYS = 1e6, 20
"""Numbers that are not unpacked without need, and names shown of those that hold them."""
DEEPEST_PATH = 12
"""Parts of a path that are followed."""
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
    lists
        Name -> several texts.
    labels
        Name of a signal -> what it is called and, perhaps, its unit, where the file says it elsewhere.
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
    lists: dict[str, list[str]] = field(default_factory=dict)
    labels: dict[str, str] = field(default_factory=dict)
    outside: list[str] = field(default_factory=list)
    room: Room | None = None
    shelf: Shelf | None = None
    findings: list[Finding] = field(default_factory=list)

    def add(self, name: str, value: Any, units: Sequence[str] = ()) -> None:
        """Take a numeric array: a vector as it is, a matrix column by column, one number as a scalar.

        ``units`` are the texts of its unit: one, one for each column, or its letters.
        """
        array = value if isinstance(value, FileArray) else np.asarray(value)
        if array.dtype.kind == "U":
            self.tell(name, np.asarray(value).ravel().tolist())
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

    def tell(self, name: str, texts: Sequence[str]) -> None:
        """Take one text, or a list of as many as may be the names or units of a matrix."""
        if len(texts) == 1:
            self.texts[name] = texts[0]
        elif 1 < len(texts) <= MOST_LABELS and max(map(len, texts)) <= LONGEST_LABEL:
            self.lists[name] = [text.strip() for text in texts]

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
        if timed or name.lower() in DATE_NAMES or kind_of(name) or is_name_list(whole):
            return
    if not any(kind_of(name) or is_name_list(name) for name in stated):
        raise rate_missing(source.head.path, [excerpt(name) for name, _ in arrays[:SHOWN_ARRAYS]])


def tables_of(arrays: Arrays, source: Source) -> list[Table]:
    """Return the tables of each test in its order: one for every length of arrays, if some have times only of those.

    Raises
    ------
    Refusal
        If there is no array of two numbers.
    """
    if arrays.outside and len(arrays.signals) < 2:
        raise Refusal(source.head.path, _elsewhere(arrays), "copy the numbers into the file (`h5repack` does)")
    if not arrays.signals:
        raise Refusal(source.head.path, "no numeric array of two or more numbers", "save the signals as vectors")
    mapped = _mapped(source)
    names, units = labels_of(list(arrays.signals), arrays.lists)
    arrays.labels = {n: label for n, label in (names | arrays.labels).items() if n.lower() not in mapped}
    arrays.units = units | arrays.units
    tests = split_in_tests(list(arrays.signals), {name: len(values) for name, values in arrays.signals.items()})
    if mapped & {name.lower() for names in tests.values() for name in names}:
        tests = {}
    tables: list[Table] = []
    for part, condition, history in _parts(arrays, tests, source):
        made = [replace(t, condition=condition, history=history) for t in _tables(part, source)]
        tables += made
    findings = tuple(arrays.findings)
    if arrays.outside:
        findings += (Finding("not-read", "", None, f"{_elsewhere(arrays)}: left out"),)
    logs = only_logs(tables, source)
    return [replace(logs[0], findings=(*findings, *logs[0].findings)), *logs[1:]]


def _mapped(source: Source) -> set[str]:
    """Return the columns that the channel map names, in lower-case letters: arrays keep the paths it calls them by."""
    return {column.strip().lower() for column in source.rules.columns if isinstance(column, str)}


def _parts(
    arrays: Arrays, tests: Mapping[str, Sequence[str]], source: Source
) -> Iterator[tuple[Arrays, dict[str, float], tuple[str, ...]]]:
    """Yield the arrays of each test, with its condition and its name in the history; first those beside the tests.

    A test has the clock beside the tests where it has none of its own. What is said beside the tests is said of each.
    """
    if not tests:
        yield arrays, {}, ()
        return
    within = {name for names in tests.values() for name in names}
    beside = [name for name in arrays.signals if name not in within]
    order = {name: k for k, name in enumerate(arrays.signals)}
    clocks = _time(beside, arrays, source.rules, order)
    parts = []
    for test, names in tests.items():
        rows = {len(arrays.signals[n]) for n in names}
        taken = [] if _time(list(names), arrays, source.rules, order) else clocks
        taken = [n for n in taken if len(arrays.signals[n]) in rows]
        part = _part(arrays, [*taken, *names], test, tests)
        own = {k: v for k, v in part.scalars.items() if "." not in k}
        condition = conditions_in(own, part.units | _units_of(own, part))
        parts.append((part, condition, history_of("test", test)))
        beside = [n for n in beside if n not in taken]
    if beside:
        yield _part(arrays, beside, "", tests), {}, ()
    yield from parts


def _units_of(scalars: Mapping[str, float], arrays: Arrays) -> dict[str, str]:
    return {name: unit for name in scalars if (unit := unit_beside(name, arrays.texts, ("_", ".")))}


def _part(arrays: Arrays, names: Sequence[str], test: str, tests: Mapping[str, Any]) -> Arrays:
    """Return some arrays, called as within a test, with what is said of them and of the whole file."""
    begin = f"{test}." if test else "."

    def told(about: Mapping[str, Any]) -> dict[str, Any]:
        inside = {name.removeprefix(begin): value for name, value in about.items() if name.startswith(begin)}
        others = {
            f".{name.lstrip('.')}": value
            for name, value in about.items()
            if not any(name == other or name.startswith(f"{other}.") for other in tests)
        }
        return others | inside

    part = arrays.another()
    called = {name: name.removeprefix(begin) for name in names}
    part.signals = {called[name]: arrays.signals[name] for name in names}
    part.labels = {called[name]: arrays.labels[name] for name in names if name in arrays.labels}
    part.scalars, part.texts = told(arrays.scalars), told(arrays.texts)
    part.units = told(arrays.units) | {called[name]: arrays.units[name] for name in names if name in arrays.units}
    return part


def _tables(arrays: Arrays, source: Source) -> list[Table]:
    """Return one table for every length of arrays; where some have a time vector, those without are left out."""
    order = {name: k for k, name in enumerate(arrays.signals)}
    groups = grouped((len(values), name) for name, values in arrays.signals.items())
    times = {size: _time(names, arrays, source.rules, order) for size, names in groups.items()}
    timed = [size for size, names in groups.items() if times[size] and len(times[size]) < len(names)]
    chosen = timed or list(groups)
    left = [name for size in groups if size not in chosen for name in groups[size]]
    tables = [_table(groups[size], times[size], arrays, order) for size in chosen]
    return (
        [replace(tables[0], findings=(_left_out(left, arrays), *tables[0].findings)), *tables[1:]] if left else tables
    )


def _elsewhere(arrays: Arrays) -> str:
    shown = few([f"'{n}'" for n in arrays.outside], 5)
    return f"the numbers of {shown} lie in other files, which are not opened"


def _left_out(names: Sequence[str], arrays: Arrays) -> Finding:
    shown = ", ".join(f"'{n}' ({len(arrays.signals[n])})" for n in names)
    return Finding("not-read", "", None, f"arrays of another length than the time vector are left out: {shown}")


def _time(names: list[str], arrays: Arrays, rules: Rules, order: Mapping[str, int]) -> list[str]:
    """Return the vectors of a group that are times: named so and rising, but for a few jumps; the first is used."""
    if rules.time is not None:
        places = columns_meant(rules.time.column, {place: n for n, place in order.items()})
        return [n for n in names if order[n] in places]
    names = [n for n in names if not rules.leaves_out(n)]
    named = {n: name_and_unit(_called(n, arrays))[0] for n in names}
    # only of names that can be times the unit is looked up, which takes long among many arrays
    times = [n for n in names if is_called_time(named[n], None)]
    times = [n for n in times if is_called_time(named[n], _column(n, arrays, order[n]).unit)]
    for called in (times, [n for n in names if named[n].lower() in DATE_NAMES]):
        if rising := [n for n in called if series.rises(arrays.signals[n])]:
            return rising
    stamps = [n for n in names if is_stamp(_called(n, arrays), arrays.signals[n])]
    return [n for n in names if is_clock(_column(n, arrays, order[n]))] or stamps


def _called(name: str, arrays: Arrays) -> str:
    return arrays.labels.get(name) or name.rpartition(".")[2]


def _table(names: list[str], times: list[str], arrays: Arrays, order: Mapping[str, int]) -> Table:
    columns = {n: _column(n, arrays, order[n]) for n in names}
    dt, unclear = (None, ()) if times else stated_rate(_told(names, arrays))
    rows = len(arrays.signals[names[0]])
    time = columns[times[0]] if times else None
    if time is not None and time.unit is None:  # log.time_us
        time = replace(time, unit=name_and_unit(_called(times[0], arrays))[1])
    copies = {n for n in times if series.equal(arrays.signals[n], arrays.signals[times[0]])}
    return Table(
        tuple(columns[n] for n in names if n not in copies),
        series.counted(rows, series.in_memory(arrays.signals[names[0]])),
        time=time,
        dt=dt,
        findings=unclear,
    )


def _column(name: str, arrays: Arrays, index: int) -> Column:
    stated = arrays.units.get(name) or unit_beside(name, arrays.texts, ("_", "."), arrays.signals) or None
    if stated is None and name.rpartition(".")[2].lower() in OF_CONTAINERS:  # simout.force.Data beside its Units
        stated = unit_beside(name.rpartition(".")[0], arrays.texts, (".",)) or None
    called = arrays.labels.get(name, name)
    bare, unit = (name, stated) if called.endswith("]") and called == name else name_and_units(called, stated)
    return Column(bare, unit, arrays.signals[name], index)


def _told(names: Sequence[str], arrays: Arrays) -> list[StatedNumber]:
    """Return the statements on the rate of these arrays: all in the file, but those on other arrays or their group."""
    own, all_places = ({place for n in some for place in _places(n)} for some in (names, arrays.signals))
    told = []
    for name, value in (*arrays.scalars.items(), *arrays.texts.items()):
        of, _, word = name.rpartition(".")
        of = of.strip(".")
        if may_tell(word) and (of in own or of not in all_places):
            unit = arrays.units.get(name) or unit_beside(name, arrays.texts, ("_", ".", ""))
            told.append(StatedNumber(word, value, unit, "" if of in own else of))
    return told


def _places(name: str) -> list[str]:
    """Return a signal's name, that of its matrix, those of the groups around it, and an empty one for the file."""
    matrix = re.sub(r"\[\d+\]$", "", name)
    parts = matrix.split(".")[:DEEPEST_PATH]
    return [name, matrix, *(".".join(parts[:k]) for k in range(len(parts)))]
