"""JSON: arrays by name, a list of records, or columns with data, beside ``dt`` and ``units``."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from mrfit.core.counting import few
from mrfit.core.recording import Finding
from mrfit.core.specs import Array, ReaderSpec
from mrfit.ingest.containers.attributes import (
    COUNTED_SCALES,
    OFFSET_ATTRIBUTES,
    OTHER_FACTOR_ATTRIBUTES,
    SCALE_ATTRIBUTES,
    unit_beside,
    units_in,
)
from mrfit.ingest.containers.labels import is_name_list
from mrfit.ingest.containers.rates import stated_rate, texts_in, told_in
from mrfit.ingest.containers.runs import history_of, only_logs
from mrfit.ingest.readers.parquet import log_time
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head, body_bytes
from mrfit.ingest.text.layout import CLOCK, DATE_NAMES, STAMP, Header, name_and_unit, name_and_units
from mrfit.ingest.text.long_format import long_format, sorted_out
from mrfit.ingest.time.clocks import is_called_clock
from mrfit.ingest.time.stamps import since_first

SPEC = ReaderSpec("json-log", "JSON: arrays by name, records, or columns with data; dt and units beside them")
BEGINS = re.compile(r"\s*(?:\{\s*\"|\[\s*[\[{])")
VALUES = ("values", "value", "data", "samples", "y")
"""Names of the array of a channel that is an object with a unit."""
SPANS = ("interval", "step")
"""Names of a sample interval that are it in this format only."""
ROWS = ("data", "rows", "values", "records", "samples")
"""Names of lists of rows beside the names of their columns."""
MOST_HEADERS = 8
"""Records before those of samples that may say something of them."""
JSON_FACTORS = (*SCALE_ATTRIBUTES, *COUNTED_SCALES, *OFFSET_ATTRIBUTES, *OTHER_FACTOR_ATTRIBUTES)
"""Names of factors and offsets, which are said and never applied."""
OF_UNIT = ".unit"
"""End of the name of the unit that stands with a number in a record."""
PLAIN_CLOCK = re.compile(rf"(?=\d\d:\d\d:\d\d|.*[Mm]){CLOCK.pattern}")
"""A time of day in two digits, or AM or PM, which is one whatever it is called."""
DEEPEST_OBJECT = 4
"""Objects inside each other in which arrays are looked for."""


def sniff(head: Head) -> bool:
    """Whether the text begins as a JSON object with a key, or as a list of objects or rows."""
    return bool(head.encoding) and bool(BEGINS.match("\n".join(head.lines[:50]) or ""))


def read(source: Source) -> list[Table]:
    """Return a table of each run: arrays of one length, or records.

    Raises
    ------
    Refusal
        If the file is no JSON, holds no numbers, or its arrays have several lengths.
    """
    found = [run for run in _runs(_document(source), _RunArrays(), 0) if run.columns]
    if not found:
        remedy = 'write {"dt": 0.001, "units": {"force": "N"}, "force": [0.1, 0.2]} or the like'
        raise Refusal(source.head.path, "no array of numbers in this JSON file", remedy)
    tables = [_table(run, source) for run in found]
    if len(found) > 1:
        told = [history_of("run", run.place) for run in found]
        tables = [replace(t, history=(*said, *t.history)) for t, said in zip(tables, told, strict=True)]
    return only_logs(tables, source)


@dataclass(frozen=True)
class _RunArrays:
    """Arrays of one run by name, with what the objects around them say.

    ``words`` are columns of texts beside them, and ``place`` is the path to them.
    """

    columns: Mapping[str, Array] = field(default_factory=dict)
    place: str = ""
    units: Mapping[str, str] = field(default_factory=dict)
    texts: Mapping[str, str] = field(default_factory=dict)
    words: Mapping[str, list[str]] = field(default_factory=dict)
    dt: float | None = None
    condition: Mapping[str, float] = field(default_factory=dict)
    factors: tuple[str, ...] = ()
    unclear: tuple[Finding, ...] = ()


def _document(source: Source) -> Any:
    """Return the whole file; lines that are each an object are a list of records."""
    head = source.head
    text = body_bytes(head).decode(head.body_encoding, errors="replace")
    try:
        return json.loads(text)
    except RecursionError:
        raise Refusal(head.path, "JSON nested too deep to be a log", "export the log again") from None
    except ValueError as error:
        lines = [line for line in text.splitlines() if line.strip()]
        if len(lines) > 1 and all(line.lstrip().startswith("{") for line in lines):
            try:
                return [json.loads(line) for line in lines]
            except (ValueError, RecursionError):
                pass
        raise Refusal(head.path, f"damaged JSON ({error})", "copy it again") from None


def _runs(content: Any, around: _RunArrays, depth: int) -> Iterator[_RunArrays]:
    """Yield the runs in a value of the file, with what was said of them further out."""
    if depth > DEEPEST_OBJECT:
        return
    content = _by_name(content)
    if isinstance(content, list):
        header, rows = _header_and_rows(content)
        about = _about(header, around) if header else around
        found = _records(rows)
        if found.columns:
            yield replace(about, columns=found.columns, units=dict(about.units) | dict(found.units), words=found.words)
        else:
            for place, inner in enumerate(rows if all(isinstance(one, dict) for one in rows) else ()):
                yield from _runs(inner, replace(about, place=f"{about.place}[{place}]"), depth + 1)
        return
    if not isinstance(content, dict):
        return
    about = _about(content, around)
    if (found := _columns(content)).columns:
        own = [f"{n}.{k}" for n, v in content.items() if isinstance(v, dict) for k in _factors_in(v)]
        beside = dict(about.units) | _units_beside(content) | dict(found.units)
        factors = (*about.factors, *own)
        about = replace(about, dt=None, unclear=found.unclear) if found.unclear else about
        yield replace(about, columns=found.columns, units=beside, words=found.words, factors=factors)
        return
    for name, inner in content.items():
        yield from _runs(inner, replace(about, place=f"{about.place}.{name}".strip(".")), depth + 1)


def _by_name(content: Any) -> Any:
    """Return a list of channels, each an object with its name and numbers, as an object of channels.

    Of records by their number, as pandas writes them, return the list.
    """
    if isinstance(content, dict) and len(content) > 1 and all(_is_record(one) for one in content.values()):
        rows, counted = _by_number(content)
        return rows if counted else content
    if not isinstance(content, list) or not all(isinstance(one, dict) for one in content):
        return content
    named = {
        one["name"]: one for one in content if isinstance(one.get("name"), str) and not one.keys().isdisjoint(VALUES)
    }
    return named if content and len(named) == len(content) else content


def _is_record(value: Any, deepest: int = DEEPEST_OBJECT) -> bool:
    """Whether a value is an object of single values: with a list, or numbered values, it is a channel or a run."""
    if not isinstance(value, dict) or not deepest or any(map(str.isdigit, value)):
        return False
    inner = [one for one in value.values() if isinstance(one, (list, dict))]
    return all(_is_record(one, deepest - 1) for one in inner)


def _by_number(content: Mapping[str, Any]) -> tuple[list[Any], bool]:
    """Return the values of an object in the order of their numbers, and whether these count from 0 or 1.

    They may be sorted as texts are (0, 1, 10, 2); those that do not count may be times.
    """
    if not content or not all(re.fullmatch(r"\d{1,20}", key) for key in content):
        return [], False
    order = sorted(content, key=int)
    counted = int(order[0]) < 2 and all(int(b) - int(a) == 1 for a, b in pairwise(order))
    return [content[key] for key in order], counted


def _header_and_rows(content: list[Any]) -> tuple[dict[str, Any], list[Any]]:
    """Return the statements of records before those of samples, and the records of samples.

    Before them stand those that have none of the numbers of a record in the middle.
    """
    middle = content[len(content) // 2] if len(content) > 2 else None
    usual = {n for n, v in middle.items() if not isinstance(v, (str, list))} if isinstance(middle, dict) else set()
    header: dict[str, Any] = {}
    for place, one in enumerate(content[:MOST_HEADERS]):
        if not usual or not isinstance(one, dict) or not usual.isdisjoint(one):
            return header, content[place:]
        header |= one
    return {}, content


def _columns(content: Mapping[str, Any]) -> _RunArrays:
    """Return the arrays of an object: by name, of channels that are objects, or of names of columns and rows."""
    names = next((v for n, v in content.items() if is_name_list(n) and isinstance(v, list)), None)
    rows = next((content[n] for n in ROWS if isinstance(content.get(n), list)), None)
    if names and rows and all(isinstance(name, str) for name in names) and isinstance(rows[0], list):
        return _records([dict(zip(names, row, strict=False)) for row in rows if isinstance(row, list)])
    found, numbered = {}, {n: _by_number(v) for n, v in content.items() if isinstance(v, dict)}
    for name, value in content.items():
        inner: Any = value
        if isinstance(value, dict):
            listed = [value[v] for v in VALUES if isinstance(value.get(v), list)]
            inner = numbered[name][0] or (listed[0] if listed else None)
        if isinstance(inner, list) and (numbers := _numbers(inner)) is not None:
            found[name] = numbers
    odd = [f"'{n}'" for n, (rows, counted) in numbered.items() if n in found and rows and not counted]
    if not odd:
        return _RunArrays(found)
    text = f"numbers that do not count the rows stand beside those of {few(odd, 5)}: no stated rate is used"
    return _RunArrays(found, unclear=(Finding("rate-unclear", "", None, text),))


def _records(rows: list[Any]) -> _RunArrays:
    """Return the columns of a list of records or of rows of numbers; none if it is neither."""
    if rows and all(isinstance(row, list) for row in rows):
        width = max(map(len, rows))
        rows = [{f"column{k}": value for k, value in enumerate(row)} for row in rows] if width else []
    flat = [_flat(row, DEEPEST_OBJECT) if isinstance(row, dict) else None for row in rows]
    records = [one for one in flat if one is not None]
    if not rows or len(records) < len(rows):
        return _RunArrays()
    names = dict.fromkeys(name for row in records for name in row)
    leaves = [name.rpartition(".")[2] for name in names]
    columns, words, units = dict[str, Array](), dict[str, list[str]](), dict[str, str]()
    for name, leaf in zip(names, leaves, strict=True):
        values = [row.get(name) for row in records]
        if (numbers := _numbers(values)) is not None:
            columns[leaf if leaves.count(leaf) == 1 else name] = numbers
        elif len(texts := [v for v in values if isinstance(v, str)]) == len(values):
            words[name] = texts
    for name in [n for n in words if n.endswith(OF_UNIT)]:
        title = name.removesuffix(OF_UNIT)
        units[title if title in columns else title.rpartition(".")[2]] = " or ".join(sorted({*words.pop(name)}))
    return _RunArrays(columns, units=units, words=words)


def _flat(record: Mapping[str, Any], deepest: int) -> dict[str, Any] | None:
    """Return a record whose objects are numbers with units, or hold more of the record; None where it holds lists."""
    flat: dict[str, Any] = {}
    for name, value in record.items():
        if isinstance(value, dict) and value.keys() == {"v", "u"}:
            value = {"value": value["v"], "unit": value["u"]}
        if isinstance(value, list) or isinstance(value, dict) and not deepest:
            return None
        if not isinstance(value, dict):
            flat[name] = value
        elif (word := next((w for w in VALUES if w in value), None)) and not isinstance(value[word], (dict, list)):
            flat[name] = value[word]
            if unit := "".join(units_in(value)):
                flat[f"{name}{OF_UNIT}"] = unit
        else:
            inner = _flat(value, deepest - 1)
            if inner is None:
                return None
            flat |= {f"{name}.{n}": v for n, v in inner.items()}
    return flat


def _numbers(values: list[Any]) -> Array | None:
    """Return a list as numbers, null as nan; None if it holds something else, or nothing."""
    if not any(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values):
        return None
    if not all(v is None or isinstance(v, (int, float)) for v in values):
        return None
    try:
        return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
    except OverflowError:
        return None


def _about(content: Mapping[str, Any], around: _RunArrays) -> _RunArrays:
    """Return the statements of an object on the arrays in it, with those of the objects around it.

    Objects in it without arrays belong to it, such as ``metadata``.
    """
    said = {"sample_interval" if n.lower() in SPANS else n: v for n, v in content.items() if not _has_list(v)}
    dt, unclear = stated_rate(told_in(said))
    if dt is None and not unclear:
        dt, unclear = around.dt, around.unclear
    told: dict[str, Any] = next(
        (content[n] for n in ("condition", "conditions") if isinstance(content.get(n), dict)), {}
    )
    condition = {str(n): float(v) for n, v in told.items() if isinstance(v, (int, float)) and abs(v) < 1e300}
    texts = dict(around.texts) | texts_in(said)
    return replace(
        around,
        texts=texts,
        dt=dt,
        unclear=unclear,
        condition=dict(around.condition) | condition,
        factors=(*around.factors, *_factors_in(content)),
    )


def _has_list(value: Any, deepest: int = DEEPEST_OBJECT) -> bool:
    """Whether a value is or holds a list, or is too deep to tell."""
    if not isinstance(value, dict):
        return isinstance(value, list)
    return not deepest or any(_has_list(inner, deepest - 1) for inner in value.values())


def _factors_in(content: Mapping[str, Any]) -> list[str]:
    """Return the keys of an object that state a factor or an offset, or those of several channels."""
    numbers = {str(n): v for n, v in content.items() if isinstance(v, (int, float, dict)) and v not in (0, 1)}
    return [name for name in numbers if name.lower() in JSON_FACTORS]


def _units_beside(content: Mapping[str, Any]) -> dict[str, str]:
    """Return the units of channels that are objects."""
    held = {n: v.get("unit", v.get("units")) for n, v in content.items() if isinstance(v, dict)}
    return {n: unit for n, unit in held.items() if isinstance(unit, str)}


def _by_channel(table: Table, found: _RunArrays, source: Source) -> Table:
    """Return records that are each of one channel and time sorted into columns; others as they are."""
    places = [*found.columns, *found.words]
    called = ["value" if name.lower() in (*VALUES, "v") else name for name in places]
    header = Header(tuple(called), (None,) * len(places), frozenset(), 0)
    form = long_format(header, ["number"] * len(found.columns) + ["text"] * len(found.words))
    if form is None or form.channel < len(found.columns):
        return table
    return sorted_out(table, form, {k: found.words[places[k]] for k in form.texts}, source)


def _written_time(words: Mapping[str, list[str]]) -> Column | None:
    """Return the first texts that are stamps, or times of day, as times; None where there are none.

    A mixture is written ``1:2:1``, too. Texts that never change, as the day of the test, are no times of rows.
    """
    for name, texts in words.items():
        called = is_called_clock(name, None) or name.rpartition(".")[2].lower() in DATE_NAMES
        clock = CLOCK if called else PLAIN_CLOCK
        if len({*texts}) > 1 and all(STAMP.fullmatch(t) or clock.fullmatch(t) for t in texts):
            try:
                return Column(name, "s", since_first(texts, {}), -1)
            except ValueError:  # no day of the calendar, or stamps among times of day
                continue
    return None


def _table(found: _RunArrays, source: Source) -> Table:
    path, lengths = source.head.path, {name: len(values) for name, values in found.columns.items()}
    if len({*lengths.values()}) > 1:
        shown = ", ".join(f"{name} {length}" for name, length in list(lengths.items())[:6])
        raise Refusal(path, f"its arrays have several lengths ({shown})", "export channels of one rate together")
    rows = next(iter(lengths.values()))
    if rows < 2:
        raise Refusal(path, f"its arrays hold {rows} value", "export the whole log")
    columns = []
    for place, (title, values) in enumerate(found.columns.items()):
        named = (title, name_and_unit(title)[0])
        stated = [found.units.get(n) or unit_beside(n, found.texts, ("_", ".", ""), found.columns) for n in named]
        name, unit = name_and_units(title, next(filter(None, stated), None))
        columns.append(Column(name, unit, values, place))
    time = log_time(columns, source.rules) or _written_time(found.words)
    others = tuple(c for c in columns if c is not time)
    table = Table(others, np.arange(1, rows + 1), time=time, dt=found.dt, condition=found.condition)
    table = _by_channel(table, found, source) if found.words else table
    table = replace(table, findings=(*table.findings, *found.unclear)) if table.time is None else table
    if not found.factors:
        return table
    shown = few([f"'{n}'" for n in dict.fromkeys(found.factors)], 5)
    text = f"{shown} not applied, since the numbers may hold it already"
    return table.finding("packing-unclear", f"{text}; a channel map can say another scale")
