"""Find in one recording what is under test: the drive channel and the segments of steady or irregular excitation."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.channels import EXCITATIONS, LEVEL_CHANNELS, unit_of
from mrfit.core.counting import number_of
from mrfit.core.recording import LEAD_IN, Recording, Segment
from mrfit.core.specs import Array
from mrfit.io.columns import mean_and_deviation, part_of, span
from mrfit.segment.conditions import LEAST_CURRENT, SAME_TEST_AMPLITUDE, SAME_TEST_FREQUENCY
from mrfit.segment.excitation import cycles_of, waveform_of
from mrfit.segment.stuck import around, stuck_stretches
from mrfit.segment.waveform import STILL_NOISE, TRIANGLE_MISFIT, irregular_waveform, periodic_waveform
from mrfit.signal.cycles import SteadyCycles, gaps, steady_stretches, turning_points
from mrfit.signal.long_cycles import stretches_of
from mrfit.signal.noise import noise_level
from mrfit.signal.thinning import thinned

MOVED_DRIVES = ("displacement", "velocity", "angle", "angular_velocity")
# An irregular stretch beside periodic ones must be this long and large to be a test of its own.
IRREGULAR_SHARE = 0.2
FEWEST_CYCLE_SAMPLES = 100
HELD_SHARE = 0.05
# Deviation in A below which a current is held whatever its mean: pickup, ripple and drift of a probe, at no current
STILL_CURRENT = 0.01
# Share of the amplitude by which the middle of like stretches of one recording moves where the motion drifts
MIDDLE_MOVES = 0.02
# How much more departure is accepted in an unsteady recording, and how much more of it that must find.
UNSTEADY = 3.0
GAIN = 1.3


@dataclass(frozen=True, slots=True)
class Detection:
    """Segments of one recording (conditions and roles not yet set), and what is to be said about it.

    Attributes
    ----------
    recording
        The recording without its channels: those of many would not fit into memory.
    samples
        How many it has.
    segments
        The segments.
    findings
        Sentences for people.
    kept
        Samples that are in a segment or lead into one.
    """

    recording: Recording
    samples: int
    segments: tuple[Segment, ...]
    findings: tuple[str, ...]
    kept: int


def drive_channel(recording: Recording, wanted: str | None) -> str | None:
    """Return the channel that defines the test: the one asked for, or the first that moves.

    An excitation drives a mass. A log of force or torque is a damper's: its stroke or angle comes first. Otherwise a
    current with coil voltage or flux comes first. None if nothing fit for it moves.
    """
    if wanted is not None:
        return wanted if wanted in recording.channels else None
    excitation = next((n for n in EXCITATIONS.values() if n in recording.channels), None)
    if excitation:
        return excitation
    coil = ("current",) if {"flux", "voltage"} & set(recording.channels) else ()
    damper = {"force", "torque"} & set(recording.channels)
    order = (*MOVED_DRIVES, "current") if damper else (*coil, *MOVED_DRIVES, "current")
    return next((n for n in order if n in recording.channels and _moves(recording.channels[n])), None)


def _moves(values: Array) -> bool:
    return len(values) > 2 and span(values) > max(STILL_NOISE * noise_level(values), 1e-12)


def detect(recording: Recording, drive: str, min_cycles: int, settle: int, tolerance: float) -> Detection:
    """Return the segments of a recording.

    Parameters
    ----------
    recording
        Log, in SI.
    drive
        Channel that defines the condition.
    min_cycles
        Fewest steady cycles of a periodic segment, 2 at least.
    settle
        Steady cycles at the start of each stretch by which the model settles, not compared; fewer where that would
        leave less than two.
    tolerance
        See ``steady_stretches``.
    """
    if drive in EXCITATIONS.values():
        only = (_excited(recording, drive),)
        return Detection(replace(recording, channels={}), recording.samples, only, (), recording.samples)
    looked_at = {name: recording.channels[name] for name in (drive, *LEVEL_CHANNELS) if name in recording.channels}
    means, step = thinned(replace(recording, channels=looked_at), drive)
    found, said = _detected(means, drive, min_cycles, settle, tolerance)
    whole = [replace(s, start=step * s.start, stop=step * s.stop, warm_up=step * s.warm_up) for s in found]
    kept = sum(s.samples + s.warm_up for s in whole)
    findings = said + _said(recording, drive, whole, kept)
    stuck = stuck_stretches(recording)
    if (pieces := around(whole, stuck, recording.dt)) != whole:
        cut = sum(s.samples for s in whole) - sum(s.samples for s in pieces)
        channels = " and ".join(dict.fromkeys(s.channel for s in stuck))
        findings.append(f"{recording.id}: {cut} samples where {channels} is stuck, and about them, not compared")
        whole, kept = _numbered(pieces, recording.id), kept - cut
    return Detection(replace(recording, channels={}), recording.samples, tuple(whole), tuple(findings), kept)


def _excited(recording: Recording, drive: str) -> Segment:
    """Return a record with an excitation as one segment, see ``excitation``."""
    values, cycles = recording.channels[drive], cycles_of(recording, drive)
    shape: dict[str, float | str] = {
        "waveform": "periodic" if cycles else waveform_of(values),
        "frequency": cycles / (recording.dt * len(values)),
        "amplitude": float(np.ptp(values)) / 2,
        "offset": float(np.mean(values)),
        "cycles": cycles,
    }
    segment = _segment(recording, drive, (0, recording.samples, 0), shape)
    return replace(segment, id=f"{recording.id}#1")


def _detected(
    recording: Recording, drive: str, min_cycles: int, settle: int, tolerance: float
) -> tuple[list[Segment], list[str]]:
    """Return the segments of a recording, and what is to be said of cycles that were accepted or too few."""
    values, said = recording.channels[drive], []
    levels = [recording.channels["current"]] if drive != "current" and "current" in recording.channels else []
    stretches = stretches_of(values, recording.dt, levels, max(2, min_cycles), tolerance)
    wider = min(UNSTEADY * tolerance, 0.5)
    if 2 * _covered(stretches) < len(values):
        # A rig that does not hold its amplitude or its middle: less is asked of all cycles if that finds far more.
        unsteady = stretches_of(values, recording.dt, levels, max(2, min_cycles), wider)
        if _covered(unsteady) > max(GAIN * _covered(stretches), len(values) / 2):
            stretches = unsteady
            said.append(f"{recording.id}: {drive} is unsteady; cycles up to {100 * wider:.0f} % apart were accepted")
        else:
            fragments = _fragments(values, stretches)
            stretches = [s for s in stretches if s not in fragments]
            said += [
                f"{recording.id}: {number_of('cycle', s.cycles)} of {s.fit.frequency:.3g} Hz at "
                f"{s.start * recording.dt:.3g} s are no test of their own: they end within one "
                "cycle of the motion about them"
                for s in fragments
            ]
    ranges = [_periodic(recording, drive, s, settle) for s in stretches]
    for gap in gaps(stretches, len(values)):
        if gap[1] - gap[0] < max(FEWEST_CYCLE_SAMPLES, IRREGULAR_SHARE * len(values)):
            continue
        piece = _irregular(recording, drive, gap, bool(stretches))
        ranges += [piece] if piece else []
        said += _too_few(recording, drive, gap, piece, min_cycles, tolerance)
    return _numbered(sorted(ranges, key=lambda s: s.start), recording.id), said


def _fragments(values: Array, stretches: Sequence[SteadyCycles]) -> list[SteadyCycles]:
    """Return the small cycles that end within one cycle of the motion (N,) about them: a rig that trembles at rest."""
    whole = float(np.ptp(values))
    points = turning_points(values, max(IRREGULAR_SHARE * whole, STILL_NOISE * noise_level(values)))
    cycle = 2.0 * (points[-1] - points[0]) / (len(points) - 1) if len(points) > 1 else 0.0
    return [s for s in stretches if s.stop - s.start < cycle and 2.0 * s.fit.amplitude < IRREGULAR_SHARE * whole]


def _covered(stretches: Sequence[SteadyCycles]) -> int:
    return sum(s.stop - s.start for s in stretches)


def _numbered(segments: list[Segment], recording: str) -> list[Segment]:
    return [replace(s, id=f"{recording}#{k}") for k, s in enumerate(segments, 1)]


def _segment(
    recording: Recording, drive: str, place: tuple[int, int, int], shape: Mapping[str, float | str]
) -> Segment:
    start, stop, warm_up = place
    return Segment(
        id="",
        condition="",
        recording=recording.id,
        start=start,
        stop=stop,
        warm_up=warm_up,
        waveform=str(shape["waveform"]),
        drive=drive,
        frequency=float(shape["frequency"]),
        amplitude=float(shape["amplitude"]),
        offset=float(shape["offset"]),
        cycles=int(shape["cycles"]),
        current=float("nan") if drive == "current" else held_level(recording, "current", start, stop),
        temperature=held_level(recording, "temperature", start, stop),
        role="train",
    )


def held_level(recording: Recording, name: str, start: int, stop: int) -> float:
    """Return the mean of a channel that a test holds, else the level its condition gives; nan if not held or known."""
    if name not in recording.channels:
        return float(recording.condition.get(name, np.nan))
    window = part_of(recording.channels[name], start, stop)
    mean, spread = mean_and_deviation(window)
    # A temperature drifts in any test, so its mean is its level.
    least = STILL_CURRENT if name == "current" else 0.0
    limit = max(HELD_SHARE * abs(mean), 1.5 * noise_level(window), 0.02 * span(recording.channels[name]), least)
    return mean if spread <= limit or name == "temperature" else float("nan")


def _periodic(recording: Recording, drive: str, stretch: SteadyCycles, settle: int) -> Segment:
    period = 1.0 / (stretch.fit.frequency * recording.dt)
    lead = max(0, min(settle, stretch.cycles - 2))
    cycles = stretch.cycles - lead
    start = max(stretch.start, round(stretch.stop - cycles * period))
    shape: dict[str, float | str] = {
        "waveform": periodic_waveform(stretch.fit),
        "frequency": stretch.fit.frequency,
        "amplitude": stretch.fit.amplitude,
        "offset": float(stretch.fit.coefficients[0].real),
        "cycles": cycles,
    }
    return _segment(recording, drive, (start, stretch.stop, start - stretch.start), shape)


def _irregular(recording: Recording, drive: str, gap: tuple[int, int], beside_periodic: bool) -> Segment | None:
    values = recording.channels[drive]
    window = values[gap[0] : gap[1]]
    if float(np.ptp(window)) < IRREGULAR_SHARE * span(values):
        return None
    waveform = irregular_waveform(window)
    if waveform is None or (beside_periodic and waveform != "random"):
        return None
    shape: dict[str, float | str] = {
        "waveform": waveform,
        "frequency": 0.0,
        "amplitude": float(np.ptp(window)) / 2,
        "offset": float(np.mean(window)),
        "cycles": 0,
    }
    lead = int(LEAD_IN * len(window))
    return _segment(recording, drive, (gap[0] + lead, gap[1], lead), shape)


def _too_few(
    recording: Recording,
    drive: str,
    stretch: tuple[int, int],
    piece: Segment | None,
    min_cycles: int,
    tolerance: float,
) -> list[str]:
    """Return a sentence where most of a stretch without a periodic segment is steady cycles, only too few."""
    window = recording.channels[drive][slice(*stretch)]
    held = recording.channels.get("current") if drive != "current" else None
    levels = [] if held is None else [held[slice(*stretch)]]
    shorter = steady_stretches(window, recording.dt, levels, 2, tolerance) if min_cycles > 2 else []
    longest = max(shorter, key=lambda s: s.stop - s.start, default=None)
    if longest and 2 * (longest.stop - longest.start) > len(window):
        cycles, frequency = longest.cycles, longest.fit.frequency
        few, remedy = f"--min-cycles {min_cycles}", f"give --min-cycles {cycles} to have them as cycles"
    elif piece and (frequency := _single_sine(window, recording.dt)):
        cycles, few, remedy = 1, "the 2 that show a steady test", "log more of them"
    else:
        return []
    what = f"treated as one stretch without a frequency, '{piece.waveform}'" if piece else "left out"
    return [f"{recording.id}: {number_of('cycle', cycles)} of {frequency:.3g} Hz, fewer than {few}: {what}; {remedy}"]


def _drift(name: str, drive: str, stretches: Sequence[Segment]) -> list[str]:
    """Return a sentence where the stretches of a recording are one steady motion whose middle moves."""
    if len(stretches) < 2:
        return []
    first, middles = stretches[0], [s.offset for s in stretches]
    alike = all(
        math.isclose(s.frequency, first.frequency, rel_tol=SAME_TEST_FREQUENCY)
        and math.isclose(s.amplitude, first.amplitude, rel_tol=SAME_TEST_AMPLITUDE)
        and np.isclose(s.current, first.current, rtol=0.0, atol=LEAST_CURRENT, equal_nan=True)
        for s in stretches
    )
    if not alike or max(middles) - min(middles) < MIDDLE_MOVES * first.amplitude:
        return []
    cycles = number_of("cycle", sum(s.cycles for s in stretches))
    return [
        f"{name}: the middle of {drive} drifts from {middles[0]:.4g} to {middles[-1]:.4g} {unit_of(drive)}: cut into "
        f"{len(stretches)} stretches, {cycles} in all; a log without the drift stays whole"
    ]


def _single_sine(values: Array, dt: float) -> float:
    """Return the frequency in Hz of a signal (N,) that is one to two cycles of a sine, else 0."""
    window = values[:: max(1, len(values) // 500)]
    place = np.arange(len(window)) / len(window)

    def misfit(cycles: float) -> float:
        turn = 2 * np.pi * cycles * place
        columns = np.stack([np.ones_like(turn), np.cos(turn), np.sin(turn)], axis=1)
        rest = window - columns @ np.linalg.lstsq(columns, window, rcond=None)[0]
        return float(np.std(rest) / np.std(window))

    cycles = min(np.arange(1.0, 2.0, 0.02), key=misfit)
    return float(cycles / (len(values) * dt)) if misfit(cycles) < TRIANGLE_MISFIT else 0.0


def _said(recording: Recording, drive: str, segments: Sequence[Segment], kept: int) -> list[str]:
    """Return sentences on what was cut and on measured conditions that differ from the stated ones."""
    said = []
    if not segments:
        said.append(f"{recording.id}: no steady cycles, steps, sweep or random excitation in {drive}; left out")
    elif kept < recording.samples / 2:
        said.append(
            f"{recording.id}: {recording.samples - kept} of {recording.samples} samples cut as transients or rest"
        )
    said += _drift(recording.id, drive, [s for s in segments if s.cycles])
    # A file name states one condition; a log of several is no contradiction to it.
    stated = recording.condition if len({round(s.frequency, 2) for s in segments}) == 1 else {}
    for name in ("frequency", "amplitude"):
        measured = float(getattr(segments[0], name)) if segments else 0.0
        if name in stated and measured > 0.0 and abs(stated[name] - measured) > 0.05 * measured:
            said.append(f"{recording.id}: {name} is stated as {stated[name]:.4g}, the data say {measured:.4g} (SI)")
    return said
