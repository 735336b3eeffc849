"""Parquet: recordings of mrfit's own workspaces, and any table with a time column."""

import json
import math
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.counting import few
from mrfit.core.recording import Finding
from mrfit.core.specs import Array, ReaderSpec
from mrfit.ingest.containers.arrays import check_times
from mrfit.ingest.containers.attributes import decoded, doubt_of, unit_beside, units_in
from mrfit.ingest.containers.labels import LONGEST_LABEL
from mrfit.ingest.containers.rates import StatedNumber, stated_rate, texts_in, told_in
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.meaning.chosen import clocks_meant
from mrfit.ingest.refusal import Refusal, damaged, excerpt
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import DATE_NAMES, TIME_NAMES, Header, is_called_time, name_and_units
from mrfit.ingest.text.long_format import MOST_CHANNELS, LongFormat, long_format, sorted_out
from mrfit.ingest.time.clocks import is_clock, is_stamp
from mrfit.ingest.time.epoch import counted_since
from mrfit.io.arrow import floats

SPEC = ReaderSpec("parquet", "Apache Parquet")
BUFFER = 1 << 20
BYTES_OF_LETTER = 8
"""Bytes that a letter of a text may take, and a reference to a text."""
PROGRAMS_METADATA = ("mrfit", "pandas", "ARROW:schema")
"""Metadata in which programs describe the columns to themselves."""
EXACT_WHOLE = 2**53
"""From here on not every whole number is a float."""
NO_NUMERIC_COLUMN = ("no numeric column with two rows", "write the log as float columns beside a time column")


def sniff(head: Head) -> bool:
    """Whether the file begins with Parquet's mark."""
    return head.raw.startswith(b"PAR1")


def read(source: Source) -> list[Table]:
    """Return the numeric columns; units from the field's metadata, the table's, mrfit's own, or brackets in its name.

    A table with a row for each channel and time is sorted into columns.

    Raises
    ------
    Refusal
        If the file is damaged or holds no numbers.
    """
    rows, columns = extent(source)
    source.room().expect(rows * columns)
    form, texts = _channel_texts(source)
    table = _joined([table for part in _blocks(source, 8 * rows * max(columns, 1)) for table in part])
    return [sorted_out(table, form, texts, source)] if form else [table]


def _joined(tables: list[Table]) -> Table:
    """Return the tables of all row groups as one."""
    first = tables[0]

    def whole(parts: list[Column]) -> Column:
        return replace(parts[0], values=np.concatenate([p.values for p in parts]))

    columns = tuple(whole([t.columns[k] for t in tables]) for k in range(len(first.columns)))
    time = whole([t.time for t in tables if t.time]) if first.time else None
    return replace(first, columns=columns, time=time, lines=np.concatenate([t.lines for t in tables]))


def read_blocks(source: Source, size: int) -> Iterator[list[Table]]:
    """Yield the table a few rows at a time, about ``size`` bytes of numbers together.

    Raises
    ------
    Refusal
        If the file is damaged or holds no numbers.
    """
    with _opened(source) as (file, _):
        if _long_form(file.schema_arrow):
            text = "one row for each channel and time, in a table read in parts"
            raise Refusal(source.head.path, text, "export a column per channel")
    yield from _blocks(source, size)


def _blocks(source: Source, size: int) -> Iterator[list[Table]]:
    path, done = source.head.path, 0
    _check_times(source)
    for columns, rows, about in _parts(source, size):
        if not columns:
            raise Refusal(path, NO_NUMERIC_COLUMN[0], NO_NUMERIC_COLUMN[1])
        table = _table(columns, rows, about, source.rules)
        yield [replace(table, lines=table.lines + done)]
        done += rows
    if done < 2:
        raise Refusal(path, NO_NUMERIC_COLUMN[0], NO_NUMERIC_COLUMN[1])


def extent(source: Source) -> tuple[int, int]:
    """Return the numbers of rows, and of columns that are read, which the file states.

    Raises
    ------
    Refusal
        If it is damaged.
    """
    with _opened(source) as (file, names):
        return int(file.metadata.num_rows), len(names)


