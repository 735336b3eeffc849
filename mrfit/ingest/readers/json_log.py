"""JSON: arrays by name, a list of records, or columns with data, beside ``dt`` and ``units``."""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from mrfit.core.counting import few
from mrfit.core.specs import Array, ReaderSpec
from mrfit.ingest.containers.attributes import (
    COUNTED_SCALES,
    OFFSET_ATTRIBUTES,
    OTHER_FACTOR_ATTRIBUTES,
    SCALE_ATTRIBUTES,
    unit_beside,
)
from mrfit.ingest.meaning import units
from mrfit.ingest.readers.parquet import log_time
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import name_and_unit, name_and_units
from mrfit.ingest.time.rate import interval, of_kind

SPEC = ReaderSpec("json-log", "JSON: arrays by name, records, or columns with data; dt and units beside them")
BEGINS = re.compile(r"\s*(?:\{\s*\"|\[\s*[\[{])")
VALUES = ("values", "value", "data", "samples", "y")
"""Names of the array of a channel that is an object with a unit."""
JSON_INTERVALS = {"dt": "s", "ts": "s", "sample_interval": "s", "interval": "s", "step": "s"} | dict.fromkeys(
    ("fs", "rate", "sample_rate", "samplerate", "sampling_rate", "sampling_frequency"), "Hz"
)
"""Names of a sample interval or rate, with the unit they have where none is written."""
JSON_FACTORS = (*SCALE_ATTRIBUTES, *COUNTED_SCALES, *OFFSET_ATTRIBUTES, *OTHER_FACTOR_ATTRIBUTES)
"""Names of factors and offsets, which are said and never applied."""
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
    found = [f for f in _runs(_document(source), _RunArrays(), 0) if f.columns]
    if not found:
        remedy = 'write {"dt": 0.001, "units": {"force": "N"}, "force": [0.1, 0.2]} or the like'
        raise Refusal(source.head.path, "no array of numbers in this JSON file", remedy)
    return [_table(one, source) for one in found]


@dataclass(frozen=True)
class _RunArrays:
    """Arrays of one run by name, and what the objects around them say: units, interval, condition."""

    columns: Mapping[str, Array] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    dt: float | None = None
    condition: Mapping[str, float] = field(default_factory=dict)
    factors: tuple[str, ...] = ()


def _document(source: Source) -> Any:
    """Return the whole file; lines that are each an object are a list of records."""
    head = source.head
    text = head.path.read_bytes().decode(head.encoding, errors="replace")
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
        if found := _records(content):
            yield _RunArrays(found, around.units, around.dt, around.condition)
        else:
            for inner in content if all(isinstance(one, dict) for one in content) else ():
                yield from _runs(inner, around, depth + 1)
        return
    if not isinstance(content, dict):
        return
    about = _about(content, around)
    if columns := _columns(content):
        own = [f"{n}.{k}" for n, v in content.items() if isinstance(v, dict) for k in _factors_in(v)]
        beside = _units_beside(content) | dict(about.units)
        yield replace(about, columns=columns, units=beside, factors=(*about.factors, *own))
        return
    for inner in content.values():
        yield from _runs(inner, about, depth + 1)


def _by_name(content: Any) -> Any:
    """Return a list of channels, each an object with its name and a list of numbers, as an object of channels."""
    if not isinstance(content, list) or not all(isinstance(one, dict) for one in content):
        return content
    named = {
        one["name"]: one for one in content if isinstance(one.get("name"), str) and not one.keys().isdisjoint(VALUES)
    }
    return named if content and len(named) == len(content) else content


def _columns(content: Mapping[str, Any]) -> dict[str, Array]:
    """Return the arrays of an object: by name, of channels that are objects, or of ``columns`` and ``data``."""
    names, rows = content.get("columns"), content.get("data")
    if isinstance(names, list) and isinstance(rows, list):
        return _records([dict(zip(map(str, names), row, strict=False)) for row in rows if isinstance(row, list)])
    found = {}
    for name, value in content.items():
        inner = value
        if isinstance(value, dict):
            inner = next((value[v] for v in VALUES if isinstance(value.get(v), list)), None)
            if value and all(re.fullmatch(r"\d+", key) for key in value):
                inner = list(value.values())
        if isinstance(inner, list) and (numbers := _numbers(inner)) is not None:
            found[name] = numbers
    return found


