"""Samples at which a sensor stood at the end of its range: what it measured there was more."""

import numpy as np
from scipy.ndimage import binary_closing

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Mask
from mrfit.signal.runs import longest_run

CLIPPED_SHARE, FEWEST_CLIPPED, CLIPPED_RUN = 0.005, 10, 5
"""Least share of all samples at an end of the range that is clipped, their least number, and so many in a row."""
CUT_GAP = 5
"""Most samples for which noise takes a clipped signal off its limit."""


def clipped(recording: Recording, segment: Segment, channel: str) -> Mask:
    """Return the samples (N,) of a segment at which a channel was clipped, by what was found when it was read.

    Parameters
    ----------
    recording
        Holds the channel and the findings on it.
    segment
        Part of the recording.
    channel
        Its name.
    """
    mask = np.zeros(segment.stop - segment.start, dtype=bool)
    times = [f.at for f in recording.findings if f.kind == "clipped" and f.channel == channel and f.at is not None]
    if not times:
        return mask
    values = np.asarray(recording.channels[channel])
    rows = np.clip(np.round(np.array(times) / recording.dt).astype(np.int64), 0, len(values) - 1)
    for end in {float(values.min()), float(values.max())} & set(values[rows].tolist()):
        at_end = values == end
        if stands(at_end):
            # closing leaves out what is next to the record's ends
            lost = at_end | binary_closing(at_end, np.ones(CUT_GAP + 2, dtype=bool))
            mask |= lost[segment.start : segment.stop]
    # of a segment that is clipped altogether nothing else could be compared
    return mask if not mask.all() else np.zeros_like(mask)


def stands(at_end: Mask) -> bool:
    """Return whether a signal is at an end of its range often, and at least once for long, as where it is clipped."""
    often = np.count_nonzero(at_end) >= max(FEWEST_CLIPPED, CLIPPED_SHARE * len(at_end))
    return bool(often and longest_run(at_end) >= CLIPPED_RUN)
