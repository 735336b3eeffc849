"""Specimens: what is drawn for a case of a kind, its logs by a rig's sensors, and the truth beside them."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.signal import lfilter

from benchmarks.second_rig.logger import write_log

from .drives import WAVES, Drive, make_motion
from .forms import KINDS, Array, Name, Scales, Term, draw_terms, parts_of
from .lawful import lawful_columns, outside
from .laws import EXACT, LAWS, WRONG, Damper, draw_damper

BASES = ("bingham", "biviscous", "dahl", "guo", "tanh")
HELD_OUT = 4
LEAST_SIZE, GREATEST_SIZE = 0.01, 0.08  # largest force of a term over the range of the law's force
LEAST_CONTRAST = 1.0  # root mean square of what no law takes of a term, over the noise
ATTEMPTS = 20


@dataclass(frozen=True)
class Sensors:
    """Errors of the sensors: root mean squares, steps and offsets, in SI units."""

    rate: float
    force: float
    colour: float
    coloured: float  # share of the power of the noise that is coloured
    force_step: float
    force_offset: float
    stroke: float
    stroke_step: float
    stroke_offset: float
    current: float
    current_step: float
    current_offset: float
    temperature: bool


@dataclass(frozen=True)
class Run:
    """A test without noise: values of the variables as the sensors' offsets show them, and the terms' forces (N)."""

    values: dict[str, Array]
    terms: list[Array]

    @property
    def planted(self) -> Array:
        """All that is hidden (N)."""
        return np.sum([np.zeros_like(self.values["t"]), *self.terms], axis=0)


@dataclass(frozen=True)
class Specimen:
    """A case: what it is, its tests for the command and those kept from it, and the names that are right."""

    case: str
    kind: str
    damper: Damper
    base: str
    terms: list[Term]
    right: list[frozenset[Name]]
    sensors: Sensors
    tests: list[Run]
    held_out: list[Run]
    frames: list[pd.DataFrame]
    waves: list[str]

    @cached_property
    def size(self) -> float:
        """Range of the law's force (N)."""
        return float(np.ptp(np.concatenate([run.values["L"] for run in self.tests])))

    def described(self) -> dict[str, object]:
        """Return the truth as it stands beside the logs."""
        damper = {**asdict(self.damper), "law": self.damper.law.name}
        return {
            "case": self.case,
            "kind": self.kind,
            "base": self.base,
            "damper": damper,
            "terms": [t.described() for t in self.terms],
            "range": self.size,
            "sensors": asdict(self.sensors),
            "waves": self.waves,
        }

    def write(self, folder: Path) -> None:
        """Write the logs into ``folder/logs`` and the truth beside them."""
        (folder / "logs").mkdir(parents=True, exist_ok=True)
        for k, frame in enumerate(self.frames):
            write_log(folder / "logs" / f"run_{k + 1:02d}.csv", frame)
        (folder / "truth.json").write_text(json.dumps(self.described(), indent=1) + "\n")


def make_specimen(seed: int, kind: str, index: int, base: str = "") -> Specimen:
    """Make case ``index`` of a kind; it depends on these and the base alone.

    Raises
    ------
    RuntimeError
        If no draw has terms of which something is left beside every law.
    """
    case = f"seed{seed}-{kind}-{index:03d}"
    for attempt in range(ATTEMPTS):
        specimen = _draw(np.random.default_rng([seed, KINDS.index(kind), index, attempt]), case, kind, base)
        if all(c >= LEAST_CONTRAST for c in contrasts(specimen)):
            return specimen
    raise RuntimeError(f"{case}: in {ATTEMPTS} draws no term is seen beside every law")


def contrasts(specimen: Specimen) -> list[float]:
    """Return what no law takes of each term, over the noise, where that is less: in the tests or in those held out."""
    worst = [np.inf] * len(specimen.terms)
    for runs in (specimen.tests, specimen.held_out):
        columns = lawful_columns([r.values for r in runs], specimen.damper)
        for k in range(len(worst)):
            left = outside(columns, np.concatenate([r.terms[k] for r in runs]))
            worst[k] = min(worst[k], float(np.sqrt(np.mean(left**2))) / specimen.sensors.force)
    return worst


def _draw(rng: np.random.Generator, case: str, kind: str, base: str) -> Specimen:
    exact = kind == "null-exact-law"
    damper = draw_damper(rng, LAWS[str(rng.choice(EXACT if exact else WRONG))])
    base = base or damper.law.model or str(rng.choice(BASES))
    parts = parts_of(kind)
    warm = any(p in ("arrhenius", "temperature") for p in parts)
    drives, seconds = _draw_drives(rng, damper, warm, bool(rng.uniform() < 0.3))
    rate = float(rng.choice([500.0, 800.0]))
    bare = [_simulate(damper, d, rate) for d in drives]
    tests = bare[:-HELD_OUT]
    top = {name: max(float(np.max(np.abs(r[name]))) for r in tests) for name in ("x", "v", "a", "i")}
    size = float(np.ptp(np.concatenate([r["L"] for r in tests])))
    drawn = draw_terms(kind, rng, Scales(**top, t=seconds))
    terms = [_scaled(rng, term, tests, size) for term, _ in drawn]
    sensors = _draw_sensors(rng, rate, size, damper, warm)
    shifted = [_shifted(values, terms, sensors) for values in bare]
    frames = [_record(rng, run, sensors) for run in shifted[: len(tests)]]
    waves = [d.motion.wave for d in drives]
    right = [names for _, names in drawn]
    runs = shifted[: len(tests)], shifted[len(tests) :]
    return Specimen(case, kind, damper, base, terms, right, sensors, *runs, frames, waves)


