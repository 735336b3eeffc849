"""Hysteretic biviscous: the biviscous curve split in two by the sign of acceleration.

    a > 0:  C_inf*v - fy     for v < -vyc
            C0*(v - vh)      for -vyc <= v <= vye
            C_inf*v + fy     for v > vye
    a < 0:  the mirror image through the point (0, f0)
    vyc = (fy - C0*vh)/(C0 - C_inf),  vye = (fy + C0*vh)/(C0 - C_inf)

F - f0 is given; v velocity (m/s), a acceleration (m/s^2), F force (N), f0 offset of the gas accumulator (N), fy yield
force (N), C0 pre-yield and C_inf post-yield damping (N*s/m), vh velocity of zero force (m/s). The three lines meet at
-vyc and vye, so that each branch is the middle one of its three lines, whatever their slopes.

Source: preyield paper eqs. 5-6; its print has C0 and C_inf exchanged in two of the branches for a < 0.
"""

from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, ModelSpec, Param, ReducedModel
from mrfit.kernels.jit import clip, where
from mrfit.kernels.points import half_width, inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="hysteretic-biviscous",
    title="Hysteretic biviscous",
    equation="F = f0 + min(max(C0*(v - vh*sign(a)), C_inf*v - fy), C_inf*v + fy)",
    reference="preyield paper eqs. 5-6",
    inputs=("velocity", "acceleration"),
    output="force",
    params=(
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "yield force"),
        Param("C_inf", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "post-yield damping"),
        Param("C0", "N*s/m", 10.0, 1e8, 5e4, "log", "viscous", "pre-yield damping"),
        Param("vh", "m/s", -0.5, 0.5, 0.002, "linear", "hysteresis", "velocity of zero force"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("f0",),
    derived=(
        DerivedQuantity("vyc", "m/s", "(fy-C0*vh)/(C0-C_inf): lower yield velocity"),
        DerivedQuantity("vye", "m/s", "(fy+C0*vh)/(C0-C_inf): upper yield velocity"),
    ),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and acceleration (m/s^2), shape (2, N)."""
    return evaluate(law, drive, theta)


def derived(theta: Array) -> Array:
    """Return the yield velocities vyc and vye in m/s, shape (P, 2)."""
    fy, c_inf, c0, vh, _ = theta.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.column_stack([(fy - c0 * vh) / (c0 - c_inf), (fy + c0 * vh) / (c0 - c_inf)])


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line, the half-width of the loop at zero force and the slope up to yield."""
    v, a = drive
    line = post_yield_line(v, output)
    c0 = line["C_inf"] + line["fy"] / max(yield_velocity(v, output), 1e-6)
    return inside(SPEC, {**line, "C0": c0, "vh": half_width(v, a, output - line["f0"])})


def law(v: Array, a: Array, fy: Array, c_inf: Array, c0: Array, vh: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    post_yield = c_inf * v
    branch = c0 * (v - where(a >= 0.0, vh, -vh))
    force: Array = f0 + clip(branch, post_yield - fy, post_yield + fy)
    return force


def _reduced_response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force of fy, C_inf, steepness, width and f0, see ``REDUCED``."""
    return evaluate(_reduced_force, drive, theta)


def _reduced_force(v: Array, a: Array, *parameters: Array) -> Array:
    fy, c_inf, steepness, width, f0 = parameters
    force: Array = f0 + c_inf * v + fy * np.clip(steepness * (v - np.where(a >= 0, width, -width)), -1.0, 1.0)
    return force


def _reduce(theta: Array) -> Array:
    fy, c_inf, c0, vh, f0 = theta.T
    rise = np.maximum(c0 - c_inf, 1e-6 * c0)
    return np.column_stack([fy, c_inf, rise / fy, c0 * vh / rise, f0])


def _restore(reduced: Array) -> Array:
    fy, c_inf, steepness, width, f0 = reduced.T
    c0 = c_inf + steepness * fy
    return np.column_stack([fy, c_inf, c0, steepness * fy * width / c0, f0])


# With C0 > C_inf the force is linear in fy and C_inf: F = f0 + C_inf*v + fy*clip(steepness*(v - width*sign(a)), -1, 1)
REDUCED = ReducedModel(
    spec=replace(
        SPEC,
        params=(
            *SPEC.params[:2],
            Param("steepness", "s/m", 0.1, 1e5, 100.0, "log", text="(C0-C_inf)/fy"),
            Param("width", "m/s", -0.5, 0.5, 0.002, text="C0*vh/(C0-C_inf)"),
            SPEC.params[4],
        ),
        linear=("fy", "C_inf", "f0"),
        derived=(),
    ),
    response=_reduced_response,
    reduce=_reduce,
    restore=_restore,
)
