"""Choose segments: those whose logs hold what a model needs; by peak velocity, ``LMH``; by condition, ``sine-*-1A``."""

import fnmatch
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from mrfit.core.counting import number_of
from mrfit.core.recording import WRONG, Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.fit.identify import measured_output
from mrfit.io.dataset import Dataset
from mrfit.io.schemas.fit import Caution
from mrfit.io.workspace import Workspace
from mrfit.signal.smoothing import check_inputs, smooth
from mrfit.simulate.assembly import Assembly

# Peak velocities in m/s up to which a segment counts as low and as medium, preyield paper section 4
LOW, MEDIUM = 0.015, 0.1
# Share by which a peak velocity may exceed them: the paper's own medium test (4 mm at 4 Hz) reaches 100.5 mm/s, and a
# rig does not keep its amplitude exactly
SPEED_TOLERANCE = 0.05
# Logs named for one reason in a warning
LOGS_NAMED = 6
# Conditions listed where --only names none
CONDITIONS_LISTED = 12


def load_recordings(workspace: Workspace, segments: Sequence[Segment], streamed: bool = False) -> dict[str, Recording]:
    """Return the recordings the segments point into, with flux where the flux stage has run.

    Parameters
    ----------
    workspace
        Holds them.
    segments
        The segments.
    streamed
        Whether the channels of long ones stay on disk.

    Raises
    ------
    DataError
        If one cannot be read, or all of them are more than memory holds: that is said before the first is read.
    """
    identifiers, stage = list(dict.fromkeys(s.recording for s in segments)), workspace.latest
    workspace.check_room(identifiers, stage, streamed)
    found = {i: workspace.read_recording(i, stage, streamed) for i in identifiers}
    beyond = next((s.id for s in segments if s.stop > found[s.recording].samples), None)
    if beyond is not None:
        raise DataError(f"{workspace.segments_file}: '{beyond}' ends after its recording; run `mrfit segment` again")
    return found


def read_dataset(workspace: Workspace, streamed: bool = False) -> Dataset:
    """Return the segments of a workspace and their recordings, the long ones' channels left on disk if ``streamed``."""
    segments = workspace.read_segments()
    return Dataset(segments, load_recordings(workspace, segments, streamed))


def usable(
    segments: Sequence[Segment],
    recordings: Mapping[str, Recording],
    assembly: Assembly,
    roles: Sequence[str] = ("train", "holdout"),
) -> tuple[list[Segment], list[dict[str, str]]]:
    """Return the segments whose recordings hold what a model takes and predicts, and why others are left out.

    Parameters
    ----------
    segments
        All segments.
    recordings
        Recordings by id.
    assembly
        The model.
    roles
        Of these at least one segment has to be left.

    Returns
    -------
    tuple
        The segments that can be used, and one row for each of the others: ``segment``, ``condition``, ``role``,
        ``source``, the log, and ``reason``.

    Raises
    ------
    DataError
        If none of these roles can be used; the message has the first reason, and how many logs share the fate.
    """
    kept, left_out = [], []
    for segment in segments:
        recording = recordings[segment.recording]
        try:
            measured_output(recording, assembly)
            check_inputs(recording, segment, assembly.spec.inputs)
        except DataError as error:
            row = {"segment": segment.id, "condition": segment.condition, "role": segment.role}
            reason = str(error).removeprefix(f"{recording.source}: ")
            left_out.append(row | {"source": recording.source, "reason": reason})
        else:
            kept.append(segment)
    if left_out and not any(s.role in roles for s in kept):
        first = next((row for row in left_out if row["role"] in roles), left_out[0])
        others = len({row["source"] for row in left_out}) - 1
        more = f" ({number_of('more log', others)} cannot be used either)" if others else ""
        raise DataError(f"{first['source']}: {first['reason']}{more}")
    return kept, left_out


