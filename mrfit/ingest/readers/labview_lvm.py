"""LabVIEW measurement files (LVM): one or many segments, with no, one, or one time column per channel."""

import math
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.meaning import units
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.body import Body, Layout, number_pattern, split
from mrfit.ingest.text.head import Head
from mrfit.ingest.text.headings import Heading
from mrfit.ingest.text.layout import name_and_units
from mrfit.ingest.text.textlog import Field, body_of, positive, table_of, without_headers

SPEC = ReaderSpec("labview-lvm", "LabVIEW measurement file (LVM)", blocks=True)


def sniff(head: Head) -> bool:
    """Whether the first line is ``LabVIEW Measurement``."""
    return head.starts("LabVIEW Measurement")


def heading(head: Head) -> Heading | None:
    """Return the names and units of the first segment's header; None if there is none."""
    try:
        segment = _segment(head)
    except Refusal:
        return None
    settings = (*segment.meta.get("y_unit_label", []), *segment.meta.get("delta_x", []))
    return Heading(segment.names, settings, segment.delimiter)


@dataclass(frozen=True, slots=True)
class LvmHeader:
    """The header of the first segment: delimiter, line of the name row, names, and its settings by channel."""

    delimiter: str
    row: int
    names: tuple[str, ...]
    meta: dict[str, list[str]]


def read(source: Source) -> list[Table]:
    """Return the table, with all its clocks where they differ.

    Raises
    ------
    Refusal
        If there is no ``X_Value`` row, it names more or fewer channels than there are, or neither times nor Delta_X.
    """
    head = source.head
    segment = _segment(head)
    comment = [k for k, n in enumerate(segment.names) if n.lower() == "comment"]
    clocks = [k for k, n in enumerate(segment.names) if n.lower() == "x_value"]
    signals = [k for k, n in enumerate(segment.names) if k not in (*comment, *clocks)]
    _check_names(segment, len(signals), head)
    filled = _filled_clocks(head, segment, clocks)
    data, heads = without_headers(
        source,
        segment.row + 1,
        lambda line: _word(line).startswith((b"channels", b"labview measurement", b"x_value")),
        lambda line: _word(line).startswith(b"x_value"),
    )
    decimal = _decimal(head, segment)
    use = tuple(sorted([*signals, *filled]))
    empty = tuple(c for c in clocks if c not in filled)
    layout = Layout(0, segment.delimiter, decimal, len(segment.names), use, (), tuple(comment), empty, comment="")
    body = body_of(source, layout, data)
    fields = [_field(segment, k, place) for place, k in enumerate(signals)]
    tables = _tables(body, fields, filled, segment, head)
    # each segment states its own number of rows
    return [replace(t, breaks=heads, stated_rows=None if heads else t.stated_rows) for t in tables]


def _segment(head: Head) -> LvmHeader:
    row = next((k for k, line in enumerate(head.lines) if line.lower().startswith("x_value")), None)
    if row is None:
        raise Refusal(head.path, "no X_Value row in its header", "export the log again")
    # only the first segment has the line that states the separator
    separator = next((line.lower() for line in head.lines[:30] if line.lower().startswith("separator")), "")
    delimiter = "," if "comma" in separator or not separator and "\t" not in head.lines[row] else "\t"
    meta: dict[str, list[str]] = {}
    for line in head.lines[:row]:
        fields = split(line, delimiter)
        meta[fields[0].lower()] = fields[1:]
    names = tuple(n for n in split(head.lines[row], delimiter))
    while names and not names[-1]:
        names = names[:-1]
    return LvmHeader(delimiter, row, names, meta)


def _check_names(segment: LvmHeader, names: int, head: Head) -> None:
    """Refuse a name row that does not name as many channels as the header counts."""
    count = units.quantity(next(iter(segment.meta.get("channels", [])), ""))
    if count is not None and count[0] != names:
        remedy = "write the missing name into its X_Value row, or export the log again"
        raise Refusal(head.path, f"its header counts {count[0]:g} channels but names {names}", remedy)


