"""Inertia: the load cell also feels the mass between it and the damper.

    F = F_base + m*a

a acceleration (m/s^2), F force (N), m moving mass (kg); negative where a rig subtracts more inertia than there is.

Source: Newton's second law for the mass between load cell and damper.
"""

from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param, Programme
from mrfit.kernels.theta import columns

SPEC = EffectSpec(
    name="inertia",
    title="Mass between load cell and damper",
    equation="F = F_base + m*a",
    reference="Newton's second law",
    slot="add",
    outputs=("force",),
    inputs=("acceleration",),
    params=(Param("m", "kg", -2000.0, 2000.0, 0.0, text="moving mass"),),
    neutral=(0.0,),
    aliases=("gas-spring", "delay", "velocity-hysteresis"),
    experiment="one amplitude at two frequencies a factor 3 apart: inertia grows with f^2, a spring does not, a "
    "delay turns viscous force by f; or drive the rig with the damper taken out",
    asks=(Programme(frequencies=2, ratio=3.0),),
    breaks=Breaks(Invariance.MEMORY, sign=1, relaxation=False, early=True),
)


def law(a: Array, m: Array) -> Array:
    """Return the force of inertia in N of numbers or arrays that broadcast."""
    return m * a


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the force of inertia in N, shape (P, N), of m (P, 1) in kg."""
    return law(channels["acceleration"], *columns(theta))
