"""From printed times to a uniform time base: sample interval, gaps, clock jumps, resampling; nothing unsaid."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import cast

import numpy as np
from numpy.typing import NDArray

from mrfit.ingest import series
from mrfit.ingest.printed import print_step
from mrfit.recording import Finding
from mrfit.specs import Array

FILL_AT_MOST = 5
"""Longest run of missing samples that is interpolated; a longer one splits the record."""
TOLERANCE = 0.05
"""Largest departure of a sample from the uniform grid, in samples, that is left as it is."""
IRREGULAR_GAP = 20.0
"""In an unevenly sampled record, a step this many times the median splits it."""

COUNTED = 0.01
"""Largest departure of a step from whole stated intervals, in samples, where steps are counted, not measured."""

FEW_GAPS = 5
"""Up to this many steps of several samples are gaps; more, evenly spread, are the mark of times rounded in print."""

Rows = NDArray[np.int64]


class TimeFault(ValueError):
    """Times that no uniform base can be made of; the text says why, ``row`` where."""

    def __init__(self, text: str, row: int) -> None:
        super().__init__(text)
        self.row = row


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A stretch of rows on one uniform grid.

    Attributes
    ----------
    rows
        Its rows, ascending.
    start
        Time of its first sample, as the file counts.
    position
        Where its rows stand on the grid, in samples; None where row k is sample k.
    findings, history
        What is odd about it (times from its first sample), and what was done to it.
    """

    rows: slice
    start: float
    position: Array | None = None
    findings: tuple[Finding, ...] = ()
    history: tuple[str, ...] = ()


@dataclass(slots=True)
class TimeBase:
    """The uniform time base of a table: interval in s, pieces, and findings (times from its first row)."""

    dt: float
    pieces: list[Piece]
    findings: list[Finding] = field(default_factory=list)


def time_base(time: Array, stated: float | None, breaks: tuple[int, ...] = ()) -> TimeBase:
    """Return the uniform base of times in s.

    Parameters
    ----------
    time
        Times of the rows, shape (N,), N >= 2.
    stated
        Sample interval that a header or the channel map states.
    breaks
        Rows at which the instrument began a new run.

    Raises
    ------
    TimeFault
        If the times run backwards again and again, or do not move.
    """
    if not breaks and (even := _even_base(time, stated)):
        return even
    cuts = _cuts(time, breaks)
    step = _typical_step(time, cuts)
    printed = print_step(time)
    coarsest = series.extremes(printed)[1]
    irregular = _irregular(time, cuts, step, coarsest)
    base = TimeBase(step, [])
    gap = IRREGULAR_GAP * step if irregular else (FILL_AT_MOST + 1.5) * step + coarsest
    runs = _runs(time, cuts, gap)
    counted = stated is not None and not irregular and _counted(time, cuts, step, stated)
    if stated is not None and counted:
        base.dt = stated
    elif not irregular:
        base.dt = _interval(_Clock(time, printed, runs), step, stated, base)
    _say_cuts(time, runs, cuts, base)
    for begin, end in runs:
        run = slice(begin, end)
        own = (series.part(time, run), series.part(printed, run))
        base.pieces.append(_piece(own, begin, base.dt, irregular, counted))
    return base


def _counted(time: Array, cuts: list[int], step: float, stated: float) -> bool:
    """Whether every step is a whole number of stated intervals, most of them one: the rest are missing samples."""
    if abs(step / stated - 1.0) > COUNTED:
        return False
    return all(
        bool(np.all(np.abs(s / stated - np.maximum(np.round(s / stated), 1.0)) < COUNTED))
        for s in _inner_steps(time, cuts)
    )


def _even_base(time: Array, stated: float | None) -> TimeBase | None:
    """Return the base of times that are even throughout, which most are; None if there is anything to look into."""
    rows, first = len(time) - 1, float(time[0])
    dt = (float(time[-1]) - first) / rows
    number = series.ordinals(rows + 1)
    if dt <= 0.0:
        return None
    for t, k in series.chunks(time, number):
        if not float(np.max(np.abs(t - first - dt * k))) <= TOLERANCE * dt:
            return None
    if stated is None:
        slope, _, off = _line(number, time)
        dt = _shortest_decimal(slope, slope * _uncertainty(off / slope, rows))
    elif abs(stated - dt) * rows <= TOLERANCE * dt:
        dt = stated
    else:
        return None
    return TimeBase(dt, [Piece(slice(0, rows + 1), first)])


