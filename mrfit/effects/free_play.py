"""Free play: a clearance between rod and damper, within which the rod moves alone.

    v_d = v*(1 - g) + g*dx_d/dt,    x_d = max(x - w, min(x + w, x_d before))

x displacement of the rod (m), v its velocity (m/s), x_d displacement of the damper (m), v_d the velocity that the base
sees (m/s), w half of the clearance (m), g the share of the motion that is lost in it (1): all with 1, less with
friction in the clearance. The damper stands still until the rod has crossed the clearance, and then moves with it. w
does nothing while g is 0. The rod starts in the middle. What a base makes of the stroke itself, as a spring, is that of
the rod.

Source: play operator, M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), ch. 1; backlash as in
M. Nordin, P.-O. Gutman, Automatica 38 (2002) 1633, its model without a shaft between the sides.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Ends, Param, State, Steps, Values
from mrfit.kernels.elements import response_of

SPEC = EffectSpec(
    name="free-play",
    title="Clearance between rod and damper",
    equation="v_d = v*(1 - g) + g*dx_d/dt,  x_d = max(x - w, min(x + w, x_d before))",
    reference="Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989), ch. 1; Nordin and Gutman (2002)",
    slot="input",
    outputs=("force",),
    inputs=("displacement", "velocity"),
    params=(
        Param("g", "1", 0.0, 1.0, 0.0, text="share of the motion that is lost in the clearance"),
        Param("w", "m", 2e-5, 0.02, 5e-4, "log", "shape", "half of the clearance"),
    ),
    neutral=(0.0, 5e-4),
    aliases=("hysteretic-biviscous", "slip-lock", "backlash"),
    experiment="one frequency at three or more amplitudes: behind every turn the force of a clearance rests over the "
    "same travel 2w, that of a law with a pre-yield loop over a part of the velocity; in triangular strokes it is back "
    "at once, behind a backlash by degrees",
)


def rest(now: Values, theta: Values) -> State:
    """Return the damper's displacement in m, in the middle of the clearance."""
    return (now[0],)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the damper's velocity in m/s at the end of a step, and its displacement in m."""
    (damper,) = state
    x, v = now
    g, w = theta[1]
    following, travel = max(x - w, min(x + w, damper)), x - before[0]
    # of a step within which the rod has crossed the clearance the damper makes a part
    moved = 1.0 if abs(x - damper) >= w else 0.0
    if travel != 0.0:
        moved = (following - damper) / travel
    return v * (1.0 - g * (1.0 - moved)), (following,)


_stepped = response_of(SPEC, rest, step)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the damper's velocity in m/s, shape (N,); theta is (g, w), w in m."""
    drive = np.stack([channels["displacement"], channels["velocity"]])
    return {"velocity": _stepped(drive, theta[None], dt)[0]}
