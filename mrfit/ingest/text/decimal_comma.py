"""Rows whose decimal mark is the comma that parts their fields, too: ``0,0413,2,9999`` are two numbers, not four.

No whole number is printed as ``0413``, nor as ``-0``; where a log has such fields in every second column, and no sign
there, these are decimals.
"""

import re
from collections import Counter

from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import Head, Text
from mrfit.ingest.text.textlog import rewritten

WHOLE_PART, DECIMAL_PART = r"[+-]?\d+", r"\d+(?:[eE][+-]?\d+)?"
PAIRS = re.compile(rf"[ \t]*{WHOLE_PART},{DECIMAL_PART}(?:,[ \t]*{WHOLE_PART},{DECIMAL_PART})*[ \t]*,?[ \t]*\r?")
PAIRED = re.compile(rf"({WHOLE_PART}),({DECIMAL_PART})(,?)")
BEGINS_WITH_NUMBER = re.compile(r"[ \t]*[+-]?\d")
SURE = 0.9
"""Least share of rows that are pairs, with as many fields each."""


def pairs_in(head: Head) -> int:
    """Return the count of numbers with decimal commas in the rows of a log; 0 where the commas only part fields.

    Raises
    ------
    Refusal
        If some rows have them and others do not.
    """
    rows = [line for line in head.lines if BEGINS_WITH_NUMBER.match(line)]
    of_rows = [_width(line) for line in rows]
    widths = Counter(of_rows)
    width, count = max(((w, n) for w, n in widths.items() if w), key=lambda item: item[1], default=(0, 0))
    if 2 * count < len(rows) or not width:
        return 0
    whole = [line for line, own in zip(rows, of_rows, strict=True) if own == width]
    pairs = [line.strip().rstrip(",").split(",") for line in whole]
    columns = [[p[k].strip() for p in pairs] for k in range(2 * width)]
    if any(_is_padded(c) for column in columns[::2] for c in column):
        return 0
    named = any(_names(line) == width for line in head.lines)
    if not (named and count > 1 or any(_is_padded(c) for column in columns[1::2] for c in column)):
        return 0
    if count < SURE * len(rows):
        what = f"{len(rows) - count} of {len(rows)} rows do not have the decimal commas of the others"
        raise Refusal(head.path, f"{what} ('{excerpt(rows[0])}')", "export it with decimal points or semicolons")
    return width


def _width(line: str) -> int:
    """Return of how many pairs a row consists; 0 if of none."""
    return (line.strip().rstrip(",").count(",") + 1) // 2 if PAIRS.fullmatch(line) else 0


def _is_padded(text: str) -> bool:
    return len(text.lstrip("+-")) > 1 and text.lstrip("+-").startswith("0")


def _names(line: str) -> int:
    """Return the number of cells of a line that holds no number."""
    cells = [c.strip() for c in line.split(",")]
    return len(cells) if len(cells) > 1 and all(c and not BEGINS_WITH_NUMBER.match(c) for c in cells) else 0


def with_points(source: Source, width: int, data: Text | None = None) -> tuple[Source, bytes]:
    """Return a log of so many pairs a row with decimal points and semicolons: its head, and its text.

    A row of more or fewer stays as it is, without a semicolon: it is refused. ``data`` is the text where it was
    rewritten before.
    """

    def row(text: str) -> str:
        return PAIRED.sub(lambda m: f"{m[1]}.{m[2]}" + (";" if m[3] else ""), text)

    def body(text: str) -> str:
        return "\n".join(row(x) if _width(x) == width else x for x in text.split("\n"))

    lines = (row(x) if _width(x) == width else x.replace(",", ";") for x in source.head.lines)
    return rewritten(source, lines, body, data)
