"""Siglent SDS oscilloscopes: ``Source,CH1`` above ``Second,Volt``, with or without settings before them."""

from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, fields_at, found_line, meta_of, positive, read_columns

SPEC = ReaderSpec("siglent", "Siglent SDS oscilloscope CSV", blocks=True)


def sniff(head: Head) -> bool:
    """Whether the file has this instrument's two column rows near its top."""
    return _column_line(head) is not None


def _column_line(head: Head) -> int | None:
    for place in range(1, min(60, len(head.lines))):
        if [f.lower() for f in fields_at(head, place, ",")[:1]] != ["second"]:
            continue
        if [f.lower() for f in fields_at(head, place - 1, ",")[:1]] == ["source"]:
            return place
    return None


def read(source: Source) -> list[Table]:
    """Return the record.

    Raises
    ------
    Refusal
        If the rows do not fit the header.
    """
    head = source.head
    row = found_line(head, _column_line(head), "'Source' above 'Second,Volt'")
    names, written = fields_at(head, row - 1, ","), fields_at(head, row, ",")
    names += [f"CH{k}" for k in range(len(names), len(written))]
    fields = [Field("Second", "s", 0), *(Field(names[k], written[k], k) for k in range(1, len(written)))]
    table = read_columns(source, row + 1, fields, fields[0], head.lines[: row + 1])
    meta = meta_of(head, row)
    rows, interval = (positive(_own(meta.get(key, []))) for key in ("record length", "sample interval"))
    return [replace(table, stated_rows=rows, dt=interval)]


def _own(values: list[str]) -> list[str]:
    """Return the values of ``CH1:0.000002`` or ``Analog:140000`` fields."""
    return [v.rpartition(":")[2] for v in values if v]
