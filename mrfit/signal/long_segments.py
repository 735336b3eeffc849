"""Pieces of segments that are too long to be handled at once; an hour at 10 kHz is 36 million samples."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.grouping import grouped
from mrfit.core.recording import LEAD_IN, Segment
from mrfit.signal.noise import LONG_SEGMENT
from mrfit.signal.smoothing import FITTED_CYCLES

# Samples of a piece; one of slow cycles has as many as a Fourier series takes without its lead-in
PIECE = 1 << 19
# Cycles by which the model settles before a piece
LEAD_CYCLES = 2
# Pieces of a long segment by which it is judged and from which a fit begins: of those whose cycles are folded, and of
# others, whose samples are all simulated
FOLDED_PIECES, OTHER_PIECES = 96, 4


def pieces(segment: Segment, dt: float) -> list[Segment]:
    """Return a segment of over two million samples in pieces of about half a million, by whole cycles if it has any.

    Each but the first is led in by cycles or samples of the piece before it.
    """
    if segment.samples <= LONG_SEGMENT:
        return [segment]
    if segment.cycles:
        period = 1.0 / (segment.frequency * dt)
        each = max(round(PIECE / period), FITTED_CYCLES)
        count, lead = max(segment.cycles // each, 1), round(LEAD_CYCLES * period)
        cycles = [segment.cycles * k // count for k in range(count + 1)]
        places = [segment.start + round(c * period) for c in cycles[:-1]] + [segment.stop]
    else:
        count = math.ceil(segment.samples / PIECE)
        lead, cycles = int(LEAD_IN * PIECE), [0] * (count + 1)
        places = [segment.start + segment.samples * k // count for k in range(count + 1)]
    return [
        replace(
            segment,
            start=places[k],
            stop=places[k + 1],
            cycles=cycles[k + 1] - cycles[k],
            warm_up=lead if k else min(segment.warm_up, LONG_SEGMENT),
        )
        for k in range(count)
    ]


def middle_piece(segment: Segment, dt: float) -> Segment:
    """Return the piece in the middle of a long segment, or the whole of another."""
    found = pieces(segment, dt)
    return found[len(found) // 2]


def spread_over(segments: Sequence[Segment], most: Sequence[int]) -> list[int]:
    """Return which pieces of segments stand for all of them, in their order: all, but of very long segments.

    Parameters
    ----------
    segments
        The pieces.
    most
        How many pieces, spread over its segment, may stand for that of each.
    """
    members = grouped(((segment.id, segment.role), place) for place, segment in enumerate(segments))
    chosen: list[int] = []
    for places in members.values():
        count = min(max(most[k] for k in places), len(places))
        chosen += [places[k] for k in np.linspace(0, len(places) - 1, count).round().astype(int)]
    return sorted(chosen)
