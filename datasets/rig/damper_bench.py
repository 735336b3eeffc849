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
TESTSUITE_START = 76.675
BITS = {"position": 16, "force": 12, "current": 12, "temperature": 12}
NOISE = {"position": 2e-6, "force": 6.0, "current": 2e-3, "temperature": 0.03}
COLUMNS = {
    "Displacement": ("position", ("mm", 1e3, 0.0, ".5f"), ("in", 1 / 0.0254, 0.0, ".7f")),
    "Load": ("force", ("kN", 1e-3, 0.0, ".6f"), ("lbf", 1 / 4.4482216152605, 0.0, ".5f")),
    "Current": ("current", ("A", 1.0, 0.0, ".5f"), ("mA", 1e3, 0.0, ".2f")),
    "Temperature": ("temperature", ("degC", 1.0, 0.0, ".3f"), ("degF", 1.8, 32.0, ".3f")),
}
Column = tuple[str, Array, str]
"""Unit, values, and how a value is written."""


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
    (runs, samples), interval = record.force.shape, np.full(len(record.names), record.interval)
    drawn = {c: noises.draw(style.noise, np.full(runs, NOISE[c]), samples, interval, rng) for c in FULL_SCALE}
    seen = {c: noises.quantise(getattr(record, c) + drawn[c], FULL_SCALE[c], BITS[c]) for c in FULL_SCALE}
    seen |= {c: style.sign * seen[c] for c in ("position", "force")}
    for k, name in enumerate(style.names(record.names)):
        table = {"Time": ("s", np.arange(samples) * record.interval, ".4f")}
        for title in style.columns:
            channel, plain, other = COLUMNS[title]
            unit, scale, zero, form = other if style.other_units else plain
            table[title] = (unit, scale * seen[channel][k] + zero, form)
        rows = {title: (unit, values[:: style.stride], form) for title, (unit, values, form) in table.items()}
        if style.testsuite:
            _write_testsuite(folder / f"{name}.txt", rows)
        else:
            _write_csv(folder / f"{name}.csv", rows)
    return drawn["force"]


def _write_csv(path: Path, table: dict[str, Column]) -> None:
    """Write names, units, values, comma separated."""
    form = ",".join("{:" + spec + "}" for _, _, spec in table.values()) + "\n"
    with path.open("w", newline="\n", encoding="utf-8") as file:
        file.write(",".join(table) + "\n" + ",".join(unit for unit, _, _ in table.values()) + "\n")
        file.writelines(form.format(*row) for row in zip(*(v for _, v, _ in table.values()), strict=True))


def _write_testsuite(path: Path, table: dict[str, Column]) -> None:
    """Write as MTS TestSuite does: byte-order mark, text, names with blanks, units, tabs, time last, not from zero."""
    ordered = {title: table[title] for title in (*(t for t in table if t != "Time"), "Time")}
    unit, values, form = ordered["Time"]
    ordered["Time"] = ("sec", values + TESTSUITE_START, form)
    form = "\t".join("{:" + spec + "}" for _, _, spec in ordered.values()) + "\n"
    with path.open("w", newline="\n", encoding="utf-8-sig") as file:
        file.write(
            f"File Path: C:\\Tests\\{path.name}\nTest: damper\nTest Run: {path.stem}\nDate: 3/4/2024 10:12:00 AM\n\n\n"
        )
        file.write(" \t".join(ordered) + " \n" + "\t".join(unit for unit, _, _ in ordered.values()) + "\n")
        file.writelines(form.format(*row) for row in zip(*(v for _, v, _ in ordered.values()), strict=True))
