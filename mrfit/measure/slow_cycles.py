"""Friction and gas spring of a slow test, where the force hardly depends on the speed.

    F = F_gas + k*(d - d_m) ± F_f over the middle of the stroke, + where the velocity is positive

F_gas gas force (N) at the middle d_m of the stroke, k gas rate (N/m), F_f friction (N).

Source: quasi-static test, as ``mrfit.measure.quasi_static``.
"""

from dataclasses import replace

import numpy as np

from mrfit.measure.cycles import Cycles
from mrfit.measure.quantity import Quantity, without
from mrfit.measure.quasi_static import MIDDLE_PART

SLOW_QUANTITIES = ("friction", "gas force", "gas rate")


def quantities(cycles: Cycles, slow: float) -> list[Quantity]:
    """Return friction, gas force and gas rate where no speed is above ``slow`` in m/s."""
    if cycles.peak_velocity > slow:
        return without(
            SLOW_QUANTITIES, f"no slow test: {1e3 * cycles.peak_velocity:.3g} mm/s, above {1e3 * slow:g} mm/s"
        )
    rows = []
    for pair in zip(cycles.branches(True), cycles.branches(False), strict=True):
        parts, forces = [], []
        for up, (at, force) in zip((True, False), pair, strict=True):
            moved = cycles.moved(up, at)
            inside = np.abs(moved) <= MIDDLE_PART * cycles.stroke / 2.0
            sign = np.full(int(inside.sum()), 1.0 if up else -1.0)
            parts.append(np.stack([sign, np.ones(len(sign)), moved[inside]], axis=1))
            forces.append(force[inside])
        rows.append((np.concatenate(parts), np.concatenate(forces)))
    friction, gas, rate = cycles.regression(rows)
    found = (friction, replace(gas, zero=cycles.zero), rate)
    return [Quantity(n, cycles.estimate(lambda x: x, one)) for n, one in zip(SLOW_QUANTITIES, found, strict=True)]
