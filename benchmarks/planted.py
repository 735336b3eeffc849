"""Logs made in memory from models with known parameters: what speed and coverage are measured on."""

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array
from mrfit.fit.identify import FitGroup, build_group
from mrfit.search.cube import Cube, cube_of
from mrfit.signal.smoothing import smooth
from mrfit.simulate.assembly import Assembly, assemble

PER_CYCLE = 2000
LEAD_CYCLES = 2
# Samples of noise before the first that is used
SETTLING = 200
# Drives by output: channel, and amplitude (SI) and frequency (Hz) of one condition after another
DRIVES = {"flux": "current", "force": "displacement", "torque": "angle", "current": "flux"}
AMPLITUDES = {
    "current": (3.0, 1.0, 5.0),
    "flux": (0.05, 0.02, 0.1),
    "displacement": (0.02, 0.01, 0.03),
    "angle": (0.3, 0.15, 0.5),
}
# Start and true values that give a loop to be seen
VISIBLE = {"boucwen-flux": {"D": 0.05}}
FREQUENCIES = (2.0, 1.0, 5.0, 3.0, 0.5)


def problem(
    model: str,
    conditions: int,
    samples: int,
    rng: np.random.Generator,
    noise: float = 0.01,
    fitted: str = "",
    correlation: float = 0.0,
) -> tuple[FitGroup, Assembly, Cube]:
    """Return the blocks of a joint fit to planted logs, with the model and its cube.

    Parameters
    ----------
    model
        Registry name.
    conditions
        Number of logs, each with an amplitude and a frequency of its own.
    samples
        Samples compared per log, 2000 per cycle.
    rng
        Source of the noise and of the planted parameters, which lie about the start values.
    noise
        Standard deviation of the noise, as a share of the output's.
    fitted
        Model to fit, of the same output; empty for the one that makes the data.
    correlation
        Of the noise at a lag of one sample.
    """
    assembly = assemble(model)
    cube = cube_of(assembly.spec, {}, VISIBLE.get(model, {}), {})
    theta = planted_values(cube, rng)
    recordings, segments = {}, []
    for number in range(conditions):
        recording, segment = sine_log(assembly, theta, number, samples)
        output = recording.channels[assembly.spec.output]
        scale = noise * float(np.std(output[segment.start :]))
        burn = SETTLING if correlation else 0
        white = rng.standard_normal(len(output) + burn)
        coloured = lfilter([np.sqrt(1.0 - correlation**2)], [1.0, -correlation], white)[burn:]
        channels = {**recording.channels, assembly.spec.output: output + scale * coloured}
        recordings[recording.id] = replace(recording, channels=channels)
        segments.append(segment)
    if fitted:
        assembly = assemble(fitted)
        cube = cube_of(assembly.spec, {}, VISIBLE.get(fitted, {}), {})
    return build_group("all", segments, recordings, assembly, split=False), assembly, cube


def planted_values(cube: Cube, rng: np.random.Generator) -> Array:
    """Return parameters (1, K) about the start values."""
    return cube.to_theta(np.clip(cube.start + 0.1 * (rng.random((1, len(cube.free))) - 0.5), 0.02, 0.98))


def sine_log(assembly: Assembly, theta: Array, number: int, samples: int) -> tuple[Recording, Segment]:
    """Return one noise-free sine test and its segment, led in by two cycles that are not compared."""
    drive = DRIVES[assembly.spec.output]
    amplitude = AMPLITUDES[drive][number % 3]
    frequency = FREQUENCIES[number % len(FREQUENCIES)]
    dt, lead = 1.0 / (PER_CYCLE * frequency), LEAD_CYCLES * PER_CYCLE
    values = amplitude * np.sin(2.0 * np.pi * np.arange(lead + samples) / PER_CYCLE)
    nan = float("nan")
    condition = {} if drive == "current" else {"current": 1.0, "temperature": 25.0}
    name = f"log{number}"
    recording = Recording(
        id=name, source=name, sha256="0", reader="none", dt=dt, start=0.0,
        channels={drive: values}, units={}, condition=condition,
    )  # fmt: skip
    segment = Segment(
        f"{name}#1", name, name, lead, lead + samples, lead, "sine", drive, frequency, amplitude, 0.0,
        samples // PER_CYCLE, condition.get("current", nan), condition.get("temperature", nan), "train",
    )  # fmt: skip
    whole = replace(segment, start=0, warm_up=0, cycles=segment.cycles + LEAD_CYCLES)
    inputs = smooth(recording, whole, assembly.spec.inputs)
    output = assembly.simulate(inputs.values, theta, dt)[0]
    return replace(recording, channels={drive: values, assembly.spec.output: output}), segment
