"""Rows and cells in wrappings of programs: a row in quotes or behind its number, a cell as a spreadsheet's formula."""

import re
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise, takewhile

from mrfit.ingest.text.body import NUMBER_ROW
from mrfit.ingest.text.labelled_numbers import LABEL, MOST_ROWS
from mrfit.ingest.text.layout import SAMPLE_LINES


def _timed(match: re.Match[str]) -> str:
    """Return a row with its time as the first cell, labelled as the others are; of the names, the name of the times."""
    row = match[2].strip()
    mark = next((m for m in "\t;," if m in row), " " if " " in row else ",")
    label = "time=" if LABEL.match(row) else ""
    return f"{label}{match[1]}{mark}{row}" if label or row[:1] in "+-.0123456789" else f"Time{mark}{row}"


ROW_NUMBER = re.compile(r"(?m:^)[ \t]*(\d+):[ \t]+(?=[^\s:])")
ROW_WRAPPINGS = (
    (re.compile(r'(?m:^)"([^"\n]*)"[ \t]*(?m:(?=\r?$))'), r"\1"),
    (re.compile(r'"=""([^"\n]*)"""|="([^"\n]*)"'), r"\1\2"),
    (ROW_NUMBER, ""),
    (re.compile(r"(?m:^)(\d\d:\d\d:\d\d\.\d+) -> (.*)"), _timed),
)
"""What most rows have, each another one, and what stands for it: the last is of the monitor of a serial port."""
OPEN_CELL = re.compile(r'(?:^|[,;\t|]) *"[^"]*$')
HEADER_BYTES, MOST_WRAPPED = 8192, 8
"""Beginning of a log in which cells of a header may go on in the next line, and most lines of such a row."""


def unwrapped(lines: Sequence[str]) -> Iterator[Callable[[str], str]]:
    """Yield functions that take the wrappings off the text of a log; they keep the number of its lines."""
    if any(map(OPEN_CELL.search, lines[:SAMPLE_LINES])):
        yield _with_whole_rows
    last = [line for line in lines[-SAMPLE_LINES:] if line.strip()]
    for form, plain in ROW_WRAPPINGS:
        found = [match for line in last if (match := form.search(line))]
        # numbers that rise by more than one may be times
        counts = form is not ROW_NUMBER or all(int(b[1]) - int(a[1]) == 1 for a, b in pairwise(found))
        if counts and len({match[0] for match in found}) >= max(1, MOST_ROWS * len(last)):
            yield partial(form.sub, plain)


def _with_whole_rows(text: str) -> str:
    """Return a text in which each row of the header stands in one line, and blank lines behind it for the others."""
    end = text.find("\n", HEADER_BYTES)
    lines, done = (text if end < 0 else text[:end]).split("\n"), list[str]()
    # the header's alone: a mark in a text beside numbers opens no row
    while lines and not NUMBER_ROW.match(lines[0].encode()):
        count = _lines_of_row(lines[:MOST_WRAPPED])
        done += [" ".join(line.strip("\r") for line in lines[:count]), *[""] * (count - 1)]
        lines = lines[count:]
    return "\n".join([*done, *lines]) + ("" if end < 0 else text[end:])


def _lines_of_row(lines: Sequence[str]) -> int:
    """Return the number of lines of the first row of a header: more than one where a cell in quotes goes on."""
    if not lines[0].count('"') % 2 or not OPEN_CELL.search(lines[0]):
        return 1
    # of the names alone: a mark of inches opens no cell that goes on in the rows
    names = list(takewhile(lambda line: not NUMBER_ROW.match(line.encode()), lines))
    return next((k for k in range(2, len(names) + 1) if not "".join(names[:k]).count('"') % 2), 1)
