"""Backlash: each side of a joint carries its force only after some travel towards it.

    F = F_base*(1 - d*(1 - e^p)),    e = (1 + sign(F_base)*(x - y)/w)/2,    y = max(x - w, min(x + w, y before))

x displacement (m), F force (N), y the middle of the joint (m), w half of the travel between its sides (m), d the share
of the force (1) that is lost on the side that was left, e how far the other is engaged (1), p how late it takes up the
force (1): evenly with 1, at the end with a large one. w and p do nothing while d is 0. The joint starts in its middle.

Source: play and stop operators, M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), ch. 1; a force
that a gap takes up over a travel: Y. K. Wen, J. Eng. Mech. Div. ASCE 102 (1976) 249; T. T. Baber, M. N. Noori, J. Eng.
Mech. 111 (1985) 1010.
"""

import math

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.elements import rows_of

SPEC = EffectSpec(
    name="backlash",
    title="Force taken up over a travel behind every turn",
    equation="F = F_base*(1 - d*(1 - e^p)),  e = (1 + sign(F_base)*(x - y)/w)/2,  y = max(x - w, min(x + w, y before))",
    reference="Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989), ch. 1; Wen (1976)",
    slot="output",
    outputs=("force",),
    inputs=("displacement",),
    params=(
        Param("d", "1", 0.0, 1.0, 0.0, text="share of the force that is lost behind a turn"),
        Param("w", "m", 1e-5, 0.02, 5e-4, "log", "shape", "half of the travel over which it comes back"),
        Param("p", "1", 0.5, 16.0, 2.0, "log", "shape", "how late it comes back"),
    ),
    neutral=(0.0, 5e-4, 2.0),
    aliases=("free-play", "slip-lock"),
    experiment="triangular strokes of one amplitude at two or more speeds and currents: the share of the force that is "
    "lost behind a turn is the same in all and comes back by degrees, that of a clearance comes back at once",
    asks=(Programme(waveform="triangle", speeds=2, currents=2),),
)


def rest(now: Values, theta: Values) -> State:
    """Return the middle of the joint in m."""
    return (now[1],)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the force in N at the end of a step, and the middle of the joint in m."""
    (y,) = state
    force, x = now
    d, w, p = theta[1]
    y = max(x - w, min(x + w, y))
    engaged = max(0.5 + 0.5 * math.copysign(1.0, force) * (x - y) / w, 0.0)
    return force * (1.0 - d * (1.0 - engaged**p)), (y,)


_stepped = rows_of(SPEC, rest, step)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: Steps) -> Array:
    """Return the force in N, shape (P, N), of a joint with backlash; theta (P, 3), w in m."""
    return _stepped(output, theta, dt, channels["displacement"])
