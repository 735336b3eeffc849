"""From printed times to a uniform time base: sample interval, gaps, clock jumps, resampling; nothing unsaid."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrfit.recording import Finding
from mrfit.specs import Array

FILL_AT_MOST = 5
"""Longest run of missing samples that is interpolated; a longer one splits the record."""
TOLERANCE = 0.05
"""Largest departure of a sample from the uniform grid, in samples, that is left as it is."""
IRREGULAR_GAP = 20.0
"""In an unevenly sampled record, a step this many times the median splits it."""

PRINT_BLOCK = 512
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
    irregular = _irregular(time, cuts, step, float(printed.max()))
    base = TimeBase(step, [])
    gap = IRREGULAR_GAP * step if irregular else (FILL_AT_MOST + 1.5) * step + float(printed.max())
    runs = _runs(time, cuts, gap)
    base.dt = step if irregular else _interval(_Clock(time, printed, runs), step, stated, base)
    _say_cuts(time, runs, cuts, base)
    for begin, end in runs:
        base.pieces.append(_piece((time[begin:end], printed[begin:end]), begin, base.dt, irregular))
    return base


def _even_base(time: Array, stated: float | None) -> TimeBase | None:
    """Return the base of times that are even throughout, which most are; None if there is anything to look into."""
    rows = len(time) - 1
    dt = float(time[-1] - time[0]) / rows
    off = float(np.max(np.abs(time - time[0] - dt * np.arange(rows + 1)))) if dt > 0.0 else np.inf
    if off > TOLERANCE * dt:
        return None
    if stated is None:
        slope, left = _line(np.arange(rows + 1, dtype=np.float64), time)
        dt = _shortest_decimal(slope, slope * _uncertainty(float(np.max(np.abs(left))) / slope, rows))
    elif abs(stated - dt) * rows <= TOLERANCE * dt:
        dt = stated
    else:
        return None
    return TimeBase(dt, [Piece(slice(0, rows + 1), float(time[0]))])


def _uncertainty(off: float, rows: int) -> float:
    """Return the relative uncertainty of an interval fitted to times that are ``off`` samples off their line."""
    return max((0.1 * off + 1e-9) / max(rows, 1), min(0.02 / max(rows, 1), 1e-7))


def coarse(time: Array) -> bool:
    """Whether times are printed so coarsely that two rows may show the same one."""
    steps = np.diff(time)
    return bool(float(print_step(time).max()) > 0.5 * float(np.median(np.abs(steps))))


def print_step(time: Array) -> Array:
    """Return the unit of the last printed decimal of every time, found over blocks of rows; 0 where there is none."""
    ends = [*range(0, len(time), PRINT_BLOCK), len(time)]
    blocks = [_decimal_step(time[a:b]) for a, b in zip(ends[:-1], ends[1:], strict=True)]
    # a block in which the print changes shows the finer step: its neighbours know better
    wide = [max(blocks[max(0, k - 1) : k + 2]) for k in range(len(blocks))]
    return np.repeat(wide, np.diff(ends)).astype(np.float64)


def _decimal_step(time: Array) -> float:
    some = time[:: max(1, len(time) // 64)]
    for decimals in range(13):
        scaled = some * 10.0**decimals
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-4):
            if decimals < 9 or np.max(np.abs(scaled)) < 1e11:
                return float(10.0**-decimals)
            return 0.0
    return 0.0


def repeated(time: Array, breaks: tuple[int, ...] = ()) -> Rows:
    """Return the rows that repeat the time of the row before, where that is the exception.

    Raises
    ------
    TimeFault
        If the time stands still all along.
    """
    same = np.flatnonzero(np.diff(time) == 0.0) + 1
    if len(same) > 0.9 * max(len(time) - 1, 1):
        raise TimeFault(f"time stands still at {time[0]:g} s", int(same[0]))
    if len(same) > max(3, 0.02 * len(time)):
        return same[:0]  # times printed so coarsely that neighbours look equal
    return np.setdiff1d(same, np.array(breaks, dtype=np.int64))


def _cuts(time: Array, breaks: tuple[int, ...]) -> list[int]:
    """Return the rows at which a new run begins: stated ones, and where the clock jumps back."""
    back = np.flatnonzero(np.diff(time) < 0.0) + 1
    back = np.setdiff1d(back, breaks)
    if len(back) > max(3, 0.01 * len(time)):
        text = f"time runs backwards {len(back)} times, first from {time[back[0] - 1]:g} to {time[back[0]]:g}"
        raise TimeFault(text, int(back[0]))
    return sorted({*breaks, *(int(b) for b in back)} - {0, len(time)})


def _inner_steps(time: Array, cuts: list[int]) -> Array:
    step = np.diff(time)
    if cuts:
        step = np.delete(step, np.array(cuts) - 1)
    return step


def _typical_step(time: Array, cuts: list[int]) -> float:
    """Return the mean of the ordinary steps, so that times rounded in print still give the true interval."""
    step = _inner_steps(time, cuts)
    step = step[step >= 0.0]
    if not step.size or not step.any():
        raise TimeFault("time does not move", 0)
    middle = float(np.median(step)) or float(np.mean(step))
    sharp = np.abs(step - middle) < 0.05 * middle
    if np.mean(sharp) > 0.8:
        return float(np.mean(step[sharp]))
    ordinary = step[step <= 2.5 * middle]
    return float(np.mean(ordinary)) or float(np.mean(step))


def _irregular(time: Array, cuts: list[int], step: float, printed: float) -> bool:
    """Whether steps vary so much that gaps cannot be told from slow samples."""
    steps = _inner_steps(time, cuts) / step
    ordinary = np.abs(steps - np.maximum(np.round(steps), 1.0)) < 0.3 + printed / step
    return bool(np.mean(ordinary) < 0.9)


def _runs(time: Array, cuts: list[int], gap: float) -> list[tuple[int, int]]:
    wide = np.flatnonzero(np.diff(time) > gap) + 1
    edges = sorted({0, len(time), *cuts, *(int(w) for w in wide)})
    return list(zip(edges[:-1], edges[1:], strict=True))


@dataclass(frozen=True, slots=True)
class _Clock:
    """Times, the step of their print, and the runs between gaps."""

    time: Array
    printed: Array
    runs: list[tuple[int, int]]

    @property
    def longest(self) -> slice:
        """Rows of the longest run."""
        return slice(*max(self.runs, key=lambda r: r[1] - r[0]))


def _interval(clock: _Clock, step: float, stated: float | None, base: TimeBase) -> float:
    """Return the sample interval: the stated one if the times bear it out, else the fit over the whole record."""
    fitted, off, longest = _fit(clock, step)
    coarse = float(clock.printed[clock.longest].max())
    if stated is not None:
        if abs(stated / fitted - 1.0) * longest <= 2.0 * off + 0.5 or abs(stated / fitted - 1.0) < 1e-6:
            return stated
        text = f"the header states an interval of {stated:.6g} s but the times say {fitted:.6g} s: the times are used"
        base.findings.append(Finding("rate-differs", "", None, text))
    elif off > TOLERANCE and coarse > TOLERANCE * fitted:
        text = f"times are printed to {coarse:g} s only: the interval {fitted:.6g} s is a fit over {longest} rows"
        base.findings.append(Finding("rounded-time", "", None, text))
    return _shortest_decimal(fitted, fitted * _uncertainty(off, longest))


def _places(time: Array, step: float, printed: Array) -> Array:
    """Return the sample number of every row: one more than the row before, or more where samples are missing."""
    plain = np.arange(len(time), dtype=np.float64)
    steps = np.diff(time) / step
    ahead = np.maximum(np.round(steps), 1.0)
    missing = np.concatenate([[0.0], np.cumsum(ahead)])
    whole = np.abs(steps - ahead) < 0.2
    if whole.all() and np.count_nonzero(ahead > 1.0) <= FEW_GAPS:
        return missing
    slope, off = _line(plain, time)
    if np.all(np.abs(off) <= 0.55 * printed + TOLERANCE * abs(slope)):
        return plain  # one evenly sampled run whose print is rounded
    if np.mean(whole) > 0.95:
        return missing
    # a rounded print makes some steps look like two: only what rounding cannot explain counts as missing
    beyond = np.diff(time) > 1.5 * step + np.where(printed[1:] < 0.5 * step, 0.0, printed[1:])
    return np.concatenate([[0.0], np.cumsum(np.where(beyond, ahead, 1.0))])


def _line(places: Array, time: Array) -> tuple[float, Array]:
    """Return the slope of times over sample numbers, and how far each is off the line."""
    k = places - places.mean()
    slope = float(k @ (time - time.mean()) / (k @ k))
    off = time - time.mean() - slope * k
    return slope, off - 0.5 * (off.max() + off.min())


def _fit(clock: _Clock, step: float) -> tuple[float, float, int]:
    """Return interval, largest departure from the grid in samples, and number of samples of the longest run."""
    stretch = clock.time[clock.longest]
    if len(stretch) < 2:
        return step, 0.0, 1
    places = _places(stretch, step, clock.printed[clock.longest])
    begin, end = _unbroken(places)
    if 4 * (end - begin) > len(places):  # after a gap the clock may stand in between two samples
        places, stretch = places[begin:end], stretch[begin:end]
    slope, off = _line(places, stretch)
    if slope <= 0.0:
        return step, 0.0, 1
    return slope, float(np.max(np.abs(off)) / slope), int(places[-1] - places[0])


def _unbroken(places: Array) -> tuple[int, int]:
    """Return the longest stretch of rows without a missing sample."""
    edges = [0, *(np.flatnonzero(np.diff(places) > 1.0) + 1), len(places)]
    k = int(np.argmax(np.diff(edges)))
    return int(edges[k]), int(edges[k + 1])


def _shortest_decimal(value: float, within: float) -> float:
    """Return the interval, or inverse rate, with the fewest digits within an uncertainty."""
    for digits in range(1, 13):
        for candidate in (float(f"{value:.{digits - 1}e}"), 1.0 / float(f"{1.0 / value:.{digits - 1}e}")):
            if abs(candidate - value) <= within:
                return candidate
    return value


def _piece(run: tuple[Array, Array], first: int, dt: float, irregular: bool) -> Piece:
    time, printed = run
    rows = slice(first, first + len(time))
    if len(time) < 2:
        return Piece(rows, float(time[0]))
    if irregular:
        return _resampled(rows, time, dt, "irregular")
    places = _places(time, dt, printed)
    off = (time - time[0]) / dt - places
    allowed = TOLERANCE + 0.55 * printed / dt
    if np.any(np.abs(off - 0.5 * (off.max() + off.min())) > allowed):
        return _resampled(rows, time, dt, "jittering")
    missing = int(places[-1]) + 1 - len(places)
    if missing == 0:
        return Piece(rows, float(time[0]))
    at = int(np.flatnonzero(np.diff(places) > 1.0)[0])
    text = f"{missing} samples are missing and were interpolated, the first after {time[at]:.6g} s"
    finding = Finding("dropped-samples", "", float(time[at] - time[0]), text)
    return Piece(rows, float(time[0]), places, (finding,), (f"interpolated {missing} missing samples",))


def _resampled(rows: slice, time: Array, dt: float, what: str) -> Piece:
    position = (time - time[0]) / dt
    off = float(np.max(np.abs(np.diff(position) - 1.0)))
    text = f"times are {what} (steps up to {off:.2g} samples off): resampled linearly to {dt:.6g} s"
    finding = Finding("resampled", "", None, text)
    return Piece(rows, float(time[0]), position, (finding,), (f"resampled linearly to dt = {dt:.9g} s",))


def _say_cuts(time: Array, runs: list[tuple[int, int]], cuts: list[int], base: TimeBase) -> None:
    for begin, _ in runs[1:]:
        jump = float(time[begin] - time[begin - 1])
        kind = "clock-jump" if jump < 0 else ("new-run" if begin in cuts else "gap")
        text = f"the clock goes from {time[begin - 1]:.6g} to {time[begin]:.6g} s: the record is split there"
        base.findings.append(Finding(kind, "", float(time[begin - 1] - time[0]), text))


def on_grid(values: Array, piece: Piece) -> Array:
    """Return a channel of a piece on its uniform grid."""
    own = values[piece.rows]
    if piece.position is None:
        return own
    grid = np.arange(np.floor(piece.position[-1] + 1e-9) + 1.0)
    return np.interp(grid, piece.position, own)
