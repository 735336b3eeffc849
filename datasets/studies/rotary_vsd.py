"""Logs of the rotary-stiffness paper's bench: 60 sines by a shake table on a lever, 2048 samples a second.

The disk is the plug of ``rig/plug.py`` turned: chains that yield over 1 to 12 mrad, a viscosity that thins, a spring
that grows with current; the size of each is near the paper's eqs. 20-24. The table moves the tip of a lever of 202.5 mm
(7.06, 17.65 and 28.2 mm are 2, 5 and 8 degrees); a load cell in its rod and two transducers at its tip are recorded.
"""

from pathlib import Path

import numpy as np

from datasets.rig.plug import Plug
from datasets.rig.stop import Array, StopLaw

RATE, OVERSAMPLING, CYCLES = 2048.0, 2, 6
LEVER = 0.2025
STROKES = (7.06e-3, 17.65e-3, 28.2e-3)
FREQUENCIES = (0.5, 1.0, 2.0, 3.0)
CURRENTS = (0.0, 0.5, 1.0, 1.5, 2.0)
FORCE_NOISE, STROKE_NOISE, CURRENT_NOISE = 0.15, 5e-6, 2e-3
MAP = f"""\
lever = {LEVER}

[channels]
displacement = {{column = "Horizontal", unit = "mm"}}
vertical = {{column = "Vertical", unit = "mm"}}
"""


def disk() -> Plug:
    """Return the disk: torque in N*m over angle in rad."""
    thresholds = np.geomspace(1e-3, 12e-3, 6)
    law = StopLaw(thresholds, np.full(len(thresholds), 1.0 / len(thresholds)) / thresholds)
    return Plug(
        yield_force=lambda i: 0.77 + 4.97 * i,
        post_yield=lambda i: 0.25 + 2.2 * i,
        pre_yield=lambda i: 20.0 + 220.0 * i,
        shear_speed=2.0,
        law=law,
    )


def spring(current: Array) -> Array:
    """Return the stiffness in N*m/rad."""
    return 1.0 + 17.0 * current


def make(out: Path, seed: int) -> None:
    """Write 60 logs of six cycles."""
    rng = np.random.default_rng([seed, 5])
    (out / "mrfit.toml").write_text(MAP, encoding="utf-8")
    step = 1.0 / (RATE * OVERSAMPLING)
    tests = [(a, i) for a in STROKES for i in CURRENTS]
    stroke, current = (np.array(column)[:, None] for column in zip(*tests, strict=True))
    for frequency in FREQUENCIES:
        time = step * np.arange(round(CYCLES / frequency / step))
        horizontal = stroke * np.sin(2.0 * np.pi * frequency * time)
        angle = np.arcsin(horizontal / LEVER)
        torque = disk().force(angle, current, np.full(len(tests), step)) + spring(current) * angle
        force, vertical = torque / (LEVER * np.cos(angle)), LEVER * (1.0 - np.cos(angle))
        for k, (amplitude, ampere) in enumerate(tests):
            kept = slice(None, None, OVERSAMPLING)
            noise = rng.standard_normal((4, len(time[kept])))
            columns = [
                time[kept],
                1e3 * (horizontal[k, kept] + STROKE_NOISE * noise[0]),
                1e3 * (vertical[k, kept] + STROKE_NOISE * noise[1]),
                force[k, kept] + FORCE_NOISE * noise[2],
                ampere + CURRENT_NOISE * noise[3],
            ]
            path = out / f"{frequency:g}Hz_{1e3 * amplitude:g}mm_{ampere:g}A.csv"
            with path.open("w", newline="\n", encoding="ascii") as file:
                file.write("Time,Horizontal,Vertical,Load,Current\ns,mm,mm,N,A\n")
                np.savetxt(file, np.stack(columns, axis=1), "%.7g", ",")
