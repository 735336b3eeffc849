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

from mrfit.core.specs import Array, EffectSpec, Param, Programme, Steps
from mrfit.kernels import uneven
from mrfit.kernels.filters import level, smooth_play
from mrfit.kernels.theta import plain

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


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the effective velocity in m/s, shape (N,); theta is (Omega, w) in 1/s and m/s."""
    x, v = channels["displacement"], channels["velocity"]
    if isinstance(dt, np.ndarray):
        return {"velocity": uneven.smooth_play(plain(v), theta[1], dt) + theta[0] * (x - uneven.level(x, dt))}
    return {"velocity": smooth_play(plain(v), theta[1]) + theta[0] * (x - level(x))}
