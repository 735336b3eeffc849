"""What is wrong with a channel that nothing can be measured on."""

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.specs import Array
from mrfit.signal.noise import noise_level

MOVES = 6.0
"""Range of a channel over its noise from which on it moves."""
LEAST, MOST = 1e-100, 1e100
"""Ranges in SI beyond which squares of the numbers are lost; no quantity of a test is of such a size."""


def unusable(name: str, values: Array) -> str:
    """Return why a channel (N,) cannot be measured: constant but for noise, or of no size; empty where it can."""
    low, high = float(np.min(values)), float(np.max(values))
    if not high - low > MOVES * noise_level(np.asarray(values)):
        return f"the {name} is constant but for noise; check that column and its unit"
    if not LEAST < high - low < MOST:
        return (
            f"the {name} moves by {high - low:.3g} {unit_of(name)}, which is no {name}; check that column and its unit"
        )
    return ""
