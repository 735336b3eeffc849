"""LeCroy and Teledyne LeCroy oscilloscopes: one channel per file, known from the file's name only."""

import re
from collections.abc import Sequence
from dataclasses import replace

from mrfit.core.recording import Finding
from mrfit.core.specs import ReaderSpec
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.textlog import Field, found_line, read_columns, side_by_side

SPEC = ReaderSpec("lecroy", "LeCroy oscilloscope text, one file per channel", blocks=True)


def sniff(head: Head) -> bool:
    """Whether the first line names a LeCroy."""
    return head.starts("LECROY")


def part(head: Head) -> str | None:
    """Return the text that the channels of one acquisition share: ``C1Trace00000`` and ``C2Trace00000``."""
    match = re.fullmatch(r"(.*)C\d((?:--)?[A-Za-z]+.*?\d+)", head.path.stem)
    return f"{head.path.parent}/{match[1]}C*{match[2]}" if match else None


def read(source: Source) -> list[Table]:
    """Return the channel; segments of a sequence acquisition begin new runs.

    Raises
    ------
    Refusal
        If the header has no ``Time,Ampl`` row.
    """
    head = source.head
    row = next((k for k, line in enumerate(head.lines[:4096]) if line.lower().startswith("time,")), None)
    row = found_line(head, row, "'Time,Ampl' row")
    match = re.search(r"C(\d)(?:--)?[A-Za-z]", head.path.stem)
    name = f"CH{match[1]}" if match else "ampl"
    time = Field("Time", "s", 0)
    table = read_columns(source, row + 1, [time, Field(name, "V", 1)], time)
    segments, size = _segments(head)
    table = replace(table, stated_rows=segments * size if segments and size else None)
    if segments > 1 and size:
        table = replace(table, breaks=tuple(row + 2 + size * k for k in range(1, segments)))
    text = f"the file gives {name.lower()} no unit: taken as V; a channel map can say another"
    return [replace(table, findings=(*table.findings, Finding("unit-assumed", name.lower(), None, text)))]


def _segments(head: Head) -> tuple[int, int]:
    """Return the number of segments and the rows of each, from ``Segments,1,SegmentSize,100002``; 0 if unsaid."""
    for line in head.lines[:8]:
        fields = split(line, ",")
        if fields[0].lower() == "segments" and len(fields) >= 4 and fields[1].isdigit() and fields[3].isdigit():
            return int(fields[1]), int(fields[3])
    return 0, 0


def join(tables: Sequence[Table]) -> list[Table]:
    """Return the channels of one acquisition side by side; apart if their times differ."""
    joined = side_by_side(tables)
    return [joined] if joined else list(tables)