def _uncertainty(off: float, rows: int) -> float:
    """Return the relative uncertainty of an interval fitted to times that are ``off`` samples off their line."""
    return max((0.1 * off + 1e-9) / max(rows, 1), min(0.02 / max(rows, 1), 1e-7))


def coarse(time: Array) -> bool:
    """Whether times are printed so coarsely that two rows may show the same one."""
    typical = float(np.median(np.abs(_some_steps(time, []))))
    return series.extremes(print_step(time))[1] > 0.5 * typical


def repeated(time: Array, breaks: tuple[int, ...] = ()) -> Rows:
    """Return the rows that repeat the time of the row before, where that is the exception.

    Raises
    ------
    TimeFault
        If the time stands still all along.
    """
    number = sum(int(np.count_nonzero(step == 0.0)) for _, step in series.steps(time))
    if number > 0.9 * max(len(time) - 1, 1):
        raise TimeFault(f"time stands still at {time[0]:g} s", _first(time, lambda step: step == 0.0))
    if number > max(3, 0.02 * len(time)):
        return np.empty(0, dtype=np.int64)  # times printed so coarsely that neighbours look equal
    return np.setdiff1d(_rows_after(time, lambda step: step == 0.0), np.array(breaks, dtype=np.int64))


def _rows_after(values: Array, mask: Callable[[Array], series.Values]) -> Rows:
    """Return the rows before which the step of ``values`` is as ``mask`` says."""
    found = [k + 1 + np.flatnonzero(mask(step)) for k, step in series.steps(values)]
    return np.concatenate(found) if found else np.empty(0, dtype=np.int64)


def _first(values: Array, mask: Callable[[Array], series.Values]) -> int:
    return next(k + 1 + int(np.argmax(m)) for k, step in series.steps(values) if (m := mask(step)).any())


def _cuts(time: Array, breaks: tuple[int, ...]) -> list[int]:
    """Return the rows at which a new run begins: stated ones, and where the clock jumps back."""
    number = sum(int(np.count_nonzero(step < 0.0)) for _, step in series.steps(time))
    back = np.empty(0, dtype=np.int64)
    if number <= max(3, 0.01 * len(time)) + len(breaks):
        back = np.setdiff1d(_rows_after(time, lambda step: step < 0.0), breaks)
        number = len(back)
    if number > max(3, 0.01 * len(time)):
        row = next(
            k + 1 + int(p)
            for k, step in series.steps(time)
            for p in np.flatnonzero(step < 0.0)
            if k + 1 + int(p) not in breaks
        )
        text = f"time runs backwards {number} times, first from {time[row - 1]:g} to {time[row]:g}"
        raise TimeFault(text, row)
    return sorted({*breaks, *(int(b) for b in back)} - {0, len(time)})


def _inner_steps(time: Array, cuts: list[int]) -> Iterator[Array]:
    """Yield the steps within runs, chunk by chunk."""
    edges = np.array(cuts, dtype=np.int64) - 1
    for k, step in series.steps(time):
        inside = edges[(edges >= k) & (edges < k + len(step))] - k
        yield np.delete(step, inside) if len(inside) else step


