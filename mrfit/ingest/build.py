"""From a reader's table to recordings: names, SI units, a uniform time base, conditions and findings."""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from mrfit.core.channels import CHANNELS, unit_of
from mrfit.core.counting import few
from mrfit.core.recording import Finding, Recording
from mrfit.core.specs import Array, Index
from mrfit.ingest import series
from mrfit.ingest.decimate import decimated
from mrfit.ingest.low_pass import low_passed
from mrfit.ingest.meaning.channel_map import FILE_NAME, Rules
from mrfit.ingest.meaning.chosen import mapped_places
from mrfit.ingest.meaning.coil import with_coil
from mrfit.ingest.meaning.conditions import conditions_of, wording
from mrfit.ingest.meaning.factors import with_factors
from mrfit.ingest.meaning.faults import fault_findings
from mrfit.ingest.meaning.lever import levered
from mrfit.ingest.meaning.marks import without_marks
from mrfit.ingest.meaning.naming import Signal, all_missing, check_wrong_dimension, name_signals
from mrfit.ingest.meaning.sanity import channel_findings, relation_findings, shortened, shortening
from mrfit.ingest.meaning.statistics import STATISTICS_ROW as STATISTICS
from mrfit.ingest.meaning.statistics import without_statistics
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Column, Lines, RejectedRow, RejectedRows, Table
from mrfit.ingest.time.clocks import on_one_clock
from mrfit.ingest.time.counter import counter_of, counting_samples, is_counter, numbers_rows
from mrfit.ingest.time.epoch import in_seconds
from mrfit.ingest.time.late_rows import late_rows
from mrfit.ingest.time.rate import rate_missing
from mrfit.ingest.time.timebase import TimeBase, TimeFault, coarse, on_grid, repeated, time_base

OVERFLOW = 1e30
"""Magnitude from which a number is an instrument's mark for overflow."""

OFF_RATE = 0.01
"""Departure of a clock in whole seconds from the stated rate."""
LONGEST_INTERVAL = 600.0
"""Sample interval in s above which a unit of time is not believed, as ``Ms`` for ms."""
SLOW_CHANNELS = {"temperature", "voltage", "current"}
"""Channels of models that may be sampled more slowly than others."""
FEWEST_SLOW = 3
"""Fewest numbers of a channel by which it is seen to be slow, and one more."""

FEW_REPEATED, NEARLY_ALL = 0.02, 0.9
"""Share of rows up to which a repeated time is an exception, and share of more of them that repeat all channels."""
REPEATED_HEADER = "repeated header"
NO_SAMPLE = (REPEATED_HEADER, "empty row", "repeated time", STATISTICS)
"""Refused rows that stood for no sample."""


@dataclass(frozen=True, slots=True)
class LogOrigin:
    """Origin of a table, as its recordings state it."""

    path: str
    sha256: str
    reader: str
    rules: Rules


@dataclass(frozen=True, slots=True, eq=False)
class RowTimes:
    """Times of all rows in s, the interval stated by map or header, the unit of the last digit, what was assumed."""

    values: Array
    stated: float | None
    printed: float | None = None
    assumed: tuple[Finding, ...] = ()


@dataclass(slots=True)
class NamedRows:
    """Named signals and times of the rows still kept, where runs begin, and the rows refused so far."""

    signals: list[Signal]
    time: Array
    lines: Lines
    begins: tuple[int, ...]
    refused: RejectedRows
    findings: list[Finding] = field(default_factory=list)

    @property
    def breaks(self) -> tuple[int, ...]:
        """Rows at which a new run begins."""
        return tuple(sorted({bisect_left(self.lines, line) for line in self.begins} - {0, len(self.lines)}))

    @property
    def number(self) -> Array | None:
        """The rows counted with the refused ones between them that stood for a sample; None where there are none."""
        lost = self.refused.without(NO_SAMPLE)
        return _counted(self.lines, lost) if len(lost) else None

    def drop(self, rows: Lines, kinds: Sequence[str]) -> None:
        """Refuse rows, ascending; ``kinds`` names each one's fault."""
        if not len(rows):
            return
        self.refused.add(kinds, series.at(self.lines, rows))
        self.signals = [replace(s, values=series.without(s.values, rows)) for s in self.signals]
        self.time, self.lines = series.without(self.time, rows), series.without(self.lines, rows)


