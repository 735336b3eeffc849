"""Shared parts of the readers of text logs: from a layout and column names to a table."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Column, RejectedRow, Source, Table
from mrfit.ingest.text.body import NUMBER_ROW, Body, Layout, is_cut, number_pattern, read_body, split
from mrfit.ingest.text.head import Head, Text, body_view, feeds
from mrfit.ingest.text.layout import is_called_time
from mrfit.ingest.text.printed import Digits, digits_of

BLANK = b" \t\r\0"
DIGIT_ROWS = 256
"""Rows by which it is seen how columns are printed."""


@dataclass(frozen=True, slots=True)
class Field:
    """A column of a text log that is read: header name, unit text or None, place in the row."""

    name: str
    unit: str | None
    index: int


def meta_of(head: Head, stop: int, delimiter: str = ",") -> dict[str, list[str]]:
    """Return the ``name,value,value…`` lines of a header by lower-case name without trailing ``=`` or ``:``."""
    meta: dict[str, list[str]] = {}
    for line in head.lines[:stop]:
        fields = split(line, delimiter)
        if fields[0]:
            meta.setdefault(fields[0].rstrip("=: ").lower(), fields[1:])
    return meta


def first_of(meta: Mapping[str, Sequence[str]], name: str, otherwise: str) -> str:
    """Return the first value of a line of a header, or another text where that is empty or there is none."""
    return next(iter(meta.get(name, [])), "") or otherwise


def positive(texts: Sequence[str]) -> float | None:
    """Return the first text as a positive number, or None."""
    found = units.quantity(texts[0]) if texts else None
    return found[0] if found and found[0] > 0.0 else None


def fields_at(head: Head, line: int, delimiter: str) -> list[str]:
    """Return the fields of a line (index from 0), trailing empty ones left out."""
    fields = split(head.lines[line], delimiter) if line < len(head.lines) else []
    while fields and not fields[-1]:
        fields.pop()
    return fields


def check_width(head: Head, line: int, delimiter: str, expected: int) -> int:
    """Return the number of fields of the first full data row, empty ones counted, if it fills ``expected`` columns.

    Raises
    ------
    Refusal
        If there is no data row, or it has other columns than the header names.
    """
    if line >= len(head.lines) or not head.lines[line].strip():
        raise Refusal(head.path, f"no data row after its header (line {line + 1})", "copy the log again")
    filled = len(fields_at(head, line, delimiter))
    for place in range(line, min(line + 200, len(head.lines))):
        filled = max(filled, len(fields_at(head, place, delimiter)))
        if filled >= expected:
            break
    if filled != expected:
        raise Refusal(
            head.path,
            f"the header names {expected} columns but line {line + 1} has {filled} ('{excerpt(head.lines[line])}')",
            "check its delimiter and decimal mark, and export the log again",
        )
    return max(expected, len(split(head.lines[place], delimiter)))


def read_table(source: Source, layout: Layout, fields: Sequence[Field], time: Field | None = None) -> Table:
    """Return the table of a text log: the named fields as columns.

    Raises
    ------
    Refusal
        If it has no data row.
    """
    body = body_of(source, layout)
    return table_of(body, fields, time)


def read_columns(
    source: Source,
    first: int,
    fields: Sequence[Field],
    time: Field | None,
    header: Sequence[str] = (),
    marks: tuple[str, str] = (",", "."),
) -> Table:
    """Return the table of a log in which every column from the left on is a field, and none stands beside them.

    Parameters
    ----------
    first
        Line (from 0) of the first row.
    fields, time
        Columns, and which of them is the time.
    header
        Lines by which a repeated header is known.
    marks
        Delimiter and decimal mark.
    """
    number = len(fields)
    width = check_width(source.head, first, marks[0], number)
    known = frozenset(line.strip() for line in header if line.strip())
    layout = Layout(first, *marks, width, tuple(range(number)), blank=tuple(range(number, width)), header=known)
    return read_table(source, layout, [f for f in fields if f is not time], time)


def found_line(head: Head, line: int | None, missing: str) -> int:
    """Return the place of a line of the header.

    Raises
    ------
    Refusal
        If there is none.
    """
    if line is None:
        raise Refusal(head.path, f"no {missing} in its header", "export the log again")
    return line


def text_of(source: Source) -> Text:
    """Return the text to read: the whole file or a block of it."""
    return body_view(source.head) if source.block is None else source.block.data


def rewritten(
    source: Source, lines: Iterable[str], change: Callable[[str], str], data: Text | None = None
) -> tuple[Source, bytes]:
    """Return a log with other lines in its head, and its text (``data``, where it is rewritten already) changed."""
    encoding = source.head.body_encoding
    text = (text_of(source) if data is None else data)[:].decode(encoding, errors="surrogateescape")
    part = replace(source, head=replace(source.head, lines=tuple(lines)))
    return part, change(text).encode(encoding, errors="surrogateescape")


def line_by_line(source: Source, plain: Callable[[str], str], data: Text | None) -> tuple[Source, bytes]:
    """Return a log, and its text, with each line as a function gives it."""
    lines = map(plain, source.head.lines)
    return rewritten(source, lines, lambda text: "\n".join(map(plain, text.split("\n"))), data)


def without_headers(
    source: Source, first_row: int, begins: Callable[[bytes], bool], ends: Callable[[bytes], bool]
) -> tuple[bytes, tuple[int, ...]]:
    """Return the text with all headers blanked, and the line numbers of the last lines of the later ones.

    ``first_row`` is the line (from 0) below the first header; what begins one and comes upon a row is none.
    """
    first = source.block.line if source.block else 1
    lines = text_of(source)[:].split(b"\n")
    top = max(0, first_row + 1 - first)
    lines[:top] = [b""] * len(lines[:top])
    heads: list[int] = []
    begin: int | None = None
    for place, line in enumerate(lines[top:], start=top):
        begin = place if begin is None and begins(line) else begin
        lines[place] = line if line.strip(BLANK) or not begins(line) else b""  # of NUL bytes
        if begin is not None and ends(line):
            lines[begin : place + 1] = [b""] * (place + 1 - begin)
            heads.append(first + place)
        if begin is not None and (ends(line) or NUMBER_ROW.match(line)):
            begin = None
    return b"\n".join(lines), tuple(heads)


def time_place(names: Sequence[str], written: Sequence[str]) -> int | None:
    """Return the place of the first column that is named as a time, or else is in a unit of time."""
    timed = [k for k, u in enumerate(written) if units.compatible(u, "s")]
    named = [k for k, (name, unit) in enumerate(zip(names, written, strict=True)) if is_called_time(name, unit)]
    return next(iter(named + timed), None)


def body_of(source: Source, layout: Layout, data: Text | None = None) -> Body:
    """Return the rows of a text log, or of ``data`` where its headers have been blanked already.

    Raises
    ------
    Refusal
        If there are none.
    """
    block = source.block
    data = text_of(source) if data is None else data
    encoding = source.head.body_encoding
    body = read_body(data, layout, encoding, 1 if block is None else block.line)
    body.digits = _digits(source.head, layout)
    if (block is None or block.last) and is_cut(data, layout, encoding, block.before if block else b""):
        _leave_out_last(body, (block.line if block else 1) + feeds(data, 0, len(data)))
    if block is None:
        check_rows(source.head, len(body.lines), body.refused)
    return body


def _leave_out_last(body: Body, line: int) -> None:
    """Refuse the last row, if it was kept, since its last number is cut."""
    if not len(body.lines) or body.lines[-1] != line:
        return
    body.open_line = line
    body.lines = body.lines[:-1]
    body.numbers = {c: v[:-1] for c, v in body.numbers.items()}
    body.texts = {c: t[:-1] for c, t in body.texts.items()}
    body.refused.append(RejectedRow("cut-off row", line))


def _digits(head: Head, layout: Layout) -> dict[int, Digits | None]:
    """Return the forms in which the columns are printed, seen in some rows of the head."""
    lines = head.lines[layout.skip :]
    rows = [split(line, layout.delimiter) for line in lines[:: max(1, len(lines) // DIGIT_ROWS)]]
    number = number_pattern(layout.decimal)
    full = [r for r in rows if all(c < len(r) and number.fullmatch(r[c]) for c in layout.use)]
    return {c: digits_of([r[c] for r in full]) for c in layout.use}


def check_rows(head: Head, rows: int, refused: Sequence[RejectedRow]) -> None:
    """Refuse a log of which no row can be kept."""
    if rows:
        return
    told = f" ({refused[0].kind} in line {refused[0].line})" if refused else ""
    raise Refusal(head.path, f"no row of numbers after its header{told}", "copy or export the log again")


def table_of(body: Body, fields: Sequence[Field], time: Field | None = None) -> Table:
    """Return the table of rows already read."""
    columns = tuple(Column(f.name, f.unit, body.numbers[f.index], f.index) for f in fields)
    clock = None
    if time:
        clock = Column(time.name, time.unit, body.numbers[time.index], time.index, body.digits.get(time.index))
    return Table(
        columns,
        body.lines,
        time=clock,
        refused=tuple(body.refused),
        open_line=body.open_line,
        comments=tuple(body.comments),
    )


def side_by_side(tables: Sequence[Table]) -> Table | None:
    """Return tables of one time base as one with all their columns, or None if their times differ."""
    tables = [_whole_rows(t) for t in tables]
    first = tables[0]
    common = first.lines
    for table in tables[1:]:
        common = np.intersect1d(common, table.lines)
    masks = [np.isin(t.lines, common) for t in tables]
    for table, mask in zip(tables, masks, strict=True):
        if not _same_times(first, masks[0], table, mask):
            return None
    columns = [replace(c, values=c.values[m]) for t, m in zip(tables, masks, strict=True) for c in t.columns]
    time = first.time and replace(first.time, values=first.time.values[masks[0]])
    lost = {r.line: r for t in tables for r in t.refused}
    for table in tables:
        for line in np.setdiff1d(table.lines, common):
            lost.setdefault(int(line), RejectedRow("no row of another channel", int(line)))
    findings = tuple(dict.fromkeys(f for t in tables for f in t.findings))
    return replace(
        first,
        columns=tuple(columns),
        lines=common,
        time=time,
        refused=tuple(lost[k] for k in sorted(lost)),
        findings=findings,
    )


def _whole_rows(table: Table) -> Table:
    """Refuse the rows of a table that lack a number."""
    values = [c.values for c in table.columns] + ([table.time.values] if table.time else [])
    mask = ~np.logical_or.reduce([np.isnan(v) for v in values])
    if mask.all():
        return table
    lost = tuple(RejectedRow("empty value", int(n)) for n in table.lines[~mask])
    return table.cut(lambda v: v[mask], tuple(sorted((*table.refused, *lost), key=lambda r: r.line)))


def _same_times(first: Table, mine: np.ndarray, other: Table, its: np.ndarray) -> bool:
    if first.dt != other.dt or (first.time is None) != (other.time is None):
        return False
    if abs(first.rows - other.rows) > 0.5 * first.rows:
        return False
    if first.time is None or other.time is None:
        return first.start == other.start
    apart = np.abs(first.time.values[mine] - other.time.values[its])
    step = float(np.median(np.abs(np.diff(first.time.values)))) if first.rows > 1 else 0.0
    return bool(np.all(apart <= 0.01 * step))
