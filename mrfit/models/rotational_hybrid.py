"""Rotary damper by a hyperbolic tangent and a Gauss bell whose sign follows the angular acceleration.

    T = delta + epsilon*tanh(phi*omega) + lambda*exp(-omega^2/(2*sigma^2))    for d(omega)/dt >= 0
    T = delta + epsilon*tanh(phi*omega) - lambda*exp(-omega^2/(2*sigma^2))    for d(omega)/dt < 0

omega angular velocity (rad/s), T torque (N*m), delta offset (N*m), epsilon amplitude (N*m), phi steepness (s/rad),
lambda half the loop's height at rest (N*m), negative where the torque lags, sigma the velocity over which the loop
closes (rad/s).

Source: rotary-stiffness paper eq. 19, which prints >= in both lines.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.jit import where
from mrfit.kernels.points import inside, loop_height, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="rotational-hybrid",
    title="Rotary damper, hyperbolic tangent and Gauss bell",
    equation="T = delta + epsilon*tanh(phi*omega) + sign(d omega/dt)*lambda*exp(-omega^2/(2*sigma^2))",
    reference="rotary-stiffness paper eq. 19",
    inputs=("angular_velocity", "angular_acceleration"),
    output="torque",
    params=(
        Param("delta", "N*m", -1e4, 1e4, 0.0, "linear", "offset", "offset"),
        Param("epsilon", "N*m", 1e-2, 1e4, 4.0, "log", "yield", "amplitude of the S-shaped part"),
        Param("phi", "s/rad", 0.05, 1e3, 5.0, "log", "knee", "steepness of the S-shaped part"),
        Param("lambda", "N*m", -1e4, 1e4, -1.0, "linear", "hysteresis", "half the loop's height at rest"),
        Param("sigma", "rad/s", 1e-3, 100.0, 0.3, "log", "hysteresis", "velocity over which the loop closes"),
    ),
    linear=("delta", "epsilon", "lambda"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the torque in N*m, shape (P, N), of angular velocity (rad/s) and acceleration (rad/s^2), shape (2, N)."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return offset, amplitude, steepness and loop height from the torque-velocity curve."""
    omega, acceleration = drive
    line, turn = post_yield_line(omega, output), max(yield_velocity(omega, output), 1e-6)
    found = {"delta": line["f0"], "epsilon": line["fy"], "phi": 1 / turn, "sigma": 2 * turn}
    return inside(SPEC, {**found, "lambda": -loop_height(omega, acceleration, output)})


def law(
    omega: Array, acceleration: Array, delta: Array, epsilon: Array, phi: Array, bell: Array, sigma: Array
) -> Array:
    """Return the torque in N*m of numbers or arrays that broadcast."""
    height = where(acceleration >= 0.0, bell, -bell) * np.exp(-0.5 * (omega / sigma) ** 2)
    torque: Array = delta + epsilon * np.tanh(phi * omega) + height
    return torque
