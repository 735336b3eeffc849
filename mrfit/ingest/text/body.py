"""The body of a delimited text log: numbers in bulk where it is sound, line by line and counted where it is not."""

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import takewhile
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.ingest.table import Lines, RejectedRow
from mrfit.ingest.text.head import TAIL_BYTES, Text, feeds
from mrfit.ingest.text.printed import Digits, digits_of
from mrfit.io.arrow import floats

LINE_BY_LINE_BYTES = 8192
BLANKS = "\x1f"  # stands for a run of blanks while pyarrow splits
EMPTY_FIELDS = ("", " ", "  ")
NUMBER_ROW = re.compile(rb'[\s,;|"]*[+-]?[.,]?\d')
"""How a row of numbers begins, and a line of a header does not."""
ALL_DIGITS = 15
"""Significant digits of a double."""
NOT_A_NUMBER = ("nan", "NaN", "NAN", "NA", "N/A", "n/a", "#N/A", "null", "NULL", "None", "--", "---")
NO_VALUE = (*EMPTY_FIELDS, *NOT_A_NUMBER)
SHEET_ERRORS = ("#REF!", "#DIV/0!", "#VALUE!", "#NUM!", "#NAME?", "#NULL!", "#SPILL!", "#CALC!")
"""What a spreadsheet writes in place of a number that it cannot compute."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Places of the numbers of a text log.

    Attributes
    ----------
    skip
        Lines before the first data row.
    delimiter
        One character, or the empty string for runs of blanks.
    decimal
        Decimal mark.
    width
        Fields of a full data row.
    use
        Columns read as numbers.
    texts
        Columns returned as text (time stamps, events).
    optional
        Columns that short rows may lack.
    blank
        Columns in which nothing may stand.
    header
        Stripped header lines, by which a repeated header is known.
    comment
        Characters that begin a comment line.
    """

    skip: int
    delimiter: str
    decimal: str
    width: int
    use: tuple[int, ...]
    texts: tuple[int, ...] = ()
    optional: tuple[int, ...] = ()
    blank: tuple[int, ...] = ()
    header: frozenset[str] = frozenset()
    comment: str = "#"


@dataclass(slots=True)
class Body:
    """Rows of a text log: numbers and texts by column, their line numbers, and the rows left out.

    ``digits`` says how columns are printed, ``comments`` gives the line numbers of comments. ``open_line`` is the
    number of the last line if it was left out because the file ends inside its last number; else 0.
    """

    numbers: dict[int, Array]
    lines: Lines
    texts: dict[int, list[str]] = field(default_factory=dict)
    refused: list[RejectedRow] = field(default_factory=list)
    open_line: int = 0
    digits: dict[int, Digits | None] = field(default_factory=dict)
    comments: list[int] = field(default_factory=list)


def is_cut(data: Text, layout: Layout, encoding: str = "utf-8", before: bytes = b"") -> bool:
    """Whether the file ends inside the last number of its last row, or may do so.

    A number with the decimals that all others of its column have is whole. Where they vary, one shorter than the
    longest may be cut. ``before`` is what stands above ``data``.
    """
    if not data or data[-1:] in b"\r\n \t\x1a":
        return False
    tail = (before + data[-TAIL_BYTES:])[-TAIL_BYTES:]
    *above, last = tail.decode(encoding, errors="replace").split("\n")
    column = max(layout.use, default=0)
    fields = split(last, layout.delimiter)
    if len(fields) <= column:
        return False
    whole = len(fields) > column + 1  # a delimiter stands behind it, unless that is a decimal comma
    if last.count('"') % 2:
        return True
    number = number_pattern(layout.decimal)
    rows = [split(line, layout.delimiter) for line in above[len(tail) >= TAIL_BYTES :]]
    # a row of more fields, as with a stray comma for a point, is not printed like the others
    others = [r[column] for r in rows if column < len(r) <= layout.width and number.fullmatch(r[column])]
    if not others:
        return False
    form = digits_of(others)
    digits = re.sub(r"\D", "", fields[column]).lstrip("0")
    if len(digits) >= ALL_DIGITS and not any("e" in o.lower() for o in others):
        return False  # what may be missing does not change the number
    if form is None or form.decimals == 0:
        return not whole and len(fields[column]) < max(len(o) for o in others)
    own = digits_of([fields[column]])
    same_power = not form.scientific or _power_length(fields[column]) in {_power_length(o) for o in others}
    return own is None or own.decimals < form.decimals or own.scientific != form.scientific or not same_power


def _power_length(text: str) -> int:
    return len(text) - max(text.rfind("e"), text.rfind("E"))


