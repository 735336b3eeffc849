"""Bingham plastic: a Coulomb element for the yield stress beside a viscous damper.

    F = f0 + fy*sign(v) + C_inf*v

v velocity (m/s), F force (N), f0 offset of the gas accumulator (N), fy yield force (N), C_inf post-yield damping
(N*s/m). At v = 0 the Coulomb force is 0.

Source: preyield paper eq. 1; published values in its Tables 1-2.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.points import inside, post_yield_line
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="bingham",
    title="Bingham plastic",
    equation="F = f0 + fy*sign(v) + C_inf*v",
    reference="preyield paper eq. 1",
    inputs=("velocity",),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "C_inf", "f0"),
    jumps=("velocity",),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of a velocity in m/s, shape (1, N); dt does not enter."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return yield force, damping and offset of the line through the faster half of the samples."""
    return inside(SPEC, post_yield_line(drive[0], output))


def law(v: Array, fy: Array, c_inf: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    force: Array = f0 + fy * np.sign(v) + c_inf * v
    return force
