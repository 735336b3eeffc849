"""Temperature as a polynomial: one factor on all forces of the fluid, of up to third order about 25 degC.

    alpha(T) = 1 + a1*u + a2*u^2 + a3*u^3,  u = (T - 25)/50,    yield_force = alpha*yield_force,  damping the same

T temperature (degC), a1, a2 and a3 coefficients (1) of the factor on the base's parameters of the roles ``yield`` and
``viscous``; parameters are those at 25 degC. alpha is held above 0.01, so that no force turns round far outside the
temperatures tested. A polynomial bends as measured points do and means nothing beyond them; ``temperature``, an
exponential, is the other form.

Source: Savaia et al. eq. 3, alpha(T) a polynomial with alpha(25 degC) = 1.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.kernels.theta import columns, once

REFERENCE, SCALE = 25.0, 50.0
LEAST = 0.01

SPEC = EffectSpec(
    name="temperature-polynomial",
    title="Forces changing with temperature as a polynomial",
    equation="alpha = 1 + a1*u + a2*u^2 + a3*u^3, u = (T - 25 degC)/50 K,  yield_force and damping times alpha",
    reference="Savaia et al. eq. 3",
    slot="theta",
    outputs=("force", "torque"),
    inputs=("temperature",),
    params=(
        Param("a1", "1", -3.0, 3.0, 0.0, text="slope of the factor, over 50 K", symbol="a_1"),
        Param("a2", "1", -3.0, 3.0, 0.0, text="its second-order coefficient", symbol="a_2"),
        Param("a3", "1", -3.0, 3.0, 0.0, text="its third-order coefficient", symbol="a_3"),
    ),
    neutral=(0.0, 0.0, 0.0),
    # a network takes the warm tests, those at high current and speed, for a law of these
    aliases=("neural-network",),
    experiment="one sine repeated while the damper warms and again after it cooled, over all temperatures wanted: "
    "temperature must move against current and speed",
    proposed=False,
    steady=False,
    moves=(("temperature", 1.0),),
)


ROLES = ("yield", "viscous")


def law(temperature: Array, a1: Array, a2: Array, a3: Array) -> tuple[Array, Array]:
    """Return the factors of ``ROLES``, of numbers or arrays that broadcast."""
    u = (temperature - REFERENCE) / SCALE
    alpha = np.maximum(1.0 + u * (a1 + u * (a2 + u * a3)), LEAST)
    return alpha, alpha


def factors(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the factors on parameters of the roles yield and viscous; theta (P, 3).

    They have the shape (P, N), or (P, 1) where the temperature does not change.
    """
    return dict(zip(ROLES, law(once(channels["temperature"]), *columns(theta)), strict=True))
