"""Choose segments by peak velocity or by the name of their condition: ``LMH``, ``MH``, ``sine-*-1A``."""

import fnmatch
from collections.abc import Mapping, Sequence

import numpy as np

from mrfit.drive import smooth
from mrfit.errors import ConfigError, DataError
from mrfit.recording import Recording, Segment

# Peak velocities in m/s up to which a segment counts as low and as medium, preyield paper section 4
LOW, MEDIUM = 0.015, 0.1


def select(segments: Sequence[Segment], only: str, recordings: Mapping[str, Recording]) -> list[Segment]:
    """Return the segments a fit is limited to.

    Parameters
    ----------
    segments
        All segments.
    only
        Empty for all; letters of ``LMH`` for those whose peak velocity is low (to 15 mm/s), medium (to 100 mm/s) or
        high, so that ``LMH`` and ``MH`` are the data sets of preyield paper; else patterns on conditions, by commas.
    recordings
        Recordings by id.

    Raises
    ------
    ConfigError
        If nothing is left, or nothing to train on.
    DataError
        If velocities are wanted that a recording does not give.
    """
    if not only:
        return list(segments)
    if set(only) <= set("LMH"):
        kept = [s for s in segments if speed_class(s, recordings[s.recording]) in only]
        what = "bands of peak velocity L (to 15 mm/s), M (to 100 mm/s) and H"
    else:
        patterns = [p.strip() for p in only.split(",")]
        kept = [s for s in segments if any(fnmatch.fnmatchcase(s.condition, p) for p in patterns)]
        what = "patterns on conditions"
    if not any(s.role == "train" for s in kept):
        there = ", ".join(sorted({s.condition for s in segments if s.role == "train"})[:12])
        raise ConfigError(f"--only {only} leaves nothing to train on; it takes {what}, and there are {there}")
    return kept


def speed_class(segment: Segment, recording: Recording) -> str:
    """Return ``L``, ``M`` or ``H`` by the peak velocity of a segment's smoothed drive."""
    peak = peak_velocity(segment, recording)
    return "L" if peak <= LOW else "M" if peak <= MEDIUM else "H"


def peak_velocity(segment: Segment, recording: Recording) -> float:
    """Return the greatest speed in m/s within a segment, of its smoothed drive.

    Raises
    ------
    DataError
        If the recording holds neither velocity nor displacement.
    """
    if not {"velocity", "displacement"} & set(recording.channels):
        raise DataError(
            f"{recording.source}: --only by peak velocity needs velocity or displacement in this log; give a pattern "
            "on conditions instead"
        )
    drive = smooth(recording, segment, ("velocity",))
    return float(np.max(np.abs(drive.values[0, drive.warm_up :])))
