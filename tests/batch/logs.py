"""Logs of a damper whose parameters are known, written as CSV."""

from pathlib import Path

import numpy as np

from mrfit.models import bingham

FREQUENCY, PER_CYCLE, CYCLES, AMPLITUDE = 2.0, 200, 6, 0.01
NOISE = 2.0


def write_log(path: Path, seed: int, fy: float = 500.0, damping: float = 1200.0) -> None:
    """Write a log of a Bingham damper in sinusoidal motion, with noise in its force."""
    rng = np.random.default_rng(seed)
    dt = 1.0 / (FREQUENCY * PER_CYCLE)
    time = np.arange(PER_CYCLE * CYCLES) * dt
    omega = 2.0 * np.pi * FREQUENCY
    position, velocity = AMPLITUDE * np.sin(omega * time), AMPLITUDE * omega * np.cos(omega * time)
    force = bingham.response(velocity[None, :], np.array([[fy, damping, 0.0]]), dt)[0]
    force = force + NOISE * rng.standard_normal(len(time))
    rows = np.column_stack([time, position, velocity, force])
    path.parent.mkdir(parents=True, exist_ok=True)
    header = "time (s),displacement (m),velocity (m/s),force (N)"
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=header, comments="")