def _field(segment: LvmHeader, column: int, place: int) -> Field:
    """Return name and unit of a channel; units stand in its column, or one after the other as the channels do."""
    labels = segment.meta.get("y_unit_label", [])
    clocks = [k for k, n in enumerate(segment.names) if n.lower() == "x_value"]
    packed = len(clocks) > 1 and not any(k - 1 < len(labels) and labels[k - 1] == "" for k in clocks[1:])
    at = place if packed else column - 1
    label = labels[at] if 0 <= at < len(labels) else ""
    return Field(*name_and_units(segment.names[column], label or None), column)


def _filled_clocks(head: Head, segment: LvmHeader, clocks: list[int]) -> list[int]:
    """Return the X_Value columns that hold times; with X_Columns No they are empty."""
    first = next((line for line in head.lines[segment.row + 1 :] if line.strip()), "")
    fields = split(first, segment.delimiter)
    return [k for k in clocks if k < len(fields) and fields[k]]


def _decimal(head: Head, segment: LvmHeader) -> str:
    """Return the decimal mark: the stated one, or (files of version 0.92 state none) the one the data have."""
    stated = next(iter(segment.meta.get("decimal_separator", [])), "")
    if stated in (".", ","):
        return stated
    first = next((line for line in head.lines[segment.row + 1 :] if line.strip()), "")
    fields = [f for f in split(first, segment.delimiter) if f]
    return "." if any(number_pattern(".").fullmatch(f) for f in fields) else ","


def _word(line: bytes) -> bytes:
    return line[:24].strip().lower()


def _tables(body: Body, fields: list[Field], clocks: list[int], segment: LvmHeader, head: Head) -> list[Table]:
    if not clocks:
        return [_stated(table_of(body, fields), segment, head)]
    delta = _seconds(segment, "delta_x")
    time, *others = (Field("X_Value", _x_unit(segment), c) for c in clocks)
    if all(np.array_equal(body.numbers[clocks[0]], body.numbers[c], equal_nan=True) for c in clocks):
        return [replace(_counted(table_of(body, fields, time), segment), dt=delta)]
    return [replace(table_of(body, sorted([*fields, *others], key=lambda f: f.index), time), dt=delta)]


def _counted(table: Table, segment: LvmHeader) -> Table:
    return replace(table, stated_rows=positive(segment.meta.get("samples", [])))


def _x_unit(segment: LvmHeader) -> str:
    """Return the unit of the X values, seconds where none of time is stated."""
    label = next((u for u in segment.meta.get("x_unit_label", []) if u), "s")
    return label if units.known(label) and units.compatible(label, "s") else "s"


def _seconds(segment: LvmHeader, key: str) -> float | None:
    """Return a number of the first channel's X axis in s, or None if its header has none."""
    text = next(iter(segment.meta.get(key, [])), "").replace(",", ".")
    value = float(text.replace("∞", "inf")) if number_pattern(".").fullmatch(text) else math.inf
    return value * units.to_unit(_x_unit(segment), "s").scale if math.isfinite(value) else None


def _stated(table: Table, segment: LvmHeader, head: Head) -> Table:
    """Return a table without times on the grid X0 + k·Delta_X."""
    start, delta = _seconds(segment, "x0"), _seconds(segment, "delta_x")
    if delta is None or delta <= 0.0:
        raise Refusal(head.path, "neither X values nor Delta_X", "write rate = HZ in a channel map")
    for key in ("delta_x", "x0"):
        if len(set(filter(None, segment.meta.get(key, [])))) > 1:
            what = f"its channels have no X values, and differ in {key.title()} ({', '.join(segment.meta[key])})"
            raise Refusal(head.path, what, "export it with X values for each channel")
    digits = len(segment.meta["delta_x"][0].lower().partition("e")[0].replace(",", "").replace(".", "").strip("0"))
    if digits <= 3 and not _round_rate(delta):
        text = f"Delta_X = {delta:g} s has {digits} digits only: the rate of {1.0 / delta:.1f} Hz is that inexact"
        table = table.finding("rounded-rate", text)
    return replace(_counted(table, segment), dt=delta, start=start or 0.0)


def _round_rate(delta: float) -> bool:
    return abs(round(1.0 / delta) - 1.0 / delta) < 1e-6 / delta
