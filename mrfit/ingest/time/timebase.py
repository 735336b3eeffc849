"""From printed times to a uniform time base: sample interval, gaps, clock jumps, resampling; nothing unsaid."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.core.recording import Finding
from mrfit.core.specs import Array, Index
from mrfit.ingest import series
from mrfit.ingest.text.printed import print_step
from mrfit.ingest.time.numbering import GRID_TOLERANCE, Clock, line, places

FILL_AT_MOST = 5
"""Longest run of missing samples that is interpolated; a longer one splits the record."""
IRREGULAR_GAP = 20.0
"""In an unevenly sampled record, a step this many times the median splits it."""

COUNTED_STEPS = 0.01
"""Largest departure of a step from whole intervals, in samples, where steps are counted, not measured."""
FINE_PRINT = 0.01
"""Times printed to this share of the interval, or finer, show every missing sample."""
MISSING_AT_MOST = 0.15
"""Largest share of steps over missing samples where nothing but the print tells them from a slower clock."""

FEWEST_OF_RUN, EVEN = 20, 0.1
"""Rows above which a run has a rate of its own, and largest departure of its steps from their median."""
WHOLE_TICKS, FEWEST_TICKS = 0.02, 20
"""Departure of steps from whole ticks of a clock, and fewest ticks by which an even interval is seen in them."""
SAID_ONE_BY_ONE = 3
"""More cuts of one kind than this are said in one line."""

Rows = Index


class TimeFault(ValueError):
    """Times that no uniform base can be made of; the text says why, ``row`` where."""

    def __init__(self, text: str, row: int) -> None:
        super().__init__(text)
        self.row = row


@dataclass(frozen=True, slots=True, eq=False)
class GridPiece:
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
    dt
        Its own interval in s, where the runs of a log differ in it.
    """

    rows: slice
    start: float
    position: Array | None = None
    findings: tuple[Finding, ...] = ()
    history: tuple[str, ...] = ()
    dt: float | None = None


@dataclass(slots=True)
class TimeBase:
    """The uniform time base of a table: interval in s, pieces, and findings that concern all of it."""

    dt: float
    pieces: list[GridPiece]
    findings: list[Finding] = field(default_factory=list)


def time_base(
    time: Array,
    stated: float | None,
    breaks: tuple[int, ...] = (),
    number: Array | None = None,
    printed: float | None = None,
) -> TimeBase:
    """Return the uniform base of times in s.

    Parameters
    ----------
    time
        Times of the rows, shape (N,), N >= 2.
    stated
        Sample interval that a header or the channel map states.
    breaks
        Rows at which the instrument began a new run.
    number
        The rows counted with those that were refused in between, shape (N,); None where there were none.
    printed
        Unit of the last digit in s, where the text shows it; the numbers alone do not show final zeros.

    Raises
    ------
    TimeFault
        If the times run backwards again and again, do not move, or span many more samples than there are rows.
    """
    if not breaks and (even := _even_base(time, stated)):
        return even
    cuts = _cuts(time, breaks)
    if cuts and _differ_in_rate(time, runs := _runs(time, cuts, np.inf)):
        return _of_own_rates(time, runs, cuts, stated, number, printed)
    step = _typical_step(time, cuts)
    whole = _whole_step(time, cuts) if printed is not None and printed <= FINE_PRINT * step else None
    step = step if whole is None else whole
    clock = Clock(time, print_step(time), series.ordinals(len(time)) if number is None else number)
    coarsest = series.extremes(clock.printed)[1]
    irregular = _irregular(time, cuts, step, coarsest)
    base = TimeBase(step, [])
    gap = IRREGULAR_GAP * step if irregular else (FILL_AT_MOST + 1.5) * step + coarsest
    runs = _runs(time, cuts, gap)
    counted = stated is not None and not irregular and _counted(time, cuts, step, stated)
    if stated is not None and counted:
        base.dt = stated
    elif not irregular:
        counted = whole is not None
        longest = clock.part(slice(*max(runs, key=lambda r: r[1] - r[0])))
        base.dt = _interval(longest, step, stated, base, counted)
    for (begin, end), said in zip(runs, _cut_findings(time, runs, cuts), strict=True):
        piece = _piece(clock.part(slice(begin, end)), begin, base.dt, irregular, counted)
        base.pieces.append(replace(piece, findings=(*said, *piece.findings)))
    resampled = any(f.kind == "resampled" for p in base.pieces for f in p.findings)
    ticking = _ticking_base(time, stated) if resampled and not cuts and number is None else None
    return ticking or base


