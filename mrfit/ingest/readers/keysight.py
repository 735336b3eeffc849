"""Keysight and Agilent InfiniiVision oscilloscopes: ``x-axis,1,2,4`` above ``second,Volt,Volt,Volt``."""

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, fields_at, read_columns

SPEC = ReaderSpec("keysight", "Keysight/Agilent InfiniiVision oscilloscope CSV", blocks=True)


def sniff(head: Head) -> bool:
    """Whether the first two lines are this instrument's header."""
    return head.starts("x-axis,") and [f.lower() for f in fields_at(head, 1, ",")[:1]] == ["second"]


def read(source: Source) -> list[Table]:
    """Return the record; its first rows may have a time and no values.

    Raises
    ------
    Refusal
        If the rows do not fit the header.
    """
    head = source.head
    names, written = fields_at(head, 0, ","), fields_at(head, 1, ",")
    fields = [
        Field(f"CH{name}" if name.isdigit() else name, written[k] if k < len(written) else "V", k)
        for k, name in enumerate(names)
    ]
    return [read_columns(source, 2, fields, fields[0], head.lines[:2])]
