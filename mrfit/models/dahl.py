"""Dahl damper: a viscous damper beside Dahl's friction, whose force depends on the path.

    F = f0 + c*v + fy*w,    dw/dt = rho*(v - |v|*w)

x displacement (m), v velocity (m/s), F force (N), c damping (N*s/m), fy friction force (N), w state between -1 and 1
with w = 0 at sample 0, rho inverse of the travel over which friction turns over (1/m), f0 offset (N). w depends on the
path of x alone: every step is its exponential, exact at any sampling, for rho linear over the step too.

Source: Q. Zhou, S. Nielsen, W. Qu, Journal of Sound and Vibration 296 (2006) 1; named in the reviews of Savaia et al.
and
003 ("Dahl hysteresis operator").
"""

import math

import numpy as np

from mrfit.core.specs import Array, Ends, ModelSpec, Param, State, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.points import inside, post_yield_line

SPEC = ModelSpec(
    name="dahl",
    title="Viscous damper with Dahl friction",
    equation="F = f0 + c*v + fy*w;  dw/dt = rho*(v - |v|*w)",
    reference="Zhou, Nielsen, Qu 2006; reviewed in Savaia et al. and 003",
    inputs=("displacement", "velocity"),
    output="force",
    params=(
        Param("c", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "damping"),
        Param("fy", "N", 1.0, 1e6, 500.0, "log", "yield", "friction force"),
        Param(
            "rho", "1/m", 1.0, 1e6, 2000.0, "log", "hysteresis", "inverse of the travel over which friction turns over"
        ),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("c", "fy", "f0"),
)


def rest(now: Values, theta: Values) -> State:
    """Return w of friction that has stood still."""
    return (0.0,)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N and w at the end of a step."""
    (w,) = state
    then, (c, fy, rho, f0) = theta
    travel = now[0] - before[0]
    w += math.expm1(-0.5 * (then[2] + rho) * abs(travel)) * (w - math.copysign(1.0, travel))
    return f0 + c * now[1] + fy * w, (w,)


response = response_of(SPEC, rest, step)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line, and friction that turns over a tenth of the amplitude."""
    line = post_yield_line(drive[1], output)
    rate = 20.0 / max(float(np.ptp(drive[0])), 1e-6)
    return inside(SPEC, {"rho": rate, "fy": line["fy"], "c": line["C_inf"], "f0": line["f0"]})
