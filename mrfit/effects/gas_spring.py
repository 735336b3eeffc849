"""Gas spring: the accumulator behind the piston pushes back in proportion to the stroke.

    F = F_base + k_g*x

x displacement (m), F force (N), k_g stiffness of the accumulator (N/m). A base that has a stiffness of its own takes
it up.

Source: stiffness k1 of the accumulator, B. F. Spencer et al., J. Eng. Mech. 123 (1997) 230; preyield paper sec. 2.
"""

from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="gas-spring",
    title="Stiffness of the gas accumulator",
    equation="F = F_base + k_g*x",
    reference="Spencer et al., J. Eng. Mech. 123 (1997) 230: accumulator stiffness",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(Param("k_g", "N/m", -1e6, 1e6, 0.0, text="stiffness of the accumulator"),),
    neutral=(0.0,),
    aliases=("inertia", "velocity-hysteresis", "delay", "end-stop", "force-offset"),
    experiment="one amplitude at two frequencies a factor 3 apart: k - m*omega^2 shows which part is inertia; very "
    "slow strokes at several amplitudes show the spring alone, an end stop only at the largest, an offset at none",
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the spring's force in N, shape (P, N), of k_g (P, 1) in N/m."""
    return theta[:, :1] * channels["displacement"]