def build(table: Table, origin: LogOrigin) -> list[Recording]:
    """Return the recordings of a table, one for each stretch without a gap; their ids are still empty.

    Raises
    ------
    Refusal
        If channels, units or times cannot be made out.
    """
    _check_first_row(table, origin)
    table = _oldest_first(without_statistics(table))
    columns, marked = without_marks(table.columns)
    table = counting_samples(_factored(replace(table, columns=tuple(columns)), origin.rules))
    table = _split_at_headers(on_one_clock(table, origin.rules, origin.path))
    check_wrong_dimension(table.columns, origin.rules, origin.path)
    signals, findings = _named(table, origin)
    signals, assumed = with_coil(signals, origin.rules.coil)
    findings += [*marked, *assumed]
    if not signals:
        raise Refusal(origin.path, "no channel beside the time", "export at least one signal")
    signals = levered(signals, origin.rules, origin.path)
    times = _times(table, origin)
    rows = NamedRows(signals, times.values, table.lines, table.breaks, RejectedRows(table.refused))
    _refuse_missing(rows, origin)
    base = _base(rows, times, table, origin)
    findings = [*table.findings, *times.assumed, *findings, *rows.findings, *_refused_findings(rows), *base.findings]
    return _recordings(rows, base, findings, table, origin)


def _oldest_first(table: Table) -> Table:
    """Return a table from its last row to its first where its times fall from row to row."""
    if table.time is None or not series.in_memory(table.time.values) or not np.all(np.diff(table.time.values) < 0.0):
        return table
    turned = replace(table.cut(lambda values: values[::-1], table.refused), lines=table.lines)
    return turned.finding("newest-first", "its rows stand newest first: they are read from the last one on")


def _named(table: Table, origin: LogOrigin) -> tuple[list[Signal], list[Finding]]:
    """Return the signals of all columns but those that number the rows, and what is said of them."""
    named = mapped_places(origin.rules, table.columns)
    counts = [c for c in table.columns if c.index not in named and numbers_rows(c)]
    if len(counts) == len(table.columns):
        counts = []
    others = tuple(c for c in table.columns if all(c is not other for other in counts))
    signals, findings = name_signals(others, origin.rules, origin.path)
    text = "column {} has no name and numbers the rows: it is no channel"
    return signals, [*(Finding("no-channel", "", None, text.format(c.index)) for c in counts), *findings]


def _split_at_headers(table: Table) -> Table:
    """Return a table without a clock with a break at each repeated header: how long it lasted nothing says."""
    if table.time is not None or any(map(is_counter, table.columns)):
        return table
    lost = RejectedRows(table.refused)
    headers = {r.line for r in lost if r.kind == REPEATED_HEADER}
    if not headers:
        return table
    lines = np.sort(lost.lines)  # what stands directly above or below it belongs to it
    groups = [g.tolist() for g in np.split(lines, 1 + np.flatnonzero(np.diff(lines) > 1))]
    groups = [g for g in groups if not headers.isdisjoint(g)]
    headers.update(line for g in groups for line in g)
    begins = [g[0] for g in groups]
    text = f"the header stands again in line {few(begins, 3)}: a new run begins there"
    kept = [RejectedRow(REPEATED_HEADER if r.line in headers else r.kind, r.line) for r in lost]
    return replace(table, refused=kept, breaks=(*table.breaks, *begins)).finding("repeated-header", text)


def _check_first_row(table: Table, origin: LogOrigin) -> None:
    """Refuse a log whose first row is off the clock and holds powers of ten only: it may be a row of scale factors."""
    if table.time is None or table.rows < 4 or not table.columns or origin.rules.channels:
        return
    steps = np.diff(table.time.values[:4])
    row = np.array([c.values[0] for c in (table.time, *table.columns)])
    off = abs(steps[0] - steps[1]) > 0.5 * abs(steps[1]) and abs(steps[1] - steps[2]) < 0.1 * abs(steps[1])
    if off and np.all(row > 0.0) and np.all(np.log10(row) % 1.0 == 0.0):
        what = f"line {table.lines[0]}, its first row, is off the clock and may hold scale factors"
        remedy = f"delete the line, or write scale or unit of each channel in a channel map ({FILE_NAME} or --map)"
        raise Refusal(origin.path, what, remedy)


