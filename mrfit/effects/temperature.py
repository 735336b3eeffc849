"""Temperature: the fluid yields and flows at less force when it is warm.

    yield_force(T) = exp(-b_yield*(T - 25))*yield_force,    damping(T) = exp(-b_viscous*(T - 25))*damping

T temperature (degC), b_yield and b_viscous falling rates (1/K) of the base's parameters of the roles ``yield`` and
``viscous``; parameters are those at 25 degC. The exponential keeps every parameter's sign at any temperature and
falls steepest in the cold, as Savaia et al. measured (57 % over 80 K: 0.0105 1/K).

Source: Savaia et al. eq. 3, alpha(T) with alpha(25 degC) = 1, an exponential in place of its polynomial, which is
``temperature-polynomial``, and one for each role. `mrfit fit --forms evidence` chooses between them.
"""

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Form, Invariance, Param
from mrfit.kernels.theta import columns, once

REFERENCE = 25.0

SPEC = EffectSpec(
    name="temperature",
    title="Yield force and viscosity falling with temperature",
    equation="yield_force = yield_force(25 degC)*exp(-b_yield*(T - 25 degC)),  damping the same with b_viscous",
    reference="Savaia et al. eq. 3, alpha(T) as an exponential",
    slot="theta",
    outputs=("force", "torque"),
    inputs=("temperature",),
    params=(
        Param("b_yield", "1/K", -0.05, 0.05, 0.0, text="falling rate of the yield force"),
        Param("b_viscous", "1/K", -0.05, 0.05, 0.0, text="falling rate of the post-yield damping"),
    ),
    neutral=(0.0, 0.0),
    aliases=("current-saturation", "quadratic-drag", "gain-drift", "degradation"),
    experiment="one sine repeated while the damper warms and again after it cooled, or in a climatic chamber: "
    "temperature must move against current, speed and time, or tests at high current and speed, which are the warm "
    "ones, look alike",
    steady=False,
    moves=(("temperature", 1.0),),
    breaks=Breaks(Invariance.TEMPERATURE),
    forms=(
        Form("exponential", "temperature"),
        Form("polynomial of order 1", "temperature-polynomial", ("a2", "a3")),
        Form("polynomial of order 2", "temperature-polynomial", ("a3",)),
        Form("polynomial of order 3", "temperature-polynomial"),
    ),
)


ROLES = ("yield", "viscous")


def law(temperature: Array, b_yield: Array, b_viscous: Array) -> tuple[Array, Array]:
    """Return the factors of ``ROLES``, of numbers or arrays that broadcast."""
    excess = temperature - REFERENCE
    return np.exp(-b_yield * excess), np.exp(-b_viscous * excess)


def factors(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the factors on parameters of the roles yield and viscous; theta (P, 2) in 1/K.

    They have the shape (P, N), or (P, 1) where the temperature does not change.
    """
    return dict(zip(ROLES, law(once(channels["temperature"]), *columns(theta)), strict=True))
