"""The four kinds of tests that Savaia et al. identify a Hammerstein-Wiener damper with, and one to judge it by."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import mrfit.segment.stage
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, write_json
from mrfit.simulate.assembly import assemble

DT = 1e-3
PEAK_SPEED = 0.25
# Speed in m/s and amplitude in m of the triangular strokes
SPEEDS = ((0.04, 0.01), (0.1, 0.025), (0.25, 0.025))
NOISE = 8.0
TRUTH = {
    **{"c_pre": 2.5e4, "c_post": 1500.0, "a": 0.025, "b": 0.006, "f0": 40.0},
    **{"p1": 90.0, "p2": 300.0, "p3": 700.0, "p4": 1500.0, "omega": 350.0, "xi": 0.9},
    **{"q1": 50.0, "q2": 350.0, "zero": 180.0, "tau": 0.004},
    **{"temperature.b_yield": 0.0, "temperature.b_viscous": 0.009},
}
KINDS = ("speed", "sine", "step", "heating", "road")


@dataclass(frozen=True)
class Motion:
    """One log's clean channels (N,): velocity in m/s, current in A, temperature in degC."""

    name: str
    velocity: Array
    current: Array
    temperature: Array


def constant_speed(speed: float, current: float, stroke: float = 0.025, cycles: int = 3) -> Motion:
    """Triangular strokes: the force against speed is the static map."""
    frequency = speed / (4 * stroke)
    t = np.arange(round(cycles / frequency / DT)) * DT
    v = speed * np.sign(np.sin(2 * np.pi * (t + DT / 2) * frequency))
    return _at(f"speed-{speed:g}-{current:g}", v, current)


def sine(frequency: float, current: float, cycles: int = 6) -> Motion:
    """Sines of one peak speed: the faster, the wider the loop."""
    t = np.arange(round(cycles / frequency / DT)) * DT
    return _at(f"sine-{frequency:g}-{current:g}", PEAK_SPEED * np.cos(2 * np.pi * frequency * t), current)


def step(speed: float, current: float, stroke: float = 0.025, cycles: int = 4) -> Motion:
    """Triangular strokes with the current switched on at their middle and off at their end."""
    still = constant_speed(speed, 0.0, stroke, cycles)
    phase = np.arange(len(still.velocity)) * DT * speed / (4 * stroke)
    on = np.where((2 * phase) % 1.0 > 0.5, current, 0.0)
    return Motion(f"step-{speed:g}-{current:g}", still.velocity, on, still.temperature)


def heating(current: float, seconds: float = 8.0) -> Motion:
    """A sine of 2.5 Hz that warms a small damper."""
    t = np.arange(round(seconds / DT)) * DT
    v = PEAK_SPEED * np.cos(2 * np.pi * 2.5 * t)
    return Motion(f"heating-{current:g}", v, np.full(len(t), current), 80.0 - 75.0 * np.exp(-t / 3.0))


def road(seed: int, seconds: float = 6.0) -> Motion:
    """Random strokes up to 10 Hz under a binary current of random levels."""
    rng, t = np.random.default_rng(seed), np.arange(round(seconds / DT)) * DT
    rates = np.linspace(0.3, 10.0, 60)
    v = sum(0.035 * np.sin(2 * np.pi * (f * t + p)) for f, p in zip(rates, rng.random(60), strict=True))
    levels = np.repeat(rng.uniform(0.0, 2.0, 400) * (rng.random(400) > 0.5), rng.integers(25, 120, 400))[: len(t)]
    return Motion(f"road-{seed}", np.asarray(v), levels, np.full(len(t), 25.0))


def _at(name: str, velocity: Array, current: float) -> Motion:
    return Motion(name, velocity, np.full(len(velocity), current), np.full(len(velocity), 25.0))


def programme(kinds: Sequence[str] = KINDS) -> list[Motion]:
    """Return the motions of the kinds of tests wanted."""
    made = {
        "speed": [constant_speed(s, i, x) for s, x in SPEEDS for i in (0.0, 0.8, 1.6)],
        "sine": [sine(f, i) for f in (1.5, 4.0, 9.0) for i in (0.4, 1.2)],
        "step": [step(0.1, 0.8), step(0.1, 1.6)],
        "heating": [heating(1.2)],
        "road": [road(1)],
    }
    return [motion for kind in kinds for motion in made[kind]]


def write_tests(
    folder: Path, motions: Sequence[Motion], model: str, truth: Mapping[str, float] = TRUTH, seed: int = 1
) -> Workspace:
    """Return a workspace with the logs of a model's force on the motions, noise added, segmented; road held out."""
    workspace, rng, whole = Workspace(folder), np.random.default_rng(seed), assemble(model)
    theta = np.array([[truth[n] for n in whole.spec.names]])
    records = []
    for m in motions:
        x = np.cumsum(m.velocity) * DT
        channels = {"displacement": x - x.mean(), "velocity": m.velocity, "current": m.current}
        channels |= {"temperature": m.temperature}
        clean = whole.simulate(np.stack([channels[n] for n in whole.spec.inputs]), theta, DT)[0]
        channels["force"] = clean + NOISE * rng.standard_normal(len(clean))
        records.append(Recording(m.name, m.name, m.name, "none", DT, 0.0, channels, {}, {}, {}))
        workspace.write_recording(records[-1])
    write_json(workspace.ingest_json, {"recordings": [About.of(r) for r in records], "refused": []})
    held = "waveform=random" if any(m.name.startswith("road") for m in motions) else "none"
    mrfit.segment.stage.run(workspace, mrfit.segment.stage.Settings(holdout=held))
    return workspace
