"""Siglent SDS oscilloscopes: ``Source,CH1`` above ``Second,Volt``, with or without settings before them."""

from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import Layout
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, check_width, fields_at, meta_of, positive, read_table

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
    row = _column_line(head)
    if row is None:
        raise Refusal(head.path, "no 'Source' above 'Second,Volt' in its header", "export the log again")
    names, written = fields_at(head, row - 1, ","), fields_at(head, row, ",")
    width = check_width(head, row + 1, ",", len(written))
    names += [f"CH{k}" for k in range(len(names), len(written))]
    fields = [Field(names[k], written[k], k) for k in range(1, len(written))]
    columns = tuple(range(len(written)))
    header = frozenset(line.strip() for line in head.lines[: row + 1] if line.strip())
    layout = Layout(row + 1, ",", ".", width, columns, blank=tuple(range(len(written), width)), header=header)
    table = read_table(source, layout, fields, Field("Second", "s", 0))
    meta = meta_of(head, row)
    table = replace(table, stated_rows=positive(_own(meta.get("record length", []))))
    return [replace(table, dt=positive(_own(meta.get("sample interval", []))))]


def _own(values: list[str]) -> list[str]:
    """Return the values of ``CH1:0.000002`` or ``Analog:140000`` fields."""
    return [v.rpartition(":")[2] for v in values if v]
