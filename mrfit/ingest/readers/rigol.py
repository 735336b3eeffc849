"""Rigol DS, MSO and DHO oscilloscopes, in the header forms their models and PC software write."""

from dataclasses import replace

import numpy as np

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.body import split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, fields_at, meta_of, positive, read_columns

SPEC = ReaderSpec("rigol", "Rigol oscilloscope CSV", blocks=True)
PC_SOFTWARE = "number of data points"


def sniff(head: Head) -> bool:
    """Whether the first two lines are one of Rigol's headers."""
    return _pc_row(head) is not None or _counted(head) or _timed(head)


def _row(head: Head, line: int) -> list[str]:
    return [f.lower() for f in fields_at(head, line, ",")]


def _counted(head: Head) -> bool:
    """``X,CH1,…,Start,Increment`` above ``Sequence,Volt,…,start,increment``."""
    return _row(head, 0)[:1] == ["x"] and _row(head, 0)[-2:] == ["start", "increment"]


def _timed(head: Head) -> bool:
    """``X,CH1,CH2`` or ``,CH2,CH4`` above ``Second,Volt,Volt``."""
    names, below = _row(head, 0), _row(head, 1)
    named = len(names) > 1 and names[0] in ("x", "") and all(n.startswith(("ch", "math")) for n in names[1:])
    return named and below[:1] == ["second"]


def _pc_row(head: Head) -> int | None:
    """Return the line of the column names in an export of the PC software."""
    if not head.starts(f'"{PC_SOFTWARE}', PC_SOFTWARE):
        return None
    return next((k for k, line in enumerate(head.lines[:40]) if split(line, ",")[0].lower() == "time (s)"), None)


def read(source: Source) -> list[Table]:
    """Return the record.

    Raises
    ------
    Refusal
        If the rows do not fit the header.
    """
    if (row := _pc_row(source.head)) is not None:
        return [_pc(source, row)]
    return [_counted_table(source) if _counted(source.head) else _timed_table(source)]


def _read(source: Source, first: int, fields: list[Field]) -> Table:
    return read_columns(source, first, fields, fields[0], source.head.lines[:first])


def _fields(time: Field, names: list[str], written: list[str]) -> list[Field]:
    return [time, *(Field(n, written[k] if k < len(written) else "V", k) for k, n in enumerate(names) if k)]


def _timed_table(source: Source) -> Table:
    names, below = fields_at(source.head, 0, ","), fields_at(source.head, 1, ",")
    return _read(source, 2, _fields(Field("X", "s", 0), names, below))


def _counted_table(source: Source) -> Table:
    """The first column counts samples, not always from 0: t = start + X·increment."""
    head = source.head
    names, below = fields_at(head, 0, ",")[:-2], fields_at(head, 1, ",")
    numbers = [units.quantity(f) for f in below[len(names) :]]
    if len(numbers) < 2 or numbers[0] is None or numbers[1] is None or numbers[1][0] <= 0.0:
        raise Refusal(head.path, "no start and increment in its second line", "export the log again")
    start, increment = numbers[0][0], numbers[1][0]
    table = _read(source, 2, _fields(Field("X", None, 0), names, below))
    assert table.time is not None
    count = table.time.values
    time = Column("X", "s", start + count * increment, 0)
    if not np.array_equal(count[np.isfinite(count)], np.round(count[np.isfinite(count)])):
        raise Refusal(head.path, "its X column does not count samples", "export the log again")
    return replace(table, time=time, dt=increment)


def _pc(source: Source, row: int) -> Table:
    head = source.head
    meta = meta_of(head, row)
    columns = fields_at(head, row, ",")
    names = [n.replace(" ", "") for n in meta.get("channel data", [])]
    fields = [Field("Time", "s", 0)]
    for k in range(1, len(columns)):
        unit = columns[k].partition("(")[2].rstrip(") ") or "V"
        fields.append(Field(names[k - 1] if k <= len(names) else f"CH{k}", unit, k))
    table = _read(source, row + 1, fields)
    rate = positive(meta.get("sampling frequency (hz)", []))
    return replace(table, dt=1.0 / rate if rate else None)
