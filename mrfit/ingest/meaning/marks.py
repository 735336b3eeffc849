"""Numbers that stand for missing ones, as -999 or 99999, and zeros of a sensor that drops out: found and taken out.

A number is a mark by how it lies among the others, never by its size alone: it stands exactly the same in several rows,
and far outside all others, or alone among values that move on smoothly.
"""

from collections.abc import Container, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.recording import Finding
from mrfit.ingest import series
from mrfit.ingest.meaning import units
from mrfit.ingest.series import Values
from mrfit.ingest.table import Column

_NINES = [10.0**n - 1.0 + part for n in range(2, 10) for part in (0.0, 0.25, 0.9, 0.99, 0.999)]
_LIMITS = [65535.0, 8388607.0, 8388608.0, 2147483647.0, 2147483648.0, 4294967295.0]
_SCALED = [code / 10.0**n for code in (32767.0, 32768.0) for n in range(5)]
# the last two are what SCPI instruments print
_PRINTED = [1.0, 6999.0, 7999.0, 888.0, 8888.0, 88888.0, *(10.0**n for n in range(6, 39)), 9.9e37, 9.91e37]
MISSING_MARKS = np.array(
    sorted({sign * mark for mark in (*_NINES, *_LIMITS, *_SCALED, *_PRINTED) for sign in (1.0, -1.0)})
)
"""What loggers and converters write where they have no value."""
SAME_MARK = 1e-7
"""Relative departure of a mark that was stored in single precision."""
FAR_MARK, FAR_ALONE = 1.0, 4.0
"""Distance from the range of all others, in that range, of a mark in several rows, and in a single one."""
MECHANICAL_UNITS = ("m", "m/s", "N", "N*m", "rad")
FAR_LEVEL, LEVEL_ROWS = 20.0, 4096
"""The same for any other number that stands exactly the same in several rows, and rows by which it is looked for."""
SMOOTH_CHANNEL = 20.0
"""Range of a channel in its greatest ordinary steps from which it moves on smoothly."""
MARK_JUMP = 5.0
"""Least step into a mark and out of it, in greatest ordinary steps of a smooth channel."""
HELD_ROWS, SURE_MARK = 3, 99.0
"""Rows of a single run that is a mark, and the least number that is one so: smaller ones are pulses of a channel."""
FEWEST_MARK_LEVELS = 10
"""A channel of fewer values is a switch or a code."""
CODES = 300
"""A channel of fewer steps from end to end is printed coarsely."""
AROUND = 7
"""Rows on either side of a run of zeros by which it is seen how the channel goes there."""
DROPOUT_DISTANCE = 3.0
"""Least distance from zero of the rows beside a drop-out, in the greatest step around it."""
SURE_DROPOUTS = 2
"""Runs of zeros that are drop-outs, from which on all zeros are under which the channel moves."""
FEWEST_DROPOUTS, MOST_ZEROS, SCATTERED_ZEROS = 3, 0.25, 0.05
"""Least number of zeros, and greatest share of rows, that are drop-outs; above the last share not evenly apart."""
SCATTER_CODES = 2.0
"""Least step about a drop-out, in the least distance of values: what a held level scatters by."""
SHORT_DROPOUT = 5
"""Rows of a run of zeros over which a channel goes on as before."""
DROPOUT_WAY = 2.0
"""Least way on one side of a longer run, over as many rows, in the greatest step there: a held level does not move."""
EVEN = 0.1
"""Relative scatter from which distances between runs, or values beside them, are not all one."""


def without_marks(columns: Sequence[Column]) -> tuple[tuple[Column, ...], list[Finding]]:
    """Return columns with nan where a number stands for a missing one, and findings on them.

    A column of which more than half is missing is left out, so that it does not cost the rows of the others.
    """
    kept: list[Column] = []
    findings: list[Finding] = []
    marks = [list(_marks(c.values, anything=_is_mechanical(c))) for c in columns]
    if known := {mark for found in marks for mark, _ in found} - {0.0}:
        marks = [list(_marks(c.values, known, _is_mechanical(c))) for c in columns]
    for column, found in zip(columns, marks, strict=True):
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
        """Return the distance of a number from the range."""
        return max(self.low - mark, mark - self.high)

    @property
    def smooth(self) -> bool:
        """Whether they move on in steps that are small against their range."""
        return self.spread > SMOOTH_CHANNEL * self.step


def _is_mechanical(column: Column) -> bool:
    """Whether a column is a motion or a force, which makes no pulses of one exact height, as a current may."""
    unit = column.unit or ""
    return units.known(unit) and any(units.compatible(unit, own) for own in MECHANICAL_UNITS)


