"""The direction of sliding friction."""

import math

import numpy as np

from mrfit.core.specs import Array, State, Values
from mrfit.kernels.filters import play_step, smooth_play
from mrfit.kernels.jit import kernel

# Velocity in m/s below which friction does not fade any further
CREEP = 1e-4


def slip(x: Array, v: Array, reach: Array, turn: Array) -> Array:
    """Return the direction of sliding friction, (P, N) between -1 and 1, of a stroke x (m) and velocity v (m/s), (N,).

    A seal sticks and is bent before it slips: the direction is that of a stop operator, (x - play(x, r))/r, which turns
    from one side to the other over 2r of travel after a reversal. Lubricated, it also fades with the velocity, as
    tanh(sqrt(v^2 + v_c^2)/v_r) with a creep v_c of 0.1 mm/s: a turning point that falls on a sample counts as stuck if
    v_r is far below that. reach (P,) in m is r > 0, turn (P,) in m/s is v_r > 0 (where both are small: sign(v)).

    Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (Maxwell slip).
    """
    direction = np.empty((len(reach), len(x)))
    for r in np.unique(reach):
        direction[reach == r] = (x - smooth_play(x, r)) / r
    speed = np.hypot(v, CREEP)
    return direction * np.tanh(speed / turn[:, None])


@kernel
def stuck(x: float, reach: float) -> State:
    """Return the displacement from which a seal at rest at x (m) is bent, and that it has not moved."""
    return max(x - reach, min(x + reach, 0.0)), 0.0, 0.0


@kernel
def slip_step(state: State, before: Values, now: Values, shape: tuple[float, float], dt: float) -> tuple[float, State]:
    """Return ``slip`` after a step of displacement (m) and velocity (m/s), of r and v_r, and the state of the seal."""
    reach, turn = shape
    y, travel, length = play_step(state[0], (state[1], state[2]), before[0], now[0], reach, dt)
    direction = (now[0] - y) / reach * math.tanh(math.hypot(now[1], CREEP) / turn)
    return direction, (y, travel, length)
