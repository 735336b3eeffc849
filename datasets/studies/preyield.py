"""Logs of the preyield paper's bench: 100 sines, 4 to 16 mm by 0.1 to 4 Hz by 0 to 1 A, on a damper like its RD-8040-1.

None of the paper's nine models made them: it is the plug of ``rig/plug.py`` with a gas spring K*x + f0. fy and C0 at 0
and 1 A and C at 0 A are near the paper's Tables 1-2 (LMH); K and f0 are those of a gas chamber of 300 psi behind a rod
of 10 mm.
"""

from pathlib import Path

import numpy as np

from datasets.rig.plug import Plug
from datasets.rig.stop import Array

AMPLITUDES = (0.004, 0.008, 0.012, 0.016)
FREQUENCIES = (0.1, 0.5, 1.0, 2.0, 4.0)
CURRENTS = (0.0, 0.25, 0.5, 0.75, 1.0)
CYCLES, PER_CYCLE, OVERSAMPLING = 6, 400, 4
FORCE_NOISE, STROKE_NOISE = 3.0, 2e-6
STIFFNESS, OFFSET = 900.0, 160.0
# 1 mm/s at most
SLOW, SLOW_FREQUENCY, SLOW_PER_CYCLE = "slow_16mm_0.01Hz.csv", 0.01, 8000


def yield_force(current: Array) -> Array:
    """Return fy in N: 75 N without current, 850 N at 1 A, saturating."""
    return 75.0 + 1130.0 * current - 355.0 * current**2


def post_yield(current: Array) -> Array:
    """Return C in N*s/m at standstill."""
    return 1000.0 + 3400.0 * current - 500.0 * current**2


def pre_yield(current: Array) -> Array:
    """Return C0 in N*s/m."""
    return 2.0e4 + 1.9e5 * current - 5.0e4 * current**2


def tests() -> tuple[Array, Array, Array]:
    """Return amplitude (m), frequency (Hz) and current (A) of the hundred tests."""
    grid = np.meshgrid(AMPLITUDES, FREQUENCIES, CURRENTS, indexing="ij")
    return grid[0].ravel(), grid[1].ravel(), grid[2].ravel()


def make(out: Path, seed: int) -> None:
    """Write a hundred logs of six cycles, 400 samples each, as a test machine saves them."""
    rng = np.random.default_rng([seed, 3])
    amplitude, frequency, current = tests()
    fine = PER_CYCLE * OVERSAMPLING
    phase = 2.0 * np.pi * np.arange(CYCLES * fine) / fine
    position = amplitude[:, None] * np.sin(phase)
    step = 1.0 / (frequency * fine)
    plug = Plug(yield_force, post_yield, pre_yield)
    force = plug.force(position, current[:, None], step) + STIFFNESS * position + OFFSET
    position, force = position[:, ::OVERSAMPLING], force[:, ::OVERSAMPLING]
    position = position + STROKE_NOISE * rng.standard_normal(position.shape)
    force = force + FORCE_NOISE * rng.standard_normal(force.shape)
    for k in range(len(amplitude)):
        stem = f"sine_{1e3 * amplitude[k]:02.0f}mm_{frequency[k]:g}Hz_{current[k]:g}A"
        time = np.arange(position.shape[1]) / (frequency[k] * PER_CYCLE)
        held = np.full(len(time), current[k])
        with (out / f"{stem}.csv").open("w", newline="\n", encoding="ascii") as file:
            file.write("Time,Displacement,Load,Current\ns,mm,N,A\n")
            columns = np.stack([time, 1e3 * position[k], force[k], held], axis=1)
            np.savetxt(file, columns, "%.8g", ",")
    slow_test(out, plug, rng)


def slow_test(out: Path, plug: Plug, rng: np.random.Generator) -> None:
    """Write the quasi-static test of the paper's Fig. 2: two slow cycles without current, which is not recorded."""
    amplitude, cycles = AMPLITUDES[-1], 2
    position = amplitude * np.sin(2.0 * np.pi * np.arange(cycles * SLOW_PER_CYCLE + 1) / SLOW_PER_CYCLE)[None, :]
    step = 1.0 / (SLOW_FREQUENCY * SLOW_PER_CYCLE)
    force = plug.force(position, np.zeros((1, 1)), np.array([step])) + STIFFNESS * position + OFFSET
    stroke = position[0] + STROKE_NOISE * rng.standard_normal(position.shape[1])
    load = force[0] + FORCE_NOISE * rng.standard_normal(position.shape[1])
    with (out / SLOW).open("w", newline="\n", encoding="ascii") as file:
        file.write("Time,Displacement,Load\ns,mm,N\n")
        np.savetxt(file, np.stack([step * np.arange(len(stroke)), 1e3 * stroke, load], axis=1), "%.8g", ",")
