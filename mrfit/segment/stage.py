"""The segment stage: recordings in, segments by test condition with training and hold-out roles out."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, replace

from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording, Segment
from mrfit.errors import ConfigError, DataError
from mrfit.io.keys import code_version, segment_key
from mrfit.io.schemas.reading import UnknownSchema
from mrfit.io.schemas.stages import ConditionRow, CutRow, SegmentRow, SegmentSettings, SegmentsFile
from mrfit.io.workspace import Workspace, checked, plain
from mrfit.segment.conditions import assign_roles, cut_blocks, hold_out_after, left_of_blocks, name_conditions
from mrfit.segment.detect import Detection, detect, drive_channel
from mrfit.settings.segment import Settings as Settings

METADATA = "mrfit"


def run(workspace: Workspace, settings: Settings, progress: Progress = silent) -> SegmentsFile:
    """Find the segments of all recordings and write segments.parquet.

    Parameters
    ----------
    workspace
        Holds recordings, with flux where that stage has run; on an error it is left as it was.
    settings
        How to cut.
    progress
        Reports every recording.

    Returns
    -------
    SegmentsFile
        Segments, conditions, samples kept and cut of recordings, findings, and whether all was there already.

    Raises
    ------
    ConfigError
        If a setting is wrong or names what there is not.
    DataError
        If nothing has been ingested or no segment is found.
    """
    _check(settings)
    identifiers = sorted(workspace.identifiers)
    key = segment_key(asdict(settings), workspace.contents(identifiers, workspace.latest))
    existing = _made(workspace)
    if existing and existing.key == key:
        return replace(existing, skipped=True)
    stage = workspace.latest
    recordings = (workspace.read_recording(i, stage, streamed=True) for i in identifiers)
    with workspace.scratching():
        segments, detections = cut(recordings, len(identifiers), settings, progress)
    summary = checked(_summary(key, settings, segments, detections))
    workspace.write_segments(segments, {METADATA: json.dumps(plain(summary), ensure_ascii=False)})
    return summary


def cut(
    recordings: Iterable[Recording], number: int, settings: Settings, progress: Progress = silent
) -> tuple[list[Segment], list[Detection]]:
    """Return the segments of recordings with their roles, and what was found in each recording.

    Parameters
    ----------
    recordings
        The recordings, sorted by id.
    number
        How many they are.
    settings
        How to cut.
    progress
        Reports every recording.

    Raises
    ------
    ConfigError
        If a setting is wrong or names what there is not.
    DataError
        If no segment is found.
    """
    _check(settings)
    detections = _detections(recordings, number, settings, progress)
    found = [s for d in detections for s in d.segments]
    stated = {d.recording.id: d.recording.condition for d in detections}
    wording = {d.recording.id: d.recording.wording for d in detections}
    named, (how, _, when) = name_conditions(found, stated, wording), settings.holdout.partition("=")
    if settings.blocks:
        named = cut_blocks(named, settings.blocks)
        detections = [_in_blocks(d, settings.blocks) for d in detections]
    if how == "after":
        return hold_out_after(named, when, {d.recording.id: d.recording.dt for d in detections}), detections
    return assign_roles(named, settings.holdout), detections


def _in_blocks(detection: Detection, cycles: int) -> Detection:
    """Return a detection without the samples that fill no block, and with what is said of them."""
    left = [left_of_blocks(s, cycles) for s in detection.segments]
    said = (*detection.findings, *(text for _, text in left if text))
    return replace(detection, findings=said, kept=detection.kept - sum(samples for samples, _ in left))


def last_settings(workspace: Workspace) -> Settings:
    """Return the settings of the workspace's last segment run, or the defaults."""
    stored = workspace.segments_summary()
    if stored is None and workspace.segments_file.exists():
        raise DataError(
            f"{workspace.segments_file}: another mrfit's, without settings in it; delete it and run `mrfit segment "
            f"--work {workspace.root}` with the settings you want"
        )
    return Settings(**asdict(stored.settings)) if stored else Settings()


