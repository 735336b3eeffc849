"""Averages over moving windows that end where a piece of a signal does."""

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import kernel


@kernel
def moving_mean(values: Array, starts: Index, stops: Index, half: int) -> Array:
    """Return means over ``half`` samples to either side, as far as the piece goes, (N,).

    Parameters
    ----------
    values
        Signal, shape (N,).
    starts, stops
        Ranges of the pieces, shape (P,).
    half
        Samples to either side.
    """
    means = np.empty_like(values)
    for p in range(len(starts)):
        total = 0.0
        first = last = starts[p]
        for j in range(starts[p], stops[p]):
            while last < stops[p] and last <= j + half:
                total += values[last]
                last += 1
            while first < j - half:
                total -= values[first]
                first += 1
            means[j] = total / (last - first)
    return means
