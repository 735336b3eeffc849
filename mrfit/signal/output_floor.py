"""The noise floor of an output over each segment, by whatever the records allow: cycles, repeats, or a regression."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import sqrt

import numpy as np

from mrfit.core.channels import DRIVING, DRIVING_MOTIONS, EXCITATIONS, LEVEL_CHANNELS, MOTION_OF_MASS
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.signal.drift import SteadyDrift, steady_drift
from mrfit.signal.harmonics import harmonic_fit
from mrfit.signal.input_regression import DrivingInput, regression_floor
from mrfit.signal.long_segments import middle_piece
from mrfit.signal.noise import TREND_CYCLES, noise_floor, noise_level, quantisation
from mrfit.signal.noise_floor import NoiseFloor, measured_samples, not_known, white_noise
from mrfit.signal.repeated_records import repeats_floor
from mrfit.signal.savitzky_golay import WINDOW_MIN, Smoother
from mrfit.signal.smoothing import cycles_agree, inputs_repeat

# More samples than this share filled in: cycles are not compared, as what was filled in would count as noise
PATCHED = 0.005
# Two estimates of one floor that differ by less say the same
SAME_FLOOR_RATIO = 1.3


def output_floors(
    segments: Sequence[Segment], recordings: Mapping[str, Recording], outputs: Sequence[Array], output: str = ""
) -> list[NoiseFloor]:
    """Return the noise floor of every segment's output, in its unit.

    Cycle is compared with cycle only where every input recorded repeats with the cycle: under a current that moves on
    its own, cycles differ without any noise. Records of one condition are compared where their inputs are the same.
    Otherwise it is what a flexible regression on the inputs leaves, of the segment or of others of its recording, or
    not known. A long segment is judged by its middle.

    Parameters
    ----------
    segments
        Segments, of one output.
    recordings
        Recordings by id.
    outputs
        Output over each segment, (N,).
    output
        Its channel: where that is the motion of a driven mass, no regression on the motion tells its noise.
    """
    middles = [middle_piece(s, recordings[s.recording].dt) for s in segments]
    # one slice: of an output on disk no more than the piece is read
    outputs = [y[m.start - s.start : m.stop - s.start] for s, m, y in zip(segments, middles, outputs, strict=True)]
    segments = middles
    alone = [cycles_floor(recordings[s.recording], s, y, output) for s, y in zip(segments, outputs, strict=True)]
    unknown = [k for k, floor in enumerate(alone) if floor is None]
    if not unknown:
        return [floor for floor in alone if floor is not None]
    repeated = repeats_floor([segments[k] for k in unknown], recordings, [outputs[k] for k in unknown])
    found = dict(zip(unknown, repeated, strict=True))
    floors = [
        floor or found[k] or _by_regression(recordings[segments[k].recording], segments[k], outputs[k], output)
        for k, floor in enumerate(alone)
    ]
    return as_of_one_record(segments, floors)


def as_of_one_record(segments: Sequence[Segment], floors: Sequence[NoiseFloor]) -> list[NoiseFloor]:
    """Return floors with those not known as of the other pieces of their record, which one instrument took.

    Parameters
    ----------
    segments, floors
        Segments, and what is known of the noise floor of each.
    """
    known: dict[str, list[float]] = {}
    for segment, floor in zip(segments, floors, strict=True):
        if floor.known:
            known.setdefault(segment.recording, []).append(floor.value)
    found = list(floors)
    for place, (segment, floor) in enumerate(zip(segments, floors, strict=True)):
        if not floor.known and segment.recording in known:
            found[place] = _from_elsewhere(floor, max(float(np.median(known[segment.recording])), floor.low))
    return found


def cycles_floor(recording: Recording, segment: Segment, values: Array, output: str = "") -> NoiseFloor | None:
    """Return the noise floor of an output (N,) from the difference of cycles; None where they cannot be compared.

    A steady drift is no noise. Of few cycles a trend of the drive, as of a sweep, cannot be told from noise, and at a
    corner cycles are sampled at other places of a jump: there what a regression leaves must not be less.
    """
    if segment.cycles < 2 or np.mean(~measured_samples(values)) > PATCHED:
        return None
    repeat, agree = inputs_repeat(recording, segment), cycles_agree(recording, segment)
    if not repeat and not agree:
        return None
    drift = cycles_drift(values, segment, recording.dt)
    steady = values if drift is None else values - drift.total
    value = noise_floor(steady, recording.dt, segment.frequency, segment.cycles, trending=True)
    # rounding errors of a repeated output repeat
    value = max(value, quantisation(values) / sqrt(12.0))
    width = value * np.sqrt(2.0 / max(len(values) * (1.0 - 1.0 / segment.cycles), 1.0))
    floor = NoiseFloor(value, "cycles", max(value - 2.0 * width, 0.0), value + 2.0 * width)
    if repeat and (agree or segment.cycles >= TREND_CYCLES):
        return floor
    other = _by_regression(recording, segment, values, output)
    if not other.known:
        return not_known(values, float(np.nanmin([value, other.high])))
    return floor if value <= SAME_FLOOR_RATIO * other.value else other


def cycles_drift(values: Array, segment: Segment, dt: float) -> SteadyDrift | None:
    """Return the steady drift of an output (N,) over cycles of the same drive, None where there is none."""
    repeated = harmonic_fit(values, dt, segment.frequency, refine=False)
    series = repeated.evaluate(np.arange(len(values), dtype=np.float64) * dt)
    return steady_drift(values - series, series, dt, segment.cycles)


def residual_floor(
    floor: NoiseFloor, recording: Recording, segment: Segment, residual: Array, output: str = ""
) -> NoiseFloor:
    """Return a floor that is not known as that of a model's residual (N,), if a regression of it on the inputs tells.

    A model's residual holds the same noise as the output, and less else that a regression could miss. So a floor that
    is above the residual is none: cycles of a drive that wobbles differ by more than noise.
    """
    error = float(np.sqrt(np.mean(residual**2)))
    if floor.known and floor.value <= SAME_FLOOR_RATIO * error:
        return floor
    found = _by_regression(recording, segment, residual, output)
    if found.known:
        return found
    highs = [high for high in (floor.high, found.high, error) if np.isfinite(high)]
    return NoiseFloor(float("nan"), "not known", min(floor.low, found.low, min(highs)), min(highs))


def with_colour(floors: Sequence[NoiseFloor], outputs: Sequence[Array]) -> list[NoiseFloor]:
    """Return floors with those that are not known, or no firmer, taken from records that have cycles.

    Records of one instrument share the noise's colour: the ratio of the floor to the white noise.

    Parameters
    ----------
    floors, outputs
        Noise floor and output (N,) of every segment.
    """
    white = [white_noise(y) for y in outputs]
    colours = [f.value / w for f, w in zip(floors, white, strict=True) if f.method == "cycles" and w > 0.0]
    if not colours:
        return list(floors)
    colour = max(float(np.median(colours)), 1.0)
    return [_coloured(f, colour * w) for f, w in zip(floors, white, strict=True)]


def _coloured(floor: NoiseFloor, value: float) -> NoiseFloor:
    if floor.method in ("cycles", "repeats") or (
        floor.known and not floor.value / SAME_FLOOR_RATIO < value < floor.value * SAME_FLOOR_RATIO
    ):
        return floor
    return _from_elsewhere(floor, value)


def _from_elsewhere(floor: NoiseFloor, value: float) -> NoiseFloor:
    return replace(floor, value=min(value, floor.most), method="other records")


def _by_regression(recording: Recording, segment: Segment, values: Array, output: str) -> NoiseFloor:
    # the motion of a driven mass holds the very noise that is asked for
    of_mass = output in MOTION_OF_MASS and segment.drive in EXCITATIONS.values()
    motion = None if of_mass else motion_of(recording, segment)
    return not_known(values) if motion is None else regression_floor(values, motion)


def motion_of(recording: Recording, segment: Segment) -> DrivingInput | None:
    """Return what drives a specimen over a segment, None where nothing that moves was recorded.

    The inputs are smoothed as recorded, without any series: cycles that differ stay different.
    """
    begin = max(segment.start - segment.warm_up, 0)
    window = slice(begin, segment.stop)
    kept = slice(segment.start - begin, None)
    channels = {n: recording.channels[n][window] for n in DRIVING if n in recording.channels}
    moving = [n for n, values in channels.items() if float(np.ptp(values)) > 0.0]
    if not moving or segment.stop - begin < WINDOW_MIN:
        return None
    name = moving[0]
    local = Smoother(channels[name], moves=name in DRIVING_MOTIONS)
    orders = range(3 if DRIVING[name] == 0 else 2)
    parts = [local.smoothed(order).values / recording.dt**order for order in orders]
    if DRIVING[name] == 1:
        parts.insert(0, np.cumsum(parts[0] - parts[0].mean()) * recording.dt)
    others = []
    for other in LEVEL_CHANNELS:
        values = recording.channels.get(other)
        if other != name and values is not None and _varies(values[window]):
            others.append(Smoother(values[window]).smoothed(0).values[kept])
    moved, rate, acceleration = (part[kept] for part in parts)
    return DrivingInput(moved, rate, acceleration, others, recording.dt)


def _varies(values: Array) -> bool:
    return float(np.ptp(values)) > 10.0 * noise_level(values) + 1e-9 * float(np.max(np.abs(values)))
