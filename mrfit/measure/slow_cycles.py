"""Friction and gas spring of a slow test, where the force hardly depends on the speed.

    F = F_gas + k*(d - d_m) ± F_f over the middle of the stroke, + where the velocity is positive

F_gas gas force (N) at the middle d_m of the stroke, k gas rate (N/m), F_f friction (N).

Source: quasi-static test, as ``mrfit.measure.quasi_static``.
"""

import numpy as np

from mrfit.measure.cycles import GRID, Cycles
from mrfit.measure.intervals import PerCycle
from mrfit.measure.quantity import Quantity, without
from mrfit.measure.quasi_static import MIDDLE

NAMES = ("friction", "gas force", "gas rate")


def quantities(cycles: Cycles, slow: float) -> list[Quantity]:
    """Return friction, gas force and gas rate where no speed is above ``slow`` in m/s."""
    if cycles.peak_velocity > slow:
        return without(NAMES, f"no slow test: {1e3 * cycles.peak_velocity:.3g} mm/s, above {1e3 * slow:g} mm/s")
    found = np.empty((3, 2, cycles.count))
    branches = [(up, *cycles.branch_times(up), cycles.samples(up)) for up in (True, False)]
    for k in range(cycles.count):
        rows, forces = [], []
        for up, begin, end, samples in branches:
            at = (cycles.time[samples[k]] - begin[k]) / (end[k] - begin[k])
            moved = np.interp(at, GRID, cycles.table[up][0]) - cycles.middle
            inside = np.abs(moved) <= MIDDLE * cycles.stroke / 2.0
            sign = np.full(int(inside.sum()), 1.0 if up else -1.0)
            rows.append(np.stack([sign, np.ones(len(sign)), moved[inside]], axis=1))
            forces.append(cycles.force[samples[k]][inside])
        weights = np.linalg.pinv(np.concatenate(rows))
        found[:, 0, k] = weights @ np.concatenate(forces)
        found[:, 1, k] = cycles.noise**2 * np.sum(weights**2, axis=1)
    zeros = (0.0, cycles.zero, 0.0)
    return [
        Quantity(name, cycles.estimate(lambda x: x, PerCycle(values, noise, zero=zero)))
        for name, (values, noise), zero in zip(NAMES, found, zeros, strict=True)
    ]
