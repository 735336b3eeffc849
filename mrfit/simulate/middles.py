"""Twice the samples: a drive that goes straight from each to the next, with what is in the middle between them."""

import numpy as np

from mrfit.core.specs import Array, Steps


def with_middles(drive: Array) -> Array:
    """Return channels (C, N) with the means of neighbours between them, (C, 2N - 1)."""
    whole = np.empty((len(drive), 2 * drive.shape[1] - 1))
    whole[:, ::2] = drive
    whole[:, 1::2] = 0.5 * (drive[:, :-1] + drive[:, 1:])
    return whole


def halved(dt: Steps) -> Steps:
    """Return the interval between these samples in s, of one number or of uneven steps (N,)."""
    if not isinstance(dt, np.ndarray):
        return 0.5 * dt
    steps: Array = np.repeat(0.5 * dt, 2)[1:]
    return steps
