"""What a model makes in the middle between samples, for an effect behind it that asks for that.

The model runs a second time, along middles of its drive: what it makes at the samples stays as it is.
"""

import numpy as np

from mrfit.core.specs import Array, Steps


def middles_of(drive: Array) -> Array:
    """Return the means of channels (C, N) at each sample and the one before; the first, held before, is its own."""
    middles = drive.copy()
    middles[:, 1:] = 0.5 * (drive[:, :-1] + drive[:, 1:])
    return middles


def apart(dt: Steps) -> Steps:
    """Return the time from each of these to that before, in s: of one interval that, of steps (N,) the mean of two."""
    if not isinstance(dt, np.ndarray):
        return dt
    steps = dt.copy()
    steps[2:] = 0.5 * (dt[1:-1] + dt[2:])
    return steps


def between(output: Array, middles: Array) -> Array:
    """Return outputs (P, N) with what is made in the middle before each but the first, (P, 2N - 1)."""
    whole = np.empty((len(output), 2 * output.shape[1] - 1))
    whole[:, ::2] = output
    whole[:, 1::2] = middles[:, 1:]
    return whole


def halved(dt: Steps) -> Steps:
    """Return the interval of what is twice as near in s, of one number or of uneven steps (N,)."""
    if not isinstance(dt, np.ndarray):
        return 0.5 * dt
    return np.repeat(0.5 * dt, 2)[1:]
