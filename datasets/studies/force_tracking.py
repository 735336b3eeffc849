"""Logs of the inverse-tanh paper's bench: sines of 1 and 2 Hz, 5 and 10 mm, at 0 to 1 A, and steps of the current.

The damper is the plug of ``rig/plug.py``, not the paper's tanh, with the yield force, viscosity and offset over current
of the paper's Table 3. Leak, spring, chains, thinning and a factor on the viscosity are those by which its forces in
the 24 sines are nearest to those of the tanh with Table 3. The fluid sees the current behind a lag of 50 1/s (eq. 9)
and a residual magnetism, which the paper names as a source of its errors: what Table 3 says holds where the current
rises. 1000 samples a second, noise and all: the channel map asks for the 20 Hz low-pass of the paper's record.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from datasets.rig.damper import lagged, play
from datasets.rig.plug import Plug
from datasets.rig.stop import Array, StopLaw

RATE, OVERSAMPLING, CYCLES = 1000.0, 2, 6
CURRENTS = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
SINES = ((1.0, 0.005), (2.0, 0.005), (1.0, 0.010), (2.0, 0.010))
FORCE_NOISE, STROKE_NOISE, CURRENT_NOISE = 6.0, 2e-6, 2e-3
ACTUATOR_LAG = 0.010
STEPS_SECONDS = 12.0


@dataclass(frozen=True)
class Rig:
    """Field and plug of the damper.

    Attributes
    ----------
    lag
        Time constant of the field in s.
    coercive
        Half-width in A of the play between current and field.
    stiffness
        Spring in N/m.
    leak
        Pre-yield dashpot in N*s/m without current, and its slope in N*s/m/A.
    thinning
        Speed in m/s over which the viscosity thins.
    strokes
        Strokes in m over which the first and the last of seven chains yield.
    thicker
        Viscosity over the c of Table 3, of which the chains and the leak take a part.
    noise
        Of the force, in N.
    """

    lag: float = 0.016
    coercive: float = 0.03
    stiffness: float = 50.0
    leak: tuple[float, float] = (1.06e4, 9.3e4)
    thinning: float = 0.19
    strokes: tuple[float, float] = (21e-6, 460e-6)
    thicker: float = 1.43
    noise: float = FORCE_NOISE

    def field(self, command: Array, step: float) -> Array:
        """Return the current in A that the fluid feels; it is the command where that has only risen."""
        return play(lagged(command, self.lag, step), self.coercive, before=-self.coercive) + self.coercive

    def drawn(self, seed: int) -> "Rig":
        """Return a rig with another draw of what the paper leaves open: leak, chains, thinning, noise."""
        rng = np.random.default_rng(seed)
        low, high = (float(s * rng.uniform(0.7, 1.4)) for s in self.strokes)
        wider = float(rng.uniform(0.7, 1.4))
        return replace(
            self,
            leak=(wider * self.leak[0], wider * self.leak[1]),
            strokes=(low, high),
            thinning=float(self.thinning * rng.uniform(0.5, 2.0)),
            noise=float(self.noise * rng.uniform(0.5, 2.0)),
        )


def yield_force(current: Array) -> Array:
    """Return fy of Table 3 in N."""
    above = -719.6 * current**2 + 1817.0 * current - 135.7
    return np.where(current < 0.2, 579.6 * current + 82.96, above)


def viscosity(current: Array) -> Array:
    """Return c of Table 3 in N*s/m; its jump of 0.05 N*s/mm at 0.2 A is left out."""
    above = 0.1429 * current**2 + 2.669 * current + 0.79
    return 1e3 * np.where(current < 0.2, 3.1 * current + 0.71, above)


def offset(current: Array) -> Array:
    """Return f0 of Table 3 in N."""
    above = 16.28 * current**2 - 29.55 * current - 11.67
    return np.where(current < 0.2, -19.95 * current - 11.77, above)


def plant(position: Array, command: Array, step: float, rig: Rig = Rig()) -> Array:
    """Return the damper's force in N, of piston stroke (m) and current command (A), each (runs, samples)."""
    field, strokes = rig.field(command, step), np.geomspace(*rig.strokes, 7)
    law = StopLaw(strokes, np.full(len(strokes), 1.0 / len(strokes)) / strokes)
    plug = Plug(
        yield_force,
        lambda i: rig.thicker * viscosity(i),
        lambda i: rig.leak[0] + rig.leak[1] * i,
        rig.thinning,
        law,
    )
    force: Array = plug.force(position, field, np.full(len(position), step)) + rig.stiffness * position + offset(field)
    return force


