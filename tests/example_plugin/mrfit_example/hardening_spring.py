"""Hardening spring: a rubber mount beside the damper.

    F = F_base + k3*x^3

x displacement (m), F force (N), k3 cubic stiffness (N/m^3).

Source: none; an example.
"""

from collections.abc import Mapping

from mrfit.core.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="hardening-spring",
    title="Spring that hardens with displacement",
    equation="F = F_base + k3*x^3",
    reference="an example",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(Param("k3", "N/m^3", -1e9, 1e9, 0.0, text="cubic stiffness"),),
    neutral=(0.0,),
    aliases=("gas-spring",),
    experiment="quasi-static strokes of two amplitudes: the force at the ends grows with the third power of the stroke",
)


def term(channels: Mapping[str, Array], theta: Array, dt: float) -> Array:
    """Return the spring's force in N, shape (P, N), of k3 (P, 1)."""
    force: Array = theta[:, :1] * channels["displacement"] ** 3
    return force
