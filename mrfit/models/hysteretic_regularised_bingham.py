"""Hysteretic regularised Bingham: the regularised curve shifted either way by the sign of acceleration.

    F = f0 + fy*sign(u)*(1 - exp(-|u|/vy)) + C_inf*u,    u = v - vh for a >= 0,  u = v + vh for a < 0

v velocity (m/s), a acceleration (m/s^2), F force (N), f0 offset of the gas accumulator (N), fy yield force (N), vy
regularisation velocity (m/s), vh half-width of the loop (m/s), C_inf post-yield damping (N*s/m).

Source: preyield paper eq. 7. Its print shifts by -vh for a < 0, a clockwise loop, against its own text
(counter-clockwise)
and the sign of its hysteretic biviscous model with the same tabulated vh > 0; here the signs agree, and vh < 0 is the
print.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.jit import where
from mrfit.kernels.points import half_width, inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="hysteretic-regularised-bingham",
    title="Hysteretic regularised Bingham",
    equation="F = f0 + fy*sign(u)*(1 - exp(-|u|/vy)) + C_inf*u;  u = v - vh*sign(a)",
    reference="preyield paper eq. 7",
    inputs=("velocity", "acceleration"),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("vy", "m/s", 1e-4, 1.0, 0.005, "log", "knee", "regularisation velocity"),
        Param("vh", "m/s", -0.5, 0.5, 0.002, "linear", "hysteresis", "half-width of the loop"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "C_inf", "f0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and acceleration (m/s^2), shape (2, N)."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line, the half-width of the loop at zero force and the velocity of yield."""
    v, a = drive
    line = post_yield_line(v, output)
    return inside(SPEC, {**line, "vy": yield_velocity(v, output), "vh": half_width(v, a, output - line["f0"])})


def law(v: Array, a: Array, fy: Array, c_inf: Array, vy: Array, vh: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    u = v - where(a >= 0.0, vh, -vh)
    force: Array = f0 - fy * np.sign(u) * np.expm1(-np.abs(u) / vy) + c_inf * u
    return force
