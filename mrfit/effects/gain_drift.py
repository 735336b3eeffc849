"""Gain drift: the force that is measured, or made, grows or falls steadily from the start of a record.

    F_measured = F*(1 + g*t)

F force (N) or torque, t time since the record's start (s), g drift of the gain (1/s): an amplifier warming up, or a
fluid that warms or settles where no thermometer was in place. Parameters of the base are those at the record's start.

Source: linear zero-order form of any slow gain; compare Savaia et al. eq. 3, where temperature is the gain's cause.
"""

from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param

SPEC = EffectSpec(
    name="gain-drift",
    title="Gain of the force drifting with time",
    equation="F_measured = F*(1 + g*t)",
    reference="first-order form of a slow gain",
    slot="output",
    outputs=("force", "torque"),
    inputs=("time",),
    params=(Param("g", "1/s", -1.0, 1.0, 0.0, text="drift of the gain"),),
    neutral=(0.0,),
    aliases=("temperature", "degradation"),
    experiment="one sine repeated after a rest, the amplifier left on: a warm fluid has cooled and gives its first "
    "force again, an amplifier's drift has gone on; a thermometer in the fluid",
    steady=False,
    breaks=Breaks(Invariance.TIME),
)


def law(force: Array, time: Array, g: Array) -> Array:
    """Return the force of a drifting gain, of numbers or arrays that broadcast."""
    return force * (1.0 + g * time)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the force, shape (P, N), with gain 1 + g*t; g (P, 1) in 1/s."""
    return law(output, channels["time"], theta[:, :1])
