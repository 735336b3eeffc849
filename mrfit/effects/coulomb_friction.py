"""Coulomb friction: dry friction of seals and guides, whatever the current.

    F = F_base + fc*s,    s = (x - play(x, r))/r*tanh(|v|/v_r) between -1 and 1

x displacement (m), v velocity (m/s), F force (N), fc friction force (N), r travel over which the seal is bent before it
slips (m), v_r velocity below which a lubricated seal rubs less (m/s); r and v_r do nothing while fc is 0. Sliding
friction is fc*sign(v) but near a reversal: a seal that sticks turns from one side to the other over 2r of travel, one
that floats over 2v_r of velocity. A dry or a floating seal is the limit of small v_r or r. The side is that of the
travel, so that the velocity's noise does not make the force chatter.

Source: W. D. Iwan, J. Appl. Mech. 33 (1966) 893 (Maxwell slip); B. Armstrong-Helouvry, P. Dupont, C. Canudas de Wit,
Automatica 30 (1994) 1083.
"""

from mrfit.core.specs import Array, EffectSpec, Param, Programme, Steps
from mrfit.kernels.sliding import slip
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="coulomb-friction",
    title="Dry friction of seals and guides",
    equation="F = F_base + fc*s,  s = (x - play(x, r))/r*tanh(|v|/v_r)",
    reference="Iwan, J. Appl. Mech. 33 (1966) 893; Armstrong-Helouvry et al., Automatica 30 (1994) 1083",
    slot="add",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(
        Param("fc", "N", 0.0, 1e5, 0.0, text="friction force"),
        Param("r", "m", 1e-7, 5e-3, 2e-5, "log", "shape", "travel over which the seal is bent before it slips"),
        Param("v_r", "m/s", 1e-5, 0.01, 3e-4, "log", "shape", "velocity below which friction fades"),
    ),
    neutral=(0.0, 2e-5, 3e-4),
    aliases=("delay", "stribeck"),
    experiment="slow triangular strokes without current and with a current: friction is there without one; at "
    "several speeds below 20 mm/s: a Stribeck force falls as the speed grows, friction stays; at several frequencies: "
    "a delay's loop grows with them",
    asks=(Programme(waveform="triangle", currents=2), None, Programme(frequencies=3)),
)


def term(channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the friction in N, shape (P, N), of fc in N, r in m and v_r in m/s, theta (P, 3)."""
    x, v = plain(channels["displacement"]), channels["velocity"]
    force: Array = theta[:, :1] * slip(x, v, theta[:, 1], theta[:, 2], dt)
    return force