def _ticking_base(time: Array, stated: float | None) -> TimeBase | None:
    """Return the even base of which times are rounded to ticks of a clock, of any length; None if they are not."""
    number = series.ordinals(len(time))
    tick = min(float(np.min(s, where=s > 0.0, initial=np.inf)) for _, s in series.steps(time))
    whole = all(bool(np.all(np.abs(s / tick - np.round(s / tick)) < WHOLE_TICKS)) for _, s in series.steps(time))
    slope, _, off = line(number, time)
    if not whole or off > 0.55 * tick:
        return None
    if (span := float(time[-1] - time[0])) < FEWEST_TICKS * tick:
        return None
    dt = _shortest_decimal(slope, 0.5 * slope * tick / span)
    low, high = series.extremes(series.mapped(lambda t, k: t - dt * k, time, number))
    if high - low > (1.0 + WHOLE_TICKS) * tick:  # times are rounded within one tick
        dt = _shortest_decimal(slope, slope * _uncertainty(off / slope, len(time)))
    if stated is not None and abs(stated / slope - 1.0) * len(time) > 2.0 * off / slope + 0.5:
        return None
    text = f"times are rounded to {tick:.6g} s: the interval {stated or dt:.6g} s is a fit over {len(time)} rows"
    said = Finding("rounded-time", "", None, text)
    return TimeBase(stated or dt, [GridPiece(slice(0, len(time)), float(time[0]))], [said])


def _differ_in_rate(time: Array, runs: list[tuple[int, int]]) -> bool:
    """Whether runs, each even in itself, differ in their interval by more than coarse print makes."""
    if any(end - begin <= FEWEST_OF_RUN for begin, end in runs):
        return False
    parts = [series.part(time, slice(*run)) for run in runs]
    steps = [float(np.median(_some_steps(part, []))) for part in parts]
    if min(steps) <= 0.0 or max(steps) <= (1.0 + 2.0 * EVEN) * min(steps):
        return False
    return all(
        bool(np.all(np.abs(s - step) < EVEN * step))
        for part, step in zip(parts, steps, strict=True)
        for s in _inner_steps(part, [])
    )


def _of_own_rates(
    time: Array,
    runs: list[tuple[int, int]],
    cuts: list[int],
    stated: float | None,
    number: Array | None,
    printed: float | None,
) -> TimeBase:
    """Return the base of runs of different rates: each has its own interval."""
    base = TimeBase(0.0, [])
    for (begin, end), said in zip(runs, _cut_findings(time, runs, cuts), strict=True):
        rows = slice(begin, end)
        own_number = None if number is None else series.part(number, rows)
        own = time_base(series.part(time, rows), stated, (), own_number, printed)
        base.dt = base.dt or own.dt
        base.findings += own.findings
        shifted = [slice(begin + p.rows.start, begin + p.rows.stop) for p in own.pieces]
        pieces = [replace(p, rows=rows, dt=own.dt) for p, rows in zip(own.pieces, shifted, strict=True)]
        pieces[-1] = replace(pieces[-1], findings=(*said, *pieces[-1].findings))
        base.pieces += pieces
    return base


def _counted(time: Array, cuts: list[int], step: float, stated: float) -> bool:
    """Whether every step is a whole number of stated intervals, most of them one: the rest are missing samples."""
    if abs(step / stated - 1.0) > COUNTED_STEPS:
        return False
    return all(
        bool(np.all(np.abs(s / stated - np.maximum(np.round(s / stated), 1.0)) < COUNTED_STEPS))
        for s in _inner_steps(time, cuts)
    )


