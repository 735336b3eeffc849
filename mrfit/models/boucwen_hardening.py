"""Bouc-Wen damper whose loop may harden: both shapes of the loop may have either sign.

    F = c*v + k*(x - x0) + alpha*z
    dz/dt = v - (b*v + g*|v|*sign(z))*|z/z0|^n

x displacement (m), v velocity (m/s), F force (N), c damping (N*s/m), k stiffness (N/m), x0 displacement at which the
spring is at rest (m), alpha stiffness of the hysteretic element at first (N/m), z its deflection (m) with z = 0 at
sample 0, b and g shapes of the loop (1), n sharpness of the knee (1). z0 (m) is the unit in which b and g count: the
stroke of the training logs. The loop softens where b + g > 0 and hardens where b + g < 0; ``boucwen`` has both above 0.

Source: F. Ismail, F. Ikhouane, J. Rodellar, Archives of Computational Methods in Engineering 16 (2009) 161, eq. 2 and
the classes of its table 1; the benchmark of Noel and Schoukens (2016) hardens.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Ends, ModelSpec, Param, State, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.friction import bouc_wen_step
from mrfit.kernels.points import inside, post_yield_line

SPEC = ModelSpec(
    name="boucwen-hardening",
    title="Bouc-Wen damper whose loop may harden",
    equation="F = c*v + k*(x-x0) + alpha*z;  dz/dt = v - (b*v + g*|v|*sign(z))*|z/z0|^n",
    reference="Ismail, Ikhouane, Rodellar 2009, eq. 2",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("c", "N*s/m", 1e-2, 1e6, 1000.0, "log", "viscous", "damping"),
        Param("k", "N/m", 1.0, 1e8, 1000.0, "log", "stiffness", "stiffness"),
        Param("x0", "m", -1.0, 1.0, 0.0, "linear", "offset", "displacement at which the spring is at rest"),
        Param("alpha", "N/m", 1.0, 1e8, 1e5, "log", "stiffness", "stiffness of the hysteretic element at first"),
        Param("b", "1", -5.0, 5.0, 0.5, "linear", "hysteresis", "shape of the loop, follows the velocity's sign"),
        Param("g", "1", -5.0, 5.0, 0.5, "linear", "hysteresis", "shape of the loop, width"),
        Param("n", "1", 0.5, 4.0, 1.5, "log", "hysteresis", "sharpness of the knee"),
        Param("z0", "m", 1e-6, 1.0, 1e-2, "log", text="deflection in which b and g count", fixed=True),
    ),
    linear=("c", "k", "alpha"),
)
# Deflection over z0 at which a loop that hardens ends
LARGEST_DEFLECTION = 30.0


def rest(now: Values, theta: Values) -> State:
    """Return z/z0 of an element that has stood still."""
    return (0.0,)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N and z/z0 at the end of a step."""
    then, (c, k, x0, alpha, b, g, n, z0) = theta
    travel = now[0] - before[0]
    shapes = (1.0 / then[7], then[4] / then[7], then[5] / then[7], then[6])
    y = state[0]
    if abs(y) < LARGEST_DEFLECTION or travel * y < 0.0:
        y = bouc_wen_step(y, travel, shapes, (1.0 / z0, b / z0, g / z0, n))
    if not abs(y) < LARGEST_DEFLECTION:
        y = math.copysign(LARGEST_DEFLECTION, travel)
    return c * now[1] + k * (now[0] - x0) + alpha * z0 * y, (y,)


response = response_of(SPEC, rest, step)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line's damping, and a stiffness shared by spring and element over the stroke."""
    line, stroke = post_yield_line(drive[1], output), 0.5 * float(np.ptp(drive[0]))
    stiffness = 0.25 * float(np.ptp(output)) / max(stroke, 1e-9)
    return inside(SPEC, {"c": line["C_inf"], "k": stiffness, "alpha": stiffness, "z0": stroke})