def _marks(values: Values, known: Container[float] = (), anything: bool = False) -> Iterator[tuple[float, Values]]:
    """Yield marks with their rows; a mark ``known`` from another column needs to be outside, or alone, but once.

    With ``anything``, a mark may be any number.
    """
    low, high = _ends(values)
    tried = [
        float(m)
        for m in MISSING_MARKS[
            (MISSING_MARKS >= low - SAME_MARK * abs(low)) & (MISSING_MARKS <= high + SAME_MARK * abs(high))
        ]
    ]
    levels = [end for end in _far_ends(values, low, high) if end not in tried] if anything else []
    tried += levels
    places = {mark: rows for mark in tried if len(rows := series.places(lambda v, m=mark: _is(v, m), values))}
    # marks nearer to each other than single precision are one: the nearest
    first = {mark: float(series.at(values, rows[:1])[0]) for mark, rows in places.items()}
    nearest = {v: min((m for m in places if first[m] == v), key=lambda m: abs(m - v)) for v in first.values()}
    places = {mark: rows for mark, rows in places.items() if nearest[first[mark]] == mark}
    zeros = series.places(lambda v: v == 0.0, values) if low <= 0.0 <= high else np.empty(0, dtype=np.int64)
    if not places and not FEWEST_DROPOUTS <= len(zeros) <= MOST_ZEROS * len(values):
        return
    others = _others(values, list(places))
    if others is None:
        return
    for mark, rows in places.items():
        away = others.distance(mark)
        if mark in levels:
            if len(rows) > 1 and away > FAR_LEVEL * others.spread:
                yield mark, rows
            continue
        # a power of ten that stands once is a garbled number, which is said by itself
        enough = FAR_MARK if len(rows) > 1 else np.inf if float(np.log10(abs(mark))).is_integer() else FAR_ALONE
        is_far = away > (0.0 if mark in known else enough * others.spread)
        if is_far or len(rows := _alone(values, rows, mark, others, 1 if mark in known else 2)):
            yield mark, rows
    if len(dropouts := _dropouts(values, zeros, others)):
        yield 0.0, dropouts


