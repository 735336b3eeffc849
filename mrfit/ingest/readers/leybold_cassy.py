"""Leybold CASSY Lab: ``MIN= MAX= SCALE= DEC= DEF=`` lines; quantity, symbol and unit inside DEF; decimal comma."""

import re

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import Layout, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import find_grid
from mrfit.ingest.text.textlog import Field, check_width, found_line, read_table

SPEC = ReaderSpec("leybold-cassy", "Leybold CASSY Lab text", blocks=True)
QUANTITY = re.compile(r'"([^"]*)"\s*(\S*)\s*(?:/\s*(.*))?')


def sniff(head: Head) -> bool:
    """Whether the first lines are MIN=, MAX= and, within ten lines, DEF=."""
    return head.starts("MIN=", "MAX=", "SCALE=", "DEC=") and _definition(head) is not None


def _definition(head: Head) -> int | None:
    return next((k for k, line in enumerate(head.lines[:10]) if line.upper().startswith("DEF=")), None)


def read(source: Source) -> list[Table]:
    """Return the table; the first quantity is time.

    Raises
    ------
    Refusal
        If DEF= names no time.
    """
    head = source.head
    row = found_line(head, _definition(head), "DEF= line")
    fields = [_field(cell, k) for k, cell in enumerate(head.lines[row][4:].split("\t"))]
    if not fields[0].unit:
        raise Refusal(head.path, "its DEF= line gives the first quantity no unit", "export the log again")
    decimal = find_grid(head, row + 1).decimal
    width = check_width(head, row + 1, "\t", len(fields))
    layout = Layout(row + 1, "\t", decimal, width, tuple(range(len(fields))))
    return [read_table(source, layout, fields[1:], fields[0])]


def _field(cell: str, index: int) -> Field:
    """Return name and unit of a definition such as ``"Weg" s_A1 / m``."""
    match = QUANTITY.fullmatch(cell.strip())
    if match is None:
        return Field(split(cell, "\t")[0], None, index)
    return Field(match[1] or match[2], (match[3] or "").strip() or None, index)
