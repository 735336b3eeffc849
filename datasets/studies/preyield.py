"""Logs of the preyield paper's bench: 100 sines, 4 to 16 mm by 0.1 to 4 Hz by 0 to 1 A, on a damper like its RD-8040-1.

None of the paper's nine models made them: it is the plug of ``rig/plug.py`` with a gas spring K*x + f0. The six
constants of the plug at 0 and at 1 A are fitted to the paper's Tables 1-2; its chains yield over longer strokes where
there is current. K and f0 are those of a gas chamber of 300 psi behind a rod of 10 mm.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from datasets.rig.plug import Plug
from datasets.rig.stop import Array, StopLaw

AMPLITUDES = (0.004, 0.008, 0.012, 0.016)
FREQUENCIES = (0.1, 0.5, 1.0, 2.0, 4.0)
CURRENTS = (0.0, 0.25, 0.5, 0.75, 1.0)
CYCLES, OVERSAMPLING = 6, 4
STROKE_NOISE = 2e-6
# 1 mm/s at most
SLOW, SLOW_FREQUENCY, SLOW_PER_CYCLE = "slow_16mm_0.01Hz.csv", 0.01, 8000
# What a rig varies beside the plug's constants
GAS = {"stiffness": (0.5, 2.0), "offset": (0.5, 2.0), "noise": (0.5, 3.0)}


@dataclass(frozen=True)
class Rig:
    """Constants at 0 and at 1 A, between them as the field saturates; gas spring, noise and the size of a log.

    Attributes
    ----------
    yield_force, post_yield, pre_yield
        fy in N, C at standstill and C0 in N*s/m.
    thinning
        Speed in m/s over which the viscosity thins.
    first, last
        Strokes in m over which the first and the last chain yield.
    chains
        How many chains.
    stiffness, offset, noise
        K in N/m, f0 in N, noise of the force in N.
    per_cycle, currents
        Samples a cycle, and the currents tested in A.
    """

    yield_force: tuple[float, float] = (84.0, 889.0)
    post_yield: tuple[float, float] = (1048.0, 10760.0)
    pre_yield: tuple[float, float] = (2.757e4, 4.015e5)
    thinning: tuple[float, float] = (0.667, 0.0304)
    first: tuple[float, float] = (84e-6, 58.6e-6)
    last: tuple[float, float] = (304e-6, 1837e-6)
    chains: int = 7
    stiffness: float = 900.0
    offset: float = 160.0
    noise: float = 3.0
    per_cycle: int = 400
    currents: tuple[float, ...] = CURRENTS

    def plug(self, current: float) -> Plug:
        """Return the plug at a current in A."""
        field = 1.45 * current - 0.45 * current**2
        fy, c, c0 = (low + (high - low) * field for low, high in (self.yield_force, self.post_yield, self.pre_yield))
        ends = (self.thinning, self.first, self.last)
        thinning, first, last = (low * (high / low) ** field for low, high in ends)
        strokes = np.geomspace(first, last, self.chains)
        law = StopLaw(strokes, np.full(self.chains, 1.0 / self.chains) / strokes)
        return Plug(lambda i: fy + 0.0 * i, lambda i: c + 0.0 * i, lambda i: c0 + 0.0 * i, thinning, law)

    def drawn(self, seed: int) -> "Rig":
        """Return a rig with another draw of what the paper leaves open: gas spring, noise, how many chains."""
        rng = np.random.default_rng(seed)
        gas = {name: getattr(self, name) * rng.uniform(*span) for name, span in GAS.items()}
        return replace(self, **gas, chains=int(rng.integers(4, 13)))


def make(out: Path, seed: int, rig: Rig = Rig()) -> None:
    """Write logs of six cycles of every sine, as a test machine saves them, and the slow test."""
    rng = np.random.default_rng([seed, 3])
    fine = rig.per_cycle * OVERSAMPLING
    phase = 2.0 * np.pi * np.arange(CYCLES * fine) / fine
    amplitude, frequency = (grid.ravel() for grid in np.meshgrid(AMPLITUDES, FREQUENCIES, indexing="ij"))
    position = amplitude[:, None] * np.sin(phase)
    for current in rig.currents:
        force = damped(rig, current, position, 1.0 / (frequency * fine))
        for k, (metres, hertz) in enumerate(zip(amplitude, frequency, strict=True)):
            path = out / f"sine_{1e3 * metres:02.0f}mm_{hertz:g}Hz_{current:g}A.csv"
            kept = slice(None, None, OVERSAMPLING)
            save(path, position[k, kept], force[k, kept], 1.0 / (hertz * rig.per_cycle), rig, rng, current)
    # the quasi-static test of the paper's Fig. 2: two slow cycles without current, which is not recorded
    slow = AMPLITUDES[-1] * np.sin(2.0 * np.pi * np.arange(2 * SLOW_PER_CYCLE + 1) / SLOW_PER_CYCLE)[None, :]
    step = 1.0 / (SLOW_FREQUENCY * SLOW_PER_CYCLE)
    save(out / SLOW, slow[0], damped(rig, 0.0, slow, np.array([step]))[0], step, rig, rng)


def damped(rig: Rig, current: float, position: Array, step: Array) -> Array:
    """Return the force in N of strokes (runs, samples) in m at a current in A."""
    plug: Array = rig.plug(current).force(position, np.zeros((1, 1)), step)
    return plug + rig.stiffness * position + rig.offset


def save(
    path: Path, stroke: Array, force: Array, step: float, rig: Rig, rng: np.random.Generator, *held: float
) -> None:
    """Write one log with the noise of its instruments, and the current that is held, if it is recorded."""
    stroke = stroke + STROKE_NOISE * rng.standard_normal(len(stroke))
    force = force + rig.noise * rng.standard_normal(len(force))
    columns = [step * np.arange(len(stroke)), 1e3 * stroke, force, *(np.full(len(stroke), i) for i in held)]
    heads = ("Time,Displacement,Load,Current\ns,mm,N,A\n", "Time,Displacement,Load\ns,mm,N\n")
    with path.open("w", newline="\n", encoding="ascii") as file:
        file.write(heads[not held])
        np.savetxt(file, np.stack(columns, axis=1), "%.8g", ",")
