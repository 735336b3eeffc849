"""Nonlinear biviscous: a stiff damper before yield, a soft one after it.

    F = f0 + C0*v                                      for |v| < vy
    F = f0 + fy*sign(v) + C_inf*(v - vy*sign(v))       for |v| >= vy,    fy = C0*vy

v velocity (m/s), F force (N), f0 offset of the gas accumulator (N), fy yield force (N), vy yield velocity (m/s), C_inf
post-yield damping (N*s/m). The pre-yield damping C0 = fy/vy (N*s/m) follows from continuity and is reported as derived.

Source: preyield paper eq. 3; published values in its Tables 1-2.
"""

import numpy as np

from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate
from mrfit.specs import Array, Derived, ModelSpec, Param

SPEC = ModelSpec(
    name="biviscous",
    title="Nonlinear biviscous",
    equation="F = f0 + C0*v for |v|<vy, else f0 + fy*sign(v) + C_inf*(v - vy*sign(v));  C0 = fy/vy",
    reference="preyield paper eq. 3",
    inputs=("velocity",),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("vy", "m/s", 1e-4, 1.0, 0.005, "log", "knee", "yield velocity"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "C_inf", "f0"),
    derived=(Derived("C0", "N*s/m", "fy/vy: pre-yield damping"),),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of a velocity in m/s, shape (1, N); dt does not enter."""
    return evaluate(_force, drive, theta)


def derived(theta: Array) -> Array:
    """Return the pre-yield damping C0 in N*s/m, shape (P, 1)."""
    return theta[:, :1] / theta[:, 2:3]


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the line through the faster half of the samples and the velocity at which the slow ones reach it."""
    return inside(SPEC, {**post_yield_line(drive[0], output), "vy": yield_velocity(drive[0], output)})


def _force(v: Array, fy: Array, c_inf: Array, vy: Array, f0: Array) -> Array:
    pre_yield = np.clip(v, -vy, vy)
    force: Array = f0 + fy / vy * pre_yield + c_inf * (v - pre_yield)
    return force
