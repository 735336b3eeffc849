"""Tests that stand side by side in one table, each in columns of the same names that begin with its times."""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.chosen import clocks_meant
from mrfit.ingest.table import Table
from mrfit.ingest.text.layout import DATE_NAMES, TIME_NAMES, Header

COPY_MARK = re.compile(r"[._ ]\d+$")
"""What pandas and spreadsheets put behind a name that stood there already."""

RUN_BEFORE = re.compile(r"(?:(?:run|lauf|test|data ?set) ?#?\d+|latest) ?: ?", re.IGNORECASE)
"""The run that Logger Pro puts before every name."""
AXIS_NAME = re.compile(r"freq|order|lag\b|bin\b|harmonic", re.IGNORECASE)
"""Names of the axis of a spectrum or the like, beside a unit of frequency."""
EVEN_AXIS = 0.1
"""Relative range of the steps of an axis."""


def without_runs(header: Header, named: Sequence[str | int] = ()) -> Header:
    """Return a header without the runs that stand before every name, unless these alone tell columns apart.

    What a map names by place, or with the run, stays as it is.
    """
    if any(isinstance(one, int) or clocks_meant(one, dict(enumerate(header.names))) for one in named):
        return header
    runs = [RUN_BEFORE.match(name) for name in header.names]
    cut = [name[m.end() :] for name, m in zip(header.names, runs, strict=True) if m]
    if not all(cut) or len(cut) < len(runs):
        return header
    shorter = replace(header, names=tuple(cut))
    return shorter if len({*cut}) == len(cut) or tests_beside(shorter) else header


def tests_beside(header: Header, named: Sequence[str | int] = ()) -> list[range]:
    """Return the columns of each test; none where the columns are of one test.

    Columns without a name, which part the tests, belong to none. A map that names columns by place, or by names that
    not all tests have, tells the tests apart itself.
    """
    called = [COPY_MARK.sub("", name.strip().lower()) for name in header.names]
    begins = [k for k, name in enumerate(called) if name in TIME_NAMES | DATE_NAMES and name == called[0]]
    if len(begins) < 2 or begins[0] != 0:
        return []
    edges = [*begins, len(called)]
    groups = [range(a, b) for a, b in zip(edges, edges[1:], strict=False)]
    groups = [range(g.start, 1 + max(k for k in g if called[k])) for g in groups]
    first = [called[k] for k in groups[0]]
    same = all([called[k] for k in g] == first for g in groups)
    plain = all(header.names[k].strip().lower() == called[k] for k in groups[0])
    meant = [clocks_meant(one, dict(enumerate(header.names))) for one in named if isinstance(one, str)]
    apart = len(meant) < len(named) or any(places and len(places) < len(groups) for places in meant)
    return groups if same and plain and len(first) > 2 and not apart else []


def header_of(header: Header, columns: range) -> Header:
    """Return a header that names the columns of one test by the names of the first, and no others."""
    first = header.names[: len(columns)]
    names = [first[k - columns.start] if k in columns else "" for k in range(len(header.names))]
    written = [unit if k in columns else None for k, unit in enumerate(header.units)]
    return replace(header, names=tuple(names), units=tuple(written))


def without_ended(table: Table) -> Table:
    """Return a table without another one at its right, as of a spectrum: columns that end early, the first an axis."""
    filled = [np.flatnonzero(np.isfinite(c.values)) for c in table.columns]
    ends = [int(places[-1]) + 1 if len(places) else 0 for places in filled]
    first = next((k for k in range(len(ends)) if k and 2 < ends[k] < table.rows and len({*ends[k:]}) == 1), len(ends))
    if first > len(ends) - 2 or max(ends[:first]) < table.rows or len(filled[first]) < ends[first]:
        return table
    axis = table.columns[first]
    if not (units.known(axis.unit or "") and units.compatible(axis.unit or "", "Hz") or AXIS_NAME.match(axis.name)):
        return table  # channels of another rate, or that ended early
    steps = np.diff(axis.values[: ends[first]])
    if not (np.all(steps > 0.0) and np.ptp(steps) < EVEN_AXIS * np.mean(steps)):
        return table
    shown = ", ".join(f"'{c.name}'" for c in table.columns[first:])
    text = f"{shown} at the right end after {ends[first]} rows, and are another table: not read"
    return replace(table, columns=table.columns[:first]).finding("not-read", text)


def own_rows(table: Table) -> Table:
    """Return a table without the rows at its end in which nothing of it stands, since another test was longer."""
    values = [c.values for c in (*table.columns, *([table.time] if table.time else []))]
    filled = np.flatnonzero(np.logical_or.reduce([~np.isnan(v) for v in values]))
    rows = int(filled[-1]) + 1 if len(filled) else 0
    return table if rows == table.rows else table.cut(lambda v: v[:rows], table.refused)
