"""Free play: a clearance between rod and damper, within which the rod moves alone.

    v_d = v where x - w >= x_d or x + w <= x_d, else 0;    x_d = max(x - w, min(x + w, x_d before))

x displacement of the rod (m), v its velocity (m/s), x_d displacement of the damper (m), v_d the velocity that the base
sees (m/s), w half of the clearance (m). The damper stands still until the rod has crossed the clearance, and then moves
with it. The rod starts in the middle. What a base makes of the stroke itself, as a spring, is that of the rod.

Source: play operator, M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), ch. 1; backlash as in
M. Nordin, P.-O. Gutman, Automatica 38 (2002) 1633, its model without a shaft between the sides.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, State, Steps, Values
from mrfit.kernels.elements import response_of

SPEC = EffectSpec(
    name="free-play",
    title="Clearance between rod and damper",
    equation="v_d = v where x - w >= x_d or x + w <= x_d, else 0;  x_d = max(x - w, min(x + w, x_d before))",
    reference="Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989), ch. 1; Nordin and Gutman (2002)",
    slot="input",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(Param("w", "m", 0.0, 0.01, 0.0, text="half of the clearance"),),
    neutral=(0.0,),
    aliases=("hysteretic-biviscous",),
    experiment="one frequency at three or more amplitudes: behind every turn the force of a clearance rests over the "
    "same travel 2w, that of a law with a pre-yield loop over a part of the velocity",
    proposed=False,
)


def rest(now: Values, theta: Values) -> State:
    """Return the damper's displacement in m, in the middle of the clearance."""
    return (now[0],)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the damper's velocity in m/s at the end of a step, and its displacement in m."""
    (damper,) = state
    x, v = now
    (w,) = theta[1]
    closed = x - w >= damper or x + w <= damper
    return v if closed else 0.0, (max(x - w, min(x + w, damper)),)


_stepped = response_of(SPEC, rest, step)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the damper's velocity in m/s, shape (N,); theta is (w,) in m."""
    drive = np.stack([channels["displacement"], channels["velocity"]])
    return {"velocity": _stepped(drive, theta[None], dt)[0]}
