"""Slip-lock: the loop is pinched where it passes zero, as where a joint slips before it locks again.

    v_d = v*(1 - zeta*exp(-((z*sign(v) - q)/w)^2)),    dz/dt = (v - |v|*z)/d

v velocity of the rod (m/s), v_d the velocity that the base sees (m/s), zeta the share of the motion that is lost where
the joint slips (1), z (1) the memory of the travel, from -1 to 1, d the travel over which it forgets (m), q where it
slips (1), from -1 behind a turn to 1 far from it, w over which part of the turn (1). The travel that is lost comes back
after every turn. All but zeta do nothing while zeta is 0. z starts at 0.

Source: T. T. Baber, M. N. Noori, J. Eng. Mech. 111 (1985) 1010 (slip-lock element); G. C. Foliente, J. Struct. Eng. 121
(1995) 1013, its pinching function, which multiplies the motion of the hysteretic part.
"""

import math

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import response_of

SPEC = EffectSpec(
    name="slip-lock",
    title="Loop pinched by a joint that slips and locks",
    equation="v_d = v*(1 - zeta*exp(-((z*sign(v) - q)/w)^2)),  dz/dt = (v - |v|*z)/d",
    reference="Baber and Noori, J. Eng. Mech. 111 (1985) 1010; Foliente, J. Struct. Eng. 121 (1995) 1013",
    slot="input",
    outputs=("force",),
    inputs=("velocity",),
    params=(
        Param("zeta", "1", 0.0, 0.98, 0.0, text="share of the motion that is lost where the joint slips"),
        Param("d", "m", 1e-5, 0.05, 2e-3, "log", "shape", "travel over which the loop turns"),
        Param("q", "1", -0.6, 0.8, 0.0, "linear", "shape", "where in the turn it slips"),
        Param("w", "1", 0.1, 1.0, 0.4, "log", "shape", "over which part of the turn it slips"),
    ),
    neutral=(0.0, 2e-3, 0.0, 0.4),
    aliases=("free-play", "backlash"),
    experiment="triangular strokes of one speed at three amplitudes: a joint that slips loses force some travel behind "
    "a turn and has all of it just behind the turn, a clearance or a backlash has least of it there",
    asks=(Programme(waveform="triangle", amplitudes=3),),
)


def rest(now: Values, theta: Values) -> State:
    """Return the memory of the travel, none."""
    return (0.0,)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the velocity in m/s that the base sees at the end of a step, and the memory of the travel."""
    (z,) = state
    zeta, d, q, w = theta[1]
    v = now[0]
    travel = 0.5 * (before[0] + v) * dt
    side = math.copysign(1.0, travel)
    z = z + math.expm1(-abs(travel) / d) * (z - side)
    return v * (1.0 - zeta * math.exp(-(((math.copysign(z, z * v) - q) / w) ** 2))), (z,)


_stepped = response_of(SPEC, rest, step)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the velocity in m/s, shape (N,), that the base sees; theta is (zeta, d, q, w), d in m."""
    return {"velocity": _stepped(np.asarray(channels["velocity"])[None], theta[None], dt)[0]}
