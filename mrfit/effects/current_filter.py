"""Current filter: the magnetisation dynamics M(s) of the Hammerstein-Wiener damper, from coil current to field.

    i_sim = M(s)*i,    M(s) = (1 + r_z*T*s)/((1 + T*s)*(1 + r_2*T*s))*exp(-tau*s)

i current (A), i_sim the current that the base sees (A), T the longest time constant (s), which is 1/q1 of
``hammerstein-wiener``, r_2 = q1/q2 (1) and r_z = q1/zero (1) the other time constants as shares of it, tau delay (s).
The time constants are 0 together, so that M is proper for every T; its gain is 1. r_2 and r_z do nothing while T is 0.
M is exact for a current that is linear between samples, and at rest at the first.

Source: Savaia et al. eq. 7.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, State, Steps, Values
from mrfit.kernels.dynamics import magnetisation_filter
from mrfit.kernels.elements import response_of
from mrfit.kernels.lti import SHORTEST, cascade_step, delayed, passed
from mrfit.kernels.past import late
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="current-filter",
    title="Magnetisation dynamics M(s) from current to field",
    equation="i_sim = M(s)*i,  M(s) = (1 + r_z*T*s)/((1 + T*s)*(1 + r_2*T*s))*exp(-tau*s)",
    reference="Savaia et al. eq. 7",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(
        Param("T", "s", 0.0, 0.2, 0.0, text="longest time constant"),
        Param("r_2", "1", 1e-3, 1.0, 0.15, "log", "shape", "second time constant over the longest"),
        Param("r_z", "1", 1e-3, 10.0, 0.3, "log", "shape", "time constant of the zero over the longest"),
        Param("tau", "s", 0.0, 0.05, 0.0, text="delay"),
    ),
    neutral=(0.0, 0.15, 0.3, 0.0),
    aliases=("hammerstein-wiener",),
    experiment="current steps up and down at constant speed: the force follows with the delay and both time "
    "constants; sines at constant current cannot show them",
    proposed=False,
)


LATE, OWN = 1, 2 * 5


def longest(theta: Values) -> float:
    """Return the greatest age in s of the current that a step reads."""
    return theta[3]


def rest(now: Values, theta: Values) -> State:
    """Return the current in A, that of the delay ago, and the states of the poles, at rest."""
    return now[0], now[0], now[0], now[0]


def step(state: State, before: Values, now: Values, theta: Ends, dt: float, past: Array) -> tuple[float, State]:
    """Return the magnetising current in A at the end of a step, and the state."""
    slowest, second, lead, tau = theta[1]
    _, start, m1, m2 = state
    ago = late(past, 0, tau, dt, now[0])
    if slowest <= 0.0:
        return ago, (now[0], ago, ago, ago)
    pole = 1.0 / max(slowest, SHORTEST)
    poles = (pole, pole / second)
    m1, m2 = cascade_step((m1, m2), poles, (start, ago), dt, past, 0)
    return passed(poles, (lead / pole, 0.0), (m1, m2), ago, 0.0), (now[0], ago, m1, m2)


_stepped = response_of(SPEC, rest, step, LATE, OWN)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the magnetising current in A, shape (N,); theta is (T, r_2, r_z, tau), T and tau in s."""
    slowest, second, lead, tau = theta
    current = plain(channels["current"])
    if isinstance(dt, np.ndarray):
        return {"current": _stepped(current[None], theta[None], dt)[0]}
    if slowest <= 0.0:
        return {"current": delayed(current, np.array([tau / dt]))[0]}
    pole = 1.0 / max(slowest, SHORTEST)
    poles = np.array([[pole, pole / second]])
    return {"current": magnetisation_filter(current, poles, np.array([lead / pole]), np.array([tau]), dt)[0]}
