"""Gas spring: the accumulator behind the piston pushes back, the harder the more its gas is compressed.

    F = F_base + k_g*((1 - c*x)^-n - 1)/(n*c),    n = 1.3

x displacement (m), F force (N), k_g stiffness of the accumulator at x = 0 (N/m), c share of the gas column that a metre
of stroke takes away (1/m), negative where x counts the other way: the inverse of the column's length. With c = 0 the
force is k_g*x; c does nothing while k_g is 0. A base that has a stiffness of its own takes up the straight part.

Source: stiffness k1 of the accumulator, B. F. Spencer et al., J. Eng. Mech. 123 (1997) 230; preyield paper sec. 2;
polytropic gas, J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007).
"""

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param, Programme
from mrfit.kernels.jit import where
from mrfit.kernels.theta import columns

POLYTROPIC = 1.3
# Gas column left at which the force stops growing, as a share
LEAST_COLUMN = 0.02

SPEC = EffectSpec(
    name="gas-spring",
    title="Stiffness of the gas accumulator",
    equation="F = F_base + k_g*((1 - c*x)^-n - 1)/(n*c),  n = 1.3",
    reference="Spencer et al., J. Eng. Mech. 123 (1997) 230: accumulator stiffness; Dixon, The Shock Absorber Handbook",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(
        Param("k_g", "N/m", -1e6, 1e6, 0.0, text="stiffness of the accumulator"),
        Param("c", "1/m", -50.0, 50.0, 0.0, "linear", "shape", "inverse length of the gas column"),
    ),
    neutral=(0.0, 0.0),
    aliases=("inertia", "velocity-hysteresis", "delay", "end-stop", "force-offset"),
    experiment="one amplitude at two frequencies a factor 3 apart: k - m*omega^2 shows which part is inertia; very "
    "slow strokes at several amplitudes show the spring alone, an end stop only at the largest, an offset at none",
    asks=(Programme(frequencies=2, ratio=3.0),),
    breaks=Breaks(Invariance.POSITION),
)


def law(x: Array, k_g: Array, c: Array) -> Array:
    """Return the spring's force in N of numbers or arrays that broadcast."""
    shrinking = where(c == 0.0, 1.0, c)
    column = np.log1p(np.maximum(-shrinking * x, LEAST_COLUMN - 1.0))
    travel = np.expm1(-POLYTROPIC * column) / (POLYTROPIC * shrinking)
    force: Array = k_g * where(c == 0.0, x, travel)
    return force


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the spring's force in N, shape (P, N), of k_g in N/m and c in 1/m, theta (P, 2)."""
    return law(channels["displacement"], *columns(theta))
