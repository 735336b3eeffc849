"""The direction of sliding friction."""

import math

from mrfit.core.specs import State, Values
from mrfit.kernels.filters import play_step
from mrfit.kernels.jit import kernel

# Velocity in m/s below which friction does not fade any further
CREEP = 1e-4


@kernel
def stuck(x: float, reach: float) -> State:
    """Return the displacement from which a seal at rest at x (m) is bent, and that it has not moved."""
    return max(x - reach, min(x + reach, 0.0)), 0.0, 0.0


@kernel
def slip_step(state: State, before: Values, now: Values, shape: tuple[float, float], dt: float) -> tuple[float, State]:
    """Return the direction of sliding friction at a step's end, between -1 and 1, and the state of the seal.

    A seal sticks and is bent before it slips: the direction is that of a stop operator, (x - play(x, r))/r, which turns
    from one side to the other over 2r of travel after a reversal. Lubricated, it also fades with the velocity, as
    tanh(sqrt(v^2 + v_c^2)/v_r) with a creep v_c of 0.1 mm/s: a turning point that falls on a sample counts as stuck if
    v_r is far below that. ``before`` and ``now`` are displacement (m) and velocity (m/s), ``shape`` is r > 0 in m and
    v_r > 0 in m/s (where both are small: sign(v)).

    Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (Maxwell slip).
    """
    reach, turn = shape
    y, travel, length = play_step(state[0], (state[1], state[2]), before[0], now[0], reach, dt)
    direction = (now[0] - y) / reach * math.tanh(math.hypot(now[1], CREEP) / turn)
    return direction, (y, travel, length)
