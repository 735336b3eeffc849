"""Nonlinear biviscous: a stiff damper before yield, a soft one after it.

    F = f0 + C0*v                    for |v| < vy
    F = f0 + fy*sign(v) + C_inf*v    for |v| >= vy,    C0*vy = fy + C_inf*vy

v velocity (m/s), F force (N), f0 offset of the gas accumulator (N), fy yield force (N), where the post-yield line meets
the ordinate, vy yield velocity (m/s), C_inf post-yield damping (N*s/m). The pre-yield damping C0 = fy/vy + C_inf
(N*s/m) follows from continuity and is reported as derived.

Source: preyield paper eq. 3 with fy as its Figure 4 and its Tables 1-2 have it. The equation as printed has the force
at yield for fy, fy = C0*vy, which the tables do not obey; the 1.8 and 4.1 mm/s of their rows MH stand for 18 and 41.
"""

from mrfit.core.specs import Array, DerivedQuantity, ModelSpec, Param
from mrfit.kernels.jit import clip
from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="biviscous",
    title="Nonlinear biviscous",
    equation="F = f0 + C0*v for |v|<vy, else f0 + fy*sign(v) + C_inf*v;  C0 = fy/vy + C_inf",
    reference="preyield paper eq. 3, fy as in its Figure 4 and Tables 1-2",
    inputs=("velocity",),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("vy", "m/s", 1e-4, 1.0, 0.005, "log", "knee", "yield velocity"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "C_inf", "f0"),
    derived=(DerivedQuantity("C0", "N*s/m", "fy/vy + C_inf: pre-yield damping"),),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of a velocity in m/s, shape (1, N); dt does not enter."""
    return evaluate(law, drive, theta)


def derived(theta: Array) -> Array:
    """Return the pre-yield damping C0 in N*s/m, shape (P, 1)."""
    return theta[:, :1] / theta[:, 2:3] + theta[:, 1:2]


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the line through the faster half of the samples and the velocity at which the slow ones reach it."""
    return inside(SPEC, {**post_yield_line(drive[0], output), "vy": 2.0 * yield_velocity(drive[0], output)})


def law(v: Array, fy: Array, c_inf: Array, vy: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    force: Array = f0 + fy * clip(v / vy, -1.0, 1.0) + c_inf * v
    return force
