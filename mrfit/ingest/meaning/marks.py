"""Numbers that stand for missing ones, as -999 or 99999, and zeros of a sensor that drops out: found and taken out.

A number is a mark by how it lies among the others, never by its size alone: it stands exactly the same in several rows,
and far outside all others, or alone among values that move on smoothly.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.recording import Finding
from mrfit.ingest import series
from mrfit.ingest.series import Values
from mrfit.ingest.table import Column

_NINES = [10.0**n - 1.0 + part for n in range(3, 10) for part in (0.0, 0.25, 0.9, 0.99, 0.999)]
_LIMITS = [32767.0, 32768.0, 65535.0, 8388607.0, 8388608.0, 2147483647.0, 2147483648.0, 4294967295.0]
_PRINTED = [6999.0, 7999.0, 8888.0, 88888.0, *(10.0**n for n in range(6, 30))]
MARKS = np.array(sorted({sign * mark for mark in (*_NINES, *_LIMITS, *_PRINTED) for sign in (1.0, -1.0)}))
"""What loggers and converters write where they have no value."""
EXACT = 1e-7
"""Relative departure of a mark that was stored in single precision."""
FAR, FAR_ALONE = 1.0, 4.0
"""Distance from the range of all others, in that range, of a mark in several rows, and in a single one."""
SMOOTH = 20.0
"""Range of a channel in its greatest ordinary steps from which it moves on smoothly."""
JUMP = 5.0
"""Least step into a mark and out of it, in greatest ordinary steps of a smooth channel."""
NEAREST = 2.0
"""Least distance from zero of the values beside a drop-out, in greatest ordinary steps for each row of it."""
LEVELS = 10
"""A channel of fewer values is a switch or a code."""
LONGEST_DROPOUT, FEWEST_DROPOUTS, MOST_ZEROS = 5, 3, 0.05
"""Rows of a run of zeros, number of such runs, and share of rows, that are drop-outs."""


def without_marks(columns: Sequence[Column]) -> tuple[tuple[Column, ...], list[Finding]]:
    """Return columns with nan where a number stands for a missing one, and findings on them.

    A column of which more than half is missing is left out, so that it does not cost the rows of the others.
    """
    kept: list[Column] = []
    findings: list[Finding] = []
    for column in columns:
        found = list(_marks(column.values))
        rows = np.unique(np.concatenate([rows for _, rows in found])) if found else np.empty(0, dtype=np.int64)
        shown = " and ".join(f"{mark:.10g} in {len(rows)} rows" for mark, rows in found)
        if 2 * len(rows) > len(column.values) and len(columns) > 1:
            text = f"'{column.name}': {shown} stands for missing values, which is most of them: left out"
            findings.append(Finding("not-read", "", None, text))
            continue
        kept.append(replace(column, values=series.blanked(column.values, rows)) if found else column)
        if found:
            text = f"'{column.name}': {shown} stands for missing values, being far from all others or alone among them"
            findings.append(Finding("missing-values", "", None, text))
    return tuple(kept), findings


@dataclass(frozen=True, slots=True)
class _Others:
    """All values of a channel but marks: their ends, how many differ, and the greatest ordinary step."""

    low: float
    high: float
    levels: int
    step: float

    @property
    def spread(self) -> float:
        """Their range."""
        return self.high - self.low

    def distance(self, mark: float) -> float:
        """Return how far a number lies outside."""
        return max(self.low - mark, mark - self.high)

    @property
    def smooth(self) -> bool:
        """Whether they move on in steps that are small against their range."""
        return self.spread > SMOOTH * self.step


def _marks(values: Values) -> Iterator[tuple[float, Values]]:
    """Yield marks with their rows."""
    low, high = _ends(values)
    tried = [float(m) for m in MARKS[(MARKS >= low - EXACT * abs(low)) & (MARKS <= high + EXACT * abs(high))]]
    places = {mark: rows for mark in tried if len(rows := series.places(lambda v, m=mark: _is(v, m), values))}
    zeros = series.places(lambda v: v == 0.0, values) if low <= 0.0 <= high else np.empty(0, dtype=np.int64)
    if not places and not FEWEST_DROPOUTS <= len(zeros) <= MOST_ZEROS * len(values):
        return
    others = _others(values, list(places))
    if others is None:
        return
    for mark, rows in places.items():
        away = others.distance(mark)
        # a power of ten that stands once is a garbled number, which is said by itself
        enough = FAR if len(rows) > 1 else np.inf if float(np.log10(abs(mark))).is_integer() else FAR_ALONE
        is_far = away > enough * others.spread
        if is_far or len(rows := _alone(values, rows, mark, others)):
            yield mark, rows
    if len(dropouts := _dropouts(values, zeros, others)):
        yield 0.0, dropouts


def _is(values: Values, mark: float) -> Values:
    return np.asarray(np.abs(values - mark) <= EXACT * abs(mark))


def _ends(values: Values) -> tuple[float, float]:
    """Return the lowest and the highest number; inf and -inf where there is none."""
    ends = [(np.inf, -np.inf)]
    for (v,) in series.chunks(values):
        low, high = (float(v.min()), float(v.max())) if len(v) else ends[0]
        sound = v if np.isfinite([low, high]).all() else v[np.isfinite(v)]
        ends += [(float(sound.min()), float(sound.max()))] if len(sound) else []
    return min(e[0] for e in ends), max(e[1] for e in ends)


def _others(values: Values, marks: list[float]) -> _Others | None:
    """Return what the other values are like; None where there are too few different ones."""
    low, high, step, levels = np.inf, -np.inf, 0.0, 0
    for (v,) in series.chunks(values):
        own = np.isfinite(v) & ~np.logical_or.reduce([np.zeros(len(v), bool), *(_is(v, m) for m in marks)])
        if not own.any():
            continue
        sound = v[own]
        low, high = min(low, float(sound.min())), max(high, float(sound.max()))
        levels = max(levels, len(np.unique(sound[:: max(1, len(sound) // 1000)])))
        # zeros may be drop-outs, too: their steps are no ordinary ones
        steps = np.abs(np.diff(v))[own[1:] & own[:-1] & (v[1:] != 0.0) & (v[:-1] != 0.0)]
        step = max(step, float(np.percentile(steps, 99.5))) if len(steps) else step
    return _Others(low, high, levels, step) if levels >= LEVELS else None


@dataclass(frozen=True, slots=True)
class _Runs:
    """Runs of neighbouring rows: first and last row, and the values before and behind; nan at the ends of the log."""

    first: Values
    last: Values
    before: Values
    behind: Values

    def rows(self, mask: Values) -> Values:
        """Return the rows of some runs."""
        return np.concatenate([np.arange(a, b + 1) for a, b in zip(self.first[mask], self.last[mask], strict=True)])


def _runs(values: Values, rows: Values) -> _Runs:
    edges = np.flatnonzero(np.diff(rows) > 1)
    first, last = rows[np.append(0, edges + 1)], rows[np.append(edges, len(rows) - 1)]
    inside, on = first > 0, last < len(values) - 1
    before, behind = np.full(len(first), np.nan), np.full(len(first), np.nan)
    before[inside], behind[on] = series.at(values, first[inside] - 1), series.at(values, last[on] + 1)
    return _Runs(first, last, before, behind)


def _alone(values: Values, rows: Values, mark: float, others: _Others) -> Values:
    """Return the rows at which a smooth channel jumps to a number and away; all, if it mostly does so.

    Beside them the number may be the channel's own value at times.
    """
    runs = _runs(values, rows)
    before, behind = (np.nan_to_num(np.abs(v - mark), nan=np.inf) for v in (runs.before, runs.behind))
    alone = np.minimum(before, behind) > JUMP * others.step
    if not others.smooth or np.count_nonzero(alone) < 2:
        return rows[:0]
    return rows if 2 * np.count_nonzero(alone) >= len(alone) else runs.rows(alone)


def _dropouts(values: Values, zeros: Values, others: _Others) -> Values:
    """Return the rows of zeros to which a smooth channel jumps, and from which it goes on as before."""
    none = np.empty(0, dtype=np.int64)
    if not others.smooth or not FEWEST_DROPOUTS <= len(zeros) <= MOST_ZEROS * len(values):
        return none
    runs = _runs(values, zeros)
    length = runs.last - runs.first + 1
    near = np.minimum(np.abs(runs.before), np.abs(runs.behind))
    goes_on = np.abs(runs.behind - runs.before) <= 1.5 * (length + 1) * others.step
    alone = (length <= LONGEST_DROPOUT) & goes_on & (near > NEAREST * others.step * (length + 1)) & (near > 0.0)
    if np.count_nonzero(alone) < FEWEST_DROPOUTS:
        return none
    return runs.rows(alone)
