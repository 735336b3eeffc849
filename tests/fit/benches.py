"""Damper logs whose parameters are known: a model driven by sines at several currents, with white noise added."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.io.workspace import Workspace
from mrfit.simulate.assembly import Assembly

SAMPLES_PER_CYCLE = 100
CYCLES = 8
# Share of a sample by which no sample falls on a reversal, where a sign is a matter of rounding
ASIDE = 0.25
# What moves in a log of each output, with its two rates, and the factor on a sine's amplitude in m
MOVED = {
    "force": (("displacement", "velocity", "acceleration"), 1.0),
    "torque": (("angle", "angular_velocity", "angular_acceleration"), 60.0),
    "flux": (("current",), 300.0),
    "current": (("flux",), 2.0),
}


@dataclass(frozen=True)
class Bench:
    """What makes the logs: model, its parameters (K,), noise as a share of each log's range of output, seed."""

    assembly: Assembly
    theta: Array
    noise: float
    seed: int


def planted_segments(
    sines: Sequence[tuple[float, float]], levels: Sequence[float], drive: str = "displacement"
) -> list[Segment]:
    """One segment of whole cycles after one cycle of warm-up for every sine (Hz, amplitude in m) and current (A)."""
    lead = SAMPLES_PER_CYCLE
    return [
        Segment(
            id=f"{f:g}Hz{x:g}at{i:g}#1",
            condition=f"sine-{f:g}Hz-{x:g}-{i:g}A",
            recording=f"{f:g}Hz{x:g}at{i:g}",
            start=lead,
            stop=lead + CYCLES * SAMPLES_PER_CYCLE,
            warm_up=lead,
            waveform="sine",
            drive=drive,
            frequency=f,
            amplitude=x,
            offset=0.0,
            cycles=CYCLES,
            current=i,
            temperature=float("nan"),
            role="train",
        )
        for f, x in sines
        for i in levels
    ]


def drive_channels(output: str, segment: Segment) -> dict[str, Array]:
    """Clean channels of one log: what moves, with its rates, and the current at which it was held."""
    names, scale = MOVED[output]
    rate = 2 * np.pi * segment.frequency
    count = segment.stop
    phase = 2 * np.pi * (np.arange(count) + ASIDE) / SAMPLES_PER_CYCLE
    values = (np.sin(phase), rate * np.cos(phase), -(rate**2) * np.sin(phase))
    channels = {n: scale * segment.amplitude * v for n, v in zip(names, values, strict=False)}
    return {"current": np.full(count, segment.current), **channels}


def record(bench: Bench, segment: Segment, rng: np.random.Generator) -> Recording:
    """The log of one segment: the model's output on the clean drive, plus noise."""
    spec = bench.assembly.spec
    channels = drive_channels(spec.output, segment)
    dt = 1 / (segment.frequency * SAMPLES_PER_CYCLE)
    drive = np.stack([channels[n] for n in spec.inputs])
    output = bench.assembly.simulate(drive, bench.theta[None, :], dt)[0]
    output = output + bench.noise * np.ptp(output) * rng.standard_normal(len(output))
    identifier = segment.recording
    return Recording(
        identifier,
        identifier,
        "0",
        "none",
        dt,
        0.0,
        {**channels, spec.output: output},
        {},
        {},
        {"current": segment.current},
    )


def write_workspace(
    folder: Path, bench: Bench, sines: Sequence[tuple[float, float]], levels: Sequence[float]
) -> Workspace:
    """A workspace as ingest and segment leave it, one log for every sine and current, all of them training."""
    workspace, rng = Workspace(folder), np.random.default_rng(bench.seed)
    drive = MOVED[bench.assembly.spec.output][0][0]
    segments = planted_segments(sines, levels, drive)
    for segment in segments:
        workspace.write_recording(record(bench, segment, rng))
    workspace.write_segments(segments, {})
    return workspace
