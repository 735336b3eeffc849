"""The direction of sliding friction."""

import math

from mrfit.core.specs import State, Values
from mrfit.kernels.filters import carried, turning
from mrfit.kernels.jit import kernel

# Velocity in m/s below which friction does not fade any further
CREEP = 1e-4
# Travel at which the stops of a seal of breadth 1 slip, as a multiple of r, and their shares of its force: a full turn
# is Dahl's, -1 + 2*(1 - exp(-travel/r)), within 4 %. Their mean is r at any breadth, as is the work of a cycle.
NARROW, MIDDLE, WIDE = 0.3, 0.9, 2.02
OF_NARROW, OF_MIDDLE, OF_WIDE = 0.3, 0.45, 0.25


@kernel
def slips_at(reach: float, breadth: float) -> tuple[float, float, float]:
    """Return the travel at which each stop of a seal slips (m), of mean r > 0 (m): all at once at a breadth of 0."""
    narrow, middle, wide = 1.0 + breadth * (NARROW - 1.0), 1.0 + breadth * (MIDDLE - 1.0), 1.0 + breadth * (WIDE - 1.0)
    return narrow * reach, middle * reach, wide * reach


@kernel
def stuck(x: float, reach: float, breadth: float) -> State:
    """Return the plays of the stops of a seal at rest at x (m), and that it has not moved."""
    narrow, middle, wide = slips_at(reach, breadth)
    return carried(0.0, x, x, narrow), carried(0.0, x, x, middle), carried(0.0, x, x, wide), 0.0, 0.0


@kernel
def slip_step(
    state: State, before: Values, now: Values, shape: tuple[float, float, float], dt: float
) -> tuple[float, State]:
    """Return the direction of sliding friction at a step's end, between -1 and 1, and the state of the seal.

    A seal sticks and is bent before it slips, one part after another: the direction is that of three stop operators,
    sum of w_k*(x - play(x, r_k))/r_k, r_k = r*(1 + b*(h_k - 1)). After a reversal it turns from one side to the other
    along a straight line over 2r if b = 0 (one stop), as -1 + 2*(1 - exp(-travel/r)) if b = 1. Unlike Dahl's equation,
    whose turn this is, stops close their loops: a sensor's noise moves no rest.
    Lubricated, it also fades with the velocity, as tanh(sqrt(v^2 + v_c^2)/v_r) with a creep v_c of 0.1 mm/s: a turning
    point that falls on a sample counts as stuck if v_r is far below that. ``before`` and ``now`` are displacement (m)
    and velocity (m/s), ``shape`` is r > 0 in m, b and v_r > 0 in m/s (where r and v_r are small: sign(v)).

    Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (stops in parallel); P. R. Dahl, AIAA J. 14 (1976) 1675 (turn).
    """
    reach, breadth, fade = shape
    first, second, third = slips_at(reach, breadth)
    x = now[0]
    turn, travel, length = turning((state[3], state[4]), before[0], x, dt)
    narrow, middle, wide = (
        carried(state[0], turn, x, first),
        carried(state[1], turn, x, second),
        carried(state[2], turn, x, third),
    )
    bent = OF_NARROW * (x - narrow) / first + OF_MIDDLE * (x - middle) / second + OF_WIDE * (x - wide) / third
    return bent * math.tanh(math.hypot(now[1], CREEP) / fade), (narrow, middle, wide, travel, length)
