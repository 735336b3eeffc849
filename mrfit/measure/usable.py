"""Faults of a channel on which nothing can be measured."""

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.specs import Array
from mrfit.signal.noise import noise_level

MOVING_NOISE = 6.0
"""Range of a channel over its noise from which on it moves."""
RANGE_LEAST, RANGE_MOST = 1e-100, 1e100
"""Ranges in SI beyond which squares of the numbers are lost; no quantity of a test is of such a size."""


def unusable(name: str, values: Array) -> str:
    """Return the fault of a channel (N,): constant but for noise, or of no size; empty where it has none."""
    low, high = float(np.min(values)), float(np.max(values))
    if not high - low > MOVING_NOISE * noise_level(np.asarray(values)):
        return f"the {name} is constant but for noise; check that column and its unit"
    if not RANGE_LEAST < high - low < RANGE_MOST:
        return (
            f"the {name} moves by {high - low:.3g} {unit_of(name)}, which is no {name}; check that column and its unit"
        )
    return ""
