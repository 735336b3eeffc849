"""Rotary damper by the error function: an S-shaped torque beside a rotational spring and damper.

    T = k*theta + c*omega + alpha*erf(beta*omega + gamma*sign(theta)) + T0

theta angle (rad), omega angular velocity (rad/s), T torque (N*m), k stiffness (N*m/rad), c damping (N*m*s/rad), alpha
amplitude of the S (N*m), beta its steepness (s/rad), gamma its shift with the angle's sign (1), T0 offset (N*m).

Source: rotary-stiffness paper eqs. 1-2 and 5-6; eq. 2 prints theta inside erf where eq. 6 has the angular velocity,
which is right.
T0 is half the sum of the greatest and the least torque of a condition. Published: k and c linear in current, negative k
at 0 A (eqs. 20-24).
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.jit import erf
from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="rotational-erf",
    title="Rotary damper, error function",
    equation="T = k*theta + c*omega + alpha*erf(beta*omega + gamma*sign(theta)) + T0",
    reference="rotary-stiffness paper eqs. 5-6",
    inputs=("angle", "angular_velocity"),
    output="torque",
    params=(
        Param("k", "N*m/rad", -1e4, 1e4, 10.0, "linear", "stiffness", "rotational stiffness"),
        Param("c", "N*m*s/rad", 1e-3, 1e4, 1.0, "log", "viscous", "rotational damping"),
        Param("alpha", "N*m", 1e-2, 1e4, 4.0, "log", "yield", "amplitude of the S-shaped part"),
        Param("beta", "s/rad", 0.05, 1e3, 18.5, "log", "knee", "steepness of the S-shaped part"),
        Param("gamma", "1", -5.0, 5.0, 0.6, "linear", "hysteresis", "shift with the angle's sign"),
        Param("T0", "N*m", -1e4, 1e4, 0.0, "linear", "offset", "offset"),
    ),
    linear=("k", "c", "alpha", "T0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the torque in N*m, shape (P, N), of angle (rad) and angular velocity (rad/s), shape (2, N)."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return T0 as the source defines it and amplitude, damping and steepness from the torque-velocity curve."""
    omega = drive[1]
    line = post_yield_line(omega, output)
    found = {"alpha": line["fy"], "c": line["C_inf"], "beta": 1 / max(yield_velocity(omega, output), 1e-6)}
    return inside(SPEC, {**found, "T0": 0.5 * float(np.max(output) + np.min(output))})


def law(
    angle: Array, omega: Array, k: Array, c: Array, alpha: Array, beta: Array, gamma: Array, offset: Array
) -> Array:
    """Return the torque in N*m of numbers or arrays that broadcast."""
    torque: Array = k * angle + c * omega + alpha * erf(beta * omega + gamma * np.sign(angle)) + offset
    return torque
