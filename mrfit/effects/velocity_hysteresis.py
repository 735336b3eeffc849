"""Velocity hysteresis: the force follows the velocity plus a share of the stroke, which opens a loop in force-velocity.

    v_eff = play(v, w) + Omega*(x - mean(x))

x displacement (m), v velocity (m/s), v_eff the velocity that the base sees (m/s), Omega hysteretic critical velocity
over critical displacement (1/s), w half-width of a play in the velocity (m/s): the fluid's microstructure gives way
only when the velocity has turned by 2w. Either may be the memory; papers use both. The zero of a stroke sensor has no
meaning for the fluid, so the mean of x over the samples is taken away, under a Hann window, which an unfinished cycle
does not bias.

Source: preyield paper eq. 8 (S. Guo et al.), whose print has the quotient of Omega upside down, and eqs. 5-7 (velocity
branches v -/+ vh by the sign of the acceleration, which is a play of half-width vh).
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.filters import level, level_of, play_step

SPEC = EffectSpec(
    name="velocity-hysteresis",
    title="Memory in the velocity",
    equation="v_eff = play(v, w) + Omega*(x - mean(x))",
    reference="preyield paper eq. 8",
    slot="input",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(
        Param("Omega", "1/s", -500.0, 500.0, 0.0, text="critical velocity over critical displacement"),
        Param("w", "m/s", 0.0, 0.2, 0.0, text="half-width of the play in velocity"),
    ),
    neutral=(0.0, 0.0),
    aliases=("delay", "gas-spring", "inertia"),
    experiment="one amplitude at three or more frequencies over a decade: the loop's half-width in velocity stays "
    "Omega*x, where that of a delay grows with f^2; gas springs and inertia lean the loop instead of opening it at "
    "v = 0",
    asks=(Programme(frequencies=3, ratio=10.0),),
)


# Channels of which ``step`` takes what is left less their middle
CENTRED = ("displacement",)


def rest(now: Values, theta: Values) -> State:
    """Return the velocity in m/s at which the play rests, from 0, and that it has not moved."""
    w = theta[1]
    return max(now[1] - w, min(now[1] + w, 0.0)), 0.0, 0.0


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the effective velocity in m/s about a stroke whose middle is 0, and the play with its last chord."""
    omega, w = theta[1]
    y, travel, length = play_step(state[0], (state[1], state[2]), before[1], now[1], w, dt)
    return y + omega * now[0], (y, travel, length)


_stepped = response_of(SPEC, rest, step)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the effective velocity in m/s, shape (N,); theta is (Omega, w) in 1/s and m/s."""
    x, v = channels["displacement"], channels["velocity"]
    middle = level_of(x, dt) if isinstance(dt, np.ndarray) else level(x)
    return {"velocity": _stepped(np.stack([x - middle, v]), theta[None], dt)[0]}
