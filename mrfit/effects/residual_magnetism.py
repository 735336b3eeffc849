"""Residual magnetism: the field keeps part of what an earlier current made of it.

    i_eff(t) = max(i(t) - w, min(i(t) + w, i_eff before))

i current (A), i_eff the current that the base sees (A), w half-width of the play between them (A): the coercive
current of core and fluid. The play starts demagnetised, at 0. After a current has gone back to 0 the yield force
stays that of w. It is the core that remembers: what it makes of the current then lags and saturates, so that this
effect acts first of those that change the current.

Source: play operator, M. A. Krasnosel'skii, A. V. Pokrovskii, Systems with Hysteresis (1989), ch. 1.
"""

from mrfit.core.specs import Array, Breaks, EffectSpec, Ends, Invariance, Param, State, Values
from mrfit.kernels.filters import play
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="residual-magnetism",
    title="Field remembering earlier currents",
    equation="i_eff(t) = max(i(t) - w, min(i(t) + w, i_eff before))",
    reference="play operator, Krasnosel'skii and Pokrovskii, Systems with Hysteresis (1989), ch. 1",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(Param("w", "A", 0.0, 1.0, 0.0, text="half-width of the play, the coercive current"),),
    neutral=(0.0,),
    aliases=("current-lag", "slow-release"),
    experiment="current up and down in stairs at constant speed, each step held until the force rests, once fast and "
    "once slowly: residual magnetism leaves different forces on the way up and down at any rate, a lag does not",
    breaks=Breaks(Invariance.CURRENT, sign=1),
    turn=-1,
)


def rest(now: Values, theta: Values) -> State:
    """Return the current in A at which the play rests, from 0."""
    (w,) = theta
    return (max(now[0] - w, min(now[0] + w, 0.0)),)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the effective current in A at the end of a step, twice."""
    (w,) = theta[1]
    y = max(now[0] - w, min(now[0] + w, state[0]))
    return y, (y,)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the effective current in A, shape (N,); theta is (w,) in A."""
    return {"current": play(plain(channels["current"]), theta[0])}
