"""Folders in which documented command lines are run: logs, a workspace with fits, and the files that pages name."""

import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
from scipy.io import savemat
from scipy.special import erf

from mrfit.simulate.assembly import assemble
from tests import commands
from tests.batch.logs import write_log
from tests.conftest import ROOT
from tests.docs.pages import blocks

RATE, SECONDS = 250.0, 5.0
RIG = '[rig]\nseconds = 10\nstroke = "30 mm"\nspeed = 0.3\nforce = "4 kN"\ncurrent = 3\n'
RESISTANCE = "resistance = 2.1\n"


def prepare(name: str, folder: Path) -> None:
    """Make the lab of a name in a folder."""
    LABS[name](folder)


def _run(folder: Path, line: str) -> None:
    done = commands.text(folder, *line.split())
    assert done.returncode == 0, f"mrfit {line}\n{done.stderr}"


def _shared(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for shipped in ("datasets", "pipelines"):
        (folder / shipped).symlink_to(ROOT / shipped)


def _write(path: Path, **columns: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    names = ",".join(name.rpartition("_")[0] for name in columns)
    units = ",".join(name.rpartition("_")[2] for name in columns)
    np.savetxt(
        path, np.column_stack([*columns.values()]), delimiter=",", fmt="%.7g", header=f"{names}\n{units}", comments=""
    )


def write_press_log(folder: Path, name: str, motion: tuple[float, float], current: float) -> None:
    """Write the log of a sine of a frequency (Hz) and an amplitude (m) at a constant current."""
    time, (frequency, amplitude) = np.arange(int(RATE * SECONDS)) / RATE, motion
    phase = 2.0 * np.pi * frequency * time
    velocity = amplitude * 2.0 * np.pi * frequency * np.cos(phase)
    force = (100.0 + 300.0 * current) * np.tanh(60.0 * velocity) + (800.0 + 200.0 * current) * velocity
    force += 3.0 * np.random.default_rng([int(1e3 * frequency), int(10 * current)]).standard_normal(len(time))
    columns = {"displacement_mm": 1e3 * amplitude * np.sin(phase), "force_N": force}
    _write(folder / f"{name}.csv", time_s=time, **columns, current_A=np.full(len(time), current))


def damper(folder: Path, *thorough: str) -> None:
    """Make a damper on a press, with joint and separate fits."""
    _shared(folder)
    for current in range(4):
        write_press_log(folder / "logs", f"sine_2Hz_10mm_{current}A", (2.0, 0.010), current)
    write_press_log(folder / "logs", "sine_1Hz_10mm_1A", (1.0, 0.010), 1.0)
    write_press_log(folder / "other", "sine_1Hz_5mm_2A", (1.0, 0.005), 2.0)
    (folder / "press.toml").write_text(RIG)
    for plugin, sign in (("my_damper.py", "@model"), ("my_spring.py", "EffectSpec")):
        (folder / plugin).write_text(next(b for b in blocks(ROOT / "docs/plugins.md", "python") if sign in b))
    _run(folder, "ingest logs")
    _run(folder, "segment --holdout *-3A")
    joint = ("--per", "all", "--current-order", "fy=1,c=1", "--fix", "k=0", "--fix", "f0=0")
    _run(folder, " ".join(("fit", "--model", "tanh", *joint, *thorough)))
    _run(folder, "fit --model tanh --budget 200")


def models(folder: Path) -> None:
    """Make the damper's lab with profiles of the parameters, and a fit of a second model."""
    damper(folder, "--intervals", "profile")
    _run(folder, "fit --model boucwen --budget 300 --only sine-2Hz-10mm-1A")


def coil(folder: Path) -> None:
    """Make a coil, with a fit of every condition."""
    _shared(folder)
    (folder / "mrfit.toml").write_text(f"[flux]\n{RESISTANCE}")
    _run(folder, "ingest " + " ".join(f"datasets/coil/coil_{f}Hz_1A.csv" for f in ("01", "05", "10")))
    _run(folder, "fit --model boucwen-flux --opt pso-fmin --budget 80")


def core(folder: Path) -> None:
    """Make a coil with one fit of all conditions."""
    _shared(folder)
    _run(folder, "ingest " + " ".join(f"datasets/coil/coil_{f}Hz_{i}A.csv" for f in ("01", "05") for i in (1, 3)))
    _run(folder, "fit --model stop-mmf --opt lsq --fix m=0 --per all")


def lag(folder: Path) -> None:
    """Make the damper of the first pages, with the fit of the lag that discovery finds in it."""
    _shared(folder)
    _run(folder, "ingest datasets/damper")
    _run(folder, "segment --holdout sine-2Hz-*")
    _run(folder, "fit --model tanh+current-lag --per all --current-order fy=2,c=1")


def bench(folder: Path) -> None:
    """Make tests that are measured without a model: slow cycles, and steps that a lag follows."""
    time = np.arange(int(RATE * 40.0)) / RATE
    travel = 16.0 * np.abs(2.0 * np.mod(time / 20.0, 1.0) - 1.0) - 8.0
    slow = {"displacement_mm": travel, "force_N": 30.0 + 2.0 * travel + 20.0 * np.sign(np.gradient(travel))}
    command = 1.0 + 0.5 * np.sign(np.sin(2.0 * np.pi * 0.5 * time))
    lagging = command.copy()
    for k in range(1, len(time)):
        lagging[k] = lagging[k - 1] + (command[k - 1] - lagging[k - 1]) / (0.02 * RATE)
    for path in ("logs/slow.csv", "slow_16mm_0.01Hz.csv"):
        _write(folder / path, time_s=time, **slow)
    _write(folder / "logs/steps.csv", time_s=time, current_command_A=command, current_A=lagging)
    _write(folder / "steps_1Hz_10mm.csv", time_s=time, stroke_command_mm=command, displacement_mm=lagging)


def discovered(folder: Path) -> None:
    """Make the damper's lab with a discovery, of which the tests determine the base at what is held out."""
    damper(folder)
    _run(folder, "segment --holdout sine-2Hz-10mm-1A")
    _run(folder, "discover --model tanh")


def batch(folder: Path) -> None:
    """Make folders of a coil's logs."""
    for place in ("folder", "logs"):
        (folder / place).mkdir(parents=True)
        for name in ("coil_01Hz_1A.csv", "coil_05Hz_1A.csv", "mrfit.toml"):
            shutil.copy(ROOT / "datasets/coil" / name, folder / place)
    _shared(folder)


def empty(folder: Path) -> None:
    """Make a fresh clone: logs that ship, and no workspace."""
    _shared(folder)


def fleet(folder: Path) -> None:
    """Make three units with three tests each, fitted by a batch, and a table of their covariates."""
    table = ["log,cycles,temperature"]
    for unit in range(3):
        for test in range(3):
            name = f"A{unit}_2026-01-0{test + 1}"
            write_log(folder / f"logs/{name}.csv", 3 * unit + test, fy=500.0 + 10.0 * unit)
            table.append(f"{name},{1000 * test},{20 + 5 * test}")
    (folder / "life.csv").write_text("\n".join(table))
    _run(folder, "batch logs --model bingham --opt lsq")


def rotary(folder: Path) -> None:
    """Make a sine of a rotary damper."""
    time = np.arange(int(RATE * SECONDS)) / RATE
    angle, velocity = 0.1 * np.sin(2.0 * np.pi * time), 0.2 * np.pi * np.cos(2.0 * np.pi * time)
    torque = 5.0 * angle + 0.8 * velocity + 4.0 * erf(15.0 * velocity + 0.5 * np.sign(angle))
    columns = {"angle_rad": angle, "angular-velocity_rad/s": velocity, "torque_N*m": torque}
    _write(folder / "logs/rotary.csv", time_s=time, **columns)
    _run(folder, "ingest logs")


def blocks_of_damper(folder: Path) -> None:
    """Make strokes at constant speed, a sine and steps of current, one for each block of a damper."""
    time = np.arange(int(RATE * SECONDS)) / RATE
    phase = 2.0 * np.pi * time
    strokes = 10.0 * 2.0 / np.pi * np.arcsin(np.sin(phase))
    steps = 1.0 + 0.5 * np.sign(np.sin(0.5 * phase))
    tests = [(strokes, 0.5), (strokes, 1.5), (10.0 * np.sin(phase), 1.0), (strokes, steps)]
    for k, (travel, current) in enumerate(tests):
        force = (100.0 + 300.0 * current) * np.tanh(0.06 * np.gradient(travel, time)) + 1e-3 * time
        columns = {"displacement_mm": travel, "force_N": force, "current_A": np.broadcast_to(current, time.shape)}
        _write(folder / f"logs/test_{k}.csv", time_s=time, **columns)
    _run(folder, "ingest logs")


def shaker(folder: Path) -> None:
    """Make a mass that a force drives: a record to train on in HDF5, a test of one array a file, and a fit."""
    folder.mkdir(parents=True, exist_ok=True)
    phase, rng = 2.0 * np.pi * np.arange(750) / 750.0, np.random.default_rng(5)
    cycle = sum(4.0 * np.cos(k * phase + rng.uniform(0.0, 2.0 * np.pi)) for k in range(5, 80, 3))
    law = assemble("boucwen-hardening@force")
    values = {"c": 10.0, "k": 5e4, "x0": 0.0, "alpha": 5e4, "b": -2.2, "g": 1.6, "n": 1.0, "z0": 2e-3, "mass": 2.0}
    motion = law.simulate(np.tile(cycle, 3)[None], law.spec.theta(values)[None], 1.0 / 750.0)[0, -750:]
    with h5py.File(folder / "training_dynonet.h5", "w") as file:
        file["multisine/u"] = np.tile(cycle, 3)
        file["multisine/y"] = np.tile(motion, 3) + 1e-6 * rng.standard_normal(2250)
    for name, signal in (("uval", cycle), ("yval", motion)):
        savemat(folder / f"{name}_multisine.mat", {f"{name}_multisine": signal[None]})
    page = next(b for b in blocks(ROOT / "docs/driven.md", "toml"))
    (folder / "boucwen.toml").write_text(page.replace("0.091552734375", "1.0"))
    _run(folder, "ingest training_dynonet.h5 --map boucwen.toml")
    _run(folder, "fit --model boucwen-hardening --driven-by force --mass free")


LABS: dict[str, Callable[[Path], None]] = {
    "damper": damper,
    "models": models,
    "coil": coil,
    "core": core,
    "lag": lag,
    "bench": bench,
    "discovered": discovered,
    "batch": batch,
    "empty": empty,
    "fleet": fleet,
    "rotary": rotary,
    "blocks": blocks_of_damper,
    "shaker": shaker,
}
