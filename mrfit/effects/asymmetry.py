"""Asymmetry: the valve resists one direction more than the other, in its yield force, its damping, or both.

    yield_force(v) = yield_force*(1 + g_yield*s(v)),    damping(v) = damping*(1 + g_viscous*s(v))
    s(v) = (1 + tanh(v/v_a))/2

v velocity (m/s), g_yield, g_viscous extra share (1) for v > 0 of the base's parameters of the roles ``yield`` and
``viscous``, v_a velocity over which one direction gives way to the other (m/s): a valve that switches at once has a
small one, a flow that turns over gradually a large one; v_a does nothing while both shares are 0. The parameters of the
base are those of v < 0. Springs, friction of seals and masses are beside the valve and stay as they are.

Source: J. Yu et al., Asymmetric dynamic model of temperature-dependent magnetorheological damper, Frontiers in
Materials 6 (2019) 227, as cited by Savaia et al..
"""

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param, Programme
from mrfit.kernels.theta import columns

SPEC = EffectSpec(
    name="asymmetry",
    title="Different force in rebound and compression",
    equation="yield_force = yield_force(v < 0)*(1 + g_yield*s(v)),  damping the same with g_viscous,  "
    "s(v) = (1 + tanh(v/v_a))/2",
    reference="Yu et al., Frontiers in Materials 6 (2019) 227",
    slot="theta",
    outputs=("force",),
    inputs=("velocity",),
    params=(
        Param("g_yield", "1", -0.95, 4.0, 0.0, text="extra share of the yield force for v > 0"),
        Param("g_viscous", "1", -0.95, 4.0, 0.0, text="extra share of the post-yield damping for v > 0"),
        Param("v_a", "m/s", 1e-4, 0.3, 0.01, "log", "shape", "velocity over which the directions change over"),
    ),
    neutral=(0.0, 0.0, 0.01),
    aliases=("force-offset", "relief-valve"),
    experiment="one sine at two or more currents: the difference between the directions grows with the force, that "
    "of an offset does not; sines at three or more speeds: an asymmetry of the valve takes a share of all of the force "
    "of a direction, a relief valve only of what is above one force",
    asks=(Programme(currents=2), Programme(speeds=3)),
    breaks=Breaks(Invariance.ODDNESS, unexamined=("relief-valve",)),
)


ROLES = ("yield", "viscous")


def law(v: Array, g_yield: Array, g_viscous: Array, v_a: Array) -> tuple[Array, Array]:
    """Return the factors of ``ROLES``, of numbers or arrays that broadcast."""
    rising = 0.5 * (1.0 + np.tanh(v / v_a))
    return 1.0 + g_yield * rising, 1.0 + g_viscous * rising


def factors(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the factors (P, N) on parameters of the roles yield and viscous; theta (P, 3), the last in m/s."""
    return dict(zip(ROLES, law(channels["velocity"], *columns(theta)), strict=True))