def _factored(table: Table, rules: Rules) -> Table:
    """Return a table with the factors that names and units give in its numbers."""
    columns, said = with_factors(table.columns, rules)
    clock = [table.time] if table.time is not None and rules.time is None else []
    times, of_time = with_factors(clock, rules)
    time = times[0] if times else table.time
    return replace(table, columns=tuple(columns), time=time, findings=(*table.findings, *said, *of_time))


def _times(table: Table, origin: LogOrigin) -> RowTimes:
    stated = origin.rules.dt or table.dt
    if table.time is not None:
        values, scale, assumed = in_seconds(table.time, origin.rules, origin.path, stated)
        whose = "map" if origin.rules.dt else "header"
        if stated is None or not _stand_still(values) or whose == "header" and not _lasts(values, stated):
            return RowTimes(values, stated, _last_digit(table.time, scale), tuple(assumed))
        name = table.time.name or table.time.index
        text = f"the times in '{name}' stand still from row to row: the rows are counted at the {whose}'s rate"
        number, said = _numbers(table, origin)
        unused = Finding("times-unused", "", None, text)
        return RowTimes(series.mapped(lambda n: n * stated, number), stated, None, (*assumed, unused, *said))
    if stated is None:
        unclear = "".join(f"; {f.text}" for f in table.findings if f.kind == "rate-unclear")
        raise rate_missing(origin.path, [c.name or str(c.index) for c in table.columns], unclear)
    number, said = _numbers(table, origin)
    return RowTimes(series.mapped(lambda n: table.start + n * stated, number), stated, None, said)


def _stand_still(values: Array) -> bool:
    """Whether most times are those of the row before."""
    return 2 * sum(int(np.count_nonzero(step == 0.0)) for _, step in series.steps(values)) > len(values)


def _lasts(values: Array, interval: float) -> bool:
    """Whether times in whole seconds span what rows of an interval last."""
    lasting = interval * (len(values) - 1)
    ends = series.places(lambda v: np.isfinite(v), values)[[0, -1]]
    first, last = series.at(values, ends)
    return bool(abs(float(last - first) - lasting) <= 1.0 + OFF_RATE * lasting)


def _numbers(table: Table, origin: LogOrigin) -> tuple[series.Values, tuple[Finding, ...]]:
    """Return the sample number of every row where a rate is stated: as a column counts them, else as the rows do."""
    try:
        found = counter_of(table.columns)
    except TimeFault as fault:
        remedy = "write time = COLUMN in a channel map, or ignore = [COLUMN] if it counts something else"
        raise Refusal(origin.path, f"{fault} (line {table.lines[fault.row]})", remedy) from None
    if found is None:
        return _counted(table.lines, RejectedRows(table.refused).without(NO_SAMPLE)), ()
    numbers, usual = found
    if usual != 1.0 and not origin.rules.dt:
        what = (
            f"its samples are counted in steps of {usual:g}, and the stated rate may be that of the counts or the rows"
        )
        raise Refusal(origin.path, what, f"write rate = HZ of the rows in a channel map ({FILE_NAME} or --map)")
    text = "a column counts the samples and leaves some out, repeats some or starts again: its counts are the clock"
    return series.mapped(lambda n: n / usual, numbers), (Finding("counted-samples", "", None, text),)


