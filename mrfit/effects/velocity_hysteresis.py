"""Velocity hysteresis: the force follows the velocity plus a share of the stroke, which opens a loop in force-velocity.

    v_eff = v + Omega*(x - mean(x))

x displacement (m), v velocity (m/s), v_eff the velocity that the base sees (m/s), Omega hysteretic critical velocity
over critical displacement (1/s). The zero of a stroke sensor has no meaning for the fluid, so the mean of x over the
samples is taken away, under a Hann window, which an unfinished cycle does not bias.

Source: paper 003 eq. 8 (S. Guo et al.), whose print has the quotient of Omega upside down.
"""

from mrfit.kernels.filters import level
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="velocity-hysteresis",
    title="Memory of the stroke in the velocity",
    equation="v_eff = v + Omega*(x - mean(x))",
    reference="paper 003 eq. 8",
    slot="input",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(Param("Omega", "1/s", -500.0, 500.0, 0.0, text="critical velocity over critical displacement"),),
    neutral=(0.0,),
    aliases=("delay", "gas-spring", "inertia"),
    experiment="one amplitude at three or more frequencies over a decade: the loop's half-width in velocity stays "
    "Omega*x, where that of a delay grows with f^2; gas springs and inertia lean the loop instead of opening it at "
    "v = 0",
)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the effective velocity in m/s, shape (N,); theta is (Omega,) in 1/s."""
    x = channels["displacement"]
    return {"velocity": channels["velocity"] + theta[0] * (x - level(x))}
