"""Parquet: recordings of mrfit's own workspaces, and any table with a time column."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrfit.ingest import units
from mrfit.ingest.channel_map import TimeRule
from mrfit.ingest.head import Head
from mrfit.ingest.layout import TIME_NAMES, name_and_unit
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Source, Table
from mrfit.specs import Array, ReaderSpec

SPEC = ReaderSpec("parquet", "Apache Parquet")
NOTHING = ("no numeric column with two rows", "write the log as float columns beside a time column")


def sniff(head: Head) -> bool:
    """Whether the file begins with Parquet's mark."""
    return head.raw.startswith(b"PAR1")


def read(source: Source) -> list[Table]:
    """Return the numeric columns; units from the field's metadata, mrfit's own, or brackets in its name.

    Raises
    ------
    Refusal
        If the file is damaged or holds no numbers.
    """
    import pyarrow.parquet as pq

    path = source.head.path
    try:
        columns, rows, about = _content(pq.read_table(path), source.carry)
    except Exception as error:  # pyarrow raises whatever it met in a damaged file
        raise _damaged(path, error) from None
    if not columns or rows < 2:
        raise Refusal(path, NOTHING[0], NOTHING[1])
    return [_table(columns, rows, about, source.rules.time)]


def read_blocks(source: Source, size: int) -> Iterator[list[Table]]:
    """Yield the table a few rows at a time, about ``size`` bytes of numbers together.

    Raises
    ------
    Refusal
        If the file is damaged or holds no numbers.
    """
    path, done = source.head.path, 0
    for columns, rows, about in _parts(source, size):
        if not columns:
            raise Refusal(path, NOTHING[0], NOTHING[1])
        table = _table(columns, rows, about, source.rules.time)
        yield [replace(table, lines=table.lines + done)]
        done += rows
    if done < 2:
        raise Refusal(path, NOTHING[0], NOTHING[1])


def extent(source: Source) -> tuple[int, int]:
    """Return the numbers of rows and columns the file states.

    Raises
    ------
    Refusal
        If it is damaged.
    """
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(source.head.path) as file:
            return int(file.metadata.num_rows), len(file.schema_arrow)
    except Exception as error:  # pyarrow raises whatever it met in a damaged file
        raise _damaged(source.head.path, error) from None


def _parts(source: Source, size: int) -> Iterator[tuple[list[Column], int, dict[str, Any]]]:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        with pq.ParquetFile(source.head.path, buffer_size=1 << 20) as file:
            rows = max(1, size // (8 * max(1, len(file.schema_arrow))))
            for batch in file.iter_batches(rows, use_threads=False):
                yield _content(pa.Table.from_batches([batch]), source.carry)
    except Exception as error:  # pyarrow raises whatever it met in a damaged file
        raise _damaged(source.head.path, error) from None


def _damaged(path: Path, error: Exception) -> Refusal:
    text = (str(error).splitlines() or ["unreadable"])[0]
    return Refusal(path, f"damaged Parquet ({text})", "copy it again")


def _content(table: Any, carry: dict[str, Any]) -> tuple[list[Column], int, dict[str, Any]]:
    import pyarrow as pa

    about = _about(table.schema.metadata or {})
    written = {c["name"]: c["unit"] for c in about.get("channels", [])}
    columns = []
    for place, field in enumerate(table.schema):
        name, unit = name_and_unit(field.name)
        unit = "s" if pa.types.is_timestamp(field.type) else unit
        unit = (field.metadata or {}).get(b"unit", b"").decode() or written.get(field.name) or unit
        values = _numbers(table.column(place), field.type, carry, place)
        if values is not None:
            columns.append(Column(name, unit, values, place))
    return columns, table.num_rows, about


def _about(metadata: dict[bytes, bytes]) -> dict[str, Any]:
    try:
        about = json.loads(metadata.get(b"mrfit", b"{}"))
    except ValueError:
        return {}
    return about if isinstance(about, dict) else {}


def _numbers(column: Any, kind: Any, carry: dict[str, Any], place: int) -> Array | None:
    import pyarrow as pa

    if pa.types.is_timestamp(kind):
        return _seconds(column.cast(pa.timestamp("ns")).cast(pa.int64()), carry, f"first {place}")
    if pa.types.is_boolean(kind) or not (pa.types.is_floating(kind) or pa.types.is_integer(kind)):
        return None
    return _plain(column.cast(pa.float64()).fill_null(np.nan), np.float64)


def _seconds(nanoseconds: Any, carry: dict[str, Any], key: str) -> Array:
    """Return seconds from the first stamp, taken off while they are whole: a float of 1.7e18 has steps of 256."""
    empty = np.array(nanoseconds.is_null().to_pylist(), dtype=bool)
    whole = _plain(nanoseconds.fill_null(0), np.int64)
    if key not in carry and not empty.all():
        carry[key] = whole[~empty][0]
    return np.where(empty, np.nan, (whole - carry.get(key, 0)) / 1e9)


def _plain(column: Any, kind: type) -> NDArray[Any]:
    parts: list[NDArray[Any]] = [
        np.frombuffer(c.buffers()[1], kind)[c.offset : c.offset + len(c)] for c in column.chunks
    ]
    return np.concatenate(parts) if parts else np.empty(0, kind)


def _time(columns: list[Column], rule: TimeRule | None) -> Column | None:
    """Return the column of times: the map's, or one named so, or the only one in a unit of time."""
    if rule is not None:
        return next((c for c in columns if rule.column in (c.name, c.index)), None)
    timed = [c for c in columns if c.unit is not None and units.compatible(c.unit, "s")]
    named = [c for c in columns if c.name.lower() in TIME_NAMES]
    return named[0] if named else timed[0] if len(timed) == 1 else None


def _table(columns: list[Column], rows: int, about: dict[str, Any], rule: TimeRule | None) -> Table:
    time = _time(columns, rule)
    table = Table(tuple(c for c in columns if c is not time), np.arange(1, rows + 1), time=time)
    if not about:
        return table
    condition = {k: v for k, v in about.get("condition", {}).items() if isinstance(v, float)}
    clock = time and replace(time, unit="s", values=time.values + about.get("start", 0.0))
    return replace(table, time=clock, dt=about.get("dt"), condition=condition)
