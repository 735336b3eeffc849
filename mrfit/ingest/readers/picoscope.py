"""PicoScope: a name row, a row of units in brackets, a blank row; its time column may be called Frequency."""

import re

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.meaning import units
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import find_grid
from mrfit.ingest.text.textlog import Field, fields_at, read_columns

SPEC = ReaderSpec("picoscope", "PicoScope CSV and text", blocks=True)
PICOSCOPE_DELIMITERS = ("\t", ";", ",")


def sniff(head: Head) -> bool:
    """Whether the second line is all units in brackets, a time first, and the third is blank."""
    return _delimiter(head) is not None


def _delimiter(head: Head) -> str | None:
    if len(head.lines) < 3 or head.lines[2].strip():
        return None
    for delimiter in PICOSCOPE_DELIMITERS:
        cells = split(head.lines[1], delimiter)
        if len(cells) > 1 and all(re.fullmatch(r"\([^()]*\)", c) for c in cells):
            return delimiter if units.compatible(cells[0], "s") else None
    return None


def read(source: Source) -> list[Table]:
    """Return the record; the first column is time whatever its name, since its unit is one of time.

    Raises
    ------
    Refusal
        If the rows do not fit the header.
    """
    head = source.head
    delimiter = _delimiter(head) or ","
    names, written = fields_at(head, 0, delimiter), fields_at(head, 1, delimiter)
    decimal = find_grid(head, 3).decimal if delimiter != "," else "."
    names += [f"CH{k}" for k in range(len(names), len(written))]
    fields = [Field(names[k], written[k].strip("()"), k) for k in range(len(written))]
    return [read_columns(source, 3, fields, fields[0], head.lines[:2], (delimiter, decimal))]
