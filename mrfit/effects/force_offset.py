"""Force offset: the load cell's zero, or the accumulator's preload, where the base has no offset of its own.

    F = F_base + f_off

F force (N), f_off offset (N). Most bases have an f0: beside it this effect adds nothing and no data can show it.

Source: offset f0 of preyield paper sec. 2, eqs. 1-10.
"""

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param, Programme

SPEC = EffectSpec(
    name="force-offset",
    title="Constant offset of the force",
    equation="F = F_base + f_off",
    reference="preyield paper eqs. 1-10, f0",
    slot="add",
    outputs=("force",),
    inputs=(),
    params=(Param("f_off", "N", -1e5, 1e5, 0.0, role="offset", text="offset"),),
    neutral=(0.0,),
    aliases=("gas-spring", "asymmetry"),
    experiment="strokes about two middle positions, for the spring; two currents, for the asymmetry: an offset is "
    "the same at all positions and currents",
    asks=(None, Programme(currents=2)),
    breaks=Breaks(Invariance.ODDNESS),
)


def law(f_off: Array) -> Array:
    """Return the offset in N."""
    return f_off


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the offset in N, shape (P, N), of f_off (P, 1) in N."""
    return np.repeat(theta[:, :1], len(next(iter(channels.values()))), axis=1)
