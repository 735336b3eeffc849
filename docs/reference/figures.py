"""Figures of models at their start values, and of effects on a base model."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib

matplotlib.use("svg")

import matplotlib.pyplot as plt
import numpy as np

from mrfit.core import registry
from mrfit.core.built_in import own_names
from mrfit.core.channels import CHANNELS
from mrfit.core.specs import Array, EffectSpec
from mrfit.discover.evidence.screen import is_level
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.current_dependence import CurrentDependence

DT = 1e-3
SECONDS = 6.0
# Shown: the last cycles, in s
SHOWN = 2.0
# By how much an effect moves the output: RMS over range
MOVED = 0.08
HIGHEST_CURRENT = 2.0
YIELD_FORCE = {"fy@0A": 150.0, "fy@2A": 900.0}
# Base models of effects on a coil, by their output
BASES = {"flux": "boucwen-flux", "current": "stop-mmf"}
WIDTH, HEIGHT = 6.8, 2.6
STYLE = {"font.size": 9, "svg.hashsalt": "mrfit", "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True}
Channels = Mapping[str, Array]


def write(folder: Path) -> None:
    """Write one SVG for each model and effect."""
    folder.mkdir(parents=True, exist_ok=True)
    with plt.rc_context(STYLE):
        for name in own_names("model"):
            model = assemble(name)
            drive = channels(held=True)
            _draw(folder / f"{name}.svg", model, drive, [("C0", response(model, model.spec.start, drive))])
        for name in own_names("effect"):
            model, drive, without, changed = effect(name)
            _draw(folder / f"{name}.svg", model, drive, [("0.55", without), ("C1", changed)])


def channels(held: bool) -> Channels:
    """Return every channel that a model may need, over time: a sine of 1 Hz, a current held or switched."""
    time = np.arange(round(SECONDS / DT)) * DT
    w = 2 * np.pi
    sine, cosine = np.sin(w * time), np.cos(w * time)
    switched = 0.5 + (np.sin(w * time / 0.9) > 0.0)
    # heating along the part that is shown
    warmth = np.clip(time - (SECONDS - SHOWN), 0.0, None) / SHOWN
    return {
        "displacement": 0.015 * sine,
        "velocity": 0.015 * w * cosine,
        "acceleration": -0.015 * w**2 * sine,
        "angle": 0.2 * sine,
        "angular_velocity": 0.2 * w * cosine,
        "angular_acceleration": -0.2 * w**2 * sine,
        "current": np.ones_like(time) if held else switched,
        "flux": 0.06 * sine,
        "flux_resistance": np.full_like(time, 2.1),
        "heat_before": np.zeros_like(time),
        "temperature": 20.0 + 40.0 * warmth,
        "time": time,
    }


def response(model: Assembly, theta: Array, drive: Channels) -> Array:
    """Return the output (N,) of a model to a drive; a coil is driven by a sine of 3 A."""
    given = {**drive, "current": 3.0 * np.sin(2 * np.pi * drive["time"])} if model.spec.output == "flux" else drive
    rows = np.array([given[name] for name in model.spec.inputs])
    out: Array = model.simulate(rows, theta[None, :], DT)[0]
    return out


def effect(name: str) -> tuple[Assembly, Channels, Array, Array]:
    """Return an effect on its base model, the drive, and the output without and with it."""
    spec: EffectSpec = registry.load("effect", name).SPEC
    of_coil = "flux" in spec.outputs
    base = next((b for output, b in BASES.items() if output in spec.outputs), "tanh")
    varies = CurrentDependence((("fy", 1),), 0.0, HIGHEST_CURRENT) if base == "tanh" else None
    model = assemble(f"{base}+{name}", varies)
    drive = channels(held="current" not in spec.inputs)
    neutral = {f"{name}.{p.name}": value for p, value in zip(spec.params, spec.neutral, strict=True)}
    values = {**dict(zip(model.spec.names, model.spec.start, strict=True)), **neutral}
    values |= {n: v for n, v in YIELD_FORCE.items() if n in values}
    theta = np.array(list(values.values()))
    without = response(model, theta, drive)
    for p in spec.params:
        # what sets in at a level of the output sets in where the figure shows it
        if is_level(p, model.spec.output):
            theta[model.spec.names.index(f"{name}.{p.name}")] = 0.5 * np.max(np.abs(without))
    place = model.spec.names.index(f"{name}.{spec.params[0].name}")
    shown = slice(-round(SHOWN / DT), None)
    scale = float(np.ptp(without[shown]))

    def moved(value: float) -> tuple[float, Array]:
        changed = response(model, np.where(np.arange(len(theta)) == place, value, theta), drive)
        difference = (changed - without)[shown]
        # the constant of a flux is not known
        difference = difference - difference.mean() * of_coil
        return float(np.sqrt(np.mean(difference**2))) / scale, changed

    low, high = 1e-7 * spec.params[0].high, spec.params[0].high
    for _ in range(40):
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if moved(middle)[0] > MOVED else (middle, high)
    return model, drive, without, moved(low)[1]


def _draw(path: Path, model: Assembly, drive: Channels, lines: list[tuple[str, Array]]) -> None:
    shown = slice(-round(SHOWN / DT), None)
    across = _across(model)
    figure, axes = plt.subplots(1, 1 + len(across), figsize=(WIDTH, HEIGHT), layout="constrained", sharey=True)
    base = {**drive, "current": 3.0 * np.sin(2 * np.pi * drive["time"])} if model.spec.output == "flux" else drive
    for axis, name in zip(axes, ("time", *across), strict=True):
        origin = drive["time"][shown][0] if name == "time" else 0.0
        for colour, output in lines:
            axis.plot(base[name][shown] - origin, output[shown], color=colour, linewidth=1.2)
        axis.set_xlabel("time (s)" if name == "time" else _label(name))
    axes[0].set_ylabel(_label(model.spec.output))
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def _across(model: Assembly) -> tuple[str, ...]:
    """Return the channels over which an output is drawn as a loop."""
    over = {"flux": ("current",), "current": ("flux",), "torque": ("angle", "angular_velocity")}
    return over.get(model.spec.output, ("displacement", "velocity"))


def _label(name: str) -> str:
    unit = CHANNELS[name].unit if name in CHANNELS else ""
    return f"{name.replace('_', ' ')} ({unit})"
