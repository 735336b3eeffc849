"""What a reader makes of a file: columns of numbers as the file has them, before names, SI units and a time base."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrfit.ingest.channel_map import Rules
from mrfit.ingest.head import Head
from mrfit.recording import Finding
from mrfit.specs import Array

Lines = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Source:
    """A file to read: its beginning, and what the channel map says of it."""

    head: Head
    rules: Rules


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
    """

    name: str
    unit: str | None
    values: Array
    index: int


@dataclass(frozen=True, slots=True)
class Refused:
    """One data row that was not kept: what is wrong with it, and its line number (from 1)."""

    kind: str
    line: int


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """One run as a file has it.

    Attributes
    ----------
    columns
        Signals, all of one length N.
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
        Rows at which a new run begins.
    condition
        What the header says of the test, in SI.
    findings, history
        Oddities met, and steps taken, while reading.
    """

    columns: tuple[Column, ...]
    lines: Lines
    time: Column | None = None
    dt: float | None = None
    start: float = 0.0
    refused: tuple[Refused, ...] = ()
    breaks: tuple[int, ...] = ()
    condition: Mapping[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    history: tuple[str, ...] = ()

    @property
    def rows(self) -> int:
        """Number of rows N."""
        return len(self.lines)
