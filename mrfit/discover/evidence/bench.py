"""The data a discovery works on: every segment with all channels that some effect may need, and what errs on it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.channels import INTEGRALS, LOCATED_BY
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array, EffectSpec
from mrfit.discover.policy import STANDARD, Policy
from mrfit.errors import DataError
from mrfit.fit.identify import measured_output
from mrfit.search.problem import SegmentBlock, differences, entering_at_mean, full_block
from mrfit.signal.clipping import clipped
from mrfit.signal.noise_floor import NoiseFloor
from mrfit.signal.output_floor import (
    SAME_FLOOR_RATIO,
    as_of_one_record,
    cycles_drift,
    output_floors,
    residual_floor,
    with_colour,
)
from mrfit.signal.smoothing import TIME_CHANNEL, Drive, from_the_beginning, smooth
from mrfit.simulate.assembly import Assembly, counts_from_the_beginning

# Ways to a noise floor that no model and no regression can spoil
MEASURED_METHODS = ("cycles", "repeats")


@dataclass(frozen=True)
class Stretch:
    """One segment ready to be simulated with any assembly.

    Attributes
    ----------
    block
        Drive over all obtainable channels, and the measured output.
    names
        Channel of each row of the block's drive.
    floor
        Noise floor of the output, in its unit, that errors are multiples of; the least it can be where not known.
    noise
        What is known of the noise floor.
    recorded
        Start of the segment in its recording, in s.
    level_rate
        Steady drift of the output's level whose bend was taken away, in its unit per second; 0 without one.
    counted
        The block led in by all that was recorded before; None where no effect counts from there.
    """

    block: SegmentBlock
    names: tuple[str, ...]
    floor: float
    noise: NoiseFloor
    recorded: float
    level_rate: float = 0.0
    counted: SegmentBlock | None = None

    @property
    def segment(self) -> Segment:
        """The segment."""
        return self.block.segment

    @property
    def repeats(self) -> bool:
        """Whether every recorded input repeats with the cycle, so that cycle was compared with cycle."""
        return self.noise.method == "cycles"

    @property
    def measured(self) -> Array:
        """Measured output (N,)."""
        return self.block.target

    def channel(self, name: str) -> Array | None:
        """Return an input at the measured samples (N,), or None if it is not available."""
        return self.block.inputs(self.names.index(name)) if name in self.names else None

    def block_for(self, assembly: Assembly) -> SegmentBlock:
        """Return the block with the rows an assembly takes."""
        rows = [self.names.index(n) for n in assembly.spec.inputs]
        block = self.counted if assembly.counts and self.counted else self.block
        return replace(block, drive=np.ascontiguousarray(block.drive[rows]))


@dataclass(frozen=True)
class Bench:
    """All segments, and the channels every one of them has.

    Attributes
    ----------
    stretches
        The segments.
    channels
        Channels that all of them have.
    lacking
        Why a channel some effect needs is not available.
    span
        Range of the measured output over all segments.
    least_floor
        Share of it below which no error counts: floors of almost noiseless channels are not trusted.
    """

    stretches: tuple[Stretch, ...]
    channels: frozenset[str]
    lacking: dict[str, str]
    span: float
    least_floor: float = STANDARD.least_floor

    @property
    def largest(self) -> float:
        """Largest size of the measured output."""
        return max(float(np.max(np.abs(s.measured))) for s in self.stretches)

    def of_role(self, role: str) -> list[Stretch]:
        """Return the segments that are fitted (``train``) or held out (``holdout``)."""
        return [s for s in self.stretches if s.segment.role == role]

    def samples(self, role: str) -> int:
        """Return the samples of the segments of a role."""
        return sum(s.segment.samples for s in self.of_role(role))

    def simulated(self, role: str) -> int:
        """Return the samples of a role that are simulated: those before each segment, which lead it in, among them."""
        return sum(s.block.drive.shape[1] for s in self.of_role(role))

    def most_noise(self, role: str) -> float:
        """Return the most that the noise of a role can be, in multiples of its floors: 1 where these are known."""
        stretches = self.of_role(role)
        shares = [1.0 if s.noise.known else max(s.noise.most / s.floor, 1.0) ** 2 for s in stretches]
        return float(np.sqrt(np.average(shares, weights=[s.segment.samples for s in stretches])))

    def noise_is_measured(self, role: str) -> bool:
        """Return whether every noise floor of a role was measured, by cycles or by repeats."""
        return all(s.noise.method in MEASURED_METHODS for s in self.of_role(role))

    def noise_is_told(self, role: str) -> bool:
        """Return whether no noise floor of a role can hold the error of a law: it was measured, or is in line with one.

        Records of one instrument share its noise: a guess that is not clearly above floors that were measured, in
        records of any role, holds no error of a law.
        """
        measured = [s.noise.value for s in self.stretches if s.noise.method in MEASURED_METHODS]
        most = SAME_FLOOR_RATIO * float(np.median(measured)) if measured else 0.0
        return all(s.noise.method in MEASURED_METHODS or s.noise.value <= most for s in self.of_role(role))

    def errors(self, assembly: Assembly, theta: Array, role: str) -> list[Array]:
        """Return (simulated − measured) / noise floor of each segment of a role, (P, N_s) each, for theta (P, K)."""
        return [differences(s.block_for(assembly), assembly, theta) / s.floor for s in self.of_role(role)]


def build_bench(
    segments: Sequence[Segment],
    recordings: Mapping[str, Recording],
    base: Assembly,
    effects: Sequence[EffectSpec],
    policy: Policy = STANDARD,
) -> Bench:
    """Return the bench of a base model and the effects that may be missing from it.

    Raises
    ------
    DataError
        If a recording lacks what the base itself needs.
    """
    wanted = list(dict.fromkeys((*base.spec.inputs, *(i for e in effects for i in e.inputs), *LOCATED_BY)))
    counts = base.counts or any(counts_from_the_beginning(registry.load("effect", e.name)) for e in effects)
    found = {s.id: _channels(recordings[s.recording], s, wanted, counts, base.spec.rests_at) for s in segments}
    lacking = {n: reason for drives in found.values() for n, reason in drives.lacking.items()}
    for name in base.spec.inputs:
        if name in lacking:
            raise DataError(lacking[name])
    common = [n for n in wanted if n not in lacking]
    outputs = {s.id: measured_output(recordings[s.recording], base) for s in segments}
    span = float(np.ptp(np.concatenate([outputs[s.id][s.start : s.stop] for s in segments])))
    if span == 0.0:
        raise DataError(f"the {base.spec.output} is the same in every sample: there is no error to explain")
    floors = noise_floors(segments, recordings, [outputs[s.id][s.start : s.stop] for s in segments], base.spec.output)
    least = policy.least_floor * span
    stretches = [
        _with_noise(_stretch(s, recordings[s.recording], found[s.id], common, outputs[s.id], noise), noise, least)
        for s, noise in zip(segments, floors, strict=True)
    ]
    stretches = [
        _without_clipped(_straightened(s), recordings[s.segment.recording], base.spec.output) for s in stretches
    ]
    return Bench(tuple(stretches), frozenset([*common, TIME_CHANNEL]), lacking, span, policy.least_floor)


def noise_floors(
    segments: Sequence[Segment], recordings: Mapping[str, Recording], outputs: Sequence[Array], output: str
) -> list[NoiseFloor]:
    """Return the noise floor of every segment's output (N,); records without cycles take the colour of those with."""
    return with_colour(output_floors(segments, recordings, outputs, output), outputs)


