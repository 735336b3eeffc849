"""Sample numbers from printed times: which samples are missing, and which steps look odd by rounding only."""

from dataclasses import dataclass
from typing import cast

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mrfit.core.specs import Array
from mrfit.ingest import series

GRID_TOLERANCE = 0.05
"""Largest departure of a sample from the uniform grid, in samples, that is left as it is."""
FEW_GAPS = 5
"""Up to this many steps of several samples, where no row was refused, are gaps; more are the mark of rounded times."""
GAP_WINDOW = 64
"""Rows before and after a missing sample by which it is seen in rounded times."""


@dataclass(frozen=True, slots=True)
class Clock:
    """Times of rows, the step of their print, and the rows' numbers with those counted that were refused in between."""

    time: Array
    printed: Array
    number: Array

    def part(self, rows: slice) -> "Clock":
        """Return a stretch of it."""
        return Clock(*(series.part(values, rows) for values in (self.time, self.printed, self.number)))


def places(clock: Clock, step: float, counted: bool = False) -> Array:
    """Return the sample number of every row: one more than the row before, or more where samples are missing.

    ``counted`` says that steps are whole numbers of ``step`` and no even line is to be drawn through them.
    """
    time, rows = clock.time, len(clock.time)
    whole = gaps = 0
    for begin, end in series.spans(rows - 1):
        ratio = np.diff(time[begin : end + 1]) / step
        steps = np.maximum(np.round(ratio), 1.0)
        whole += int(np.count_nonzero(np.abs(ratio - steps) < 0.2))
        gaps += int(np.count_nonzero(steps > np.diff(clock.number[begin : end + 1])))
    every = whole == rows - 1 and (counted or gaps <= FEW_GAPS)
    if not every and (even := _even(clock, step)) is not None:
        return even
    found, left_out = [np.empty(0, dtype=np.int64)], [np.empty(0)]
    for begin, end in series.spans(rows - 1):
        jump, mark = np.diff(time[begin : end + 1]), clock.printed[begin + 1 : end + 1]
        wide = (steps := np.maximum(np.round(jump / step), 1.0)) > 1.0
        if not every and whole <= 0.95 * (rows - 1):
            # a rounded print makes some steps look like two: only what rounding cannot explain counts as missing
            wide &= jump > 1.5 * step + np.where(mark < 0.5 * step, 0.0, mark)
        found.append(begin + 1 + np.flatnonzero(wide))
        left_out.append(steps[wide] - 1.0)
    return _leaving_out(rows, found, left_out)


def _even(clock: Clock, step: float) -> Array | None:
    """Return the numbers by which all times lie on one line, as far as their print shows; None if there are none.

    Tried are rows without a missing sample, with the refused rows counted, and with missing samples found in the times.
    """
    rows = len(clock.time)
    after = [(k + 1 + np.flatnonzero(s > 1.0), s[s > 1.0] - 1.0) for k, s in series.steps(clock.number)]
    tried: list[Array] = [series.ordinals(rows)]
    if any(len(k) for k, _ in after):
        tried.append(_leaving_out(rows, [k for k, _ in after], [s for _, s in after]))
    best = min(tried, key=lambda numbers: line(numbers, clock.time)[2])
    if _fits(best, clock):
        return best
    found = _found(clock, step)
    return found if found is not None and _fits(found, clock) else None


def _leaving_out(rows: int, found: list[series.Values], left_out: list[series.Values]) -> Array:
    return cast(Array, series.Places(rows, np.concatenate(found), np.concatenate(left_out)))


def _fits(numbers: Array, clock: Clock) -> bool:
    slope, off, _ = line(numbers, clock.time)
    return all(
        bool(np.all(np.abs(o) <= 0.55 * p + GRID_TOLERANCE * abs(slope))) for o, p in series.chunks(off, clock.printed)
    )


def _found(clock: Clock, step: float) -> Array | None:
    """Return the numbers with the samples counted that are missing in rounded times; None if there are none.

    Times less an even line lie in a band as wide as their print; behind a missing sample the band is a step higher, so
    that the rows around it span more than is usual, even where each step for itself could be rounding.
    """
    rows: list[int] = []
    left_out: list[float] = []
    for begin, end in series.spans(len(clock.time)):
        off = clock.time[begin:end] - step * np.arange(end - begin)
        if len(off) < 4 * GAP_WINDOW:
            continue
        windows = sliding_window_view(off, GAP_WINDOW)
        low, high = windows.min(axis=1), windows.max(axis=1)
        usual = float(np.median((high - low)[:: GAP_WINDOW // 2]))
        span = high[GAP_WINDOW:] - low[:-GAP_WINDOW]  # of the rows before and after row GAP_WINDOW, …
        wide = np.flatnonzero(span > usual + 0.5 * step)
        for region in np.split(wide, 1 + np.flatnonzero(np.diff(wide) > 1)):
            if len(region):
                around = slice(int(region[0]), int(region[-1]) + 2 * GAP_WINDOW)
                middle = 0.5 * (low[region[0]] + high[region[-1] + GAP_WINDOW])
                rows.append(begin + around.start + 1 + int(np.argmin(np.cumsum(off[around] - middle))))
                left_out.append(max(1.0, np.round((float(span[region].max()) - usual) / step)))
    return _leaving_out(len(clock.time), [np.array(rows, dtype=np.int64)], [np.array(left_out)]) if rows else None


def line(numbers: Array, time: Array) -> tuple[float, Array, float]:
    """Return the slope of times over sample numbers, how far each is off the line, and the largest of that."""
    at, when = series.mean(numbers), series.mean(time)
    along = square = 0.0
    for p, t in series.chunks(numbers, time):
        along += float((p - at) @ (t - when))
        square += float((p - at) @ (p - at))
    slope = along / square
    low, high = series.extremes(series.mapped(lambda p, t: t - when - slope * (p - at), numbers, time))
    middle = 0.5 * (low + high)
    off = series.mapped(lambda p, t: t - when - slope * (p - at) - middle, numbers, time)
    return slope, off, max(high - middle, middle - low)
