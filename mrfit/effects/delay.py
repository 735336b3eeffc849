"""Delay: the record of the force is late or early against that of the motion.

    F_measured(t) = F(t - tau)

F force (N) or torque, tau time (s) by which its record is late; negative if it is early. The output is shifted by
cubic Lagrange interpolation, its ends held.

Source: time lag of the test rig, inverse-tanh paper sec. 3.2; interpolation after Laakso et al., IEEE Signal Processing
Magazine 13 (1996) 30.
"""

from mrfit.kernels.filters import shifted
from mrfit.kernels.theta import plain
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="delay",
    title="Force late or early against the motion",
    equation="F_measured(t) = F(t - tau)",
    reference="inverse-tanh paper sec. 3.2",
    slot="output",
    outputs=("force", "torque"),
    inputs=(),
    params=(Param("tau", "s", -0.1, 0.1, 0.0, text="time by which the force is late"),),
    neutral=(0.0,),
    aliases=("velocity-hysteresis", "gas-spring", "inertia", "current-lag", "coulomb-friction", "stribeck"),
    experiment="one amplitude at three or more frequencies over a decade: a delay turns the phase in proportion to "
    "f, a spring's part falls and an inertia's grows with f; edges of a triangular motion, which a delay keeps "
    "sharp",
)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the output, shape (P, N), delayed by tau (P, 1) in s."""
    return shifted(plain(output), theta[:, 0] / dt)
