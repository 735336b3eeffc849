"""Samples at which a sensor or a logger is stuck belong to no segment: what was not measured is compared with nothing.

A stuck output leaves the motion as it was, by which the model goes on through the fault. Behind a stuck input the model
settles once more.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import DRIVING, LEVEL_CHANNELS
from mrfit.core.recording import LEAD_IN, Recording, Segment
from mrfit.signal.noise import LONG_SEGMENT
from mrfit.signal.stuck import STUCK_KIND, stuck_rows

# Where so large a share of the samples is stuck, the channel stands still by its nature
MOST_STUCK = 0.2
# Fewest samples of a piece, and whole cycles in one that has any: fewer do not show that it is steady
FEWEST_SAMPLES, FEWEST_CYCLES = 100, 2


@dataclass(frozen=True)
class StuckRows:
    """Rows at which a channel is stuck."""

    rows: slice
    channel: str

    @property
    def of_input(self) -> bool:
        """Whether a model is driven by this channel."""
        return self.channel in DRIVING or self.channel in LEVEL_CHANNELS


def stuck_stretches(recording: Recording) -> list[StuckRows]:
    """Return the rows at which channels of a recording are stuck, in order; only those of a finding are looked at."""
    names = dict.fromkeys(f.channel for f in recording.findings if f.kind == STUCK_KIND)
    if not names or recording.samples > LONG_SEGMENT:
        return []
    channels = {n: np.asarray(v[:]) for n, v in recording.channels.items()}
    found = [StuckRows(rows, name) for name in names for rows in stuck_rows(channels, name)[0]]
    share = sum(f.rows.stop - f.rows.start for f in found) / recording.samples
    return sorted(found, key=lambda f: f.rows.start) if share <= MOST_STUCK else []


def around(segments: Sequence[Segment], stuck: Sequence[StuckRows], dt: float) -> list[Segment]:
    """Return segments cut into pieces around stuck rows; one of which no piece is long enough stays as it is."""
    return [piece for s in segments for piece in (_pieces(s, stuck, dt) or [s])]


def _pieces(segment: Segment, stuck: Sequence[StuckRows], dt: float) -> list[Segment]:
    begin, free, pieces = segment.start - segment.warm_up, segment.start, []
    faults = [f for f in stuck if f.rows.stop > begin and f.rows.start < segment.stop]
    if not faults:
        return [segment]
    for fault in faults:
        rows = fault.rows
        pieces.append(_piece(segment, begin, free, rows.start, dt))
        free = max(free, rows.stop)
        if fault.of_input:
            begin = rows.stop
            free = max(free, begin + round(LEAD_IN * (segment.stop - begin)))
    pieces.append(_piece(segment, begin, free, segment.stop, dt))
    return [p for p in pieces if p is not None]


def _piece(segment: Segment, begin: int, start: int, stop: int, dt: float) -> Segment | None:
    """Return the part of a segment between two samples, driven from ``begin`` on: whole cycles where it has two."""
    cycles = 0
    if segment.cycles:
        period = 1.0 / (segment.frequency * dt)
        cycles = int((stop - start + 0.5) / period)
        if cycles >= FEWEST_CYCLES:
            start = stop - round(cycles * period)
        else:
            cycles = 0
    if stop - start < FEWEST_SAMPLES:
        return None
    return replace(segment, start=start, stop=stop, warm_up=start - begin, cycles=cycles)
