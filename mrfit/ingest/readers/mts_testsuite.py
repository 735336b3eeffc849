"""MTS TestSuite: ``File Path:`` lines, name and unit rows, time last; one test spread over several files."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.layout import find_grid
from mrfit.ingest.text.textlog import Field, read_columns, time_place
from mrfit.ingest.text.two_rows import two_rows

SPEC = ReaderSpec("mts-testsuite", "MTS TestSuite text export", blocks=True)


def sniff(head: Head) -> bool:
    """Whether ``File Path:`` and ``Test Run:`` stand in the first lines."""
    return head.starts("File Path:") and any(line.startswith("Test Run:") for line in head.lines[:8])


def part(head: Head) -> str | None:
    """Return the text that the parts of one test share: ``(Timed).txt``, ``(Timed)2.txt`` and so on."""
    match = re.fullmatch(r"(.*\))\d*", head.path.stem)
    return f"{head.path.parent}/{match[1]}" if match else None


def read(source: Source) -> list[Table]:
    """Return one part.

    Raises
    ------
    Refusal
        If its name row and unit row do not fit, or no column is a time.
    """
    head = source.head
    found = two_rows(head)
    if found is None:
        raise Refusal(head.path, "no unit row below its column names", "export the log again")
    names, written, row = found.names, found.units, found.first - 1
    if (time := time_place(names, written)) is None:
        raise Refusal(head.path, f"none of its columns is a time ({', '.join(names)})", "export the log again")
    decimal = find_grid(head, row + 1).decimal
    fields = [Field(n, u, k) for k, (n, u) in enumerate(zip(names, written, strict=True))]
    return [read_columns(source, row + 1, fields, fields[time], head.lines[: row + 1], ("\t", decimal))]


def join(tables: Sequence[Table]) -> list[Table]:
    """Return the parts of one test one after the other, in the order of their times (not of their file names)."""
    ordered = sorted(tables, key=_first_time)
    names = [[c.name for c in t.columns] for t in ordered]
    if any(n != names[0] for n in names):
        return list(tables)
    whole = ordered[0]
    for part_table in ordered[1:]:
        whole = _appended(whole, part_table)
    return [whole]


def _first_time(table: Table) -> float:
    return float(table.time.values[0]) if table.time is not None else 0.0


def _appended(first: Table, second: Table) -> Table:
    """Return two parts as one; lines of the second count on from the last of the first."""
    assert first.time is not None and second.time is not None
    shift = max([int(first.lines[-1]), *(r.line for r in first.refused)])
    refused = tuple(replace(r, line=r.line + shift) for r in second.refused)
    return replace(
        first,
        columns=tuple(_chained(a, b) for a, b in zip(first.columns, second.columns, strict=True)),
        time=_chained(first.time, second.time),
        lines=np.concatenate([first.lines, second.lines + shift]),
        refused=(*first.refused, *refused),
        comments=(*first.comments, *(line + shift for line in second.comments)),
        findings=(*first.findings, *second.findings),
    )


def _chained(first: Column, second: Column) -> Column:
    return replace(first, values=np.concatenate([first.values, second.values]))
