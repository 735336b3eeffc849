"""Another header inside a text log: where it begins, and the log cut there so that each block is read by its own."""

import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from mrfit.core.specs import Mask
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Block, Lines, RejectedRows, Source, Table
from mrfit.ingest.text import layout
from mrfit.ingest.text.body import NUMBER_ROW, split
from mrfit.ingest.text.head import FEED, HEAD_BYTES, Head, Text, decode
from mrfit.ingest.text.textlog import text_of
from mrfit.ingest.time.rate import stated_interval

SKIPPED_BYTES = b" \t\r\f\v\"',;|+-.\0"
"""What may stand before the first digit of a row."""
ROWS_SEEN = 8192
"""Bytes below a header by which its columns are told."""
MOST_PARTS = 200
NAMING_LINES = 2
"""Lines at the end of a header that name columns and units."""
HEADING_NUMBER = re.compile(r"[+-]?\d[\d.,]*(?:[eE][+-]?\d+)?")
FEW_ROWS = 5
"""So many rows above the first names are a part of the log without a header."""


@dataclass(frozen=True, slots=True)
class Heading:
    """Statements of a header on the rows below it.

    Attributes
    ----------
    names, units
        Of the columns; names are empty where only units stand there.
    delimiter
        Of the rows.
    decimal
        Decimal mark, where the rows show one.
    interval
        Sample interval in s, where the header states one.
    row
        Line (from 0) of the names; -1 where units do not stand beside or below them.
    export
        All its lines, where they begin an export of the instrument.
    """

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    delimiter: str = ""
    decimal: str = ""
    interval: float | None = None
    row: int = -1
    export: tuple[str, ...] = ()

    def same(self, before: "Heading") -> bool:
        """Whether rows below it are read as those of the header before; absent names or units are repeated."""
        marks = not self.decimal or not before.decimal or self.decimal == before.decimal
        rates = self.interval is None or self.interval == before.interval
        bare, unnamed = not any(self.units), not any(self.names)
        return (not self.export or self.export == before.export) and (
            (unnamed or [n.lower() for n in self.names] == [n.lower() for n in before.names])
            and self.delimiter == before.delimiter
            and (bare or self.units == before.units)
            and marks
            and rates
        )

    def completed(self, before: "Heading") -> "Heading | None":
        """Return it with absent names or units taken from the header before; None if these are unclear."""
        if self.row < 0:
            return self
        if not any(self.names):
            pairs = list(zip(before.names, self.units, strict=False))
            unclear = any(u and n.lower() == u.lower() for n, u in pairs)  # a row of units, most of them unknown
            named = any(before.names) and len(pairs) == len(before.names) == len(self.names) and not unclear
            return replace(self, names=before.names) if named else None
        if any(self.units) or not any(before.units):
            return self
        known = {n.lower(): u for n, u in zip(before.names, before.units, strict=True)}
        if len(known) < len(before.names) or any(n and n.lower() not in known for n in self.names):
            return None
        return replace(self, units=tuple(known.get(n.lower()) for n in self.names))


@dataclass(frozen=True, slots=True)
class HeadedPart:
    """A stretch of a log below a header of its own.

    Attributes
    ----------
    source
        It, as a log by itself.
    shift
        Lines of the log above it.
    odd
        Why its header cannot be used, or nothing.
    """

    source: Source
    shift: int = 0
    odd: str = ""

    def told(self) -> str:
        """Return in words where it begins."""
        shown = next((text for text in self.source.head.lines if text.strip()), "")
        return f"line {self.shift + 1} begins another header ('{excerpt(shown)}')"

    def placed(self, table: Table) -> Table:
        """Return a table of it with the line numbers of the log."""
        lost = RejectedRows()
        lost.add([r.kind for r in table.refused], [r.line + self.shift for r in table.refused])
        return replace(
            table,
            lines=table.lines + self.shift,
            refused=lost,
            breaks=tuple(line + self.shift for line in table.breaks),
            comments=tuple(line + self.shift for line in table.comments),
            open_line=table.open_line + self.shift if table.open_line else 0,
        )

    def in_words(self, text: str) -> str:
        """Return a statement on it with the line numbers of the log."""
        return re.sub(r"\bline (\d+)", lambda m: f"line {int(m[1]) + self.shift}", text)


Teller = Callable[[Head], Heading | None]


