"""The damper's bench: what load cell, stroke sensor, shunt and thermocouple see, and the files the press saves."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.rig import noise as noises
from datasets.rig.damper import Damper, simulate
from datasets.rig.press import OVERSAMPLING, Programme, motion_of
from datasets.rig.stop import Array
from datasets.rig.style import Style

FULL_SCALE = {"position": 0.030, "force": 4000.0, "current": 4.0, "temperature": 100.0}
NOISE = {"position": 3e-6, "force": 6.0, "current": 2e-3, "temperature": 0.03}
COLUMNS = {
    "Displacement": ("position", ("mm", 1e3, 0.0, ".5f"), ("in", 1 / 0.0254, 0.0, ".7f")),
    "Load": ("force", ("kN", 1e-3, 0.0, ".6f"), ("lbf", 1 / 4.4482216152605, 0.0, ".5f")),
    "Current": ("current", ("A", 1.0, 0.0, ".5f"), ("mA", 1e3, 0.0, ".2f")),
    "Temperature": ("temperature", ("degC", 1.0, 0.0, ".3f"), ("degF", 1.8, 32.0, ".3f")),
}


@dataclass(frozen=True, slots=True)
class DamperRecord:
    """What the sensors present to the converters, before noise; arrays (runs, samples), SI."""

    names: list[str]
    interval: float
    position: Array
    speed: Array
    force: Array
    current: Array
    temperature: Array


def run(damper: Damper, magnitudes: Mapping[str, float], tests: list[Programme]) -> DamperRecord:
    """Run the press and return what the sensors present; ``speed`` is for checks, no file holds it."""
    motion = motion_of(tests)
    true = simulate(damper, magnitudes, motion)
    kept = np.s_[:, ::OVERSAMPLING]
    return DamperRecord(
        [t.name for t in tests],
        motion.step * OVERSAMPLING,
        motion.position[kept],
        motion.speed[kept],
        true.force[kept],
        motion.current[kept],
        true.temperature[kept],
    )


def save(record: DamperRecord, folder: Path, style: Style, rng: np.random.Generator) -> Array:
    """Write one CSV file with a unit row per log; return the noise added to the force in N, (runs, samples)."""
    shape, interval = record.force.shape, np.full(len(record.names), record.interval)
    drawn = {c: noises.draw(style.noise, NOISE[c], shape, interval, rng) for c in FULL_SCALE}
    seen = {c: noises.quantise(getattr(record, c) + drawn[c], FULL_SCALE[c]) for c in FULL_SCALE}
    seen |= {c: style.sign * seen[c] for c in ("position", "force")}
    for k, name in enumerate(style.names(record.names)):
        table = {"Time": ("s", np.arange(shape[1]) * record.interval, ".4f")}
        for title in style.columns:
            channel, plain, other = COLUMNS[title]
            unit, scale, zero, form = other if style.other_units else plain
            table[title] = (unit, scale * seen[channel][k] + zero, form)
        form = ",".join("{:" + spec + "}" for _, _, spec in table.values()) + "\n"
        with (folder / f"{name}.csv").open("w", newline="\n", encoding="utf-8") as file:
            file.write(",".join(table) + "\n" + ",".join(unit for unit, _, _ in table.values()) + "\n")
            columns = (values[:: style.stride] for _, values, _ in table.values())
            file.writelines(form.format(*row) for row in zip(*columns, strict=True))
    return drawn["force"]
