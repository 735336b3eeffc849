"""Static map of the Hammerstein-Wiener damper: two slopes in velocity, their corner moved by current.

    F = f0 + C(i, v)
    C(i, v) = c_pre*v                                   for |v| <= d0,    d0 = a*i + b
    C(i, v) = c_post*(v - d0*sign(v)) + c_pre*d0*sign(v)    for |v| > d0

v velocity (m/s), i current (A), F force (N), c_pre and c_post damping before and after yield (N*s/m), a (m/s/A) and b
(m/s) give the yield velocity d0, f0 offset (N). The effects ``current-filter``, M(s) before the map, and
``force-filter``, H(s) behind it, make ``hammerstein-wiener`` of it, each alone one of the models between the two.

Source: Savaia et al. eqs. 1-2, whose third branch of C must read c_post*(v + d0) - c_pre*d0.
"""

import numpy as np

from mrfit.core.specs import Array, ModelSpec, Param, Stage
from mrfit.kernels.jit import clip
from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import evaluate

SPEC = ModelSpec(
    name="hw-static",
    title="Static map of the Hammerstein-Wiener damper",
    equation="F = f0 + C(i, v);  C = c_pre*v up to |v| = a*i + b, slope c_post beyond",
    reference="Savaia et al. eqs. 1-2",
    inputs=("velocity", "current"),
    output="force",
    params=(
        Param("c_pre", "N*s/m", 10.0, 1e7, 3e4, "log", "viscous", "damping before yield"),
        Param("c_post", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "damping after yield"),
        Param("a", "m/s/A", 1e-5, 1.0, 0.02, "log", "knee", "yield velocity per current"),
        Param("b", "m/s", -0.1, 0.5, 0.005, "linear", "knee", "yield velocity without current"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("c_pre", "c_post", "f0"),
)

# Savaia et al. sec. 3: every block of Hammerstein-Wiener has a kind of test in which it acts alone
STAGES = (
    Stage("static map C", "constant-speed", ("c_pre", "c_post", "a", "b", "f0")),
    Stage("hysteresis H", "sine", ("p1", "p2", "p3", "p4", "omega", "xi", "force-filter.*")),
    Stage("magnetisation M", "current-step", ("q1", "q2", "zero", "tau", "current-filter.*", "current-lag.*")),
    Stage("temperature alpha", "heating", ("temperature.b_viscous", "temperature-polynomial.*")),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and current (A), shape (2, N); dt does not enter."""
    return evaluate(law, drive, theta)


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return the post-yield line, the pre-yield slope and the yield velocity, shared out at the mean current."""
    v, current = drive
    line = post_yield_line(v, output)
    turn = 2 * max(yield_velocity(v, output), 1e-6)
    mean = float(np.mean(np.abs(current)))
    found = {"c_post": line["C_inf"], "c_pre": line["C_inf"] + line["fy"] / turn, "f0": line["f0"], "b": turn}
    if mean > 1e-3:
        found |= {"a": 0.8 * turn / mean, "b": 0.2 * turn}
    return inside(SPEC, found)


def law(v: Array, current: Array, c_pre: Array, c_post: Array, a: Array, b: Array, f0: Array) -> Array:
    """Return the force in N of numbers or arrays that broadcast."""
    turn = np.maximum(a * current + b, 0.0)
    before_yield = clip(v, -turn, turn)
    force: Array = c_pre * before_yield + c_post * (v - before_yield) + f0
    return force
