"""Shuqi Guo: a hyperbolic tangent of velocity and displacement together.

    F = f0 + fy*tanh(C0*(v + Omega*x)) + C_inf*(v + Omega*x),    Omega = vh/xh

x displacement (m), v velocity (m/s), F force (N), f0 offset of the gas accumulator (N), fy yield force (N), C0
sharpness of yield (s/m), C_inf post-yield damping (N*s/m), Omega hysteretic critical velocity over critical
displacement (1/s).

Source: preyield paper eq. 8. Its print has the quotient of Omega upside down; its words and the dimensions say vh/xh.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.points import half_width, inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="guo",
    title="Shuqi Guo's hyperbolic tangent",
    equation="F = f0 + fy*tanh(C0*(v + Omega*x)) + C_inf*(v + Omega*x)",
    reference="preyield paper eq. 8",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("C0", "s/m", 0.5, 1e4, 100.0, "log", "knee", "sharpness of yield"),
        Param("Omega", "1/s", -100.0, 100.0, 1.0, "linear", "hysteresis", "width of the loop over displacement"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "C_inf", "f0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of displacement (m) and velocity (m/s), shape (2, N)."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line, the velocity of yield and the loop's half-width over the greatest displacement."""
    x, v = drive
    line = post_yield_line(v, output)
    omega = half_width(v, -x, output - line["f0"]) / max(np.ptp(x) / 2, 1e-9)
    return inside(SPEC, {**line, "C0": 1 / max(yield_velocity(v, output), 1e-6), "Omega": omega})


def law(x: Array, v: Array, fy: Array, c_inf: Array, c0: Array, omega: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    u = v + omega * x
    force: Array = f0 + fy * np.tanh(c0 * u) + c_inf * u
    return force
