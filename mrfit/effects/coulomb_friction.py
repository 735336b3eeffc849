"""Coulomb friction: dry friction of seals and guides, whatever the current.

    F = F_base + fc*s(x),    s(x) = (x - play(x, r))/r between -1 and 1

x displacement (m), F force (N), fc friction force (N), r travel over which the seal is bent before it slips (m); r does
nothing while fc is 0. Sliding friction is fc*sign(v) but near a reversal, where the seal sticks: s turns from one side
to the other over 2r of travel. That needs no velocity, so its noise does not make the force chatter.

Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (Maxwell slip); B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit,
Automatica 30 (1994) 1083.
"""

from mrfit.kernels.filters import slip
from mrfit.kernels.theta import plain
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="coulomb-friction",
    title="Dry friction of seals and guides",
    equation="F = F_base + fc*s(x),  s(x) = (x - play(x, r))/r",
    reference="Iwan, J. Appl. Mech. 33 (1966) 893; Armstrong-Helouvry et al., Automatica 30 (1994) 1083",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(
        Param("fc", "N", 0.0, 1e5, 0.0, text="friction force"),
        Param("r", "m", 1e-6, 5e-3, 5e-5, "log", "shape", "travel over which the seal is bent before it slips"),
    ),
    neutral=(0.0, 5e-5),
    aliases=("delay", "stribeck"),
    experiment="slow triangular strokes without current and with a current: friction is there without one; at "
    "several speeds below 20 mm/s: a Stribeck force falls as the speed grows, friction stays; at several frequencies: "
    "a delay's loop grows with them",
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the friction in N, shape (P, N), of fc in N and r in m, theta (P, 2)."""
    force: Array = theta[:, :1] * slip(plain(channels["displacement"]), theta[:, 1])
    return force
