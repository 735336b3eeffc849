"""Hyperbolic tangent: an algebraic hysteresis loop that can be inverted for control.

    F = fy*tanh(a1*v + a2*x) + c*v + k*x + f0

x displacement (m), v velocity (m/s), F force (N), fy yield force (N), a1 (s/m) slope and a2 (1/m) width of the loop at
low velocity, c viscous damping (N*s/m), k stiffness of the gas accumulator (N/m), f0 its offset (N).

Source: inverse-tanh paper eq. 1, published values in its Table 2 (there in mm); start values by characteristic
points, eqs. 2-7.
"""

from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param, ReducedModel
from mrfit.kernels.points import inside, tanh_points
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="tanh",
    title="Hyperbolic tangent",
    equation="F = fy*tanh(a1*v + a2*x) + c*v + k*x + f0",
    reference="inverse-tanh paper eq. 1",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("a1", "s/m", 0.5, 1e4, 80.0, "log", "knee", "slope at low velocity"),
        Param("a2", "1/m", -5e3, 5e3, 60.0, "linear", "hysteresis", "width of the loop at low velocity"),
        Param("c", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "viscous damping"),
        Param("k", "N/m", -1e6, 1e6, 300.0, "linear", "stiffness", "stiffness of the gas accumulator"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("fy", "c", "k", "f0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of displacement (m) and velocity (m/s), shape (2, N)."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return all six parameters from the loop's characteristic points (inverse-tanh paper eqs. 2-7)."""
    return inside(SPEC, tanh_points(drive[0], drive[1], output))


def law(x: Array, v: Array, fy: Array, a1: Array, a2: Array, c: Array, k: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    force: Array = fy * np.tanh(a1 * v + a2 * x) + c * v + k * x + f0
    return force


def _reduced_response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force of fy, a1, the lead a2/a1, c, k and f0, see ``REDUCED``."""
    return response(drive, _restore(theta), dt)


def _reduce(theta: Array) -> Array:
    return np.column_stack([theta[:, :2], theta[:, 2] / theta[:, 1], theta[:, 3:]])


def _restore(reduced: Array) -> Array:
    return np.column_stack([reduced[:, :2], reduced[:, 2] * reduced[:, 1], reduced[:, 3:]])


# a2/a1 shifts the loop's flanks by a share of x whatever their slope is; a2 does so the less, the steeper they are
REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(*SPEC.params[:2], Param("lead", "1/s", -30.0, 30.0, 0.75, text="a2/a1"), *SPEC.params[3:]),
    ),
    response=_reduced_response,
    reduce=_reduce,
    restore=_restore,
)
