"""Traces of a motion: a memory that travel fades, and the motion's last turn; sums that fade with time."""

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel


@kernel
def travel_memory(step: Array, lengths: Array) -> Array:
    """Return z' = (sign(v) - z)*|v|/d for every length d, exact for a velocity that is constant between samples.

    Parameters
    ----------
    step
        Travel of each sample, velocity times sample interval, shape (N,).
    lengths
        Lengths of travel d over which z forgets, in the unit of ``step``, shape (D,).

    Returns
    -------
    Array
        z between -1 and 1, shape (D, N); it starts at 0.
    """
    memory = np.empty((len(lengths), len(step)))
    for d in range(len(lengths)):
        z = 0.0
        for n in range(len(step)):
            side = 1.0 if step[n] > 0.0 else (-1.0 if step[n] < 0.0 else z)
            z = side + (z - side) * np.exp(-abs(step[n]) / lengths[d])
            memory[d, n] = z
    return memory


@kernel
def stopped(step: Array) -> Array:
    """Return the stop operator z = max(-1, min(1, z before + step)) of the steps (N,) of a signal; it starts at 0.

    Source: M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), ch. 1.
    """
    found = np.empty(len(step))
    z = 0.0
    for n in range(len(step)):
        z = max(-1.0, min(1.0, z + step[n]))
        found[n] = z
    return found


@kernel
def decayed(columns: Array, keep: float) -> Array:
    """Return y_n = u_n + keep*y_(n-1) of columns (N, F), in their unit; y_0 = u_0."""
    sums = np.empty(columns.shape)
    for k in range(columns.shape[1]):
        last = 0.0
        for n in range(len(columns)):
            last = columns[n, k] + keep * last
            sums[n, k] = last
    return sums


@kernel
def since_reversal(x: Array, swing: float) -> Array:
    """Return the travel since the motion last turned, and half the stroke between its last two turns, shape (2, N).

    Swings smaller than ``swing`` are no turns. Half the stroke is 0 until the motion has turned twice.
    """
    found = np.zeros((2, len(x)))
    low = high = turn = x[0]
    rising, half, turns = 0, 0.0, 0
    for n in range(len(x)):
        low, high = min(low, x[n]), max(high, x[n])
        if rising >= 0 and x[n] < high - swing:
            half = 0.5 * abs(high - turn) if turns > 0 else 0.0
            turn, low, rising, turns = high, x[n], -1, turns + 1
        elif rising <= 0 and x[n] > low + swing:
            half = 0.5 * abs(low - turn) if turns > 0 else 0.0
            turn, high, rising, turns = low, x[n], 1, turns + 1
        found[0, n] = abs(x[n] - turn)
        found[1, n] = half
    return found
