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
eq. 3 is the effect ``temperature``; poles and zeros of its Tables 1-2 are lost in print. The same as a chain of which
links can be left out is ``hw-static+current-filter+force-filter``. Where parameters vary along the samples, as they do
with temperature, poles, zeros and delay keep the values of the first.
"""

from typing import Any

import numpy as np

from mrfit.core.specs import Array, Ends, Index, ModelSpec, Param, State, Steps, Values
from mrfit.kernels.dynamics import hysteresis_filter, magnetisation_filter
from mrfit.kernels.elements import response_of
from mrfit.kernels.jit import kernel
from mrfit.kernels.lti import cascade_step, passed
from mrfit.kernels.past import late
from mrfit.kernels.points import inside
from mrfit.kernels.theta import by_blocks, columns, plain
from mrfit.kernels.wiener import wiener
from mrfit.models import hw_static

_STATIC = hw_static.SPEC.params[:-1]
_OFFSET = hw_static.SPEC.params[-1]
STAGES = hw_static.STAGES

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
        *_STATIC,
        Param("p1", "1/s", 1.0, 1e4, 150.0, "log", "hysteresis", "pole of H"),
        Param("p2", "1/s", 1.0, 1e4, 300.0, "log", "hysteresis", "pole of H"),
        Param("p3", "1/s", 1.0, 1e4, 600.0, "log", "hysteresis", "pole of H"),
        Param("p4", "1/s", 1.0, 1e4, 1200.0, "log", "hysteresis", "pole of H"),
        Param("omega", "rad/s", 1.0, 1e4, 400.0, "log", "hysteresis", "frequency of H's zeros"),
        Param("xi", "1", 0.01, 5.0, 0.7, "log", "hysteresis", "damping ratio of H's zeros"),
        Param("q1", "1/s", 1.0, 1e4, 60.0, "log", text="pole of M"),
        Param("q2", "1/s", 1.0, 1e4, 400.0, "log", text="pole of M"),
        Param("zero", "1/s", 1.0, 1e4, 200.0, "log", text="zero of M", symbol="z_M"),
        Param("tau", "s", 0.0, 0.05, 0.002, text="delay of M"),
        _OFFSET,
    ),
    linear=hw_static.SPEC.linear,
)

# Poles and zeros of H to start from, over the frequency of the test
_ABOUT = {"p1": 0.3, "p2": 1.0, "p3": 10.0, "p4": 100.0, "omega": 0.5}


LATE, OWN = 1, 2 * 5 + 4 * 7
static_map: Any = kernel(hw_static.law)


def longest(theta: Values) -> float:
    """Return the greatest age in s of the current that a step reads."""
    return theta[13]


def rest(now: Values, theta: Values) -> State:
    """Return the current in A, that of the delay ago and the states of M, and the force in N and the states of H."""
    v, i = now
    force = static_map(v, i, theta[0], theta[1], theta[2], theta[3], 0.0)
    return i, i, i, i, force, force, force, force, force


def step(state: State, before: Values, now: Values, theta: Ends, dt: float, past: Array) -> tuple[float, State]:
    """Return the force in N at the end of a step, and the state."""
    _, (c_pre, c_post, a, b, p1, p2, p3, p4, omega, xi, q1, q2, zero, tau, f0) = theta
    v, i = now
    ago = late(past, 0, tau, dt, i)
    m1, m2 = cascade_step((state[2], state[3]), (q1, q2), (state[1], ago), dt, past, 0)
    magnetising = passed((q1, q2), (1.0 / zero, 0.0), (m1, m2), ago, 0.0)
    force = static_map(v, magnetising, c_pre, c_post, a, b, 0.0)
    before_h = (state[5], state[6], state[7], state[8])
    h1, h2, h3, h4 = cascade_step(before_h, (p1, p2, p3, p4), (state[4], force), dt, past, 2 * 5)
    zeros = (2.0 * xi / omega, 1.0 / omega**2)
    lagged = passed((p1, p2, p3, p4), zeros, (h1, h2, h3, h4), force, 0.0)
    return lagged + f0, (i, ago, m1, m2, force, h1, h2, h3, h4)


_stepped = response_of(SPEC, rest, step, LATE, OWN)


def response(drive: Array, theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), of velocity (m/s) and current (A), shape (2, N), sampled every dt s."""
    if isinstance(dt, np.ndarray):
        return _stepped(drive, theta, dt)
    return by_blocks(lambda block: _force(plain(drive), block, dt), drive.shape[1], theta)


def sensitivities(drive: Array, theta: Array, dt: float, places: Index) -> Array:
    """Return the force in N of velocity (m/s) and current (A), and its derivatives, as ``specs.Sensitivities`` says.

    The derivatives are exact; at the corner of the static map, and where the delay is a whole number of samples, they
    are those of one side. A vector with a value that is not finite gives NaN.
    """
    return wiener(plain(drive), plain(theta), dt, np.array(places, dtype=np.int64))


def start_values(drive: Array, output: Array, dt: float) -> dict[str, float]:
    """Return those of the static map."""
    return hw_static.start_values(drive, output, dt)


def far_starts(drive: Array, output: Array, dt: float) -> list[dict[str, float]]:
    """Return those of the static map, with poles and zeros of H about the frequency at which the velocity moves.

    What a test shows of H lies there; that frequency is the acceleration's root mean square over the velocity's.
    """
    speed = float(np.std(drive[0]))
    if not speed:
        return []
    about = float(np.sqrt(np.mean(np.diff(drive[0]) ** 2))) / (dt * speed)
    found = start_values(drive, output, dt) | {name: share * about for name, share in _ABOUT.items()}
    return [inside(SPEC, found)]


def _force(drive: Array, theta: Array, dt: float) -> Array:
    v, current = drive
    c_pre, c_post, a, b, *_, f0 = columns(theta)
    held = theta if theta.ndim == 2 else theta[:, :, 0]
    poles, omega, xi, q, zero, tau = np.split(held[:, 4:14], [4, 5, 6, 8, 9], axis=1)
    magnetising = magnetisation_filter(current, plain(q), 1.0 / zero[:, 0], tau[:, 0], dt)
    force = hw_static.law(v, magnetising, c_pre, c_post, a, b, np.zeros(1))
    lagged = hysteresis_filter(force, plain(poles), 1.0 / omega[:, 0], xi[:, 0], dt)
    lagged += f0
    return lagged