def heading(head: Head) -> Heading | None:
    """Return the names and units of the header of delimited text; None if nothing above the numbers names them."""
    try:
        grid = layout.find_grid(head)
    except Refusal:
        return None
    found = layout.find_header(head, grid)
    if not found.names or not any(found.names):
        return None
    shown = grid.decimal if any(grid.decimal in line for line in head.lines[grid.first : grid.first + 50]) else ""
    interval, _ = stated_interval(head.lines[: max(grid.first, found.first)], grid.delimiter, shown)
    names, written = found.names, found.units
    cells = [c.strip("[](){}") for c in (*split(head.lines[found.row], grid.delimiter), *("",) * grid.width)]
    if layout.are_units(cells[: grid.width]):
        names, written = ("",) * grid.width, tuple(c or None for c in cells[: grid.width])
    return Heading(names, written, grid.delimiter, shown, interval, found.row)


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Lines between two rows: where they begin and end in the text, and the number of the first."""

    begin: int
    end: int
    line: int


def exported(head: Head) -> tuple[str, ...]:
    """Return the lines above the first row of numbers, or of marks of overload."""
    rows = (k for k, line in enumerate(head.lines) if NUMBER_ROW.match(line.encode()) or is_of_numbers(line))
    first = next(rows, len(head.lines))
    return tuple(line.strip() for line in head.lines[:first] if line.strip())


def cut_at_headings(source: Source, tell: Teller) -> list[HeadedPart]:
    """Return the parts of a log, each below a header of its own.

    A log of one header, given once or several times, is one part, ``source`` itself. Lines of each count from 1.
    """
    head, data = source.head, text_of(source)
    base = source.block.line if source.block else 1
    named = _named(head, data, base)
    found: list[tuple[_Stretch, Heading, Heading | None]] = []
    current: Heading | None = None
    above = set(exported(head))
    for place, stretch in enumerate(named):
        lines = _part(head, data[stretch.begin : stretch.end], True).lines
        if {line.strip() for line in lines} <= {*above, ""}:
            continue
        unclear = any(resembles(line, above) for line in lines)
        limit = named[place + 1].begin if place + 1 < len(named) else len(data)
        below = min(stretch.end + ROWS_SEEN, limit)
        here = tell(_part(head, data[stretch.begin : below], below == limit))
        if here is None and not unclear:
            continue
        if current is None:
            before = replace(head, lines=head.lines[: stretch.line - 1])
            current = tell(before) if _names_rows(before) else None
            if current is None and base == 1 and not _has_rows(before):
                above |= {line.strip() for line in lines}
                current = tell(_part(head, data[:below], below == limit))  # it is the first header itself
                continue
        if here is not None and current is not None and here.same(current):
            continue
        whole = here if current is None or here is None else here.completed(current)
        found.append((stretch, here or Heading((), ()), whole))
        if whole is None or len(found) == MOST_PARTS:
            break
        current, above = whole, {line.strip() for line in lines}
    if not found:
        return [HeadedPart(source)]
    first = found[0][0]
    own = replace(head, lines=head.lines[: first.line - 1])
    made = [HeadedPart(replace(source, head=own, block=_block(source, data, 0, first.begin, base)))]
    for place, (stretch, here, whole) in enumerate(found):
        end = found[place + 1][0].begin if place + 1 < len(found) else len(data)
        odd = "" if whole else "its names or units are missing, and the header before does not tell them"
        odd = odd or ("more headers than that" if place + 1 == MOST_PARTS else "")
        part = _below(head, data[stretch.begin : min(end, stretch.begin + HEAD_BYTES)], here, whole)
        block = _block(source, data, stretch.begin, end, 1)
        made.append(HeadedPart(replace(source, head=part, block=block, carry={}), stretch.line - 1, odd))
    return made


def _block(source: Source, data: Text, begin: int, end: int, line: int) -> Block:
    last = end == len(data) and (source.block is None or source.block.last)
    return Block(bytes(data[begin:end]), line, last)


def resembles(line: str, headers: Iterable[str]) -> bool:
    """Whether half of the cells of a line, and not all, are those of a line of a header."""
    for header in headers:
        delimiter = next((d for d in layout.FIELD_DELIMITERS if d and d in header), "")
        pairs = list(zip(split(line, delimiter), split(header, delimiter), strict=False))
        same = sum(a == b != "" for a, b in pairs)
        if line.strip() != header and line.count(delimiter or " ") == header.count(delimiter or " "):
            filled = sum(b != "" for _, b in pairs)
            if filled > 1 and 2 * same >= filled:
                return True
    return False


def names_columns(line: str) -> bool:
    """Whether a line is a row of names or units, half of them known."""
    rows = [[c.strip("[](){}") for c in split(line.strip(), d) if c] for d in layout.FIELD_DELIMITERS]
    return _may_name(line) or any(len(cells) > 1 and layout.are_units(cells) for cells in rows)


def rows_above(head: Head, first: int, part: bool = False) -> list[int]:
    """Return the numbers of the lines of numbers between names, or in a ``part`` anywhere, above line ``first``."""
    if part:
        return [k + 1 for k, line in enumerate(head.lines[: first - 1]) if is_of_numbers(line)]
    naming = [k for k, line in enumerate(head.lines[: first - 1]) if _may_name(line)]
    between = range(naming[0], naming[-1]) if naming else range(0)
    return [k + 1 for k in between if is_of_numbers(head.lines[k])]


def is_of_numbers(line: str) -> bool:
    """Whether a line has two numbers or marks of overload, and begins with no word."""
    cells = [c for c in re.split(r"[,;\t| ]+", line.strip()) if c]
    found = [bool(HEADING_NUMBER.fullmatch(c) or layout.OVERLOAD.fullmatch(c)) for c in cells]
    return sum(found) > 1 and (found[0] or not re.search(r"[^\W\d_]", cells[0]))


def _names_rows(head: Head) -> bool:
    """Whether lines are a log with a header: two rows follow on each other, or known names stand above a row."""
    rows = [bool(NUMBER_ROW.match(line.encode())) for line in head.lines]
    if any(a and b for a, b in pairwise(rows)):
        return True
    told = heading(head)
    return told is not None and len(told.names) > 1 and _may_name(head.lines[told.row])


def _has_rows(head: Head) -> bool:
    return sum(bool(NUMBER_ROW.match(line.encode())) for line in head.lines[-FEW_ROWS:]) == FEW_ROWS


def _named(head: Head, data: Text, base: int) -> list[_Stretch]:
    """Return the stretches between rows in which a line may name columns."""
    seen: dict[bytes, bool] = {}
    found = []
    headers = exported(head)[-NAMING_LINES:]
    for stretch in _between_rows(data, base):
        text = data[stretch.begin : stretch.end]
        if text not in seen:
            seen[text] = any(_may_name(line) or resembles(line, headers) for line in _part(head, text, True).lines)
        if seen[text]:
            found.append(stretch)
    return found


def _between_rows(data: Text, base: int) -> Iterator[_Stretch]:
    """Yield every stretch of lines, below the first row, that begin with no number."""
    whole = np.frombuffer(data, np.uint8)
    starts = np.concatenate([[0], np.flatnonzero(whole == FEED) + 1])
    starts = starts[starts < len(whole)]
    at, moving = starts.copy(), np.arange(len(starts))
    skipped = np.zeros(256, dtype=bool)
    skipped[list(SKIPPED_BYTES)] = True
    while len(moving):
        moving = moving[skipped[whole[at[moving]]]]
        at[moving] += 1
        moving = moving[at[moving] < len(whole)]
    begins = np.where(at < len(whole), whole[np.minimum(at, len(whole) - 1)], FEED)
    numbers, blank = (begins >= ord("0")) & (begins <= ord("9")), begins == FEED
    if 2 * np.count_nonzero(numbers) < np.count_nonzero(~blank):
        numbers |= _worded_rows(data, starts, numbers | blank)
    rows = np.flatnonzero(numbers)
    odd = np.flatnonzero(~numbers & ~blank)
    odd = odd[odd > (-1 if base > 1 else rows[0] if len(rows) else len(starts))]
    above = np.searchsorted(rows, odd)
    for lines in np.split(odd, 1 + np.flatnonzero(np.diff(above))) if len(odd) else ():
        after = np.searchsorted(rows, lines[0])
        if after < len(rows):
            yield _Stretch(int(starts[lines[0]]), int(starts[rows[after]]), base + int(lines[0]))


def _worded_rows(data: Text, starts: Lines, others: Mask) -> Mask:
    """Return the mask of lines, but ``others``, that have a number behind the word that they begin with."""
    cell = re.compile(rb'[,;\t| ][ "]*[+-]?[.,]?\d[\d.,]*(?:[eE][+-]?\d+)?[ "]*(?:[,;\t|\r\n]|$)')
    edges = np.append(starts, len(data))
    found = np.zeros(len(starts), dtype=bool)
    for k in np.flatnonzero(~others):
        found[k] = bool(cell.search(data, int(edges[k]), int(edges[k + 1])))
    return found


def _may_name(line: str) -> bool:
    """Whether a line may be a row of names: cells without a number, half of them known names or with a known unit."""
    bare = line.strip().lstrip(layout.COMMENTS).strip()
    if not bare:
        return False
    for delimiter in layout.FIELD_DELIMITERS:
        cells = [c for c in split(bare, delimiter) if c]
        if not layout.is_name_row(cells):
            continue
        known = sum(layout.is_name(c) or units.known(c) for c in cells)
        # unknown names are single words: several are a note
        worded = delimiter and len(set(cells)) == len(cells) > 1 and all(re.fullmatch(r"[^\W\d_]\S+", c) for c in cells)
        if 2 * known >= len(cells) or worded and line.strip()[:1] not in layout.COMMENTS:
            return True
    return False


def _part(head: Head, data: bytes, whole: bool) -> Head:
    """Return the head of a stretch of text."""
    lines = decode(data, head.body_encoding).replace("\0", "").split("\n")
    if not whole and len(lines) > 1:
        lines.pop()
    return replace(head, lines=tuple(lines))


def _below(head: Head, text: bytes, here: Heading, whole: Heading | None) -> Head:
    """Return the head of a part, what its header leaves out written into it."""
    part = _part(head, text, len(text) < HEAD_BYTES)
    lines = list(part.lines)
    if whole is not None and (whole.names, whole.units) != (here.names, here.units):
        cells = [f"{n} [{u}]" if u else n for n, u in zip(whole.names, whole.units, strict=True)]
        lines[here.row] = (here.delimiter or "\t").join(cells)
    return replace(part, lines=tuple(lines))