def _whole_step(time: Array, cuts: list[int]) -> float | None:
    """Return the step of which all steps are whole multiples, and nearly all one; None if there is none."""
    step = float(np.median(_some_steps(time, cuts)))
    if step <= 0.0 or not _counted(time, cuts, step, step):
        return None
    single = _mean_of(np.asarray(s < 1.5 * step, dtype=np.float64) for s in _inner_steps(time, cuts))
    return step if single >= 1.0 - MISSING_AT_MOST else None


def _even_base(time: Array, stated: float | None) -> TimeBase | None:
    """Return the base of times that are even throughout, which most are; None if there is anything to look into."""
    rows, first = len(time) - 1, float(time[0])
    dt = (float(time[-1]) - first) / rows
    number = series.ordinals(rows + 1)
    if dt <= 0.0:
        return None
    for t, k in series.chunks(time, number):
        if not float(np.max(np.abs(t - first - dt * k))) <= GRID_TOLERANCE * dt:
            return None
    if stated is None:
        slope, _, off = line(number, time)
        dt = _shortest_decimal(slope, slope * _uncertainty(off / slope, rows))
    elif abs(stated - dt) * rows <= GRID_TOLERANCE * dt:
        dt = stated
    else:
        return None
    return TimeBase(dt, [GridPiece(slice(0, rows + 1), first)])


def _uncertainty(off: float, rows: int) -> float:
    """Return the relative uncertainty of an interval fitted to times that are ``off`` samples off their line."""
    return max((0.1 * off + 1e-9) / max(rows, 1), min(0.02 / max(rows, 1), 1e-7))


def coarse(time: Array, printed: float | None = None) -> bool:
    """Whether times are printed so coarsely that two rows may show the same one; ``printed`` as for ``time_base``."""
    typical = float(np.median(np.abs(_some_steps(time, []))))
    if printed is not None and printed <= FINE_PRINT * typical:
        return False
    return series.extremes(print_step(time))[1] > 0.5 * typical