def _records(rows: list[Any]) -> dict[str, Array]:
    """Return the columns of a list of records or of rows of numbers; none if it is neither."""
    if rows and all(isinstance(row, list) for row in rows):
        width = max(map(len, rows))
        rows = [{str(k): value for k, value in enumerate(row)} for row in rows] if width else []
        return {f"column{name}": values for name, values in _records(rows).items()}
    if not rows or any(not isinstance(r, dict) or any(isinstance(v, (list, dict)) for v in r.values()) for r in rows):
        return {}
    names = dict.fromkeys(name for row in rows for name in row)
    columns = {name: _numbers([row.get(name) for row in rows]) for name in names}
    return {name: values for name, values in columns.items() if values is not None}


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
    """Return the statements of an object on the arrays in it, with those of the objects around it."""
    stated = content.get("units")
    written = {str(n): u for n, u in stated.items() if isinstance(u, str)} if isinstance(stated, dict) else {}
    texts = {str(key): text for key, text in content.items() if isinstance(text, str)}
    beside = {n: unit_beside(n, texts, ("_", "")) or written.get(n) for n in content}
    dt = next((dt for name, value in content.items() if (dt := _interval(name, value, beside[name]))), around.dt)
    told: dict[str, Any] = next(
        (content[n] for n in ("condition", "conditions") if isinstance(content.get(n), dict)), {}
    )
    condition = {str(n): float(v) for n, v in told.items() if isinstance(v, (int, float)) and abs(v) < 1e300}
    factors = (*around.factors, *_factors_in(content))
    return _RunArrays({}, dict(around.units) | written, dt, dict(around.condition) | condition, factors)


def _factors_in(content: Mapping[str, Any]) -> list[str]:
    """Return the keys of an object that state a factor or an offset, or those of several channels."""
    numbers = {str(n): v for n, v in content.items() if isinstance(v, (int, float, dict)) and v not in (0, 1)}
    return [name for name in numbers if name.lower() in JSON_FACTORS]


def _units_beside(content: Mapping[str, Any]) -> dict[str, str]:
    """Return the units of channels that are objects."""
    held = {n: v.get("unit", v.get("units")) for n, v in content.items() if isinstance(v, dict)}
    return {n: unit for n, unit in held.items() if isinstance(unit, str)}


def _interval(name: str, value: Any, beside: str | None = None) -> float | None:
    """Return the sample interval in s that a key states: a number, ``"1 ms"``, or value and unit."""
    bare, unit = name_and_unit(name)
    unit = unit or beside
    kind = JSON_INTERVALS.get(bare.strip().lower().replace(" ", "_"))
    if isinstance(value, dict):
        value, unit = value.get("value"), value.get("unit")
    if isinstance(value, str) and (said := units.quantity(value)):
        value, unit = said[0], said[1] or unit
    if kind is None or isinstance(value, bool) or not isinstance(value, (int, float)) or not 0.0 < value < 1e300:
        return None
    written = unit if isinstance(unit, str) and unit else kind
    timed = of_kind(written, kind) or of_kind(written, "s") or of_kind(written, "Hz")
    return interval(float(value), timed) if timed else None


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
        name = name_and_unit(title)[0]
        name, unit = name_and_units(title, found.units.get(title, found.units.get(name)))
        columns.append(Column(name, unit, values, place))
    time = log_time(columns, source.rules.time)
    others = tuple(c for c in columns if c is not time)
    table = Table(others, np.arange(1, rows + 1), time=time, dt=found.dt, condition=found.condition)
    if not found.factors:
        return table
    shown = few([f"'{n}'" for n in dict.fromkeys(found.factors)], 5)
    text = f"{shown} not applied, since the numbers may hold it already"
    return table.finding("packing-unclear", f"{text}; a channel map can say another scale")