def _made(workspace: Workspace) -> SegmentsFile | None:
    """Return the summary written with the segments, None where it or they cannot be read: they are made again."""
    try:
        summary = workspace.segments_summary()
        if summary:
            workspace.read_segments()
    except UnknownSchema:
        raise
    except DataError:
        return None
    return summary


def _check(settings: Settings) -> None:
    if settings.min_cycles < 1:
        raise ConfigError(f"--min-cycles {settings.min_cycles} is below 1; give the fewest steady cycles to accept")
    if settings.blocks == 1:
        raise ConfigError("--blocks 1: a block needs at least 2 cycles, of which the last third is held out; 0 is none")
    if settings.settle < 0:
        raise ConfigError(f"settle {settings.settle} is negative; give the cycles by which the model settles")
    if not 0.0 < settings.tolerance < 1.0:
        raise ConfigError(f"tolerance {settings.tolerance:g} is not between 0 and 1; it is a share of the amplitude")


def _detections(
    recordings: Iterable[Recording], number: int, settings: Settings, progress: Progress
) -> list[Detection]:
    detections, lacking, channels = [], [], set()
    for done, recording in enumerate(recordings, 1):
        channels |= set(recording.channels)
        drive = drive_channel(recording, settings.drive)
        if drive is None:
            wanted = settings.drive or "no current, displacement, velocity or angle that moves"
            lacking.append(
                f"{recording.source}: {'no ' if settings.drive else ''}{wanted} in {_held(recording.channels)}"
            )
            detections.append(_without_drive(recording, lacking[-1].split(": ", 1)[1]))
        else:
            detections.append(detect(recording, drive, settings.min_cycles, settings.settle, settings.tolerance))
        progress("segment", done, number)
    if settings.drive is not None and settings.drive not in channels:
        raise ConfigError(f"--drive '{settings.drive}': no recording has this channel; there are {_held(channels)}")
    if not any(d.segments for d in detections):
        raise DataError(_nothing_found(detections[0], lacking, settings))
    return detections


def _without_drive(recording: Recording, reason: str) -> Detection:
    said = (f"{recording.id}: {reason}; left out",)
    return Detection(replace(recording, channels={}), recording.samples, (), said, 0)


def _held(channels: object) -> str:
    return ", ".join(sorted(map(str, channels)))  # type: ignore[call-overload]


def _nothing_found(first: Detection, lacking: Sequence[str], settings: Settings) -> str:
    if lacking:
        return (
            f"{lacking[0]}; no segment in any recording: name the drive's column in the channel map, or give it with "
            "`mrfit segment --drive CHANNEL`"
        )
    cycles = max(2, settings.min_cycles)
    return (
        f"{first.recording.source}: no segment in this or any other recording: looked for {cycles} steady cycles, "
        "steps, a sweep or random excitation; log more cycles, or try `mrfit segment` with a lower --min-cycles, or "
        "--drive CHANNEL"
    )


def _summary(
    key: str, settings: Settings, segments: Sequence[Segment], detections: Sequence[Detection]
) -> SegmentsFile:
    # a condition is in both roles where hold-out begins in time
    parts = {
        (s.condition, s.role): [p for p in segments if (p.condition, p.role) == (s.condition, s.role)] for s in segments
    }
    return SegmentsFile(
        key=key,
        code=code_version("segment"),
        settings=SegmentSettings(**asdict(settings)),
        segments=[SegmentRow(**asdict(s)) for s in segments],
        conditions=[
            ConditionRow(
                condition=name,
                role=role,
                waveform=parts[name, role][0].waveform,
                segments=len(parts[name, role]),
                samples=sum(s.samples for s in parts[name, role]),
            )
            for name, role in sorted(parts)
        ],
        recordings=[
            CutRow(id=d.recording.id, kept=d.kept, cut=d.samples - d.kept, segments=len(d.segments)) for d in detections
        ],
        findings=[f for d in detections for f in d.findings],
    )