def random_steps(rng: np.random.Generator, samples: int, step: float) -> Array:
    """Return a current that steps to another of the six levels every 0.25 to 0.9 s, (1, samples)."""
    ends = np.cumsum(rng.uniform(0.25, 0.9, 200))
    levels = rng.integers(0, len(CURRENTS), 201)
    levels[1:] += levels[1:] == levels[:-1]
    chosen = np.array(CURRENTS)[levels % len(CURRENTS)]
    return chosen[np.searchsorted(ends, step * np.arange(samples), side="right")][None, :]


MAP = """\
[channels]
displacement = {column = "Displacement", unit = "mm"}
force = {column = "Load", unit = "N", low_pass = 20}
stroke_command = {column = "Command", unit = "mm"}
"""


def save(path: Path, columns: list[Array]) -> None:
    """Write time, stroke, force, current, and the command that the actuator follows 10 ms late."""
    with path.open("w", newline="\n", encoding="ascii") as file:
        file.write("Time,Displacement,Load,Current,Command\ns,mm,N,A,mm\n")
        np.savetxt(file, np.stack(columns, axis=1), "%.8g", ",")


def record(
    path: Path, drives: tuple[Array, Array, Array], force: Array, noise: float, rng: np.random.Generator
) -> None:
    """Write one log of stroke, its command, current and force, given at the solver's rate, as instruments show them."""
    stroke, led, current, shown = (column[::OVERSAMPLING] for column in (*drives, force))
    shown = shown + noise * rng.standard_normal(len(shown))
    stroke = stroke + STROKE_NOISE * rng.standard_normal(len(stroke))
    current = current + CURRENT_NOISE * rng.standard_normal(len(current))
    time = np.arange(len(shown)) / RATE
    save(path, [time, 1e3 * stroke, shown, current, 1e3 * led])


def make(out: Path, seed: int, rig: Rig = Rig()) -> None:
    """Write 24 sines at constant current and one with random steps of the current."""
    rng = np.random.default_rng([seed, 4])
    (out / "mrfit.toml").write_text(MAP, encoding="utf-8")
    step = 1.0 / (RATE * OVERSAMPLING)
    for frequency in (1.0, 2.0):
        tests = [(a, i) for f, a in SINES if f == frequency for i in CURRENTS]
        time = np.arange(int(CYCLES / frequency / step)) * step
        stroke = np.array([a for a, _ in tests])[:, None]
        motion, led = (stroke * np.sin(2.0 * np.pi * frequency * t) for t in (time, time + ACTUATOR_LAG))
        command = np.broadcast_to(np.array([i for _, i in tests])[:, None], motion.shape)
        force = plant(motion, command, step, rig)
        for k, (amplitude, current) in enumerate(tests):
            stem = f"sine_{frequency:g}Hz_{1e3 * amplitude:02.0f}mm_{current:g}A"
            record(out / f"{stem}.csv", (motion[k], led[k], command[k]), force[k], rig.noise, rng)
    time = np.arange(int(STEPS_SECONDS / step)) * step
    motion, led = (0.010 * np.sin(2.0 * np.pi * t)[None, :] for t in (time, time + ACTUATOR_LAG))
    command = random_steps(rng, len(time), step)
    force = plant(motion, command, step, rig)
    record(out / "steps_1Hz_10mm.csv", (motion[0], led[0], command[0]), force[0], rig.noise, rng)
