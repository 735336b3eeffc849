"""Logs of the flux paper's bench: 1, 5, 10 Hz by 1 to 5 A, the voltage set at 1 Hz and not corrected for frequency.

The paper says so (its section 5): the current falls as the frequency rises, since the inductance does not. The coil is
the stop-operator coil of ``datasets/coil`` with a loss resistance of 60 ohm parallel to it: it has eddy currents.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from datasets.make_coil_logs import FREQUENCIES, OVERSAMPLING, folder, name, save, sine_burst
from datasets.rig.coil import Coil, solve, tune

EDDY = 60.0
CURRENTS = np.arange(1.0, 6.0)


def make(out: Path, seed: int) -> None:
    """Write 15 logs of 2500 rows, ten periods, as ``datasets/coil``."""
    rng = np.random.default_rng([seed, 1])
    coil = replace(Coil(), eddy=EDDY)
    frequency, amplitude = (grid.ravel() for grid in np.meshgrid(FREQUENCIES, CURRENTS, indexing="ij"))
    at_one_hertz = tune(coil, np.ones(len(CURRENTS)), CURRENTS) * (1.0 + rng.uniform(-0.012, 0.012, len(CURRENTS)))
    emf = np.tile(at_one_hertz, len(FREQUENCIES))
    steps = 2500 * OVERSAMPLING
    run = solve(coil, emf[:, None] * sine_burst(steps, steps // 10), 10.0 / frequency / steps, OVERSAMPLING)
    logs = folder(out, coil.resistance)
    for k, (hertz, ampere) in enumerate(zip(frequency, amplitude, strict=True)):
        save(logs / name(hertz, ampere), hertz, 250, (run.voltage[k], run.current[k]), rng)
