"""Force filter: the hysteresis dynamics H(s) of the Hammerstein-Wiener damper, from static to measured force.

    F = H(s)*F_base,    H(s) = (1 + 2*xi*r_w*T*s + (r_w*T*s)^2)/((1 + T*s)*(1 + r_2*T*s)*(1 + r_3*T*s)*(1 + r_4*T*s))

F force (N), T the longest time constant (s), which is 1/p1 of ``hammerstein-wiener``, r_2, r_3, r_4 = p1/p2, p1/p3,
p1/p4 (1) the others as shares of it, r_w = p1/omega (1) that of the pair of zeros, xi its damping ratio (1). All time
constants are 0 together, so that H is proper for every T; its gain is 1. All but T do nothing while T is 0. H is exact
for a force that is linear between samples, and at rest at the first.

Source: Savaia et al. eq. 5.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, State, Steps, Values
from mrfit.kernels.dynamics import hysteresis_filter
from mrfit.kernels.elements import rows_of
from mrfit.kernels.lti import SHORTEST, cascade_step, passed
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="force-filter",
    title="Hysteresis dynamics H(s) behind the force",
    equation="F = H(s)*F_base,  "
    "H(s) = (1 + 2*xi*r_w*T*s + (r_w*T*s)^2)/((1 + T*s)*(1 + r_2*T*s)*(1 + r_3*T*s)*(1 + r_4*T*s))",
    reference="Savaia et al. eq. 5",
    slot="output",
    outputs=("force", "torque"),
    inputs=(),
    params=(
        Param("T", "s", 0.0, 0.1, 0.0, text="longest time constant"),
        Param("r_2", "1", 1e-3, 1.0, 0.5, "log", "shape", "second time constant over the longest"),
        Param("r_3", "1", 1e-3, 1.0, 0.25, "log", "shape", "third time constant over the longest"),
        Param("r_4", "1", 1e-3, 1.0, 0.125, "log", "shape", "fourth time constant over the longest"),
        Param("r_w", "1", 1e-2, 10.0, 0.375, "log", "shape", "time constant of the zeros over the longest"),
        Param("xi", "1", 0.01, 5.0, 0.7, "log", "shape", "damping ratio of the zeros"),
    ),
    neutral=(0.0, 0.5, 0.25, 0.125, 0.375, 0.7),
    aliases=("hammerstein-wiener",),
    experiment="sines of one peak speed at three or more frequencies at constant current: the loop in force-velocity "
    "widens with frequency, and quasi-static strokes have none",
    proposed=False,
)


OWN = 4 * 7


def rest(now: Values, theta: Values) -> State:
    """Return the states of the poles in N, at rest."""
    return now[0], now[0], now[0], now[0]


def step(state: State, before: Values, now: Values, theta: Ends, dt: float, past: Array) -> tuple[float, State]:
    """Return the force in N behind H at the end of a step, and the states of the poles."""
    slowest, second, third, fourth, turn, xi = theta[1]
    if slowest <= 0.0:
        return now[0], (now[0], now[0], now[0], now[0])
    pole = 1.0 / max(slowest, SHORTEST)
    poles = (pole, pole / second, pole / third, pole / fourth)
    h1, h2, h3, h4 = cascade_step(state, poles, (before[0], now[0]), dt, past, 0)
    zeros = (2.0 * xi * turn / pole, (turn / pole) ** 2)
    return passed(poles, zeros, (h1, h2, h3, h4), now[0], 0.0), (h1, h2, h3, h4)


_stepped = rows_of(SPEC, rest, step, OWN)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), behind H; theta (P, 6), T in s."""
    if isinstance(dt, np.ndarray):
        return _stepped(output, theta, dt)
    force = output.copy()
    moved = np.flatnonzero(theta[:, 0] > 0.0)
    if len(moved):
        slowest, second, third, fourth, turn, xi = theta[moved].T
        slowest = np.maximum(slowest, SHORTEST)
        poles = 1.0 / (slowest[:, None] * np.column_stack([np.ones(len(moved)), second, third, fourth]))
        force[moved] = hysteresis_filter(plain(output[moved]), poles, turn * slowest, xi, dt)
    return force
