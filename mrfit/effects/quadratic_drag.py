"""Quadratic drag: turbulent flow through the gap at high speed.

    F = F_base + c2*exp(-b_drag*(T - 25))*v*|v|

v velocity (m/s), F force (N), T temperature (degC), c2 drag at 25 degC (N*s^2/m^2), b_drag its falling rate (1/K). The
rate is held at 0 in a model that does not take the temperature. The data determine it: the loss of an orifice is
proportional to the density, which hardly falls; where the whole force falls, as Savaia et al. scale it, the drag falls
too.

Source: orifice flow, J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 5; the falling rate as that of the
effect ``temperature``.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme
from mrfit.effects.temperature import REFERENCE
from mrfit.kernels.theta import columns

SPEC = EffectSpec(
    name="quadratic-drag",
    title="Turbulent flow at high speed",
    equation="F = F_base + c2*exp(-b_drag*(T - 25 degC))*v*|v|",
    reference="Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 5",
    slot="add",
    outputs=("force",),
    inputs=("velocity",),
    params=(
        Param("c2", "N*s^2/m^2", 0.0, 1e6, 0.0, text="drag"),
        Param("b_drag", "1/K", -0.02, 0.05, 0.0, role="shape", text="falling rate of the drag", needs="temperature"),
    ),
    neutral=(0.0, 0.0),
    aliases=("temperature",),
    experiment="strokes at five or more speeds up to the highest, in random order, with the damper cooled to the "
    "same temperature before each: warm fluid at high speed bends the curve too",
    asks=(Programme(speeds=5),),
)


def law(v: Array, temperature: Array, c2: Array, b_drag: Array) -> Array:
    """Return the drag in N of numbers or arrays that broadcast."""
    force: Array = c2 * np.exp(-b_drag * (temperature - REFERENCE)) * (v * np.abs(v))
    return force


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the drag in N, shape (P, N); theta (P, 2) in N*s^2/m^2 and 1/K, the latter of use with a temperature."""
    return law(channels["velocity"], channels.get("temperature", np.full(1, REFERENCE)), *columns(theta))