def _far_ends(values: Values, low: float, high: float) -> list[float]:
    """Return the ends of a channel that lie far from most of its values."""
    some = series.thinned(values, max(1, len(values) // LEVEL_ROWS))
    some = some[np.isfinite(some)]
    if not len(some):
        return []
    bottom, top = np.percentile(some, (5.0, 95.0))
    with np.errstate(over="ignore"):
        return [float(end) for end in (low, high) if max(bottom - end, end - top) > FAR_LEVEL * (top - bottom) > 0.0]


def _is(values: Values, mark: float) -> Values:
    return np.asarray(np.abs(values - mark) <= SAME_MARK * abs(mark))


def _ends(values: Values) -> tuple[float, float]:
    """Return the lowest and the highest number; inf and -inf where there is none."""
    ends = [(np.inf, -np.inf)]
    for (v,) in series.chunks(values):
        low, high = (float(v.min()), float(v.max())) if len(v) else ends[0]
        sound = v if np.isfinite([low, high]).all() else v[np.isfinite(v)]
        ends += [(float(sound.min()), float(sound.max()))] if len(sound) else []
    return min(e[0] for e in ends), max(e[1] for e in ends)


def _others(values: Values, marks: list[float]) -> _Others | None:
    """Return the properties of the other values; None where there are too few different ones."""
    low, high, step, levels = np.inf, -np.inf, 0.0, 0
    for (v,) in series.chunks(values):
        own = np.isfinite(v) & ~np.logical_or.reduce([np.zeros(len(v), bool), *(_is(v, m) for m in marks)])
        if not own.any():
            continue
        sound = v[own]
        low, high = min(low, float(sound.min())), max(high, float(sound.max()))
        levels = max(levels, len(np.unique(sound[:: max(1, len(sound) // 1000)])))
        # zeros may be drop-outs, too: their steps are no ordinary ones
        moves = np.flatnonzero(own[1:] & own[:-1] & (v[1:] != 0.0) & (v[:-1] != 0.0))
        steps = np.abs(v[moves + 1] - v[moves])
        step = max(step, float(np.percentile(steps, 99.5))) if len(steps) else step
    return _Others(low, high, levels, step) if levels >= FEWEST_MARK_LEVELS else None


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


def _alone(values: Values, rows: Values, mark: float, others: _Others, fewest: int) -> Values:
    """Return the rows at which a channel jumps to a number and away; all, if it mostly does so.

    It has to do so ``fewest`` times, by steps that are large against the ordinary ones of a smooth channel, or else
    against those beside each run. Beside them the number may be the channel's own value at times.
    """
    runs = _runs(values, rows)
    before, behind = (np.nan_to_num(np.abs(v - mark), nan=np.inf) for v in (runs.before, runs.behind))
    steps = _steps_beside(values, runs)
    alone = np.minimum(before, behind) > MARK_JUMP * (others.step if others.smooth else steps)
    if np.count_nonzero(alone) < fewest and not (abs(mark) >= SURE_MARK and _is_held_apart(runs, alone, steps)):
        return rows[:0]
    return rows if 2 * np.count_nonzero(alone) >= len(alone) else runs.rows(alone)


def _steps_beside(values: Values, runs: _Runs) -> Values:
    """Return the greatest step of a channel beside each run, and across it: how far it goes there by itself."""
    ways = [_beside(values, edge, way) for edge, way in ((runs.first, -1), (runs.last, 1))]
    with np.errstate(over="ignore"):
        steps = np.nan_to_num(np.abs(np.concatenate([np.diff(way, axis=0) for way in ways])), nan=np.inf)
        across = np.nan_to_num(np.abs(runs.behind - runs.before), nan=np.inf) / (runs.last - runs.first + 2)
    return np.asarray(np.maximum(steps.max(axis=0), across))


def _is_held_apart(runs: _Runs, alone: Values, steps: Values) -> bool:
    """Whether one run, alone, is several rows long and the channel goes on behind it as it went before."""
    length = runs.last - runs.first + 1
    way = np.abs(runs.behind - runs.before) <= 1.5 * (length + 1) * steps
    return bool(np.all(alone & way & (length >= HELD_ROWS)))


def _dropouts(values: Values, zeros: Values, others: _Others) -> Values:
    """Return the rows of zeros to which a channel jumps and from which it jumps away, by what it does around them.

    Over a short run it goes on as before. Beside a longer one it moves, as no level does that is switched off.
    A channel that hops over zero from level to level, or is chopped evenly, has no drop-outs.
    """
    none = np.empty(0, dtype=np.int64)
    if not FEWEST_DROPOUTS <= len(zeros) <= MOST_ZEROS * len(values):
        return none
    some = np.unique(values[0 : series.SERIES_CHUNK])
    code = float(np.min(np.diff(some[np.isfinite(some)])))
    coarse = others.spread < CODES * code
    if coarse and (not others.smooth or len(zeros) > SCATTERED_ZEROS * len(values)):
        return none  # a converter of 8 bits is at zero by itself, steep as its signal is
    runs = _runs(values, zeros)
    length = runs.last - runs.first + 1
    before, behind = (_beside(values, start, way) for start, way in ((runs.first, -1), (runs.last, 1)))
    steps = np.nan_to_num(np.abs(np.concatenate([np.diff(before, axis=0), np.diff(behind, axis=0)])), nan=-1.0)
    # a level held near zero scatters by some codes, and is zero by itself
    step = np.where(steps.max(axis=0) < 0.0, others.step, np.maximum(steps.max(axis=0), SCATTER_CODES * code))
    same = np.sign(runs.before) == np.sign(runs.behind)
    stride = np.maximum(1, length // (AROUND - 1))
    ways = (_way(_beside(values, s, w * stride)) for s, w in ((runs.first, -1), (runs.last, 1)))
    with np.errstate(over="ignore"):  # a garbled number may be 1e308
        least = 2.0 * others.step * (length + 1) if coarse else DROPOUT_DISTANCE * step
        jumps = np.minimum(np.abs(runs.before), np.abs(runs.behind)) > np.maximum(DROPOUT_DISTANCE * step, least)
        goes_on = same & (np.abs(runs.behind - runs.before) <= 1.5 * (length + 1) * step)
        moves = np.maximum(*ways) > DROPOUT_WAY * step
    found = jumps & np.where(length <= SHORT_DROPOUT, goes_on, moves)
    hops = found & ~same
    if np.count_nonzero(hops) > 2 and _is_even(np.abs(np.concatenate([runs.before[hops], runs.behind[hops]]))):
        found &= same
    rows = runs.rows(found) if found.any() else none
    if np.count_nonzero(found) >= SURE_DROPOUTS and not coarse:
        likely = (np.abs(runs.behind - runs.before) <= 1.5 * (length + 1) * step) & (length > 1) & (moves | goes_on)
        rows = runs.rows(found := found | likely)
    chopped = len(rows) > SCATTERED_ZEROS * len(values) and _is_even(np.diff(runs.first[found]))
    return none if len(rows) < FEWEST_DROPOUTS or chopped else rows


def _beside(values: Values, edge: Values, way: Values | int) -> Values:
    """Return the values of some rows beside each edge, going a way of rows each time; nan for zeros and none."""
    found = []
    for k in range(1, AROUND + 1):
        rows = edge + k * way
        order = np.argsort(rows, kind="stable")
        inside = order[(rows[order] >= 0) & (rows[order] < len(values))]
        some = np.full(len(rows), np.nan)
        some[inside] = series.at(values, rows[inside])
        found.append(np.where(some == 0.0, np.nan, some))
    return np.array(found)


def _way(beside: Values) -> Values:
    """Return the range of each column; 0 where it has no number."""
    top, bottom = (np.max(np.nan_to_num(sign * beside, nan=-np.inf), axis=0) for sign in (1.0, -1.0))
    return np.asarray(np.where(np.isfinite(top), top + bottom, 0.0))


def _is_even(distances: Values) -> bool:
    return len(distances) > 2 and float(np.std(distances)) < EVEN * float(np.mean(distances))