def _last_digit(time: Column, scale: float) -> float | None:
    """Return the unit of the last digit of most times, in s, where the text shows it."""
    if time.digits is None:
        return None
    some = np.abs(series.thinned(time.values, max(1, len(time.values) // series.SERIES_CHUNK)))
    some = some[np.isfinite(some)]
    return time.digits.step(float(np.median(some))) * scale if len(some) else None


def _counted(lines: Lines, refused: RejectedRows) -> Array:
    """Return the numbers of rows at these lines, those counted that were refused in between."""
    lost, place = np.sort(refused.lines), series.ordinals(len(lines))
    own = place[:] if series.in_memory(lines) else place
    return series.mapped(lambda place, lines: place + np.searchsorted(lost, lines), own, lines)


def _refuse_missing(rows: NamedRows, origin: LogOrigin) -> None:
    _leave_out_loose(rows)
    for signal in rows.signals:
        if all_missing(signal):
            raise Refusal(
                origin.path,
                f"channel '{signal.name}' holds no number at all (NaN in every row)",
                f'leave it out: ignore = ["{signal.name}"] in a channel map',
            )
    _fill_slow(rows, origin.rules)
    stack = [rows.time, *(s.values for s in rows.signals)]
    unsound = series.places(lambda *values: ~np.logical_and.reduce([_sound(v) for v in values]), *stack)
    if len(unsound):
        missing = np.logical_or.reduce([np.isnan(series.at(v, unsound)) for v in stack])
        rows.drop(unsound, ["empty value" if m else "overflow" for m in missing])
    total = len(rows.lines) + len(rows.refused)
    if len(rows.lines) < 2 or len(rows.refused) > len(rows.lines):
        what = f": {_summary(rows.refused)}" if rows.refused else ""
        raise Refusal(
            origin.path,
            f"only {len(rows.lines)} of {total} rows can be read{what}",
            "export the log again, or name its columns in a channel map",
        )


def _sound(values: Array) -> series.Values:
    return np.asarray(np.abs(values) < OVERFLOW)  # false for nan and inf too


def _leave_out_loose(rows: NamedRows) -> None:
    """Leave out columns without unit or known name that are not finite throughout: they must not cost good rows."""
    odd = [(s, series.count(lambda v: ~_sound(v), s.values)) for s in rows.signals if not s.unit]
    loose = [(s, number) for s, number in odd if number]
    if not loose or len(loose) == len(rows.signals):
        return
    rows.signals = [s for s in rows.signals if all(s is not other for other, _ in loose)]
    for signal, number in loose:
        text = f"'{signal.name}' has no unit and is not finite in {number} rows: left out"
        rows.findings.append(Finding("not-read", signal.name, None, text))


def _fill_slow(rows: NamedRows, rules: Rules) -> None:
    """Fill channels that were sampled in every n-th row; leave out others of which most is missing beside full ones.

    What moves or is moved is neither, nor is a channel that the map names.
    """
    length = len(rows.lines)
    counts = [series.count(_sound, s.values) for s in rows.signals]
    if all(2 * count <= length for count in counts):
        return
    kept = []
    for signal, count in zip(rows.signals, counts, strict=True):
        if 2 * count > length or signal.name in CHANNELS.keys() - SLOW_CHANNELS:
            kept.append(signal)
            continue
        places = series.places(_sound, signal.values)
        every = int(places[1] - places[0]) if len(places) > FEWEST_SLOW else 0
        if every > 1 and np.all(np.diff(places) == every) and places[0] < every and length - places[-1] <= every:
            kept.append(replace(signal, values=_between(signal, places, length)))
            text = f"'{signal.name}' has a number in one of {every} rows: interpolated between them"
            rows.findings.append(Finding("slow-channel", signal.name, None, text))
        elif signal.name not in {"current", *rules.channels}:
            text = f"'{signal.name}' has a number in {len(places)} of {length} rows only: left out"
            rows.findings.append(Finding("not-read", signal.name, None, text))
        else:
            kept.append(signal)
    rows.signals = kept


def _between(signal: Signal, places: series.Values, length: int) -> series.Values:
    """Return a slow channel in every row: on a cubic spline, a current that may be switched on straight lines."""
    known = series.at(signal.values, places)
    if signal.name == "current" or not series.in_memory(signal.values):
        return series.interpolated(places, known, length)
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(places, known)(np.clip(np.arange(length), places[0], places[-1])))


def _summary(refused: RejectedRows) -> str:
    return ", ".join(f"{number} × {kind} (first in line {line})" for kind, number, line in refused.first_of_kinds())


def _refused_findings(rows: NamedRows) -> list[Finding]:
    if not rows.refused:
        return []
    return [Finding("refused-rows", "", None, f"rows left out: {_summary(rows.refused)}")]


def _base(rows: NamedRows, times: RowTimes, table: Table, origin: LogOrigin) -> TimeBase:
    try:
        again = _repeated(rows, times)
        rows.drop(again, ["repeated time"] * len(again))
        late = np.setdiff1d(late_rows([s.values for s in rows.signals]), rows.breaks)
        rows.drop(late, ["repeated row"] * len(late))
        base = time_base(rows.time, times.stated, rows.breaks, rows.number, times.printed)
    except TimeFault as fault:
        raise Refusal(
            origin.path,
            f"{fault} (line {rows.lines[fault.row]})",
            "name the true time column (time = …) or give the rate (rate = …) in a channel map",
        ) from None
    lonely = [p for p in base.pieces if p.rows.stop - p.rows.start < 2]
    if lonely:
        lines = [int(rows.lines[p.rows.start]) for p in lonely]
        rows.refused.add(["single row between gaps"] * len(lonely), lines)
        base.pieces = [p for p in base.pieces if p not in lonely]
        base.findings += [replace(f, at=None) for p in lonely for f in p.findings]
    if table.time and base.dt > LONGEST_INTERVAL and not (origin.rules.time or origin.rules.dt):
        text = f"its times in '{table.time.unit or 's'}' make {base.dt:.3g} s from sample to sample"
        raise Refusal(origin.path, text, f'write time = {{column = "{table.time.name}", unit = …}} in a channel map')
    if not base.pieces:
        raise Refusal(origin.path, "no two rows follow each other in time", "check its time column")
    return base


def _repeated(rows: NamedRows, times: RowTimes) -> Index:
    """Return the rows that repeat the row before: its time, and its channels too where times alone do not show it.

    Of many rows with the time of the row before, nearly all have to: else the times are only printed coarsely.
    """
    again = repeated(rows.time, rows.breaks)
    few = len(again) <= max(3, FEW_REPEATED * len(rows.time))
    if not len(again) or few and not coarse(rows.time, times.printed):
        return again
    before = [series.at(s.values, again - 1) for s in rows.signals]
    same = [series.at(s.values, again) == b for s, b in zip(rows.signals, before, strict=True)]
    wholly = again[np.logical_and.reduce(same)]
    return wholly if few or len(wholly) > NEARLY_ALL * len(again) else again[:0]


def _recordings(
    rows: NamedRows, base: TimeBase, said: list[Finding], table: Table, origin: LogOrigin
) -> list[Recording]:
    made = []
    edges = [0, *(int(rows.lines[p.rows.start]) for p in base.pieces[1:]), np.iinfo(np.int64).max]
    for number, piece in enumerate(base.pieces):
        lost = rows.refused.lines
        refused = int(np.count_nonzero((edges[number] <= lost) & (lost < edges[number + 1])))
        record = Recording(
            id="",
            source=origin.path,
            sha256=origin.sha256,
            reader=origin.reader,
            dt=piece.dt or base.dt,
            start=piece.start,
            channels={s.name: on_grid(s.values, piece) for s in rows.signals},
            units={s.name: s.unit or unit_of(s.name) for s in rows.signals},
            columns={s.name: s.index for s in rows.signals},
            rows_kept=piece.rows.stop - piece.rows.start,
            rows_refused=refused,
            findings=(*(said if number == 0 else ()), *piece.findings),
            history=(f"read by {origin.reader}", *table.history, *piece.history),
        )
        judged = _judged(record, number, len(base.pieces), table, origin)
        made.append(decimated(low_passed(judged, origin.rules), origin.rules.decimate))
    return made


def _judged(record: Recording, number: int, runs: int, table: Table, origin: LogOrigin) -> Recording:
    """Add conditions and sanity findings to a recording."""
    short = shortened(record)
    condition, odd = conditions_of(short, number, runs, table.condition, origin.rules)
    judged = (
        *odd,
        *channel_findings(record),
        *fault_findings(short),
        *relation_findings(short),
        *shortening(record, short),
    )
    said = wording(Path(origin.path).stem, origin.rules)
    return replace(record, condition=condition, wording=said, findings=(*record.findings, *judged))
