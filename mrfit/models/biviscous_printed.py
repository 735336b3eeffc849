"""Nonlinear biviscous as printed: the force at yield is no continuation of the pre-yield line.

    F = f0 + C0*v                                   for |v| < vy
    F = f0 + fy*sign(v) + C_inf*(v - vy*sign(v))    for |v| >= vy

v velocity (m/s), F force (N), f0 offset of the gas accumulator (N), C0 pre-yield damping (N*s/m), vy yield velocity
(m/s), fy force just above it (N), C_inf post-yield damping (N*s/m). The force jumps by fy - C0*vy where it yields.
``biviscous`` is the continuous form that the paper's tables obey.

Source: preyield paper eq. 3 as printed. With the printed 1.8 and 4.1 mm/s it gives the ride of its Table 4.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="biviscous-printed",
    title="Nonlinear biviscous, as printed",
    equation="F = f0 + C0*v for |v|<vy, else f0 + fy*sign(v) + C_inf*(v - vy*sign(v))",
    reference="preyield paper eq. 3 as printed",
    inputs=("velocity",),
    output="force",
    params=(
        Param("C0", "N*s/m", 1.0, 1e8, 1e5, "log", "viscous", "pre-yield damping"),
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "force just above the yield velocity"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("vy", "m/s", 1e-4, 1.0, 0.005, "log", "knee", "yield velocity"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("C0", "fy", "C_inf", "f0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of a velocity in m/s, shape (1, N); dt does not enter."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the line through the faster half of the samples, and the slow ones' line through the origin."""
    line, turn = post_yield_line(drive[0], output), 2.0 * yield_velocity(drive[0], output)
    return inside(SPEC, {**line, "vy": turn, "C0": line["C_inf"] + line["fy"] / max(turn, 1e-6)})


def law(v: Array, c0: Array, fy: Array, c_inf: Array, vy: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    side = np.sign(v)
    force: Array = f0 + np.where(np.abs(v) < vy, c0 * v, fy * side + c_inf * (v - vy * side))
    return force