def read_body(data: Text, layout: Layout, encoding: str = "utf-8", line: int = 1) -> Body:
    """Return the rows of a text log, or of a part of it that begins with line number ``line``.

    Every line after ``layout.skip`` that is not blank is a row, kept or refused, or a comment, which is counted.
    """
    skip = max(0, layout.skip + 1 - line)
    start = _offset(data, skip)
    stop = _last_content(data)
    parts = list(_parts(data, (start, max(start, stop)), line + skip, layout, encoding))
    if len(parts) == 1:
        return parts[0]
    return Body(
        {c: np.concatenate([p.numbers[c] for p in parts] or [np.empty(0)]) for c in layout.use},
        np.concatenate([p.lines for p in parts] or [np.empty(0, np.int64)]),
        {c: [t for p in parts for t in p.texts[c]] for c in layout.texts},
        [r for p in parts for r in p.refused],
        comments=[k for p in parts for k in p.comments],
    )


def lines_below(data: Text, encoding: str) -> list[str]:
    """Return the lines below the last row of numbers of a text."""
    lines = data[-TAIL_BYTES:].decode(encoding, errors="replace").splitlines()
    return [*takewhile(lambda line: not NUMBER_ROW.match(line.encode()), reversed(lines))][::-1]


def _offset(data: Text, skip: int) -> int:
    position = 0
    for _ in range(skip):
        position = data.find(b"\n", position) + 1
        if position == 0:
            return len(data)
    return position


def _last_content(data: Text) -> int:
    end = len(data)
    while end and data[end - 1] in b" \t\r\n\x1a":
        end -= 1
    while end < len(data) and data[end] in b" \t":  # the last row's own: an empty last field
        end += 1
    return end