def _check_times(source: Source) -> None:
    """Refuse a table of many numbers without times before it is unpacked."""
    import pyarrow as pa

    with _opened(source) as (file, names):
        fields = [f for f in file.schema_arrow if f.name in names]
        stamped = any(pa.types.is_timestamp(f.type) or pa.types.is_duration(f.type) for f in fields)
        described = [(f.name, "".join(units_in(f.metadata or {}))) for f in fields]
        if not (stamped or b"mrfit" in (file.schema_arrow.metadata or {})):
            stated = [told.name for told in stated_in(file.schema_arrow)[1]]
            check_times(source, described, stated, file.metadata.num_rows * len(fields))


@contextmanager
def _opened(source: Source) -> Iterator[tuple[Any, list[str]]]:
    """Give the file and the names of the columns that are read: numbers and times.

    The others, texts above all, are left packed: a few bytes may stand for as many texts as there are rows.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    path = source.head.path
    try:
        with pq.ParquetFile(path, buffer_size=BUFFER) as file:
            yield file, list(dict.fromkeys(f.name for f in file.schema_arrow if _is_number(f.type)))
    except (OSError, ValueError, RecursionError, pa.ArrowException) as error:
        raise damaged(path, "Parquet", error) from None


def _parts(source: Source, size: int) -> Iterator[tuple[list[Column], int, dict[str, Any]]]:
    import pyarrow as pa

    with _opened(source) as (file, names):
        rows = max(1, size // (8 * max(1, len(names))))
        # a name may stand twice, and the second be a column of texts; pyarrow gives columns of one name together
        places = [k for name in names for k, f in enumerate(file.schema_arrow) if f.name == name]
        form = _long_form(file.schema_arrow)
        used = form.texts if form else ()
        others = [f"'{f.name}'" for k, f in enumerate(file.schema_arrow) if f.name not in names and k not in used]
        said = [Finding("no-channel", "", None, f"{few(others, 5)}: no numbers, and no channel")] if others else []
        for group in range(file.num_row_groups):  # asked for all, pyarrow opens all at once, each with its buffers
            for batch in file.iter_batches(rows, [group], names, use_threads=False):
                columns, length, about = _content(pa.Table.from_batches([batch]), places, source)
                about["findings"] += said
                yield columns, length, about


def _long_form(schema: Any) -> LongFormat | None:
    """Return the columns of channels and values of a table with a row for each channel and time; else None."""
    import pyarrow as pa

    def sort(kind: Any) -> str:
        held = kind.value_type if pa.types.is_dictionary(kind) else kind
        if pa.types.is_string(held) or pa.types.is_large_string(held):
            return "text"
        return "" if not _is_number(kind) else "stamp" if pa.types.is_timestamp(kind) else "number"

    if len(set(schema.names)) < len(schema.names):
        return None
    header = Header(tuple(schema.names), (None,) * len(schema.names), frozenset(), 0)
    return long_format(header, [sort(field.type) for field in schema])


def _channel_texts(source: Source) -> tuple[LongFormat | None, dict[int, list[str]]]:
    """Return the form of a table with a row for each channel and time, and the texts of its channels and units.

    They are read as numbers of a few texts, since a few bytes may stand for as many texts as there are rows.

    Raises
    ------
    Refusal
        If there are too many of them, or they are too long, to be names of channels.
    """
    import pyarrow as pa
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    path = source.head.path
    with _opened(source) as (file, _):
        schema = file.schema_arrow
    form, texts = _long_form(schema), dict[int, list[str]]()
    for place in form.texts if form else ():
        name = schema.names[place]
        try:
            with pq.ParquetFile(path, buffer_size=BUFFER, read_dictionary=[name]) as file:
                column = file.read(columns=[name], use_threads=False).column(0)
            codes = (column if pa.types.is_dictionary(column.type) else pc.dictionary_encode(column)).combine_chunks()
            known = [str(text) for text in codes.dictionary.to_pylist()]
        except (OSError, ValueError, pa.ArrowException) as error:
            raise damaged(path, "Parquet", error) from None
        longest = max(map(len, known), default=0)
        if len(known) > MOST_CHANNELS or longest > LONGEST_LABEL:
            text = (
                f"column '{excerpt(name)}' holds {len(known)} texts of up to {longest} characters, and no few channels"
            )
            raise Refusal(path, text, "export a column for each channel")
        source.room().hold("its names of channels", BYTES_OF_LETTER * len(codes) * (longest + BYTES_OF_LETTER))
        texts[place] = ["" if code is None else known[code] for code in codes.indices.to_pylist()]
    return form, texts


def stated_in(schema: Any) -> tuple[dict[str, str], list[StatedNumber]]:
    """Return the texts in the metadata of a table by name, and what these and those of its fields tell of a rate.

    Programs write objects into them as JSON; pandas keeps in one what users attach to a table.
    """
    about: dict[str, Any] = {}
    for key, value in (schema.metadata or {}).items():
        if decoded(key) not in PROGRAMS_METADATA:
            found = _object(value)
            about |= found if decoded(key) == "PANDAS_ATTRS" and isinstance(found, dict) else {decoded(key): found}
    told = told_in(about)
    for field in schema:
        told += told_in(field.metadata or {})
    return texts_in(about), told


def _object(value: bytes) -> Any:
    """Return the object that a text is, or the text."""
    text = decoded(value)
    try:
        return json.loads(text) if text.startswith("{") else text
    except (ValueError, RecursionError):
        return text


def _is_number(kind: Any) -> bool:
    import pyarrow as pa

    plain = pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind)
    return bool(plain or pa.types.is_timestamp(kind) or pa.types.is_duration(kind))


def _content(table: Any, places: list[int], source: Source) -> tuple[list[Column], int, dict[str, Any]]:
    import pyarrow as pa

    about = _about(table.schema.metadata or {}, source.head.path)
    written = {c["name"]: c["unit"] for c in about["channels"]}
    texts, told = stated_in(table.schema)
    about["rate"] = stated_rate(told)
    columns = []
    for column, field, place in zip(table.columns, table.schema, places, strict=True):
        if not _is_number(field.type):
            continue
        beside = written.get(field.name) or unit_beside(field.name, texts, ("_", "."), table.schema.names)
        name, unit = name_and_units(field.name, "".join(units_in(field.metadata or {})) or beside or None)
        if doubt := doubt_of(_numbers_in(field.metadata or {}), None):
            text = f"'{name}': {doubt}; a channel map can say another scale"
            about["findings"].append(Finding("packing-unclear", "", None, text))
        carry = source.carry
        if pa.types.is_timestamp(field.type):
            values, unit = _from_first(column.cast(pa.timestamp("ns")).cast(pa.int64()), carry, place, 1e9), "s"
        elif pa.types.is_duration(field.type):
            values, unit = _floats(column.cast(pa.duration("ns")).cast(pa.int64())) / 1e9, "s"
        elif pa.types.is_integer(field.type) and _tells_time(name, unit):
            values, counted = _counted_time(column.cast(pa.int64()), unit, carry, place)
            if counted != unit:
                text = f"the file gives '{name}' no unit: taken as {counted} since 1970, and given from its first value"
                about["findings"].append(Finding("unit-assumed", "", None, text))
            unit = counted
        else:
            values = _floats(column)
        columns.append(Column(name, unit, values, place))
    return sorted(columns, key=lambda c: c.index), table.num_rows, about


def _tells_time(name: str, unit: str | None) -> bool:
    return units.compatible(unit, "s") if unit else name.lower() in {*TIME_NAMES, *DATE_NAMES}


def _counted_time(column: Any, unit: str | None, carry: dict[str, Any], place: int) -> tuple[Array, str | None]:
    """Return whole-numbered times and their unit.

    Counted since 1970, as computers keep time, they are given from the first on. Where no unit is stated, the first
    tells it: of this century's times no two units share a number.
    """
    key = f"unit {place}"
    if key not in carry:
        known = column.drop_null()
        first = known[0].as_py() if len(known) else 0
        named = counted_since(first)[0]
        if len(known):
            carry[key] = unit or named, bool(named and not unit) or abs(first) > EXACT_WHOLE
    found, since = carry.get(key, (unit, False))
    return (_from_first(column, carry, place, 1.0) if since else _floats(column)), found


def _from_first(whole: Any, carry: dict[str, Any], place: int, per_unit: float) -> Array:
    """Return times from the first on, taken off while they are whole: a float of 1.7e18 has steps of 256."""
    import pyarrow.compute as pc

    key, known = f"first {place}", whole.drop_null()
    if key not in carry and len(known):
        carry[key] = known[0]
    return _floats(pc.subtract(whole, carry[key]) if key in carry else whole) / per_unit


def _floats(column: Any) -> Array:
    import pyarrow as pa

    # whole numbers beyond 2^53 become the nearest float, as all others do
    return floats(column.cast(pa.float64(), safe=False))


def _about(metadata: dict[bytes, bytes], path: Path) -> dict[str, Any]:
    """Return the metadata that mrfit wrote beside the columns: channels, interval, start, condition.

    Raises
    ------
    Refusal
        If something in it is not as mrfit writes it.
    """
    try:
        about = json.loads(metadata.get(b"mrfit", b"{}"))
    except (ValueError, RecursionError):
        about = None
    found = about if isinstance(about, dict) else {"mrfit": about}
    told = {"channels": [], "condition": {}, "start": 0.0} | found
    for key, is_sound in SOUND.items():
        if key in told and not is_sound(told[key]):
            shown = json.dumps(told[key], default=str)
            text = f"its 'mrfit' metadata is not as mrfit writes it ({key}: {excerpt(shown)})"
            raise Refusal(path, text, "write the table without it, or ingest the log itself")
    return told | {"given": bool(found), "findings": []}


def _is_number_written(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _are_channels(value: object) -> bool:
    return isinstance(value, list) and all(
        isinstance(c, dict) and isinstance(c.get("name"), str) and isinstance(c.get("unit"), str) for c in value
    )


SOUND: dict[str, Callable[[Any], bool]] = {
    "mrfit": lambda _: False,
    "channels": _are_channels,
    "condition": lambda value: isinstance(value, dict),
    "start": _is_number_written,
    "dt": lambda value: _is_number_written(value) and value > 0.0,
}
"""What each of these keys must be."""


def _numbers_in(about: Mapping[bytes, bytes]) -> dict[str, float]:
    """Return the attributes of a field that are numbers, which it has as texts."""
    texts = {decoded(key): units.quantity(decoded(value)) for key, value in about.items()}
    return {key: found[0] for key, found in texts.items() if found}


def log_time(columns: list[Column], rules: Rules) -> Column | None:
    """Return the column of times: the map's, or one named so, or the only one in a unit of time."""
    if rules.time is not None:
        places = clocks_meant(rules.time.column, {c.index: c.name for c in columns})
        return next((c for c in columns if c.index in places), None)
    columns = [c for c in columns if not rules.leaves_out(c.name)]
    timed = [c for c in columns if c.unit is not None and units.compatible(c.unit, "s")]
    named = [c for c in columns if is_called_time(c.name, c.unit)]
    if named or len(timed) == 1:
        return (named or timed)[0]
    dated = (c for c in columns if c.name.lower() in DATE_NAMES)
    stamps = (c for c in columns if c.unit is None and is_stamp(c.name, c.values))
    return next((c for c in columns if is_clock(c)), None) or next(dated, None) or next(stamps, None)


def _table(columns: list[Column], rows: int, about: dict[str, Any], rules: Rules) -> Table:
    time = log_time(columns, rules)
    others = tuple(c for c in columns if c is not time)
    table = Table(others, np.arange(1, rows + 1), time=time, findings=tuple(about["findings"]))
    if not about["given"]:
        dt, unclear = (None, ()) if time else about["rate"]
        return replace(table, dt=dt, findings=(*table.findings, *unclear))
    condition = {k: v for k, v in about["condition"].items() if isinstance(v, float)}
    clock = time and replace(time, unit="s", values=time.values + about["start"])
    return replace(table, time=clock, dt=about.get("dt"), condition=condition)