def with_residual_floors(bench: Bench, fit: Sequence[Array], recordings: Mapping[str, Recording], output: str) -> Bench:
    """Return a bench in which floors that were not known are those of a fit's residual, where that tells them.

    Parameters
    ----------
    bench
        The data.
    fit
        Errors of a fit in multiples of the noise floor, one (N_s,) for each stretch of the bench.
    recordings
        Recordings by id.
    output
        Channel of the output.
    """
    floors = [
        residual_floor(s.noise, recordings[s.segment.recording], s.segment, error * s.floor, output)
        for s, error in zip(bench.stretches, fit, strict=True)
    ]
    floors = as_of_one_record([s.segment for s in bench.stretches], floors)
    least = bench.least_floor * bench.span
    stretches = [
        s if noise is s.noise else _with_noise(s, noise, least)
        for s, noise in zip(bench.stretches, floors, strict=True)
    ]
    return replace(bench, stretches=tuple(stretches))


def _straightened(stretch: Stretch) -> Stretch:
    """Return a stretch without the bend of a drifting level, which no effect makes but several would follow."""
    drift = cycles_drift(stretch.measured, stretch.segment, stretch.block.dt) if stretch.repeats else None
    if drift is None or not np.any(drift.level):
        return stretch
    target = stretch.measured - drift.bend
    counted = stretch.counted and replace(stretch.counted, target=target)
    block = replace(stretch.block, target=target)
    return replace(stretch, block=block, counted=counted, level_rate=drift.level_rate)


