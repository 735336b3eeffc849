"""A damper with a law that no base has, perhaps with something hidden, written straight into a workspace.

The law is a set of yielding springs (Iwan) of which each yields at its own force, a viscous force that grows with less
than the speed, and a relaxation behind it; all of it rises with current, and not in proportion.
"""

from pathlib import Path

import numpy as np

import mrfit.segment.stage
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, write_json

RATE, SECONDS = 500.0, 4.0
CURRENTS = (0.2, 1.0, 2.0)
TESTS = ((1.0, 0.015), (2.0, 0.010), (4.0, 0.008), (6.0, 0.004))
YIELD_TRAVELS = (0.0003, 0.0008, 0.002)
NOISE = 3.0


def law(x: Array, v: Array, current: float) -> Array:
    """Force of the law alone in N, at one current in A."""
    force = np.zeros(len(x))
    strength = 60.0 + 420.0 * np.tanh(0.7 * current)
    for travel, share in zip(YIELD_TRAVELS, (0.5, 0.3, 0.2), strict=True):
        stop, top = 0.0, travel
        for n in range(1, len(x)):
            stop = min(max(stop + x[n] - x[n - 1], -top), top)
            force[n] += strength * share * stop / top
    thick = (250.0 + 150.0 * current) * np.sign(v) * np.abs(v / 0.1) ** 0.7
    late = np.zeros(len(v))
    keep = np.exp(-1.0 / RATE / 0.004)
    for n in range(1, len(v)):
        late[n] = keep * late[n - 1] + (1.0 - keep) * thick[n]
    total: Array = force + late
    return total


def workspace(folder: Path, spring: float = 0.0, mass: float = 0.0, ripple: float = 0.0, seed: int = 5) -> Workspace:
    """A workspace of twelve sine tests.

    Parameters
    ----------
    folder
        Of the workspace.
    spring, mass
        Stiffness in N/m and mass in kg that are hidden.
    ripple
        Force in N of a ripple along the stroke, which no effect of the library describes.
    seed
        Of the noise.
    """
    rng, made, about = np.random.default_rng(seed), Workspace(folder), []
    for current in CURRENTS:
        for frequency, stroke in TESTS:
            omega, lead = 2 * np.pi * frequency, int(RATE / frequency)
            t = np.arange(-lead, int(RATE * SECONDS)) / RATE
            x, v = stroke * np.sin(omega * t), stroke * omega * np.cos(omega * t)
            force = law(x, v, current) + spring * x - mass * omega**2 * x
            force += ripple * np.sin(2 * np.pi * x / 0.006)
            channels = {"displacement": x, "velocity": v, "force": force + NOISE * rng.standard_normal(len(t))}
            channels = {name: values[lead:] for name, values in channels.items()}
            channels["current"] = np.full(len(t) - lead, current)
            name = f"{frequency:g}Hz-{1e3 * stroke:g}mm-{current:g}A"
            record = Recording(name, f"{name}.csv", name, "none", 1.0 / RATE, 0.0, channels, {})
            made.write_recording(record)
            about.append(About.of(record))
    write_json(made.ingest_json, {"recordings": about, "refused": []})
    mrfit.segment.stage.run(made, mrfit.segment.stage.Settings())
    return made
