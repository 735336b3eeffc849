"""From a reader's table to recordings: names, SI units, a uniform time base, conditions and findings."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mrfit.channels import unit_of
from mrfit.ingest import units
from mrfit.ingest.channel_map import FILE_NAME, Rules
from mrfit.ingest.conditions import conditions_of
from mrfit.ingest.naming import Signal, all_missing, check_wrong_dimension, name_signals
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.sanity import sanity_findings
from mrfit.ingest.table import Refused, Table
from mrfit.ingest.timebase import Piece, TimeBase, TimeFault, coarse, on_grid, repeated, time_base
from mrfit.recording import Finding, Recording
from mrfit.specs import Array

OVERFLOW = 1e30
"""Magnitude from which a number is an instrument's mark for overflow."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a table comes from, as its recordings say it."""

    path: str
    sha256: str
    reader: str
    rules: Rules


@dataclass(slots=True)
class Rows:
    """Named signals and times of the rows still kept, and the rows refused so far."""

    signals: list[Signal]
    time: Array
    lines: NDArray[np.int64]
    breaks: tuple[int, ...]
    refused: list[Refused]
    findings: list[Finding] = field(default_factory=list)

    def keep(self, mask: Mask, kinds: Iterable[str]) -> None:
        """Drop the rows where ``mask`` is false; ``kinds`` names each one's fault."""
        if mask.all():
            return
        self.refused += [Refused(k, int(n)) for k, n in zip(kinds, self.lines[~mask], strict=True)]
        self.breaks = tuple(int(np.count_nonzero(mask[:b])) for b in self.breaks)
        self.signals = [replace(s, values=s.values[mask]) for s in self.signals]
        self.time, self.lines = self.time[mask], self.lines[mask]


def build(table: Table, origin: Origin) -> list[Recording]:
    """Return the recordings of a table, one for each stretch without a gap; their ids are still empty.

    Raises
    ------
    Refusal
        If channels, units or times cannot be made out.
    """
    check_wrong_dimension(table.columns, origin.rules, origin.path)
    signals, findings = name_signals(table.columns, origin.rules, origin.path)
    if not signals:
        raise Refusal(origin.path, "no channel beside the time", "export at least one signal")
    time, stated = _times(table, origin)
    rows = Rows(signals, time, table.lines, table.breaks, list(table.refused))
    _refuse_missing(rows, origin)
    base = _base(rows, stated, origin)
    findings = [*table.findings, *findings, *rows.findings, *_refused_findings(rows), *base.findings]
    return _recordings(rows, base, findings, table, origin)


def _times(table: Table, origin: Origin) -> tuple[Array, float | None]:
    """Return the times of all rows in s, and the interval stated by map or header."""
    stated = origin.rules.dt or table.dt
    if table.time is not None:
        text = table.time.unit or "s"
        if not units.known(text) or not units.compatible(text, "s"):
            remedy = 'write the true one in the channel map: time = {column = …, unit = "ms"}'
            raise Refusal(origin.path, f"time column '{table.time.name}' is in '{text}'", remedy)
        scale = units.to_unit(text, "s").scale
        return (table.time.values if scale == 1.0 else table.time.values * scale), stated
    if stated is None:
        raise Refusal(
            origin.path,
            f"no time column and no sample rate (columns: {_shown(table)})",
            f"write rate = HZ, or time = COLUMN, in a channel map ({FILE_NAME} beside the log, or --map)",
        )
    return table.start + _ordinals(table) * stated, stated


def _shown(table: Table) -> str:
    return ", ".join(f"'{c.name}'" if c.name else str(c.index) for c in table.columns)


def _ordinals(table: Table) -> Array:
    """Return the place of every row among all rows of the file, refused ones counted."""
    lost = np.sort(np.array([r.line for r in table.refused], dtype=np.int64))
    return np.arange(table.rows, dtype=np.float64) + np.searchsorted(lost, table.lines)


def _refuse_missing(rows: Rows, origin: Origin) -> None:
    _leave_out_loose(rows)
    for signal in rows.signals:
        if all_missing(signal):
            raise Refusal(
                origin.path,
                f"channel '{signal.name}' holds no number at all (NaN in every row)",
                f'leave it out: ignore = ["{signal.name}"] in a channel map',
            )
    stack = [rows.time, *(s.values for s in rows.signals)]
    sound = [np.abs(v) < OVERFLOW for v in stack]  # false for nan and inf too
    mask = np.logical_and.reduce(sound)
    if not mask.all():
        missing = np.logical_or.reduce([np.isnan(v) for v in stack])[~mask]
        rows.keep(mask, ["empty value" if m else "overflow" for m in missing])
    total = len(rows.lines) + len(rows.refused)
    if len(rows.lines) < 2 or len(rows.refused) > len(rows.lines):
        what = f": {_summary(rows.refused)}" if rows.refused else ""
        raise Refusal(
            origin.path,
            f"only {len(rows.lines)} of {total} rows can be read{what}",
            "export the log again, or name its columns in a channel map",
        )


