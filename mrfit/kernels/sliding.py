"""The direction of sliding friction."""

import numpy as np

from mrfit.core.specs import Array, Steps
from mrfit.kernels import uneven
from mrfit.kernels.filters import smooth_play

# Velocity in m/s below which friction does not fade any further
CREEP = 1e-4


def slip(x: Array, v: Array, reach: Array, turn: Array, dt: Steps = 1.0) -> Array:
    """Return the direction of sliding friction, (P, N) between -1 and 1, of a stroke x (m) and velocity v (m/s), (N,).

    A seal sticks and is bent before it slips: the direction is that of a stop operator, (x - play(x, r))/r, which turns
    from one side to the other over 2r of travel after a reversal. Lubricated, it also fades with the velocity, as
    tanh(|v|/v_r), but for a creep of 0.1 mm/s in |v|: a turning point that falls on a sample counts as stuck if v_r is
    far below that. reach (P,) in m is r > 0, turn (P,) in m/s is v_r > 0 (where both are small: sign(v)). The
    samples' distance in time enters only where it varies.

    Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (Maxwell slip).
    """
    direction = np.empty((len(reach), len(x)))
    for r in np.unique(reach):
        bent = uneven.smooth_play(x, r, dt) if isinstance(dt, np.ndarray) else smooth_play(x, r)
        direction[reach == r] = (x - bent) / r
    speed = np.hypot(v, CREEP)
    return direction * np.tanh(speed / turn[:, None])
