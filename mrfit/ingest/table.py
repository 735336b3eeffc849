"""Tables that readers make of files: columns of numbers as in the file, before names, SI units and a time base."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, overload

import numpy as np

from mrfit.core.recording import Finding
from mrfit.core.specs import Array, Index
from mrfit.ingest.containers.memory import Room
from mrfit.ingest.containers.shelf import Shelf
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.printed import Digits

Lines = Index


@dataclass(frozen=True, slots=True)
class Block:
    """A stretch of whole lines of a text log, or a few rows of a binary one.

    Attributes
    ----------
    data
        The lines, as ``body_bytes`` gives them.
    line
        Number of the first one, from 1.
    last
        Whether the file ends with it.
    before
        The last lines before it, at least those of a few kilobytes.
    """

    data: bytes
    line: int = 1
    last: bool = True
    before: bytes = b""


@dataclass(frozen=True, slots=True)
class Source:
    """A file to read.

    Attributes
    ----------
    head
        Its beginning.
    rules
        What the channel map says of it.
    block
        The part of it to read; None for all of it.
    carry
        What a reader that is given block after block must remember from the first on.
    memory
        Most bytes of memory it may take once unpacked; None for half of what is free.
    shelf
        Where a reader may put long arrays; None keeps them in memory.
    """

    head: Head
    rules: Rules
    block: Block | None = None
    carry: dict[str, Any] = field(default_factory=dict)
    memory: float | None = None
    shelf: Shelf | None = None

    def room(self) -> Room:
        """Return the memory that the file may take."""
        return Room(self.head.path, self.memory)


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One column of a file.

    Attributes
    ----------
    name
        Header name without its unit.
    unit
        Unit as the file writes it, or None where it says nothing.
    values
        Numbers as the file has them, shape (N,); nan where a field is empty.
    index
        Place in the file, counted from 0.
    digits
        How a text log prints them, where that is the same throughout.
    """

    name: str
    unit: str | None
    values: Array
    index: int
    digits: Digits | None = None


@dataclass(frozen=True, slots=True)
class RejectedRow:
    """One data row that was not kept: what is wrong with it, and its line number (from 1)."""

    kind: str
    line: int


class RejectedRows(Sequence[RejectedRow]):
    """Refused rows by the million, at nine bytes each, in the order they came."""

    def __init__(self, refused: Sequence[RejectedRow] = ()) -> None:
        self.kinds: list[str] = []
        self.codes = np.empty(0, dtype=np.int8)
        self.lines: Lines = np.empty(0, dtype=np.int64)
        if isinstance(refused, RejectedRows):
            self.kinds, self.codes, self.lines = list(refused.kinds), refused.codes, refused.lines
        else:
            self.add([r.kind for r in refused], [r.line for r in refused])

    def add(self, kinds: Sequence[str], lines: Sequence[int] | Lines) -> None:
        """Add rows, each with what is wrong with it."""
        self.kinds += [k for k in dict.fromkeys(kinds) if k not in self.kinds]
        place = {k: number for number, k in enumerate(self.kinds)}
        self.codes = np.concatenate([self.codes, np.array([place[k] for k in kinds], dtype=np.int8)])
        self.lines = np.concatenate([self.lines, np.asarray(lines, dtype=np.int64)])

    def __len__(self) -> int:
        return len(self.lines)

    @overload
    def __getitem__(self, key: int) -> RejectedRow: ...
    @overload
    def __getitem__(self, key: slice) -> "list[RejectedRow]": ...
    def __getitem__(self, key: int | slice) -> "RejectedRow | list[RejectedRow]":
        if isinstance(key, slice):
            return [self[k] for k in range(*key.indices(len(self)))]
        return RejectedRow(self.kinds[self.codes[key]], int(self.lines[key]))

    def __iter__(self) -> Iterator[RejectedRow]:
        return (self[k] for k in range(len(self)))

    def without(self, kinds: Sequence[str]) -> "RejectedRows":
        """Return those of other kinds."""
        keep = ~np.isin(self.codes, [self.kinds.index(k) for k in kinds if k in self.kinds])
        others = RejectedRows(self)
        others.codes, others.lines = self.codes[keep], self.lines[keep]
        return others

    def first_of_kinds(self) -> list[tuple[str, int, int]]:
        """Return (kind, number of rows, first line) of every kind, in the order of their first lines."""
        found = []
        for code, kind in enumerate(self.kinds):
            lines = self.lines[self.codes == code]
            found += [(kind, len(lines), int(lines.min()))] if len(lines) else []
        return sorted(found, key=lambda item: item[2])


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """One run as a file has it.

    Attributes
    ----------
    columns
        Signals, all of one length N; of a log read block by block they lie on disk (``series.Series``).
    lines
        Line number of every row, shape (N,), ascending; for binary files the row number from 1.
    time
        Time column, or None where the file has none.
    dt
        Sample interval in s that the header states, or None.
    start
        Time of the first row in s where there is no time column.
    refused
        Data rows left out, one entry each.
    breaks
        Line numbers; a new run begins with the first row at or after each.
    stated_rows
        Number of rows the header states, or None.
    open_line
        Number of the last line if it was left out because the file ends inside its last number, else 0.
    condition
        What the header says of the test, in SI.
    comments
        Line numbers of comments among the rows.
    findings, history
        Oddities met, and steps taken, while reading.
    """

    columns: tuple[Column, ...]
    lines: Lines
    time: Column | None = None
    dt: float | None = None
    start: float = 0.0
    refused: Sequence[RejectedRow] = ()
    breaks: tuple[int, ...] = ()
    stated_rows: float | None = None
    open_line: int = 0
    comments: tuple[int, ...] = ()
    condition: Mapping[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    history: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows N."""
        return len(self.lines)

    def cut(self, chosen: Callable[[Any], Any], refused: Sequence[RejectedRow]) -> "Table":
        """Return the table with some of its rows, which a function takes of each column, and other refused ones."""
        columns = tuple(replace(c, values=chosen(c.values)) for c in self.columns)
        time = self.time and replace(self.time, values=chosen(self.time.values))
        return replace(self, columns=columns, time=time, lines=chosen(self.lines), refused=refused)

    def finding(self, kind: str, text: str) -> "Table":
        """Return the table with a further oddity met while reading."""
        return replace(self, findings=(*self.findings, Finding(kind, "", None, text)))


def with_end(table: Table) -> Table:
    """Add findings on lines among the rows and at their end: comments, a cut last line, another number than stated."""
    if table.open_line:
        text = f"line {table.open_line}, the last, has no line end and its last number may be cut off"
        table = table.finding("last-line-open", f"{text}: left out")
    if table.comments:
        are = "comment lines stand" if len(table.comments) > 1 else "comment line stands"
        text = f"{len(table.comments)} {are} among the rows, the first in line {min(table.comments)}"
        table = table.finding("comments", text)
    rows = table.rows + len(table.refused)
    if table.stated_rows is not None and int(table.stated_rows) != rows:
        text = f"the header states {int(table.stated_rows)} rows but the file has {rows}"
        table = table.finding("record-length", text)
    return replace(table, open_line=0, comments=(), stated_rows=None)
