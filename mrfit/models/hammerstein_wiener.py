"""Hammerstein-Wiener damper: magnetisation dynamics, a static map and hysteresis dynamics in series.

    F = f0 + H(s){C(M(s)*i, v)}
    C(i, v) = c_pre*v                                   for |v| <= d0,    d0 = a*i + b
    C(i, v) = c_post*(v - d0*sign(v)) + c_pre*d0*sign(v)    for |v| > d0
    H(s) = p1*p2*p3*p4/omega^2*(s^2 + 2*xi*omega*s + omega^2)/((s+p1)*(s+p2)*(s+p3)*(s+p4))
    M(s) = q1*q2/zero*(s + zero)/((s+q1)*(s+q2))*exp(-tau*s)

v velocity (m/s), i current (A), F force (N), c_pre and c_post damping before and after yield (N*s/m), a (m/s/A) and b
(m/s) give the yield velocity d0, p1 ... p4, q1, q2 poles and zero (1/s), omega (rad/s) and xi (1) the complex pair of
zeros of H, tau delay (s), f0 offset (N). H and M have unit gain and are at rest at sample 0's force and current; both
are exact for inputs linear between samples.

Source: Savaia et al. eqs. 1-7, whose third branch of C must read c_post*(v + d0) - c_pre*d0. The factor alpha(T) of its
eq. 3 is the effect ``temperature``; poles and zeros of its Tables 1-2 are lost in print.
"""

import numpy as np

from mrfit.kernels.lti import delayed, unit_gain_filter
from mrfit.kernels.points import inside, post_yield_line, yield_velocity
from mrfit.kernels.theta import by_blocks, plain
from mrfit.specs import Array, ModelSpec, Param

SPEC = ModelSpec(
    name="hammerstein-wiener",
    title="Hammerstein-Wiener damper",
    equation=(
        "F = f0 + H(s){C(M(s)*i, v)};  C = c_pre*v up to |v| = a*i + b, slope c_post beyond;  "
        "H: poles p1..p4, zeros (omega, xi);  M: poles q1, q2, zero, delay tau;  unit gains"
    ),
    reference="Savaia et al. eqs. 1-7",
    inputs=("velocity", "current"),
    output="force",
    params=(
        Param("c_pre", "N*s/m", 10.0, 1e7, 3e4, "log", "viscous", "damping before yield"),
        Param("c_post", "N*s/m", 1.0, 1e6, 1000.0, "log", "viscous", "damping after yield"),
        Param("a", "m/s/A", 1e-5, 1.0, 0.02, "log", "yield", "yield velocity per current"),
        Param("b", "m/s", -0.1, 0.5, 0.005, "linear", "yield", "yield velocity without current"),
        Param("p1", "1/s", 1.0, 1e4, 150.0, "log", "hysteresis", "pole of H"),
        Param("p2", "1/s", 1.0, 1e4, 300.0, "log", "hysteresis", "pole of H"),
        Param("p3", "1/s", 1.0, 1e4, 600.0, "log", "hysteresis", "pole of H"),
        Param("p4", "1/s", 1.0, 1e4, 1200.0, "log", "hysteresis", "pole of H"),
        Param("omega", "rad/s", 1.0, 1e4, 400.0, "log", "hysteresis", "frequency of H's zeros"),
        Param("xi", "1", 0.01, 5.0, 0.7, "log", "hysteresis", "damping ratio of H's zeros"),
        Param("q1", "1/s", 1.0, 1e4, 60.0, "log", text="pole of M"),
        Param("q2", "1/s", 1.0, 1e4, 400.0, "log", text="pole of M"),
        Param("zero", "1/s", 1.0, 1e4, 200.0, "log", text="zero of M"),
        Param("tau", "s", 0.0, 0.05, 0.002, text="delay of M"),
        Param("f0", "N", -1e5, 1e5, 0.0, "linear", "offset", "offset of the gas accumulator"),
    ),
    linear=("c_pre", "c_post", "f0"),
)


def response(drive: Array, theta: Array, dt: float) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and current (A), shape (2, N), sampled every dt s."""
    return by_blocks(lambda block: _force(plain(drive), block, dt), drive.shape[1], theta)


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


def _force(drive: Array, theta: Array, dt: float) -> Array:
    v, current = drive
    c_pre, c_post, a, b, *_, tau, f0 = (theta[:, k, None] for k in range(theta.shape[1]))
    magnetising = unit_gain_filter(
        delayed(current, tau[:, 0] / dt),
        plain(theta[:, 10:12]),
        np.column_stack([1.0 / theta[:, 12], np.zeros(len(theta))]),
        dt,
    )
    turn = np.maximum(a * magnetising + b, 0.0)
    pre_yield = np.clip(v, -turn, turn)
    force = c_pre * pre_yield + c_post * (v - pre_yield)
    omega, xi = theta[:, 8], theta[:, 9]
    hysteresis = np.column_stack([2.0 * xi / omega, 1.0 / omega**2])
    lagged = unit_gain_filter(force, plain(theta[:, 4:8]), hysteresis, dt)
    lagged += f0
    return lagged
