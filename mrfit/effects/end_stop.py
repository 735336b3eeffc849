"""End stop: a buffer met near the ends of the stroke, or near one of them.

    F = F_base + k_s*d_0*(d/d_0)^p*sign(x - x_m),    d = max(|x - x_m| - x_s, 0),    d_0 = 1 mm

x displacement (m), F force (N), d how far the buffer is compressed (m), k_s its stiffness over the first millimetre
(N/m), x_s displacement from the middle at which it is met (m), x_m middle between the two stops (m): far from 0 where
one stop only is within reach; p how its force grows (1): 1 for a spring, 1.5 for a rubber hemisphere, more for a block.
x_s, x_m and p do nothing while k_s is 0 or the stroke stays below x_s.

Source: bump stops, J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007); p = 1.5 after H. Hertz.
"""

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Invariance, Param, Programme
from mrfit.kernels.theta import columns

DEPTH = 1e-3

SPEC = EffectSpec(
    name="end-stop",
    title="Buffer at the ends of the stroke",
    equation="F = F_base + k_s*d_0*(d/d_0)^p*sign(x - x_m),  d = max(|x - x_m| - x_s, 0),  d_0 = 1 mm",
    reference="Dixon, The Shock Absorber Handbook, 2nd ed. (2007): bump stops",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(
        Param("k_s", "N/m", 0.0, 1e7, 0.0, text="stiffness of the stop over the first millimetre"),
        Param("x_s", "m", 1e-3, 1.0, 0.01, "log", "shape", "displacement from the middle at which the stop is met"),
        Param("x_m", "m", -0.5, 0.5, 0.0, "linear", "shape", "middle between the stops"),
        Param("p", "1", 0.5, 4.0, 1.2, "log", "shape", "power by which its force grows"),
    ),
    neutral=(0.0, 0.01, 0.0, 1.2),
    aliases=("gas-spring",),
    experiment="slow strokes at three or more amplitudes up to the full stroke: a stop acts at the largest only",
    asks=(Programme(amplitudes=3),),
    breaks=Breaks(Invariance.POSITION, sign=1),
)


def law(x: Array, k_s: Array, x_s: Array, x_m: Array, p: Array) -> Array:
    """Return the stop's force in N of numbers or arrays that broadcast."""
    from_middle = x - x_m
    depth = np.maximum(np.abs(from_middle) - x_s, 0.0)
    force: Array = k_s * DEPTH * (depth / DEPTH) ** p * np.sign(from_middle)
    return force


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the stop's force in N, shape (P, N), of k_s in N/m, x_s and x_m in m and p, theta (P, 4)."""
    return law(channels["displacement"], *columns(theta))
