"""Small dampers with something hidden, written straight into a workspace."""

from pathlib import Path

import numpy as np

import mrfit.segment.stage
from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.io.schemas.stages import About
from mrfit.io.workspace import Workspace, write_json
from mrfit.kernels.filters import play

PER_CYCLE, CYCLES, NOISE = 250, 6, 2.0
TESTS = tuple((f, x) for f in (1.0, 2.0, 4.0) for x in (0.005, 0.01, 0.015))
GAS_COLUMN = 0.05
STAIRS, RIPPLE = (0.0, 0.5, 1.0, 0.5, 0.0, 1.0), 0.02
LAW = {"fy": 300.0, "a1": 60.0, "c": 800.0, "k": 2000.0}


def force(x: Array, v: Array, a: Array, mass: float, drag: float) -> Array:
    """A tanh damper with a moving mass and an orifice loss, written out here."""
    plain = LAW["fy"] * np.tanh(LAW["a1"] * v) + LAW["c"] * v + LAW["k"] * x
    total: Array = plain + mass * a + drag * v * np.abs(v)
    return total


def workspace(
    folder: Path,
    mass: float = 0.0,
    drag: float = 0.0,
    gas: float = 0.0,
    bump: float = 0.0,
    branch: float = 0.0,
    magnetism: float = 0.0,
    relief: float = np.inf,
    tests: tuple[tuple[float, float], ...] = TESTS,
) -> Workspace:
    """A workspace of sine tests on such a damper, perhaps with a gas force, local friction or a Maxwell branch.

    A relief valve takes half of the force above the one at which it opens (N).

    With residual magnetism (A) the current is logged too: stairs of a cycle each, with the ripple of a switched coil.
    """
    rng = np.random.default_rng(7)
    made = Workspace(folder)
    records = []
    for frequency, stroke in tests:
        omega = 2 * np.pi * frequency
        t = np.arange(PER_CYCLE * CYCLES) / (PER_CYCLE * frequency)
        x, v, a = stroke * np.sin(omega * t), stroke * omega * np.cos(omega * t), -stroke * omega**2 * np.sin(omega * t)
        total = force(x, v, a, mass, drag)
        total += -0.5 * np.maximum(total - LAW["k"] * x - relief, 0.0) + gas * ((1.0 - x / GAS_COLUMN) ** -1.4 - 1.0)
        total += bump * np.exp(-(((x - 4e-3) / 4e-3) ** 2)) * np.tanh(v / 5e-3)
        # a Maxwell branch, settled; its time constant is 20 ms
        total += branch * stroke * omega * np.cos(omega * t - np.arctan(0.02 * omega)) / np.hypot(1.0, 0.02 * omega)
        name = f"{frequency:g}Hz-{1e3 * stroke:g}mm"
        channels, units = {"displacement": x}, {"displacement": "m", "force": "N"}
        if magnetism:
            channels["current"] = np.repeat(STAIRS, PER_CYCLE) + RIPPLE * np.sin(0.5 * np.arange(len(t)))
            units["current"] = "A"
            total *= 1.0 + play(channels["current"], magnetism)
        records.append(
            Recording(
                id=name,
                source=f"{name}.csv",
                sha256=name,
                reader="none",
                dt=1 / (PER_CYCLE * frequency),
                start=0.0,
                channels={**channels, "force": total + NOISE * rng.standard_normal(len(t))},
                units=units,
            )
        )
    for record in records:
        made.write_recording(record)
    write_json(made.ingest_json, {"recordings": [About.of(r) for r in records], "refused": []})
    mrfit.segment.stage.run(made, mrfit.segment.stage.Settings())
    return made
