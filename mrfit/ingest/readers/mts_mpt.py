"""MTS 793 MultiPurpose TestWare (MPT): the first line states language and decimal mark; headers per block."""

from dataclasses import replace

from mrfit.ingest import units
from mrfit.ingest.body import ROW, Layout, number_pattern, split
from mrfit.ingest.head import Head
from mrfit.ingest.layout import TIME_NAMES
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.textlog import Field, body_of, table_of, text_of
from mrfit.specs import ReaderSpec

SPEC = ReaderSpec("mts-mpt", "MTS 793 MultiPurpose TestWare text")
DECIMAL_PLACE = 5  # MTS793|MPT|ENU|1|2|.|/|:|…


def sniff(head: Head) -> bool:
    """Whether the first line is ``MTS…|MPT|…``."""
    return head.starts("MTS") and "|MPT|" in head.lines[0].upper()


def read(source: Source) -> list[Table]:
    """Return the table; every block is a run of its own.

    Raises
    ------
    Refusal
        If no name row and unit row stand above numbers.
    """
    head = source.head
    row = _unit_line(head)
    if row is None:
        raise Refusal(head.path, "no unit row above its numbers", "export the log again")
    names, written = _cells(head.lines[row - 1]), _cells(head.lines[row])
    time = next((k for k, n in enumerate(names) if n.lower() in TIME_NAMES), None)
    time = time if time is not None else next((k for k, u in enumerate(written) if units.compatible(u, "s")), None)
    if len(names) != len(written) or time is None:
        raise Refusal(head.path, f"its {len(names)} names and {len(written)} units do not fit", "export the log again")
    data, heads = _without_headers(source, row)
    width = len(split(head.lines[row + 1], "\t"))
    layout = Layout(0, "\t", _decimal(head, row + 1), width, tuple(range(len(names))), comment="")
    body = body_of(source, layout, data)
    fields = [Field(names[k], written[k], k) for k in range(len(names))]
    table = table_of(body, [f for f in fields if f.index != time], fields[time])
    return [replace(table, breaks=heads)]


def _cells(line: str) -> list[str]:
    cells = split(line, "\t")
    while cells and not cells[-1]:
        cells.pop()
    return cells


def _unit_line(head: Head) -> int | None:
    """Return the first line of units that stands above a line of as many numbers."""
    for place in range(1, len(head.lines) - 1):
        cells = _cells(head.lines[place])
        if len(cells) < 2 or not all(units.known(c) for c in cells):
            continue
        below = _cells(head.lines[place + 1])
        if len(below) == len(cells) and all(_numeric(b) for b in below):
            return place
    return None


def _numeric(text: str) -> bool:
    return bool(number_pattern(".").fullmatch(text) or number_pattern(",").fullmatch(text))


def _decimal(head: Head, row: int) -> str:
    """Return the decimal mark the first line states; if it is masked, the one the numbers have."""
    stated = head.lines[0].split("|")
    if len(stated) > DECIMAL_PLACE and stated[DECIMAL_PLACE] in (".", ","):
        return stated[DECIMAL_PLACE]
    return "," if any("," in c for c in _cells(head.lines[row])) else "."


def _without_headers(source: Source, row: int) -> tuple[bytes, tuple[int, ...]]:
    """Return the data with every header line blanked, and the line numbers of the unit rows.

    The first header ends with line ``row``; a later one is all between a blank line and the unit row that is no data.
    """
    head, first = source.head, source.block.line if source.block else 1
    encoding = "utf-8" if head.encoding.startswith("utf-16") else head.encoding
    unit_row = head.lines[row].encode(encoding, "replace").strip()
    lines = text_of(source)[:].split(b"\n")
    top = max(0, row + 2 - first)
    lines[:top] = [b""] * len(lines[:top])
    heads: list[int] = []
    begin: int | None = None
    for place, line in enumerate(lines[top:], start=top):
        stripped = line.strip()
        if not stripped:
            begin = place if begin is None else begin
        elif begin is not None and stripped == unit_row:
            lines[begin : place + 1] = [b""] * (place + 1 - begin)
            heads.append(first + place)
            begin = None
        elif begin is not None and ROW.match(stripped):
            begin = None
    return b"\n".join(lines), tuple(heads)