def _some_steps(time: Array, cuts: list[int]) -> Array:
    """Return the steps within runs; of a record longer than a chunk every so many-th."""
    every = -(-(len(time) - 1) // series.CHUNK)
    # copies, since a view would keep its whole chunk in memory
    some = [step[:: max(every, 1)].copy() for step in _inner_steps(time, cuts)]
    return np.concatenate(some) if some else np.empty(0)


def _mean_of(parts: Iterable[series.Values]) -> float:
    total, number = 0.0, 0
    for values in parts:
        total, number = total + float(np.sum(values)), number + len(values)
    return total / number if number else np.nan


def _typical_step(time: Array, cuts: list[int]) -> float:
    """Return the mean of the ordinary steps, so that times rounded in print still give the true interval."""

    def rising() -> Iterator[Array]:
        return (step[step >= 0.0] for step in _inner_steps(time, cuts))

    if not any(step.any() for step in rising()):
        raise TimeFault("time does not move", 0)
    some = _some_steps(time, cuts)
    middle = float(np.median(some[some >= 0.0])) or _mean_of(rising())
    if _mean_of(np.abs(s - middle) < 0.05 * middle for s in rising()) > 0.8:
        return _mean_of(s[np.abs(s - middle) < 0.05 * middle] for s in rising())
    return _mean_of(s[s <= 2.5 * middle] for s in rising()) or _mean_of(rising())


def _irregular(time: Array, cuts: list[int], step: float, printed: float) -> bool:
    """Whether steps vary so much that gaps cannot be told from slow samples."""

    def ordinary(steps: Array) -> series.Values:
        return np.asarray(np.abs(steps - np.maximum(np.round(steps), 1.0)) < 0.3 + printed / step)

    return _mean_of(ordinary(s / step) for s in _inner_steps(time, cuts)) < 0.9


def _runs(time: Array, cuts: list[int], gap: float) -> list[tuple[int, int]]:
    wide = _rows_after(time, lambda step: step > gap)
    edges = sorted({0, len(time), *cuts, *(int(w) for w in wide)})
    return list(zip(edges[:-1], edges[1:], strict=True))


@dataclass(frozen=True, slots=True)
class _Clock:
    """Times, the step of their print, and the runs between gaps."""

    time: Array
    printed: Array
    runs: list[tuple[int, int]]

    @property
    def longest(self) -> tuple[Array, Array]:
        """Times and print steps of the longest run."""
        rows = slice(*max(self.runs, key=lambda r: r[1] - r[0]))
        return series.part(self.time, rows), series.part(self.printed, rows)


def _interval(clock: _Clock, step: float, stated: float | None, base: TimeBase) -> float:
    """Return the sample interval: the stated one if the times bear it out, else the fit over the whole record."""
    fitted, off, longest = _fit(clock, step)
    coarse = series.extremes(clock.longest[1])[1]
    if stated is not None:
        if abs(stated / fitted - 1.0) * longest <= 2.0 * off + 0.5 or abs(stated / fitted - 1.0) < 1e-6:
            return stated
        text = f"the header states an interval of {stated:.6g} s but the times say {fitted:.6g} s: the times are used"
        base.findings.append(Finding("rate-differs", "", None, text))
    elif off > TOLERANCE and coarse > TOLERANCE * fitted:
        text = f"times are printed to {coarse:g} s only: the interval {fitted:.6g} s is a fit over {longest} rows"
        base.findings.append(Finding("rounded-time", "", None, text))
    return _shortest_decimal(fitted, fitted * _uncertainty(off, longest))


def _places(time: Array, step: float, printed: Array, counted: bool = False) -> Array:
    """Return the sample number of every row: one more than the row before, or more where samples are missing.

    ``counted`` says that steps are whole numbers of ``step`` and no even line is to be drawn through them.
    """

    def ahead(times: Array) -> Array:
        return np.maximum(np.round(np.diff(times) / step), 1.0)

    rows, plain = len(time), series.ordinals(len(time))
    whole = gaps = 0
    for begin, end in series.spans(rows - 1):
        steps = ahead(time[begin : end + 1])
        whole += int(np.count_nonzero(np.abs(np.diff(time[begin : end + 1]) / step - steps) < 0.2))
        gaps += int(np.count_nonzero(steps > 1.0))
    every = whole == rows - 1 and (counted or gaps <= FEW_GAPS)
    if not every:
        slope, off, _ = _line(plain, time)
        if all(np.all(np.abs(o) <= 0.55 * p + TOLERANCE * abs(slope)) for o, p in series.chunks(off, printed)):
            return plain  # one evenly sampled run whose print is rounded
    found, left_out = [np.empty(0, dtype=np.int64)], [np.empty(0)]
    for begin, end in series.spans(rows - 1):
        times, mark = time[begin : end + 1], printed[begin + 1 : end + 1]
        wide = (steps := ahead(times)) > 1.0
        if not every and whole <= 0.95 * (rows - 1):
            # a rounded print makes some steps look like two: only what rounding cannot explain counts as missing
            wide &= np.diff(times) > 1.5 * step + np.where(mark < 0.5 * step, 0.0, mark)
        found.append(begin + 1 + np.flatnonzero(wide))
        left_out.append(steps[wide] - 1.0)
    return cast(Array, series.Places(rows, np.concatenate(found), np.concatenate(left_out)))


def _line(places: Array, time: Array) -> tuple[float, Array, float]:
    """Return the slope of times over sample numbers, how far each is off the line, and the largest of that."""
    at, when = series.mean(places), series.mean(time)
    along = square = 0.0
    for p, t in series.chunks(places, time):
        along += float((p - at) @ (t - when))
        square += float((p - at) @ (p - at))
    slope = along / square
    low, high = series.extremes(series.mapped(lambda p, t: t - when - slope * (p - at), places, time))
    middle = 0.5 * (low + high)
    off = series.mapped(lambda p, t: t - when - slope * (p - at) - middle, places, time)
    return slope, off, max(high - middle, middle - low)


def _fit(clock: _Clock, step: float) -> tuple[float, float, int]:
    """Return interval, largest departure from the grid in samples, and number of samples of the longest run."""
    stretch, printed = clock.longest
    if len(stretch) < 2:
        return step, 0.0, 1
    places = _places(stretch, step, printed)
    rows = slice(*_unbroken(places))
    if 4 * (rows.stop - rows.start) > len(places):  # after a gap the clock may stand in between two samples
        places, stretch = series.part(places, rows), series.part(stretch, rows)
    slope, _, off = _line(places, stretch)
    if slope <= 0.0:
        return step, 0.0, 1
    return slope, off / slope, int(places[-1] - places[0])


def _unbroken(places: Array) -> tuple[int, int]:
    """Return the longest stretch of rows without a missing sample."""
    edges = [0, *_rows_after(places, lambda step: step > 1.0), len(places)]
    k = int(np.argmax(np.diff(edges)))
    return int(edges[k]), int(edges[k + 1])


def _shortest_decimal(value: float, within: float) -> float:
    """Return the interval, or inverse rate, with the fewest digits within an uncertainty."""
    for digits in range(1, 13):
        for candidate in (float(f"{value:.{digits - 1}e}"), 1.0 / float(f"{1.0 / value:.{digits - 1}e}")):
            if abs(candidate - value) <= within:
                return candidate
    return value


def _piece(run: tuple[Array, Array], first: int, dt: float, irregular: bool, counted: bool) -> Piece:
    time, printed = run
    rows, start = slice(first, first + len(time)), float(time[0])
    if len(time) < 2:
        return Piece(rows, start)
    if irregular:
        return _resampled(rows, time, dt, "irregular")
    places = _places(time, dt, printed, counted)
    off = series.mapped(lambda t, p: (t - start) / dt - p, time, places)
    middle = 0.5 * sum(series.extremes(off))
    if series.count(lambda o, p: np.abs(o - middle) > TOLERANCE + 0.6 * p / dt, off, printed):
        return _resampled(rows, time, dt, "jittering")
    missing = int(places[-1]) + 1 - len(places)
    if missing == 0:
        return Piece(rows, start)
    at = float(time[_first(places, lambda step: step > 1.0) - 1])
    text = f"{missing} samples are missing and were interpolated, the first after {at:.6g} s"
    finding = Finding("dropped-samples", "", at - start, text)
    return Piece(rows, start, places, (finding,), (f"interpolated {missing} missing samples",))


def _resampled(rows: slice, time: Array, dt: float, what: str) -> Piece:
    start = float(time[0])
    position = series.mapped(lambda t: (t - start) / dt, time)
    off = max(float(np.max(np.abs(step - 1.0))) for _, step in series.steps(position))
    text = f"times are {what} (steps up to {off:.2g} samples off): resampled linearly to {dt:.6g} s"
    finding = Finding("resampled", "", None, text)
    return Piece(rows, start, position, (finding,), (f"resampled linearly to dt = {dt:.9g} s",))


def _say_cuts(time: Array, runs: list[tuple[int, int]], cuts: list[int], base: TimeBase) -> None:
    for begin, _ in runs[1:]:
        jump = float(time[begin] - time[begin - 1])
        kind = "clock-jump" if jump < 0 else ("new-run" if begin in cuts else "gap")
        text = f"the clock goes from {time[begin - 1]:.6g} to {time[begin]:.6g} s: the record is split there"
        base.findings.append(Finding(kind, "", float(time[begin - 1] - time[0]), text))


def on_grid(values: Array, piece: Piece) -> Array:
    """Return a channel of a piece on its uniform grid."""
    own = series.part(values, piece.rows)
    if piece.position is None:
        return own
    return series.interpolated(piece.position, own, int(np.floor(piece.position[-1] + 1e-9)) + 1)
