"""Quadratic drag: turbulent flow through the gap at high speed.

    F = F_base + c2*v*|v|

v velocity (m/s), F force (N), c2 drag (N*s^2/m^2).

Source: orifice flow, J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 5.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme

SPEC = EffectSpec(
    name="quadratic-drag",
    title="Turbulent flow at high speed",
    equation="F = F_base + c2*v*|v|",
    reference="Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 5",
    slot="add",
    outputs=("force",),
    inputs=("velocity",),
    params=(Param("c2", "N*s^2/m^2", 0.0, 1e6, 0.0, text="drag"),),
    neutral=(0.0,),
    aliases=("temperature",),
    experiment="strokes at five or more speeds up to the highest, in random order, with the damper cooled to the "
    "same temperature before each: warm fluid at high speed bends the curve too",
    asks=(Programme(speeds=5),),
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the drag in N, shape (P, N), of c2 (P, 1) in N*s^2/m^2."""
    v = channels["velocity"]
    return theta[:, :1] * (v * np.abs(v))
