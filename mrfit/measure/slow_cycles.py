"""Friction and gas spring of a slow test, where the force hardly depends on the speed.

    F = F_gas + k*(d - d_m) ± F_f over the middle of the stroke, + where the velocity is positive

F_gas gas force (N) at the middle d_m of the stroke, k gas rate (N/m), F_f friction (N).

Source: quasi-static test, as ``mrfit.measure.quasi_static``.
"""

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
    whole = cycles.about_reversal(True)
    moved = np.where(whole.at < 0.0, cycles.moved(True, whole.at + 1.0), cycles.moved(False, whole.at))
    near = whole.within(np.abs(moved) <= MIDDLE_PART * cycles.stroke / 2.0)
    up = near.at < 0.0
    moved = np.where(up, cycles.moved(True, near.at + 1.0), cycles.moved(False, near.at))
    gas, friction, rate = cycles.fit(near, np.stack([np.ones(up.shape), np.where(up, 1.0, -1.0), moved], axis=2))
    return [
        Quantity(n, cycles.estimate(lambda x: x, one))
        for n, one in zip(SLOW_QUANTITIES, (friction, gas, rate), strict=True)
    ]
