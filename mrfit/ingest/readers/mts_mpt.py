"""MTS 793 MultiPurpose TestWare (MPT): the first line states language and decimal mark; headers per block."""

from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import Layout, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.headings import Heading
from mrfit.ingest.text.textlog import BLANK, Field, body_of, table_of, time_place, without_headers
from mrfit.ingest.text.two_rows import two_rows

SPEC = ReaderSpec("mts-mpt", "MTS 793 MultiPurpose TestWare text", blocks=True)
DECIMAL_ROWS = 50
DECIMAL_PLACE = 5  # MTS793|MPT|ENU|1|2|.|/|:|…


def sniff(head: Head) -> bool:
    """Whether the first line is ``MTS…|MPT|…``."""
    return head.starts("MTS") and "|MPT|" in head.lines[0].upper()


def heading(head: Head) -> Heading | None:
    """Return the names and units of the first header; None if there is none."""
    found = two_rows(head)
    return Heading(tuple(found.names), tuple(found.units), "\t") if found else None


def read(source: Source) -> list[Table]:
    """Return the table; every block is a run of its own.

    Raises
    ------
    Refusal
        If no name row and unit row stand above numbers, or no column is a time.
    """
    head = source.head
    header = two_rows(head)
    if header is None:
        raise Refusal(head.path, "no unit row above its numbers", "export the log again")
    names, written = header.names, header.units
    if (time := time_place(names, written)) is None:
        shown = ", ".join(f"'{n}'" for n in names)
        raise Refusal(head.path, f"none of its columns is a time ({shown})", "export the log again with its time")
    # the first header ends above its first row; a later one is all between a blank line and the same unit row
    unit_row = head.lines[header.unit_row].encode(head.body_encoding, "replace").strip()
    data, heads = without_headers(
        source, header.first, lambda line: not line.strip(BLANK), lambda line: line.strip(BLANK) == unit_row
    )
    width = len(split(head.lines[header.first], "\t"))
    layout = Layout(0, "\t", _decimal(head, header.first), width, tuple(range(len(names))), comment="")
    body = body_of(source, layout, data)
    fields = [Field(names[k], written[k], k) for k in range(len(names))]
    table = table_of(body, [f for f in fields if f.index != time], fields[time])
    return [replace(table, breaks=heads)]


def _decimal(head: Head, row: int) -> str:
    """Return the decimal mark that the first rows have; if they have none, the one the first line states."""
    shown = {mark for line in head.lines[row : row + DECIMAL_ROWS] for mark in ".," if mark in line}
    stated = head.lines[0].split("|")
    if len(shown) != 1 and len(stated) > DECIMAL_PLACE and stated[DECIMAL_PLACE] in (".", ","):
        return stated[DECIMAL_PLACE]
    return "," if shown == {","} else "."
