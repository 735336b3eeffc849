"""The rig makes the drives that it is given, and nothing else."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.advise import read_drive, run_coil, run_damper
from datasets.rig.case import Hidden

SECONDS, FREQUENCY = 2.0, 3.0


def written(folder: Path, rate: float, unit: str, name: str, size: float) -> Path:
    time = np.arange(int(SECONDS * rate)) / rate
    value = size * np.sin(2 * np.pi * FREQUENCY * time)
    lines = [f"time [s],{name} [{unit}]" + (",current [A]" if name == "displacement" else "")]
    for t, x in zip(time, value, strict=True):
        lines.append(f"{t:.6f},{x:.9f}" + (f",{1.0 if t < 1.0 else 2.0}" if name == "displacement" else ""))
    path = folder / "drive.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def columns(path: Path, skip: int) -> np.ndarray:
    return np.genfromtxt(path, delimiter=",", skip_header=skip)


def test_the_press_follows_stroke_and_current(tmp_path: Path):
    drive = read_drive(written(tmp_path, 500.0, "m", "displacement", 0.01))
    run_damper(Hidden("plain-damper", effects={"inertia": 30.0}), drive, "advised_a", tmp_path, 0)
    log = columns(tmp_path / "advised_a.csv", 2)
    assert log[:, 1] == pytest.approx(1e3 * drive["displacement"], abs=0.02)
    # the driver's own lag is 2 ms
    assert np.abs(log[:, 3] - drive["current"])[505:].max() < 0.03 and log[499, 3] == pytest.approx(1.0, abs=0.02)
    run_damper(Hidden("plain-damper"), drive, "advised_b", tmp_path, 0)
    w, x = 2 * np.pi * FREQUENCY, drive["displacement"]
    apart = 1e3 * (log[:, 2] - columns(tmp_path / "advised_b.csv", 2)[:, 2])
    assert apart[50:-50] == pytest.approx((-30.0 * w**2 * x)[50:-50], abs=15.0)


def test_the_coil_follows_the_current(tmp_path: Path):
    drive = read_drive(written(tmp_path, 1000.0, "A", "current", 2.0))
    (tmp_path / "logs").mkdir()
    run_coil(Hidden("coil"), drive, "advised_a", tmp_path / "logs", 0)
    assert [p.name for p in (tmp_path / "logs").iterdir()] == ["advised_a.csv"]
    (log,) = (columns(p, 30) for p in (tmp_path / "logs").iterdir())
    shown = log[:, -1] / 0.1
    assert np.corrcoef(shown, drive["current"][-len(shown) :])[0, 1] > 0.99
    assert np.ptp(shown) == pytest.approx(4.0, rel=0.15)
