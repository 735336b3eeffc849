"""Any delimited text: CSV, TSV, semicolons, blanks; header and unit rows, decimal comma, comments; or a channel map.

The reader for files that no other claims. It refuses to guess: without a header it needs a channel map.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.recording import Finding
from mrfit.core.specs import ReaderSpec
from mrfit.ingest.containers.rates import kind_of
from mrfit.ingest.meaning import units
from mrfit.ingest.meaning.channel_map import FILE_NAME
from mrfit.ingest.meaning.chosen import clocks_meant
from mrfit.ingest.meaning.factor_rows import factor_row
from mrfit.ingest.meaning.naming import leaf_names
from mrfit.ingest.meaning.stated_factors import with_stated_factors
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import Column, Source, Table
from mrfit.ingest.text.body import EMPTY_FIELDS, NOT_A_NUMBER, Layout, lines_below, number_pattern, split
from mrfit.ingest.text.decimal_comma import pairs_in, with_points
from mrfit.ingest.text.head import Head, Text
from mrfit.ingest.text.labelled_numbers import labels_of, units_behind, without_labels, without_units
from mrfit.ingest.text.layout import (
    CLOCK,
    CLOCK_OWNERS,
    COMMENTS,
    DATE_NAMES,
    SAMPLE_LINES,
    STAMP,
    TIME_NAMES,
    Header,
    TextGrid,
    find_grid,
    find_header,
    name_and_unit,
    one_unit,
    words_of,
)
from mrfit.ingest.text.long_format import long_format, sorted_out
from mrfit.ingest.text.side_by_side import header_of, own_rows, tests_beside, without_ended, without_runs
from mrfit.ingest.text.spelling import plainly_written
from mrfit.ingest.text.stated_names import with_stated_names
from mrfit.ingest.text.textlog import Field, body_of, positive, table_of, text_of
from mrfit.ingest.time.clock_parts import are_seconds_beside, is_below_seconds, with_clock_parts
from mrfit.ingest.time.clocks import STAMP_NAME, is_called_clock
from mrfit.ingest.time.epoch import counted_since
from mrfit.ingest.time.rate import LONG_BARE, interval, with_rate
from mrfit.ingest.time.stamps import since_first

SPEC = ReaderSpec("delimited", "delimited text with a header, or with a channel map", blocks=True)
AXIS = re.compile(r"x|x[ _-]?(?:axis|achse|value|wert)?", re.IGNORECASE)
SCOPE_CHANNEL = re.compile(r"(?:ch|chan|channel|kanal|canal|voie|c|math|m)[ _.-]*[0-9a-d]", re.IGNORECASE)
COUNT_OF_TIME = re.compile(r"tick|time|stamp|epoch|unix|clock|date", re.IGNORECASE)
"""What a column is called that counts from a date; a counter of another thing may be as long."""
OF_COMPUTER = re.compile(r"\b(?:pc|host|computer|system|received|laptop)(?![a-z])", re.IGNORECASE)
"""Words of times at which a computer received the rows, which go by another clock."""
OF_TESTS = frozenset("s ms m mm N kN A mA V mV m/s mm/s °C".split())
"""Units of what a test measures, which are no names of anything."""
SPARSE = 0.05
NUMBERED_ROWS = 0.95
"""Least share of the first rows that a column must number to be no channel."""


def sniff(head: Head) -> bool:
    """Whether the file is text; asked only when no other reader claims the file."""
    return bool(head.encoding)


def read(source: Source) -> list[Table]:
    """Return the table.

    Raises
    ------
    Refusal
        If there are no rows of numbers, or neither header nor channel map says what they are.
    """
    source, data, said = plainly_written(source)
    if width := pairs_in(source.head):
        source, data = with_points(source, width, data)
        text = "commas part the fields and stand for the decimal point: every second field is read as decimals"
        said.append(Finding("decimal-comma", "", None, text))
    if labels := labels_of(source.head.lines):
        source, data = without_labels(source, labels, data)
    if united := units_behind(source.head.lines):
        source, data = without_units(source, [*united.values()], data)
    grid = find_grid(source.head)
    factors = factor_row(source, grid)
    if factors is not None:
        source = factors.left_out(source)
        grid = find_grid(source.head)
    head = source.head
    header = find_header(head, grid)
    grid = replace(grid, first=max(grid.first, header.first))
    if len(labels) == grid.width:
        names, written = zip(*map(name_and_unit, labels), strict=True)
        header = Header(names, written, frozenset(), grid.first)
    header, stated = with_stated_names(head, grid, header)
    if _are_units_alone(header):
        header = replace(header, units=header.names)
        said.append(Finding("named-by-unit", "", None, "its header has units alone: columns are called by them"))
    if header.short:
        header = _with_row_names(source, grid, header)
    if not header.names:
        _need_map(source, grid)
        header = replace(header, names=("",) * grid.width, units=(None,) * grid.width)
    written = tuple(one_unit(unit, united.get(k), alike=True) for k, unit in enumerate(header.units))
    header = replace(header, units=written)
    named = (*source.rules.columns, *source.rules.ignore)
    header = without_runs(header, named)
    beside = () if factors or source.rules.join else tests_beside(header, named)
    if beside and source.block:
        what = f"{len(beside)} tests stand side by side in a log that is read block by block"
        raise Refusal(
            head.path, what, "write each into a log of its own, or name one's columns by place in a channel map"
        )
    if beside:
        text = f"{len(beside)} tests stand side by side, each with times of its own: each is a recording"
        said.append(Finding("side-by-side", "", None, text))
    # what one block tells the next is told from test to test by none
    tables = [own_rows(read_grid(replace(source, carry={}), grid, header_of(header, c), data, c)) for c in beside]
    tables = [t for t in tables if t.rows] or [read_grid(source, grid, header, data)]
    tables = tables if beside or source.block else [without_ended(tables[0])]
    tables = tables if factors is None else [factors.applied(tables[0], source.rules)]
    return [replace(t, findings=(*t.findings, *said, *stated)) for t in tables]


def _are_units_alone(header: Header) -> bool:
    """Whether names are units of the quantities of a test, one of times and one of several letters."""
    others = [n for n in header.names if n not in ("s", "ms")]
    one = len(others) == len(header.names) - 1 and any(len(n) > 1 for n in others)
    return one and not any(header.units) and OF_TESTS.issuperset(others)


def _with_row_names(source: Source, grid: TextGrid, header: Header) -> Header:
    """Return a header that lacks one name with the names of all columns but the first, as R's write.table means it.

    Raises
    ------
    Refusal
        If the first column neither names nor numbers the rows.
    """
    texts = [r[0] for r in _sample_rows(source.head, grid)]
    counts = np.array([int(t) for t in texts if re.fullmatch(r"\d{1,15}", t)])
    steps = np.diff(counts[:SAMPLE_LINES])
    numbered = (
        len(counts) > max(1, NUMBERED_ROWS * len(texts))
        and np.median(steps) == 1
        and np.mean(steps > 0) > NUMBERED_ROWS
    )
    number = number_pattern(grid.decimal)
    if not numbered and sum(bool(number.fullmatch(t)) for t in texts) > 0.5 * len(texts):
        raise Refusal(
            source.head.path,
            f"its header has {grid.width - 1} names ({', '.join(n or '-' for n in header.names[:-1])}) "
            f"for {grid.width} columns",
            "write the missing name into its header, or delete the header and write a channel map by place",
        )
    return replace(header, names=("", *header.names[:-1]), units=(None, *header.units[:-1]), short=True)


def _need_map(source: Source, grid: TextGrid) -> None:
    if source.rules.channels:
        return
    row = excerpt(source.head.lines[grid.first])
    timed = _rises_evenly(source.head, grid, 0)
    hint = "; column 0 rises evenly and may be the time" if timed else ""
    what = f"no header says what its {grid.width} columns are (first row, line {grid.first + 1}: '{row}'{hint})"
    if source.rules.where:
        raise Refusal(source.head.path, what, f"name them under [channels] in {source.rules.where}")
    column = int(timed and grid.width > 1)
    first = "time = 0" if timed else "rate = HZ (or time = COLUMN)"
    example = f'{first}, then [channels] and force = {{column = {column}, unit = "N"}} or the like for each channel'
    remedy = f"`mrfit ingest LOGS --suggest-map` writes a channel map to complete, {FILE_NAME} beside it"
    raise Refusal(source.head.path, what, f"{remedy}; it holds, or a file given by --map does, {example}")


def _rises_evenly(head: Head, grid: TextGrid, column: int) -> bool:
    number = number_pattern(grid.decimal)
    texts = [r[column] for r in _sample_rows(head, grid)[:SAMPLE_LINES]]
    if len(texts) < 4 or not all(number.fullmatch(t) for t in texts):
        return False
    values = np.array([float(t.replace(grid.decimal, ".").replace("∞", "inf")) for t in texts])
    steps = np.diff(values) if np.isfinite(values).all() else np.zeros(1)
    return bool(np.all(steps > 0.0) and np.ptp(steps) < 0.1 * np.mean(steps))


def read_grid(
    source: Source, grid: TextGrid, header: Header, data: Text | None = None, columns: range | None = None
) -> Table:
    """Return the table of a text log whose layout and header are known.

    ``data`` is its text where it was rewritten; of ``columns`` alone, where others are of another test.
    """
    head = source.head
    rows = _sample_rows(head, grid)
    kinds = [kind if columns is None or k in columns else "other" for k, kind in enumerate(_kinds(rows, grid))]
    form = long_format(header, kinds)
    sorting = form.texts if form else ()
    numeric = [k for k, kind in enumerate(kinds) if kind == "number" and k not in sorting]
    stamps = [k for k, kind in enumerate(kinds) if kind == "stamp"]
    called = header if source.rules.time else _called_by_leaf(header)
    time = _time_column(source, grid, called, numeric, stamps)
    received = [] if source.rules.time else _received(header, time, [*numeric, *stamps])
    numeric = [k for k in numeric if k not in received]
    blank = tuple(k for k, kind in enumerate(kinds) if kind == "empty" and not header.names[k])
    texts = (time,) if time is not None and time in stamps else ()
    comment = "" if head.lines[grid.first].strip()[:1] in COMMENTS else COMMENTS
    layout = Layout(
        header.first,
        grid.delimiter,
        grid.decimal,
        grid.width,
        tuple(numeric),
        (*texts, *sorting),
        blank=blank,
        header=header.rows,
        comment=comment,
    )
    body = body_of(source, layout, data)
    fields = [Field(header.names[k], header.units[k], k) for k in numeric if k != time]
    clock = Field(called.names[time], called.units[time], time) if time in numeric else None
    table = table_of(body, fields, clock)
    if texts:
        table = _with_stamps(table, header.names[texts[0]], body.texts[texts[0]], texts[0], source)
    table = table if source.rules.time else with_clock_parts(table, source.carry)
    if form:
        table, kinds = sorted_out(table, form, body.texts, source), ["number"] * grid.width
    sparse, rate = _sparse(rows, header, kinds)
    if time is not None:
        name = header.names[time].strip().lower()
        twins = [k for k in stamps if k != time and header.names[k].strip().lower() == name]
        text = "'{}' (column {}) holds times, too: those of column {} are taken for all channels"
        sparse += [Finding("two-clocks", "", None, text.format(header.names[k], k, time)) for k in twins]
    if received:
        shown = ", ".join(f"'{header.names[k]}'" for k in received)
        text = f"{shown} goes by the computer's clock: the device's own times, '{header.names[time or 0]}', are taken"
        sparse.append(Finding("two-clocks", "", None, text))
    shown = grid.decimal if grid.delimiter == "," or grid.decimal in head.lines[grid.first] else ""
    table = with_rate(table, head.lines[: grid.first], grid.delimiter, shown)
    whole = source.block is None or source.block.last and source.block.line == 1
    if whole and table.dt is None and not any(f.kind == "rate-unclear" for f in table.findings):
        below = lines_below(text_of(source) if data is None else data, head.body_encoding)
        table = with_rate(table, below, grid.delimiter, shown)
    table = with_stated_factors(table, [line for line in head.lines[: grid.first] if line.strip() not in header.rows])
    return replace(table, dt=rate or table.dt, findings=(*table.findings, *sparse))


def _called_by_leaf(header: Header) -> Header:
    """Return a header whose columns are named by paths with the parts that differ, of which the time is one."""
    leaves = leaf_names(header.names)
    if not leaves:
        return header
    written = tuple(inner or unit for (_, inner), unit in zip(leaves, header.units, strict=True))
    return replace(header, names=tuple(name for name, _ in leaves), units=written)


def _sample_rows(head: Head, grid: TextGrid) -> list[list[str]]:
    lines = [line for line in head.lines[grid.first :] if line.strip()]
    chosen = lines if len(lines) <= 2 * SAMPLE_LINES else lines[:SAMPLE_LINES] + lines[-SAMPLE_LINES:]
    rows = [split(line, grid.delimiter) for line in chosen]
    return [r + [""] * (grid.width - len(r)) for r in rows if abs(len(r) - grid.width) <= 1]


def _kinds(rows: list[list[str]], grid: TextGrid) -> list[str]:
    """Return for every column what its fields are: number, stamp, text, sparse or empty."""
    number = number_pattern(grid.decimal)
    kinds = []
    for k in range(grid.width):
        filled = [r[k] for r in rows if r[k] not in EMPTY_FIELDS]
        numbers = sum(bool(number.fullmatch(f)) or f in NOT_A_NUMBER or f in ("∞", "-∞") for f in filled)
        if not filled:
            kinds.append("empty")
        elif len(filled) < SPARSE * len(rows):
            kinds.append("sparse")
        elif 2 * numbers > len(filled):
            kinds.append("number")
        elif 2 * sum(bool(STAMP.fullmatch(f) or CLOCK.fullmatch(f)) for f in filled) > len(filled):
            kinds.append("stamp")
        else:
            kinds.append("text")
    return kinds


def _time_column(
    source: Source, grid: TextGrid, header: Header, numeric: Sequence[int], stamps: Sequence[int]
) -> int | None:
    rule = source.rules.time
    if rule is not None:
        places = clocks_meant(rule.column, dict(enumerate(header.names)))
        if places and places[0] in (*numeric, *stamps):
            return places[0]
        there = ", ".join(f"{k} '{header.names[k]}'" for k in numeric)
        what = f"no column {rule.column!r} to take as time (there are {there})"
        raise Refusal(source.head.path, what, f"correct time = … in {source.rules.where}")
    numeric, stamps = ([k for k in some if not source.rules.leaves_out(header.names[k])] for some in (numeric, stamps))
    timed = [k for k in numeric if header.units[k] is not None and units.compatible(header.units[k] or "", "s")]
    timed = [k for k in timed if not (stamps and is_below_seconds(header.names[k]))]
    timed = [k for k in timed if not OF_COMPUTER.search(header.names[k])] or timed
    leaves = [(n.rpartition(".")[2] or n).strip().lower() for n in header.names]
    named = [k for k in numeric if header.names[k].strip().lower() in TIME_NAMES]
    named = named or [k for k in numeric if leaves[k] in TIME_NAMES - {"t"}]
    named = named or [k for k in numeric if not timed and are_seconds_beside(header.names[k], header.names)]
    named = [k for k in named if k in timed or not units.known(header.units[k] or "?")]
    if not named and not timed and not stamps and (axis := _scope_axis(source.head, header, numeric)) is not None:
        return axis
    dated = [k for k in numeric if header.names[k].strip().lower() in DATE_NAMES]
    begins = [k for k in numeric if re.split(r"[\s_.\d]+", header.names[k].strip().lower())[0] in TIME_NAMES]
    worded = [k for k in begins if k in timed]
    even = [k for k in numeric if header.units[k] is None and _rises_evenly(source.head, grid, k)]
    stamped = [k for k in numeric if header.names[k] == STAMP_NAME and header.units[k] is None]
    stamped = [] if source.rules.channels else stamped
    rising = [k for k in even if k in (*begins, *stamped)]
    firsts = _sample_rows(source.head, grid)[0] if even or stamped else []
    called = [k for k in stamped if number_pattern(grid.decimal).fullmatch(firsts[k])]
    called += [k for k in even if COUNT_OF_TIME.search(header.names[k])]
    counting = [k for k in called if counted_since(float(firsts[k].replace(grid.decimal, ".")))[0]]
    for choice in (named, worded, timed, stamps, dated, rising, counting):
        if len(choice) == 1 or (choice and choice is not timed):
            return choice[0]
    return None


def _received(header: Header, time: int | None, others: Sequence[int]) -> list[int]:
    """Return the columns of a computer's times beside those of the device that took the rows."""
    if time is None or OF_COMPUTER.search(header.names[time]):
        return []
    own = bool(CLOCK_OWNERS & set(words_of(header.names[time])))
    clocks = [k for k in others if k != time and is_called_clock(header.names[k], header.units[k])]
    return [k for k in clocks if own or OF_COMPUTER.search(header.names[k])]