def _without_clipped(stretch: Stretch, recording: Recording, output: str) -> Stretch:
    """Return a stretch that does not compare samples at which its output was clipped."""
    lost = clipped(recording, stretch.segment, output)
    if not lost.any():
        return stretch
    counts = np.where(lost, 0.0, stretch.block.counts)
    counted = stretch.counted and replace(stretch.counted, counts=counts)
    return replace(stretch, block=replace(stretch.block, counts=counts), counted=counted)


def _with_noise(stretch: Stretch, noise: NoiseFloor, least: float) -> Stretch:
    return replace(stretch, noise=noise, floor=max(noise.scale, least))


@dataclass(frozen=True)
class _ChannelDrives:
    """Drives by channel, those led in by all that was recorded before where they are wanted, and why others lack."""

    drives: dict[str, Drive]
    recorded: dict[str, Drive]
    lacking: dict[str, str]


def _channels(
    recording: Recording, segment: Segment, names: Sequence[str], counts: bool, rests_at: str
) -> _ChannelDrives:
    drives, lacking = {}, {}
    for name in names:
        if name == TIME_CHANNEL:
            continue
        try:
            drive = smooth(recording, segment, (name,))
            drives[name] = entering_at_mean(drive, 0) if name == rests_at else drive
        except DataError as error:
            lacking[name] = str(error)
    recorded = {n: from_the_beginning(d, recording, segment, (n,)) for n, d in drives.items()} if counts else {}
    for name, rate in INTEGRALS.items():
        if name in lacking and rate in drives:
            for own in (drives, recorded) if counts else (drives,):
                own[name] = _stroke_of(own[rate])
            del lacking[name]
    return _ChannelDrives(drives, recorded, lacking)


def _stroke_of(velocity: Drive) -> Drive:
    """Return the stroke that belongs to a velocity, up to its middle, where none was recorded."""
    values = velocity.values[0]
    stroke = np.cumsum(values - values.mean()) * velocity.dt
    return replace(velocity, values=(stroke - stroke.mean())[None, :], fits=None)


def _stretch(
    segment: Segment,
    recording: Recording,
    found: _ChannelDrives,
    names: Sequence[str],
    output: Array,
    noise: NoiseFloor,
) -> Stretch:
    names = [n for n in names if n != TIME_CHANNEL]
    measured = output[segment.start : segment.stop]
    return Stretch(
        block=_block(segment, recording, [found.drives[n] for n in names], measured),
        names=(*names, TIME_CHANNEL),
        floor=noise.scale,
        noise=noise,
        recorded=segment.start * recording.dt,
        counted=_block(segment, recording, [found.recorded[n] for n in names], measured) if found.recorded else None,
    )


def _block(segment: Segment, recording: Recording, drives: Sequence[Drive], measured: Array) -> SegmentBlock:
    """Return the block of several drives and, below them, the time."""
    fits = [f for d in drives if d.fits for f in d.fits]
    joined = replace(
        drives[0],
        values=np.vstack([d.values for d in drives]),
        fits=tuple(fits) if len(fits) == len(drives) else None,
        entry=max(d.entry for d in drives),
    )
    block = full_block(segment, joined, measured)
    first = int(block.nodes[0, 0])
    time = (np.arange(block.drive.shape[1], dtype=np.float64) - first + segment.start) * recording.dt
    return replace(block, drive=np.vstack([block.drive, time]))


def effects_for(output: str) -> list[EffectSpec]:
    """Return the SPECs of all effects that act on an output channel and may be proposed."""
    specs = [registry.load("effect", n).SPEC for n in registry.names("effect")]
    return [s for s in specs if output in s.outputs and s.proposed]
