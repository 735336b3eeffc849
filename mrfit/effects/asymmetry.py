"""Asymmetry: more force, or less, in one direction than in the other.

    F = F_base*(1 + g*(1 + tanh(v/v0))/2),    v0 = 0.001 m/s

v velocity (m/s), F force (N), g extra gain (1) for v > 0. (1 + tanh(v/v0))/2 is 1 for v > 0 and 0 for v < 0, without
the jump at v = 0 with which a noisy velocity would chatter.

Source: J. Yu et al., Asymmetric dynamic model of temperature-dependent magnetorheological damper, Frontiers in
Materials 6 (2019) 227, as cited by Savaia et al..
"""

from mrfit.kernels.filters import soft_sign
from mrfit.specs import Array, EffectSpec, Param

WIDTH = 1e-3

SPEC = EffectSpec(
    name="asymmetry",
    title="Different force in rebound and compression",
    equation="F = F_base*(1 + g*(1 + tanh(v/v0))/2),  v0 = 0.001 m/s",
    reference="Yu et al., Frontiers in Materials 6 (2019) 227",
    slot="output",
    outputs=("force",),
    inputs=("velocity",),
    params=(Param("g", "1", -1.0, 4.0, 0.0, text="extra gain for v > 0"),),
    neutral=(0.0,),
    aliases=("force-offset",),
    experiment="one sine at two or more currents: the difference between the directions grows with the force, that "
    "of an offset does not",
)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), with gain 1 + g for v > 0; g (P, 1)."""
    rising = 0.5 * (1.0 + soft_sign(channels["velocity"], WIDTH))
    force: Array = output * (1.0 + theta[:, :1] * rising)
    return force