def left_out_warnings(left_out: Sequence[Mapping[str, str]], segments: int) -> list[Caution]:
    """Return the warning that segments were left out of a number of them, once for each reason."""
    found = []
    for reason in dict.fromkeys(row["reason"] for row in left_out):
        rows = [row for row in left_out if row["reason"] == reason]
        sources = list(dict.fromkeys(row["source"] for row in rows))
        named = ", ".join(sources[:LOGS_NAMED]) + (
            f" and {number_of('more log', len(sources) - LOGS_NAMED)}" if sources[LOGS_NAMED:] else ""
        )
        held = sum(row["role"] == "holdout" for row in rows)
        also = f" ({held} held out)" if held else ""
        text = f"{len(rows)} of {segments} segments{also} take no part, those of {named}: {reason}"
        found.append(Caution(kind="recordings-left-out", text=text))
    return found


def doubtful_channels(recordings: Sequence[Recording], channels: Collection[str]) -> list[Caution]:
    """Return a warning for each channel, of those a model uses, of which ingest found what would change the fit."""
    found: dict[tuple[str, str], list[tuple[str, str]]] = {}
    for recording in recordings:
        for finding in recording.findings:
            if finding.kind in WRONG and finding.channel in channels:
                found.setdefault((finding.kind, finding.channel), []).append((recording.id, finding.text))
    return [
        Caution(kind=kind, text=f"{where[0][1]} ({where[0][0]}, and {len(where)} of {len(recordings)} logs in all)")
        for (kind, _), where in found.items()
    ]


def select(
    segments: Sequence[Segment],
    only: str,
    recordings: Mapping[str, Recording],
    roles: Sequence[str] = ("train",),
) -> list[Segment]:
    """Return the segments a fit is limited to.

    Parameters
    ----------
    segments
        All segments.
    only
        Empty for all; letters of ``LMH`` for those whose peak velocity is low (to 15 mm/s), medium (to 100 mm/s) or
        high, with 5 % of tolerance, so that ``LMH`` and ``MH`` are the data sets of preyield paper; patterns on
        conditions, by commas; or both, as ``MH,*-1A``: those of the bands that a pattern names.
    recordings
        Recordings by id.
    roles
        Of segments that a model can be fitted to.

    Raises
    ------
    ConfigError
        If nothing is left, or nothing to train on.
    DataError
        If velocities are wanted that a recording does not give.
    """
    if not only:
        return list(segments)
    bands, patterns = _parts(only)
    kept = [s for s in segments if named(s.condition, only)]
    what = "patterns on conditions"
    if bands:
        kept = [s for s in kept if speed_class(s, recordings[s.recording]) in bands]
        what = "bands of peak velocity L (to 15 mm/s), M (to 100 mm/s) and H" + f", and {what}" * bool(patterns)
    if not any(s.role in roles for s in kept):
        there = sorted({s.condition for s in segments if s.role in roles})
        more = f" and {len(there) - CONDITIONS_LISTED} more" if len(there) > CONDITIONS_LISTED else ""
        listed = ", ".join(there[:CONDITIONS_LISTED]) + more
        raise ConfigError(f"--only {only} leaves nothing to train on; it takes {what}, and there are {listed}")
    return kept


def named(condition: str, only: str) -> bool:
    """Return whether the patterns of ``--only`` name a condition; where there are none, any is named."""
    patterns = _parts(only)[1]
    return not patterns or any(fnmatch.fnmatchcase(condition, pattern) for pattern in patterns)


def _parts(only: str) -> tuple[str, list[str]]:
    """Return the bands of velocity and the patterns on conditions that ``--only`` holds."""
    words = [word for part in only.split(",") if (word := part.strip())]
    bands = [word for word in words if set(word) <= set("LMH")]
    return "".join(bands), [word for word in words if word not in bands]


def speed_class(segment: Segment, recording: Recording) -> str:
    """Return ``L``, ``M`` or ``H`` by the peak velocity of a segment's smoothed drive."""
    peak = peak_velocity(segment, recording)
    bands = (("L", LOW), ("M", MEDIUM))
    return next((band for band, most in bands if peak <= most * (1.0 + SPEED_TOLERANCE)), "H")


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
