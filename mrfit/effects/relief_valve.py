"""Relief valve: above an opening force, in one direction or in both, it takes a share of what is above.

    F = F_base - r_p*max(F_f - F_o, 0) + r_n*max(-F_f - F_o, 0),    F_f = F_base - k_b*x

x displacement (m), F force (N), F_f the force of the fluid (N), F_o the force at which the valve opens (N), r_p, r_n
the shares (1) of the force above F_o that it takes for positive and for negative force, k_b the stiffness (N/m) of what
is beside the valve, as a gas spring of the base. F_o and k_b do nothing while both shares are 0.

Source: blow-off valves, J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 6: above the pressure at which it
opens, the slope of the force falls.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme
from mrfit.kernels.theta import columns

SPEC = EffectSpec(
    name="relief-valve",
    title="Relief valve that opens above a force",
    equation="F = F_base - r_p*max(F_f - F_o, 0) + r_n*max(-F_f - F_o, 0),  F_f = F_base - k_b*x",
    reference="Dixon, The Shock Absorber Handbook, 2nd ed. (2007), ch. 6: blow-off valves",
    slot="output",
    outputs=("force",),
    inputs=("displacement",),
    params=(
        Param("r_p", "1", 0.0, 1.0, 0.0, text="share of positive force above the opening that is relieved"),
        Param("r_n", "1", 0.0, 1.0, 0.0, text="share of negative force below it that is relieved"),
        Param("F_o", "N", 1.0, 1e6, 1000.0, "log", "shape", "force at which the valve opens"),
        Param("k_b", "N/m", -1e6, 1e6, 0.0, "linear", "shape", "stiffness beside the valve"),
    ),
    neutral=(0.0, 0.0, 1000.0, 0.0),
    aliases=("asymmetry",),
    experiment="sines at three or more speeds and two currents: a relief valve bends the force of a direction above "
    "one force at every current, an asymmetry of the valve takes a share of all of it",
    asks=(Programme(speeds=3, currents=2),),
)


def law(force: Array, x: Array, r_p: Array, r_n: Array, opening: Array, k_b: Array) -> Array:
    """Return the force in N behind the valve, of numbers or arrays that broadcast."""
    fluid = force - k_b * x
    relieved: Array = force - r_p * np.maximum(fluid - opening, 0.0) + r_n * np.maximum(-fluid - opening, 0.0)
    return relieved


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), behind the valve; theta (P, 4), F_o in N and k_b in N/m."""
    return law(output, channels["displacement"], *columns(theta))
