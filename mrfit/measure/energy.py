"""Energy of whole cycles, and effective stiffness and damping that follow from it.

    E           ∮F dd
    closure     |F| at the begin of a cycle times the gap of displacement to its end, over E
    K_eff       (F(d+) - F(d-))/(d+ - d-)
    xi_eff      (2/π)*E/(K_eff*(d+ - d-)²)
    C_eq        E/(π*ω*d²), of a sine of amplitude d
    efficiency  E/(4*Fmax*d), Fmax the mean of both directions

d+ and d- are the greatest and the least displacement, d half of the travel between them. Standards print K_eff with the
magnitudes (|F(d+)| + |F(d-)|), which is the same where each force pulls back. A constant force, as of gas or of a load
cell's zero, is in the sum of magnitudes where one of them does not, and in no difference.

Source: effective stiffness and damping of isolators and dampers by whole cycles; Jacobsen, Trans. ASME 52 (1930) 169.
"""

import numpy as np

from mrfit.core.specs import Array
from mrfit.measure.cycles import FEWEST_AT_REVERSAL, Cycles
from mrfit.measure.forces import Forces, few_at_reversal
from mrfit.measure.intervals import PerCycle, of_values
from mrfit.measure.quantity import Quantity, without


def quantities(cycles: Cycles, forces: Forces, sine: bool) -> list[Quantity]:
    """Return the energy and what follows from it; ``sine`` says whether the drive is one."""
    work, travel = work_of(cycles), travel_of(cycles)
    energy = cycles.estimate(lambda w: w, work)
    found = [Quantity("E", energy), _closure(cycles, forces, energy.value)]
    high, low = forces.at_ends[True], forces.at_ends[False]

    def stiffness(above: Array, below: Array, moved: Array) -> Array:
        return (above - below) / moved

    effective = cycles.estimate(stiffness, high, low, travel)
    few = cycles.per_cycle < FEWEST_AT_REVERSAL
    found.append(Quantity("K_eff", None, few_at_reversal(cycles)) if few else Quantity("K_eff", effective))
    if few:
        found += without(("xi_eff",), few_at_reversal(cycles))
    elif effective.low > 0.0:

        def damping(done: Array, above: Array, below: Array, moved: Array) -> Array:
            return 2.0 / np.pi * done / (stiffness(above, below, moved) * moved**2)

        found.append(Quantity("xi_eff", cycles.estimate(damping, work, high, low, travel)))
    else:
        outward = "K_eff is below zero: the forces at the ends push outward"
        found += without(("xi_eff",), outward if effective.high < 0.0 else "K_eff is not distinct from zero")
    if sine:
        omega = 2.0 * np.pi / cycles.period
        found.append(Quantity("C_eq", cycles.estimate(lambda w, s: w / (np.pi * omega * (s / 2.0) ** 2), work, travel)))
    else:
        found += without(("C_eq",), "the motion is no sine")
    if forces.peaks[True].values.mean() - forces.peaks[False].values.mean() <= 0.0:
        return [*found, *without(("efficiency",), "no force against the motion")]
    inputs = (work, forces.peaks[True], forces.peaks[False], travel)
    return [*found, Quantity("efficiency", cycles.estimate(lambda w, a, b, s: w / ((a - b) * s), *inputs))]


def work_of(cycles: Cycles) -> PerCycle:
    """Return ∮F dd of every cycle in J, with the amplitude as recorded."""
    work, gains = cycles.work, cycles.gains
    noise = work.noise * gains.values**2 + work.values**2 * gains.noise
    return PerCycle(work.values * gains.values, noise, work.shared)


def travel_of(cycles: Cycles) -> PerCycle:
    """Return d+ - d- of every cycle in m."""
    return PerCycle(cycles.stroke * cycles.gains.values, cycles.stroke**2 * cycles.gains.noise)


def _closure(cycles: Cycles, forces: Forces, energy: float) -> Quantity:
    """Return the work of the gaps by which the displacement does not come back, over the energy."""
    if cycles.count < 3 or energy == 0.0:
        return Quantity("closure", None, "fewer than three cycles")
    gaps = np.abs(np.diff(cycles.middles)) * abs(float(forces.at_ends[False].values.mean()))
    return Quantity("closure", of_values(gaps / abs(energy)))
