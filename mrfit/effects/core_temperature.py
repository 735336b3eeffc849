"""Temperature of a core: warm, it magnetises more easily and saturates at less flux.

    L(T) = L*exp(b_L*(T - 25)),    flux_s(T) = flux_s*exp(-b_s*(T - 25)),    i_c(T) = i_c*exp(-b_c*(T - 25))

T temperature (degC), b_L, b_s and b_c rates (1/K) of the base's parameters of the roles ``inductance``, ``saturation``
and ``coercive``; parameters are those at 25 degC.

Source: E. C. Snelling, Soft Ferrites (1988), ch. 3 (permeability, saturation and coercivity over temperature); an
exponential for each over the range of a test.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.effects.temperature import REFERENCE
from mrfit.kernels.theta import columns, once

SPEC = EffectSpec(
    name="core-temperature",
    title="Core that magnetises more easily when it is warm",
    equation="L*exp(b_L*(T - 25 degC)),  flux_s*exp(-b_s*(T - 25 degC)),  i_c*exp(-b_c*(T - 25 degC))",
    reference="Snelling, Soft Ferrites, ch. 3",
    slot="theta",
    outputs=("current",),
    inputs=("temperature",),
    params=(
        Param("b_L", "1/K", -0.02, 0.02, 0.0, text="rising rate of the inductance"),
        Param("b_s", "1/K", -0.02, 0.02, 0.0, text="falling rate of the flux of saturation"),
        Param("b_c", "1/K", -0.05, 0.05, 0.0, text="falling rate of the coercive current"),
    ),
    neutral=(0.0, 0.0, 0.0),
    aliases=("stop-mmf",),
    experiment="one course of the flux, up to saturation, repeated at three or more temperatures of the core, each "
    "held until the winding and the core are equally warm",
    proposed=False,
    steady=False,
    moves=(("temperature", 1.0),),
)


ROLES = ("inductance", "saturation", "coercive")


def law(temperature: Array, b_l: Array, b_s: Array, b_c: Array) -> tuple[Array, Array, Array]:
    """Return the factors of ``ROLES``, of numbers or arrays that broadcast."""
    excess = temperature - REFERENCE
    return np.exp(b_l * excess), np.exp(-b_s * excess), np.exp(-b_c * excess)


def factors(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the factors on parameters of the roles inductance, saturation and coercive; theta (P, 3) in 1/K.

    They have the shape (P, N), or (P, 1) where the temperature does not change.
    """
    return dict(zip(ROLES, law(once(channels["temperature"]), *columns(theta)), strict=True))
