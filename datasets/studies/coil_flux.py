"""Logs of the flux paper's bench: 1, 5, 10 Hz by 1 to 5 A, the voltage set at 1 Hz and not corrected for frequency.

The paper says so (its section 5): the current falls as the frequency rises, since the inductance does not. The coil is
the stop-operator coil of ``datasets/coil`` with a loss resistance of 60 ohm parallel to it: it has eddy currents.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from datasets.make_coil_logs import FREQUENCIES, OVERSAMPLING, folder, name, save, sine_burst
from datasets.rig.coil import Coil, other_coil, solve, tune

CURRENTS = np.arange(1.0, 6.0)


@dataclass(frozen=True)
class Rig:
    """Loss resistance in ohm, the coil, and whether the voltage is set again at every frequency."""

    eddy: float = 60.0
    coil: Coil = Coil()
    corrected: bool = False

    def drawn(self, seed: int) -> "Rig":
        """Return a rig with another draw of what the paper leaves open: iron, resistance, eddy currents."""
        rng = np.random.default_rng(seed)
        return replace(self, coil=other_coil(rng), eddy=float(self.eddy * rng.uniform(0.5, 2.0)))


def make(out: Path, seed: int, rig: Rig = Rig()) -> None:
    """Write 15 logs of 2500 rows, ten periods, as ``datasets/coil``."""
    rng = np.random.default_rng([seed, 1])
    coil = replace(rig.coil, eddy=rig.eddy)
    frequency, amplitude = (grid.ravel() for grid in np.meshgrid(FREQUENCIES, CURRENTS, indexing="ij"))
    miss = np.tile(1.0 + rng.uniform(-0.012, 0.012, len(CURRENTS)), len(FREQUENCIES))
    emf = miss * tune(coil, frequency if rig.corrected else np.ones(len(frequency)), amplitude)
    steps = 2500 * OVERSAMPLING
    run = solve(coil, emf[:, None] * sine_burst(steps, steps // 10), 10.0 / frequency / steps, OVERSAMPLING)
    logs = folder(out, coil.resistance)
    for k, (hertz, ampere) in enumerate(zip(frequency, amplitude, strict=True)):
        save(logs / name(hertz, ampere), hertz, 250, (run.voltage[k], run.current[k]), rng)
