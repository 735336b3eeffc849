"""Error of the smoothed motion's phase, which all cycles share: their scatter does not show it.

    q ± sqrt(h² + (c*s*dq/dτ)²),    s = 1/(ω*sqrt(Σ_k 1/g_k))

q a quantity with half of its interval h, c Student's quantile, τ the time in s by which the force is late, s the
standard deviation of the phase in s, ω the angular frequency in rad/s, g_k the variance of the relative amplitude of
cycle k: of a sine, that of its phase in rad².
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.measure.cycles import Cycles
from mrfit.measure.intervals import student_quantile
from mrfit.measure.quantity import Quantity


def widened(cycles: Cycles, found: Sequence[Quantity], late: Sequence[Quantity]) -> list[Quantity]:
    """Return quantities with the phase's error in their intervals, and their values of a force one sample late.

    ``late`` are the quantities of that force.
    """
    share = _phase(cycles) / cycles.dt
    moved = {q.name: q.estimate.value for q in late if q.estimate}
    return [_widened(q, moved[q.name], share) if q.estimate and q.name in moved else q for q in found]


def _phase(cycles: Cycles) -> float:
    """Return the standard deviation of the phase in s; 0 of a motion without noise."""
    noise = cycles.gains.noise
    return cycles.period / (2.0 * np.pi * float(np.sqrt(np.sum(1.0 / noise)))) if (noise > 0.0).all() else 0.0


def _widened(one: Quantity, moved: float, share: float) -> Quantity:
    known = one.estimate
    assert known is not None
    half = float(np.hypot(known.error, student_quantile(known.freedom) * share * (moved - known.value)))
    return replace(one, estimate=replace(known, low=known.value - half, high=known.value + half), late=moved)
