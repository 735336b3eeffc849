"""Coulomb friction: dry friction of seals and guides, whatever the current.

    F = F_base + fc*tanh(v/v0),    v0 = 0.001 m/s

v velocity (m/s), F force (N), fc friction force (N). tanh(v/v0) is the sign of the velocity; below v0 it is linear,
since a sign would chatter with the noise of a velocity near 0.

Source: B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit, A survey of models ... of machines with friction,
Automatica 30 (1994) 1083.
"""

from mrfit.kernels.filters import soft_sign
from mrfit.specs import Array, EffectSpec, Param

WIDTH = 1e-3

SPEC = EffectSpec(
    name="coulomb-friction",
    title="Dry friction of seals and guides",
    equation="F = F_base + fc*tanh(v/v0),  v0 = 0.001 m/s",
    reference="Armstrong-Helouvry, Dupont, Canudas de Wit, Automatica 30 (1994) 1083",
    slot="add",
    outputs=("force",),
    inputs=("velocity",),
    params=(Param("fc", "N", 0.0, 1e5, 0.0, text="friction force"),),
    neutral=(0.0,),
    aliases=("stribeck",),
    experiment="slow triangular strokes without current and with a current: friction is there without one; at "
    "several speeds below 20 mm/s: a Stribeck force falls as the speed grows, friction stays",
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the friction in N, shape (P, N), of fc (P, 1) in N."""
    return theta[:, :1] * soft_sign(channels["velocity"], WIDTH)
