"""End stop: a rubber buffer met near the ends of the stroke.

    F = F_base + k_s*max(|x| - x_s, 0)*sign(x)

x displacement from the middle of the stroke (m), F force (N), k_s stiffness of the stop (N/m), x_s displacement at
which it is met (m); x_s does nothing while k_s is 0 or the stroke stays below it.

Source: bump stops, J. C. Dixon, The Shock Absorber Handbook, 2nd ed. (2007).
"""

import numpy as np

from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="end-stop",
    title="Buffer at the ends of the stroke",
    equation="F = F_base + k_s*max(|x| - x_s, 0)*sign(x)",
    reference="Dixon, The Shock Absorber Handbook, 2nd ed. (2007): bump stops",
    slot="add",
    outputs=("force",),
    inputs=("displacement",),
    params=(
        Param("k_s", "N/m", 0.0, 1e7, 0.0, text="stiffness of the stop"),
        Param("x_s", "m", 1e-3, 1.0, 0.01, "log", "shape", "displacement at which the stop is met"),
    ),
    neutral=(0.0, 0.01),
    aliases=("gas-spring",),
    experiment="slow strokes at three or more amplitudes up to the full stroke: a stop acts at the largest only",
)


def term(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the stop's force in N, shape (P, N), of k_s in N/m and x_s in m, theta (P, 2)."""
    x = channels["displacement"]
    k_s, x_s = theta[:, :1], theta[:, 1:]
    force: Array = k_s * np.maximum(np.abs(x) - x_s, 0.0) * np.sign(x)
    return force