def _draw_drives(rng: np.random.Generator, damper: Damper, warm: bool, switched: bool) -> tuple[list[Drive], float]:
    """Draw tests over strokes, speeds and currents, the last ones to be held out, and a typical length (s)."""
    waves = [str(w) for w in rng.choice(WAVES, size=int(rng.integers(2, 4)), replace=False)]
    levels = np.linspace(0.0, damper.greatest, int(rng.integers(3, 5)))
    count = int(rng.integers(8, 13))
    drives = []
    for k in range(count + HELD_OUT):
        held = k >= count
        far = damper.stroke * (1.0 if k == 0 else float(rng.uniform(0.45, 0.9 if held else 1.0)))
        fast = damper.speed * (1.0 if k == 0 else float(rng.uniform(0.3, 0.9 if held else 1.0)))
        seconds = float(np.clip(4 * 2 * np.pi * far / fast, 3.0, 6.0))
        motion = make_motion(waves[k % len(waves)], rng, seconds, far, fast)
        times = np.sort(rng.uniform(0.3, seconds - 0.3, 4)) if switched else np.zeros(0)
        between = bool(held and not switched and rng.uniform() < 0.5)
        current = rng.choice(levels, times.size + 1) if switched else levels[[k % levels.size]]
        current = current * (0.8 if between else 1.0)
        heat = (float(rng.uniform(15, 55)), float(rng.uniform(3, 15))) if warm else (25.0, 0.0)
        drives.append(Drive(motion, seconds, current, times, *heat))
    return drives, float(np.median([d.seconds for d in drives]))


def _simulate(damper: Damper, drive: Drive, rate: float) -> dict[str, Array]:
    t = np.arange(int(drive.seconds * rate)) / rate
    x, v, a = drive.motion.at(t)
    force = damper.force(drive, t)
    return {"x": x, "v": v, "a": a, "i": drive.current(t), "T": drive.temperature(t), "t": t, "L": force}


def _scaled(rng: np.random.Generator, term: Term, tests: list[dict[str, Array]], size: float) -> Term:
    largest = max(float(np.max(np.abs(term.at(values)))) for values in tests)
    share = float(np.exp(rng.uniform(np.log(LEAST_SIZE), np.log(GREATEST_SIZE))))
    # a mass, a gas and a viscosity push one way
    plain = any(f.variable == "a" or f.shape in ("column", "arrhenius") for f in term.factors)
    return replace(term, coefficient=share * size / largest * (1.0 if plain else float(rng.choice([-1.0, 1.0]))))


def _draw_sensors(rng: np.random.Generator, rate: float, size: float, damper: Damper, warm: bool) -> Sensors:
    noise = size * float(np.exp(rng.uniform(np.log(0.001), np.log(0.005))))
    stroke = damper.stroke * float(rng.uniform(2e-5, 1e-4))
    return Sensors(
        rate=rate,
        force=noise,
        colour=float(rng.uniform(0.5, 0.95)),
        coloured=float(rng.choice([0.0, 0.3, 0.6])),
        force_step=noise * float(rng.uniform(0.2, 1.0)),
        force_offset=size * float(rng.choice([0.0, rng.uniform(-0.02, 0.02)])),
        stroke=stroke,
        stroke_step=stroke * float(rng.uniform(0.5, 2.0)),
        stroke_offset=damper.stroke * float(rng.choice([0.0, rng.uniform(-0.05, 0.05)])),
        current=2e-3,
        current_step=1e-3,
        current_offset=float(rng.uniform(-5e-3, 5e-3)),
        temperature=warm or bool(rng.uniform() < 0.3),
    )


def _shifted(values: dict[str, Array], terms: list[Term], sensors: Sensors) -> Run:
    seen = {**values, "x": values["x"] + sensors.stroke_offset, "i": values["i"] + sensors.current_offset}
    return Run(seen, [term.at(values) for term in terms])


def _record(rng: np.random.Generator, run: Run, s: Sensors) -> pd.DataFrame:
    """Return a log in SI units: noise, offset and steps of the sensors on the quiet values."""
    values, n = run.values, run.planted.size
    white = rng.standard_normal((2, n + 200))
    coloured = lfilter([np.sqrt(1 - s.colour**2)], [1, -s.colour], white[1])
    noise = s.force * (np.sqrt(1 - s.coloured) * white[0] + np.sqrt(s.coloured) * coloured)[200:]
    columns = {
        "time": values["t"],
        "displacement": _steps(values["x"] + s.stroke * rng.standard_normal(n), s.stroke_step),
        "force": _steps(values["L"] + run.planted + s.force_offset + noise, s.force_step),
        "current": _steps(values["i"] + s.current * rng.standard_normal(n), s.current_step),
    }
    if s.temperature:
        columns["temperature"] = _steps(values["T"] + 0.05 * rng.standard_normal(n), 0.02)
    return pd.DataFrame(columns)


def _steps(signal: Array, step: float) -> Array:
    return np.round(signal / step) * step
