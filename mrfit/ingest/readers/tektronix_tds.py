"""Tektronix TDS oscilloscopes: one file per channel, its settings in columns 0-1 beside time and value in 3-4."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import Layout, number_pattern, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import OVERLOAD
from mrfit.ingest.text.textlog import Field, first_of, meta_of, positive, read_table, side_by_side

SPEC = ReaderSpec("tektronix-tds", "Tektronix TDS oscilloscope CSV, one file per channel", blocks=True)
TIME_FIELD, VALUE_FIELD = 3, 4
META_LINES = 20


def sniff(head: Head) -> bool:
    """Whether settings stand beside the first rows as these instruments write them."""
    return _first_row(head) is not None


def _first_row(head: Head) -> int | None:
    """Return the line of the first row; hand-edited files may have a title line before it."""
    number = number_pattern(".")
    for place, line in enumerate(head.lines[:3]):
        fields = split(line, ",")
        if fields[0].lower() != "record length" or len(fields) <= VALUE_FIELD:
            continue
        if any(number.fullmatch(fields[k]) for k in (TIME_FIELD, VALUE_FIELD)) or OVERLOAD.fullmatch(
            fields[VALUE_FIELD]
        ):
            return place
    return None


def part(head: Head) -> str | None:
    """Return the text that the files of one record share: the folder and the number in ``F0004CH1.CSV``."""
    match = re.fullmatch(r"(F\d{4})CH\d", head.path.stem, re.IGNORECASE)
    return f"{head.path.parent}/{match[1].upper()}" if match else None


def read(source: Source) -> list[Table]:
    """Return the channel of one file.

    Raises
    ------
    Refusal
        If its settings do not name the channel.
    """
    head = source.head
    first = _first_row(head)
    if first is None:
        raise Refusal(head.path, "no 'Record Length' in its first lines", "copy the log again")
    meta = meta_of(head, first + META_LINES)
    name, unit = first_of(meta, "source", head.path.stem[-3:]), first_of(meta, "vertical units", "V")
    width = len(split(head.lines[first], ","))
    blank = tuple(range(VALUE_FIELD + 1, width))
    layout = Layout(first, ",", ".", width, (TIME_FIELD, VALUE_FIELD), blank=blank)
    clock = Field("time", first_of(meta, "horizontal units", "s"), TIME_FIELD)
    table = read_table(source, layout, [Field(name, unit, VALUE_FIELD)], clock)
    rows, interval = (positive(meta.get(key, [])) for key in ("record length", "sample interval"))
    return [replace(table, stated_rows=rows, dt=interval)]


def join(tables: Sequence[Table]) -> list[Table]:
    """Return the channels of one record side by side; apart if their times differ."""
    joined = side_by_side(_from_line_one(tables))
    return [joined] if joined else list(tables)


def _from_line_one(tables: Sequence[Table]) -> list[Table]:
    """Count lines from the first row of each file, so that a hand-added title line does not shift a channel."""
    moved = []
    for table in tables:
        first = min([int(table.lines[0]), *(r.line for r in table.refused)]) - 1
        refused = tuple(replace(r, line=r.line - first) for r in table.refused)
        moved.append(replace(table, lines=table.lines - first, refused=refused))
    return moved
