"""Choice of the data of a figure: segment, cycles, points, units and panels."""

import math
from collections.abc import Sequence
from itertools import groupby

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.report.numbers import natural, unit_html
from mrfit.report.source import OutputSeries

CURVE_PANELS = 12
CYCLES = 2.0
LONGEST_CURVE = 20_000
"""Samples of a curve in the plane that are looked at."""
BEYOND = 0.5
"""How far a figure follows a simulation that leaves the measured values, in extents of these."""
_PREFIXES = {-3: "m", -6: "µ", 3: "k", 6: "M"}


def decimate(values: Array, limit: int) -> Index:
    """Return indices (at most ``limit``) of the least and greatest value of every stretch, so that no peak is lost.

    First and last sample are kept; all indices if there are no more than ``limit``.

    Parameters
    ----------
    values
        Curve, shape (N,).
    limit
        Points to keep, at least 4.
    """
    count = len(values)
    if count <= limit:
        return np.arange(count, dtype=np.int64)
    edges = np.linspace(0, count, (limit - 2) // 2 + 1).astype(np.int64)
    lengths = np.diff(edges)[:, None]
    # a stretch a row, the shorter ones with their last sample again
    rows = values[edges[:-1, None] + np.minimum(np.arange(lengths.max()), lengths - 1)]
    ends = edges[:-1] + np.stack([rows.argmin(axis=1), rows.argmax(axis=1)])
    return np.unique(np.append(ends, [0, count - 1]))


def simplified(across: Array, up: Array, tolerance: float = 0.002) -> Index:
    """Return indices of the points that keep a curve in the plane to a tolerance (Ramer, Douglas and Peucker).

    Parameters
    ----------
    across, up
        Curve, shape (N,) each; of more than ``LONGEST_CURVE`` samples every n-th is looked at.
    tolerance
        How far the curve may be off, as a share of its extent in either direction.
    """
    step = -(-len(across) // LONGEST_CURVE)
    first = np.arange(0, len(across), step, dtype=np.int64)
    points = unit_extent(across[first]) + 1j * unit_extent(up[first])
    if not np.isfinite(points).all():
        return first
    kept, waiting = {0, len(first) - 1}, [(0, len(first) - 1)]
    while waiting:
        a, b = waiting.pop()
        if b - a < 2:
            continue
        chord = complex(points[b] - points[a])
        rest = points[a + 1 : b] - points[a]
        along = (rest * (chord.conjugate() / max(abs(chord) ** 2, 1e-30))).real
        off = np.abs(rest - chord * np.minimum(np.maximum(along, 0.0), 1.0))
        worst = int(np.argmax(off))
        if off[worst] > tolerance:
            middle = a + 1 + worst
            kept.add(middle)
            waiting += [(a, middle), (middle, b)]
    return first[sorted(kept)]


def unit_extent(values: Array) -> Array:
    """Return values scaled to an extent of one."""
    extent = float(np.max(values) - np.min(values)) if len(values) else 0.0
    return values / extent if extent > 0.0 else np.zeros_like(values)


def shown_cycles(series: OutputSeries, cycles: float = CYCLES) -> slice:
    """Return the samples of the first cycles, or all where the test is not periodic."""
    if series.frequency <= 0.0:
        return slice(None)
    seconds = cycles / series.frequency * (1.0 + 1e-9)
    return slice(0, int(np.searchsorted(series.time - series.time[0], seconds, side="right")))


def worst_of_each(series: Sequence[OutputSeries]) -> list[OutputSeries]:
    """Return for every condition its part with the largest RMS residual, conditions in natural order."""
    ordered = sorted(series, key=lambda s: (natural(s.condition), s.segment, s.role))
    by_condition = groupby(ordered, key=lambda s: s.condition)
    return [max(parts, key=lambda s: s.error if math.isfinite(s.error) else math.inf) for _, parts in by_condition]


def shared_inputs(series: Sequence[OutputSeries]) -> list[str]:
    """Return the inputs that all series have, in the order of the first; none of no series."""
    return [name for name in (series[0].inputs if series else ()) if all(name in s.inputs for s in series)]


def sheets(series: Sequence[OutputSeries]) -> list[list[OutputSeries]]:
    """Return series in groups of at most 12 for one figure each.

    Conditions that share all but the last part of their name (``sine-1Hz-1A`` … ``sine-1Hz-5A``) are a family. More
    than 12 conditions become one figure a family; a larger family is split evenly, and families of one or two are put
    together.
    """
    if len(series) <= CURVE_PANELS:
        return [list(series)]
    pieces: list[list[OutputSeries]] = []
    for _, group in groupby(series, key=family):
        members = list(group)
        edges = np.linspace(0, len(members), -(-len(members) // CURVE_PANELS) + 1).astype(np.int64)
        pieces += [members[a:b] for a, b in zip(edges[:-1], edges[1:], strict=True)]
    if min(len(p) for p in pieces) > 2:
        return pieces
    merged = [pieces[0]]
    for piece in pieces[1:]:
        if len(merged[-1]) + len(piece) <= CURVE_PANELS:
            merged[-1] = merged[-1] + piece
        else:
            merged.append(piece)
    return merged


def family(series: OutputSeries) -> str:
    """Return all but the last part of a condition's name."""
    return series.condition.rpartition("-")[0]


def limits(measured: Array, simulated: Array) -> tuple[float, float] | None:
    """Return the ends of an axis that shows the measured values where the simulation leaves them far behind.

    Parameters
    ----------
    measured, simulated
        Values shown.

    Returns
    -------
    tuple of float or None
        None where all values lie within ``BEYOND`` times the measured extent of the measured ones.
    """
    known, reached = (values[np.isfinite(values)] for values in (measured, simulated))
    if not len(known) or not len(reached):
        return None
    room = BEYOND * float(np.ptp(known))
    low, high = float(known.min()) - room, float(known.max()) + room
    if room == 0.0 or (low <= reached.min() and reached.max() <= high):
        return None
    return max(low, float(min(known.min(), reached.min()))), min(high, float(max(known.max(), reached.max())))


def prefixed(largest: float, unit: str) -> tuple[float, str]:
    """Return the factor and unit in which values up to ``largest`` are read most easily: 0.02 Wb as 20 mWb.

    Parameters
    ----------
    largest
        Greatest magnitude shown, SI.
    unit
        SI unit in pint's spelling.
    """
    text = unit_html(unit)
    takes_prefix = text[:1].isalpha()
    if not takes_prefix or not math.isfinite(largest) or largest <= 0.0 or 0.1 <= largest < 1000.0:
        return 1.0, text
    power = min(max(3 * math.floor(math.log10(largest) / 3.0), -6), 6)
    return (10.0**-power, _PREFIXES[power] + text) if power else (1.0, text)