def _scope_axis(head: Head, header: Header, numeric: Sequence[int]) -> int | None:
    """Return the column called X beside the channels of an oscilloscope, which is its time."""
    axes = [k for k in numeric if AXIS.fullmatch(header.names[k]) and header.units[k] is None]
    others = [header.names[k] for k in numeric if k not in axes]
    return axes[0] if len(axes) == 1 and others and all(SCOPE_CHANNEL.fullmatch(n) for n in others) else None


def _with_stamps(table: Table, name: str, texts: list[str], index: int, source: Source) -> Table:
    """Turn time stamps, or times of day, into seconds from the first one."""
    try:
        seconds = since_first(texts, source.carry)
    except ValueError as error:
        what = f"column '{name}' holds no time stamps throughout ({error})"
        raise Refusal(source.head.path, what, "export it again") from None
    if source.block is None and np.isnan(seconds).all():
        raise Refusal(source.head.path, f"column '{name}' holds no time stamp", "export it again")
    return replace(table, time=Column(name, "s", seconds, index))


def _sparse(rows: list[list[str]], header: Header, kinds: list[str]) -> tuple[list[Finding], float | None]:
    """Name the columns that are no channels, and take the sample rate where one of them holds it."""
    findings: list[Finding] = []
    rate = None
    for k, kind in enumerate(kinds):
        name = header.names[k]
        if kind in ("number", "stamp") or not name:
            continue
        filled = [r[k] for r in rows if r[k] not in EMPTY_FIELDS]
        what = kind_of(name) if kind == "sparse" else ""
        value = positive(filled) if what else None
        # a bare interval of seconds may be one of milliseconds
        if what and value and (header.units[k] or interval(value, what) <= LONG_BARE):
            rate = interval(value, header.units[k] or what)
            text = f"column '{name}' gives the sample rate, {1.0 / rate:g} Hz, and is no channel"
        else:
            what = f"is filled in {len(filled)} of {len(rows)} sampled rows" if kind != "text" else "holds text"
            text = f"column '{name}' {what} and is no channel"
        findings.append(Finding("no-channel", "", None, text))
    return findings, rate