def repeated(time: Array, breaks: tuple[int, ...] = ()) -> Rows:
    """Return the rows that repeat the time of the row before.

    Raises
    ------
    TimeFault
        If the time stands still all along.
    """
    number = sum(int(np.count_nonzero(step == 0.0)) for _, step in series.steps(time))
    if number > 0.9 * max(len(time) - 1, 1):
        raise TimeFault(f"time stands still at {time[0]:g} s", _first(time, lambda step: step == 0.0))
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
    every = -(-(len(time) - 1) // series.SERIES_CHUNK)
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


def _interval(clock: Clock, step: float, stated: float | None, base: TimeBase, counted: bool) -> float:
    """Return the sample interval: the stated one if the times of the longest run bear it out, else the fit over it."""
    fitted, off, longest = _fit(clock, step, counted)
    coarse = series.extremes(clock.printed)[1]
    if stated is not None:
        if abs(stated / fitted - 1.0) * longest <= 2.0 * off + 0.5 or abs(stated / fitted - 1.0) < 1e-6:
            return stated
        text = f"an interval of {stated:.6g} s is stated but the times say {fitted:.6g} s: the times are used"
        base.findings.append(Finding("rate-differs", "", None, text))
    elif off > GRID_TOLERANCE and coarse > GRID_TOLERANCE * fitted:
        text = f"times are printed to {coarse:g} s only: the interval {fitted:.6g} s is a fit over {longest} rows"
        base.findings.append(Finding("rounded-time", "", None, text))
    return _shortest_decimal(fitted, fitted * _uncertainty(off, longest))


def _fit(clock: Clock, step: float, counted: bool) -> tuple[float, float, int]:
    """Return interval, largest departure from the grid in samples, and number of samples of a run."""
    time = clock.time
    if len(time) < 2:
        return step, 0.0, 1
    numbers = places(clock, step, counted)
    rows = slice(*_unbroken(numbers))
    if not counted and 4 * (rows.stop - rows.start) > len(
        numbers
    ):  # after a gap the clock may stand in between two samples
        numbers, time = series.part(numbers, rows), series.part(time, rows)
    slope, _, off = line(numbers, time)
    if slope <= 0.0:
        return step, 0.0, 1
    return slope, off / slope, int(numbers[-1] - numbers[0])


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


def _piece(run: Clock, first: int, dt: float, irregular: bool, counted: bool) -> GridPiece:
    time = run.time
    rows, start = slice(first, first + len(time)), float(time[0])
    if len(time) < 2:
        return GridPiece(rows, start)
    if irregular:
        _check_length((float(time[-1]) - start) / dt, run, first, dt)
        return _resampled(rows, time, dt, "irregular")
    numbers = places(run, dt, counted)
    off = series.mapped(lambda t, p: (t - start) / dt - p, time, numbers)
    middle = 0.5 * sum(series.extremes(off))
    if series.count(lambda o, p: np.abs(o - middle) > GRID_TOLERANCE + 0.6 * p / dt, off, run.printed):
        _check_length((float(time[-1]) - start) / dt, run, first, dt)
        return _resampled(rows, time, dt, "jittering")
    missing = int(numbers[-1]) + 1 - len(numbers)
    if missing == 0:
        return GridPiece(rows, start)
    _check_length(float(numbers[-1]), run, first, dt)
    at = float(time[_first(numbers, lambda step: step > 1.0) - 1])
    are = "samples are missing and were" if missing > 1 else "sample is missing and was"
    text = f"{missing} {are} interpolated, the first after {at:.6g} s"
    finding = Finding("dropped-samples", "", at - start, text)
    return GridPiece(rows, start, numbers, (finding,), (f"interpolated {missing} missing samples",))


def _check_length(last: float, run: Clock, first: int, dt: float) -> None:
    """Refuse times that span so many samples that a time must be wrong, before memory is taken for them."""
    rows = len(run.time)
    if last <= IRREGULAR_GAP * rows:
        return
    widest = max((float(step.max()), k + 1 + int(np.argmax(step))) for k, step in series.steps(run.time))
    text = f"{rows} rows span {last:.3g} samples of {dt:.3g} s: the time steps by {widest[0]:.3g} s"
    raise TimeFault(text, first + widest[1])


def _resampled(rows: slice, time: Array, dt: float, what: str) -> GridPiece:
    start = float(time[0])
    position = series.mapped(lambda t: (t - start) / dt, time)
    off = max(float(np.max(np.abs(step - 1.0))) for _, step in series.steps(position))
    text = f"times are {what} (steps up to {off:.2g} samples off): resampled linearly to {dt:.6g} s"
    finding = Finding("resampled", "", None, text)
    return GridPiece(rows, start, position, (finding,), (f"resampled linearly to dt = {dt:.9g} s",))


def _cut_findings(time: Array, runs: list[tuple[int, int]], cuts: list[int]) -> list[tuple[Finding, ...]]:
    """Return the finding on the end of each run; of many cuts of one kind, once at the first of them."""
    found: list[tuple[Finding, ...]] = []
    where: dict[str, list[int]] = {}
    for number, ((begin, end), (following, _)) in enumerate(zip(runs, runs[1:], strict=False)):
        jump = float(time[following] - time[end - 1])
        kind = "clock-jump" if jump < 0 else ("new-run" if following in cuts else "gap")
        text = f"the clock goes from {time[end - 1]:.6g} to {time[following]:.6g} s: the record is split there"
        found.append((Finding(kind, "", float(time[end - 1] - time[begin]), text),))
        where.setdefault(kind, []).append(number)
    for numbers in where.values():
        if len(numbers) > SAID_ONE_BY_ONE:
            (first,) = found[numbers[0]]
            found[numbers[0]] = (replace(first, text=f"{first.text}, and so {len(numbers) - 1} more times"),)
            for number in numbers[1:]:
                found[number] = ()
    return [*found, ()]


def on_grid(values: Array, piece: GridPiece) -> Array:
    """Return a channel of a piece on its uniform grid."""
    own = series.part(values, piece.rows)
    if piece.position is None:
        return own
    return series.interpolated(piece.position, own, int(np.floor(piece.position[-1] + 1e-9)) + 1)
