"""Logs of the rotary-stiffness paper's bench: 60 sines by a shake table on a lever, 2048 samples a second.

The disk is the plug of ``rig/plug.py`` turned, with a spring that grows with current; yield torque, viscosity and
spring are those of the paper's eqs. 20-22. Leak, a factor on the viscosity and the angles over which its chains yield,
which grow with the current, are those by which error functions fitted to all conditions come near eqs. 23-24. The table
moves the tip of a lever of 202.5 mm (7.06, 17.65 and 28.2 mm are 2, 5 and 8 degrees); a load cell in its rod and two
transducers at its tip are recorded.
"""

from dataclasses import dataclass, replace
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


@dataclass(frozen=True)
class Rig:
    """The disk: torque in N*m over angle in rad.

    Attributes
    ----------
    strokes
        Angles in rad over which the first and the last of six chains yield without current.
    growth
        Growth of these angles with the current, as a share of them for each ampere.
    thicker
        Viscosity over that of eq. 21, of which the chains and the leak take a part.
    leak
        Pre-yield dashpot in N*m*s/rad without current, and its slope over current in A.
    thinning
        Speed in rad/s over which the viscosity thins; far beyond those of the tests, it does not.
    spring
        Stiffness in N*m/rad without current, and its slope over current in A.
    noise
        Of the load cell, in N.
    """

    strokes: tuple[float, float] = (1e-4, 1.25e-4)
    growth: float = 2.5
    thicker: float = 1.2
    leak: tuple[float, float] = (18.0, 113.0)
    thinning: float = 1e3
    spring: tuple[float, float] = (-10.41, 28.48)
    noise: float = FORCE_NOISE

    def torque(self, angle: Array, current: Array, step: Array) -> Array:
        """Return the torque of angles (runs, samples) at currents (runs, 1) and steps (runs,)."""
        strokes = np.geomspace(*self.strokes, 6)
        plug = Plug(
            yield_force=lambda i: 0.77 + 4.97 * i,
            post_yield=lambda i: self.thicker * (0.23 + 2.06 * i),
            pre_yield=lambda i: self.leak[0] + self.leak[1] * i,
            shear_speed=self.thinning,
            law=StopLaw(strokes, np.full(len(strokes), 1.0 / len(strokes)) / strokes),
            growth=lambda i: 1.0 + self.growth * i,
        )
        torque: Array = plug.force(angle, current, step) + (self.spring[0] + self.spring[1] * current) * angle
        return torque

    def drawn(self, seed: int) -> "Rig":
        """Return a rig with another draw of what the paper leaves open: chains, leak, noise."""
        rng = np.random.default_rng(seed)
        low, high, leak, growth, noise = (float(x) for x in rng.uniform(0.6, 1.6, 5))
        return replace(
            self,
            strokes=(low * self.strokes[0], high * self.strokes[1]),
            leak=(leak * self.leak[0], leak * self.leak[1]),
            growth=growth * self.growth,
            noise=noise * self.noise,
        )


def make(out: Path, seed: int, rig: Rig = Rig()) -> None:
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
        torque = rig.torque(angle, current, np.full(len(tests), step))
        force, vertical = torque / (LEVER * np.cos(angle)), LEVER * (1.0 - np.cos(angle))
        for k, (amplitude, ampere) in enumerate(tests):
            kept = slice(None, None, OVERSAMPLING)
            noise = rng.standard_normal((4, len(time[kept])))
            columns = [
                time[kept],
                1e3 * (horizontal[k, kept] + STROKE_NOISE * noise[0]),
                1e3 * (vertical[k, kept] + STROKE_NOISE * noise[1]),
                force[k, kept] + rig.noise * noise[2],
                ampere + CURRENT_NOISE * noise[3],
            ]
            path = out / f"{frequency:g}Hz_{1e3 * amplitude:g}mm_{ampere:g}A.csv"
            with path.open("w", newline="\n", encoding="ascii") as file:
                file.write("Time,Horizontal,Vertical,Load,Current\ns,mm,mm,N,A\n")
                np.savetxt(file, np.stack(columns, axis=1), "%.7g", ",")
