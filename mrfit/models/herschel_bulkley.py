"""Herschel-Bulkley: a Coulomb element beside a damper whose force is a power of velocity.

    F = f0 + fy*sign(v) + C_inf*|v|^n*sign(v)

v velocity (m/s), F force (N), f0 offset of the gas accumulator (N), fy yield force (N), C_inf consistency, the viscous
force at 1 m/s (N), n flow index (1): below 1 the fluid thins with shear, above 1 it thickens.

Source: preyield paper eq. 2; in its Tables 1-2 fy falls to 0.0 N where n alone bends the curve, and n is not printed.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.kernels.points import inside, post_yield_line
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="herschel-bulkley",
    title="Herschel-Bulkley fluid",
    equation="F = f0 + fy*sign(v) + C_inf*|v|^n*sign(v)",
    reference="preyield paper eq. 2",
    inputs=("velocity",),
    output="force",
    params=(
        Param("fy", "N", 0.01, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N", 1.0, 1e6, 1000.0, "log", "viscous", "consistency: viscous force at 1 m/s"),
        Param("n", "1", 0.05, 3.0, 0.8, "log", "viscous", "flow index"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "C_inf", "f0"),
    jumps=("velocity",),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of a velocity in m/s, shape (1, N); dt does not enter."""
    v = drive[0]
    with np.errstate(divide="ignore"):
        channels = np.stack([np.sign(v), np.log(np.abs(v))])
    return evaluate(_force, channels, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the Bingham line through the faster half of the samples, that is n = 1."""
    return inside(SPEC, {**post_yield_line(drive[0], output), "n": 1.0})


def law(v: Array, fy: Array, c_inf: Array, n: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    force: Array = f0 + np.sign(v) * (fy + c_inf * np.abs(v) ** n)
    return force


def _force(sign: Array, log_v: Array, fy: Array, c_inf: Array, n: Array, f0: Array) -> Array:
    force: Array = f0 + sign * (fy + c_inf * np.exp(n * log_v))
    return force