def _leave_out_loose(rows: Rows) -> None:
    """Leave out columns without unit or known name that are not finite throughout: they must not cost good rows."""
    loose = [s for s in rows.signals if not s.unit and not np.all(np.abs(s.values) < OVERFLOW)]
    if not loose or len(loose) == len(rows.signals):
        return
    rows.signals = [s for s in rows.signals if all(s is not other for other in loose)]
    for signal in loose:
        count = int(np.count_nonzero(~(np.abs(signal.values) < OVERFLOW)))
        text = f"'{signal.name}' has no unit and is not finite in {count} rows: left out"
        rows.findings.append(Finding("not-read", signal.name, None, text))


def _summary(refused: list[Refused]) -> str:
    first: dict[str, int] = {}
    for row in sorted(refused, key=lambda r: r.line):
        first.setdefault(row.kind, row.line)
    counts = Counter(r.kind for r in refused)
    return ", ".join(f"{counts[k]} × {k} (first in line {line})" for k, line in first.items())


def _refused_findings(rows: Rows) -> list[Finding]:
    if not rows.refused:
        return []
    return [Finding("refused-rows", "", None, f"rows left out: {_summary(rows.refused)}")]


def _base(rows: Rows, stated: float | None, origin: Origin) -> TimeBase:
    try:
        again = repeated(rows.time, rows.breaks)
        if len(again) and coarse(rows.time):
            again = again[[all(s.values[k] == s.values[k - 1] for s in rows.signals) for k in again]]
        if len(again):
            mask = np.ones(len(rows.time), dtype=bool)
            mask[again] = False
            rows.keep(mask, ["repeated time"] * len(again))
        base = time_base(rows.time, stated, rows.breaks)
    except TimeFault as fault:
        raise Refusal(
            origin.path,
            f"{fault} (line {rows.lines[fault.row]})",
            "name the true time column (time = …) or give the rate (rate = …) in a channel map",
        ) from None
    lonely = [p for p in base.pieces if p.rows.stop - p.rows.start < 2]
    if lonely:
        rows.refused += [Refused("single row between gaps", int(rows.lines[p.rows.start])) for p in lonely]
        base.pieces = [p for p in base.pieces if p not in lonely]
    if not base.pieces:
        raise Refusal(origin.path, "no two rows follow each other in time", "check its time column")
    return base


def _recordings(rows: Rows, base: TimeBase, said: list[Finding], table: Table, origin: Origin) -> list[Recording]:
    made = []
    edges = [0, *(int(rows.lines[p.rows.start]) for p in base.pieces[1:]), np.iinfo(np.int64).max]
    for number, piece in enumerate(base.pieces):
        refused = sum(edges[number] <= r.line < edges[number + 1] for r in rows.refused)
        record = Recording(
            id="",
            source=origin.path,
            sha256=origin.sha256,
            reader=origin.reader,
            dt=base.dt,
            start=piece.start,
            channels={s.name: on_grid(s.values, piece) for s in rows.signals},
            units={s.name: s.unit or unit_of(s.name) for s in rows.signals},
            columns={s.name: s.index for s in rows.signals},
            rows_kept=piece.rows.stop - piece.rows.start,
            rows_refused=refused,
            findings=(*_of_piece(said, piece, number, rows), *piece.findings),
            history=(f"read by {origin.reader}", *table.history, *piece.history),
        )
        made.append(_judged(record, number, len(base.pieces), table, origin))
    return made


def _of_piece(said: list[Finding], piece: Piece, number: int, rows: Rows) -> list[Finding]:
    """Return the findings that concern a piece, their times counted from its first sample."""
    begin = float(rows.time[piece.rows.start] - rows.time[0])
    end = float(rows.time[piece.rows.stop - 1] - rows.time[0])
    chosen = []
    for finding in said:
        if finding.at is None:
            chosen += [finding] if number == 0 else []
        elif begin <= finding.at <= end:
            chosen.append(replace(finding, at=finding.at - begin))
    return chosen


def _judged(record: Recording, number: int, runs: int, table: Table, origin: Origin) -> Recording:
    """Add conditions and sanity findings to a recording."""
    condition, odd = conditions_of(record, number, runs, table.condition, origin.rules)
    findings = (*record.findings, *odd, *sanity_findings(record))
    return replace(record, condition=condition, findings=findings)