def _parts(data: Text, span: tuple[int, int], line: int, layout: Layout, encoding: str) -> Iterator[Body]:
    """Yield rows in order: the whole span at once if sound, else halves, down to single lines."""
    start, stop = span
    if start >= stop:
        return
    sound = _in_bulk(data, span, line, layout)
    if sound is not None:
        yield sound
        return
    middle = data.find(b"\n", (start + stop) // 2, stop) + 1
    if stop - start <= LINE_BY_LINE_BYTES or middle in (0, stop):
        yield _line_by_line(data[start:stop], line, layout, encoding)
        return
    yield from _parts(data, (start, middle), line, layout, encoding)
    yield from _parts(data, (middle, stop), line + feeds(data, start, middle), layout, encoding)


def _in_bulk(data: Text, span: tuple[int, int], line: int, layout: Layout) -> Body | None:
    """Return the rows if every line of the span is one sound row, else None."""
    start, stop = span
    if data.find(b"\0", start, stop) >= 0:  # a text may hold one, which only a line read by itself says
        return None
    view, delimiter = memoryview(data)[start:stop], layout.delimiter
    if not delimiter:
        view, delimiter = memoryview(_one_blank(data[start:stop])), BLANKS
    rows = feeds(data, start, stop) + (data[stop - 1 : stop] != b"\n")
    for width in _widths(layout):
        table = _arrow_table(view, delimiter, layout, width)
        if table is None or table.num_rows != rows:
            continue
        numbers = {c: floats(table.column(f"f{c}")) for c in layout.use}
        if _any_without_number(numbers):
            continue
        texts = {c: _texts(table, f"f{c}", rows) for c in layout.texts}
        return Body(numbers, np.arange(line, line + rows, dtype=np.int64), texts)
    return None


def _any_without_number(numbers: dict[int, Array]) -> bool:
    """Return whether a row has no number at all: it may be an empty row, which in bulk looks like missing values."""
    columns = iter(numbers.values())
    missing = np.isnan(next(columns, np.empty(0)))
    for column in columns:
        if not missing.any():
            return False
        missing &= np.isnan(column)
    return bool(missing.any())


def _widths(layout: Layout) -> tuple[int, ...]:
    """Return the numbers of fields a row may have: all, or all but the optional ones at its end."""
    short = layout.width - len(layout.optional)
    needed = (*layout.use, *layout.blank, *(c for c in layout.texts if c not in layout.optional))
    at_end = all(c >= short for c in layout.optional) and all(c < short for c in needed)
    return (layout.width, short) if layout.optional and at_end else (layout.width,)


def _arrow_table(view: memoryview, delimiter: str, layout: Layout, width: int) -> Any:
    """Return rows of exactly ``width`` fields as pyarrow reads them, or None."""
    import pyarrow as pa
    from pyarrow import csv as arrow

    types = {f"f{c}": pa.float64() for c in layout.use} | {f"f{c}": pa.string() for c in layout.texts if c < width}
    types |= {f"f{c}": pa.null() for c in layout.blank}
    try:
        return arrow.read_csv(
            pa.py_buffer(view),
            arrow.ReadOptions(column_names=[f"f{i}" for i in range(width)]),
            arrow.ParseOptions(delimiter=delimiter),
            arrow.ConvertOptions(
                column_types=types,
                include_columns=list(types),
                null_values=list(NO_VALUE),
                decimal_point=layout.decimal,
            ),
        )
    except pa.ArrowInvalid:
        return None


def _texts(table: Any, name: str, rows: int) -> list[str]:
    if name not in table.column_names:
        return [""] * rows
    return [(text or "").strip(" \t\r\n") for text in table.column(name).to_pylist()]


def _one_blank(text: bytes) -> bytes:
    text = re.sub(rb"(?m)^[ \t]+|[ \t\r]+$", b"", text)
    return re.sub(rb"[ \t]+", BLANKS.encode(), text)


@cache
def number_pattern(decimal: str) -> re.Pattern[str]:
    """Return the pattern of a number with the given decimal mark, as the bulk parser sees it."""
    mark = re.escape(decimal)
    return re.compile(rf"[+-]?(?:\d+{mark}?\d*|{mark}\d+)(?:[eE][+-]?\d+)?|[+-]?(?:inf|infinity|∞)", re.ASCII | re.I)


def split(line: str, delimiter: str) -> list[str]:
    """Return the fields of a line, stripped of blanks and quotes."""
    if not delimiter:
        fields = re.split(r"[ \t]+", line.strip(" \t\r\n"))
        return [f[1:-1] if len(f) > 1 and f[0] == f[-1] == '"' else f for f in fields]
    if '"' in line:
        try:
            fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
        except csv.Error:
            fields = line.split(delimiter)
    else:
        line = line.strip("\r\n")
        fields = line.split(delimiter)
        if " " not in line and "\t" not in line and "\r" not in line:
            return fields
    return [f.strip(" \t\r\n") for f in fields]


def _line_by_line(text: bytes, line: int, layout: Layout, encoding: str) -> Body:
    kept: list[list[float]] = []
    texts: list[list[str]] = []
    lines: list[int] = []
    refused: list[RejectedRow] = []
    comments: list[int] = []
    number = number_pattern(layout.decimal)
    raw_lines = text.removesuffix(b"\n").split(b"\n")
    for place, raw in enumerate(raw_lines, start=line):
        content = raw.decode(encoding, errors="replace").rstrip("\r\x1a")  # a DOS end mark
        stripped = content.strip()
        if not stripped:
            continue
        row = _row(content, stripped, layout, number)
        if isinstance(row, str):
            if layout.comment and stripped[0] in layout.comment and not _is_damaged_row(content, layout, number):
                comments.append(place)
            else:
                refused.append(RejectedRow(row, place))
            continue
        kept.append(row[0])
        texts.append(row[1])
        lines.append(place)
    values = np.array(kept, dtype=np.float64).reshape(len(kept), len(layout.use))
    return Body(
        {c: values[:, k].copy() for k, c in enumerate(layout.use)},
        np.array(lines, dtype=np.int64),
        {c: [t[k] for t in texts] for k, c in enumerate(layout.texts)},
        refused,
        comments=comments,
    )


def _is_damaged_row(content: str, layout: Layout, number: re.Pattern[str]) -> bool:
    """Whether a line that begins as a comment does is a row with an unreadable first field."""
    if content.strip().startswith(SHEET_ERRORS):
        return True
    fields = split(content, layout.delimiter)
    if content.strip() in layout.header or not max(layout.use, default=0) < len(fields) <= layout.width:
        return content.strip() in layout.header
    others = [fields[c] for c in layout.use if c > 0]
    return any(others) and all(f in NO_VALUE or number.fullmatch(f) for f in others)


def _row(content: str, stripped: str, layout: Layout, number: re.Pattern[str]) -> tuple[list[float], list[str]] | str:
    """Return numbers and texts of one line, or what is wrong with it."""
    if "\0" in content:
        return "NUL byte"
    if stripped in layout.header:
        return "repeated header"
    fields = split(content, layout.delimiter)
    if not any(fields):
        return "empty row"
    if any(c not in layout.optional for c in (*layout.use, *layout.texts) if c >= len(fields)):
        return "short row"
    if any(fields[layout.width :]) or any(fields[c] not in NO_VALUE for c in layout.blank if c < len(fields)):
        return "long row"
    values = [_number(fields[c], number, layout.decimal) for c in layout.use]
    if any(v is None for v in values):
        return "not a number"
    return [v for v in values if v is not None], [fields[c] if c < len(fields) else "" for c in layout.texts]


def _number(field_text: str, number: re.Pattern[str], decimal: str) -> float | None:
    if field_text in NO_VALUE:
        return np.nan
    if not number.fullmatch(field_text):
        return None
    return float(field_text.replace(decimal, ".").replace("∞", "inf"))
