"""Current lag: the magnetic field, and with it the yield force, follows the current behind a first-order lag.

    d(i_sim)/dt = (i(t - t_d) - i_sim)/tau

i current (A), i_sim the current that the base sees (A), tau time constant (s), 1/nu of inverse-tanh paper, which has
0.02 s, t_d dead time before the field moves (s). A record does not show when between two samples a step was made: t_d
also takes up that, which else would bias tau, and may come out below 0 by a part of a sample. Between samples the
current is a parabola, since straight lines would blur its edges by dt^2/6 and tau be short of that; i_sim starts at the
first sample. No sample knows of those after it, but where t_d is below 0.

Source: inverse-tanh paper eq. 9; the simplest M(s) of Savaia et al. eq. 7, with its delay.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Ends, Index, Invariance, Param, State, Steps, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.filters import bend_step, lag, lag_step, lagged_bends
from mrfit.kernels.filters import place as place_before
from mrfit.kernels.past import age_of, kept, place
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="current-lag",
    title="Field lagging the current",
    equation="d(i_sim)/dt = (i(t - t_d) - i_sim)/tau",
    reference="inverse-tanh paper eq. 9",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(
        Param("tau", "s", 0.0, 0.5, 0.0, text="time constant of the field"),
        Param("t_d", "s", -0.005, 0.05, 0.0, "linear", "shape", "dead time before the field moves"),
    ),
    neutral=(0.0, 0.0),
    aliases=("delay", "residual-magnetism", "slow-release"),
    experiment="current steps at constant speed, up and down, to several levels: a lag rises exponentially, a delay "
    "keeps the edge, residual magnetism leaves an error that does not decay; sines at constant current cannot show "
    "it",
    breaks=Breaks(Invariance.CURRENT, sign=1, alike=("delay",)),
    # from no lag a search may end at a dead time alone, of which the best is a minimum of its own
    starts=((0.01, 0.0), (0.05, 0.0)),
)


LATE = 4


def longest(theta: Values) -> float:
    """Return the greatest age in s of the signals that a step reads."""
    return max(theta[1], 0.0)


def rest(now: Values, theta: Values) -> State:
    """Return current and lagged current in A, and that nothing has bent them."""
    return now[0], now[0], 0.0, 0.0, 0.0, 0.0, 0.0


def step(state: State, before: Values, now: Values, theta: Ends, dt: float, past: Array) -> tuple[float, State]:
    """Return the current in A that the field corresponds to at the end of a step, and the state.

    The state is the current, the lagged one, by how much that overshoots as far as it is known now, and what is known
    of that one step before; then second derivative, slope and length of the step.
    """
    tau, dead = theta[1]
    lagged = lag_step(state[1], before[0], now[0], tau, dt)
    bend = state[3], state[4], state[5], state[6]
    guess, settled, curvature, slope, length = bend_step(bend, before[0], now[0], tau, dt)
    following = now[0], lagged, guess, settled, curvature, slope, length
    if dead <= 0.0:
        return lagged - guess, following
    back, share = place(past, dead, dt)
    older, newer = kept(past, 0, back), now[0] if back == 1 else kept(past, 0, back - 1)
    ratio = tau / max(age_of(past, back, dt) - age_of(past, back - 1, dt), 1e-300)
    stays = math.exp(-share / ratio) if ratio > 0.0 else (1.0 if share == 0.0 else 0.0)
    value = older + share * (newer - older) + stays * (kept(past, 1, back) - older)
    one = settled if back == 1 else kept(past, 3, back - 1)
    other = guess if back == 1 else (settled if back == 2 else kept(past, 3, back - 2))
    return value - ratio * (1.0 - stays) * (newer - older) - (one + share * (other - one)), following


_stepped = response_of(SPEC, rest, step, LATE)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the current in A, shape (N,), that the field corresponds to; theta is (tau, t_d) in s."""
    current, shift = plain(channels["current"])[None], theta[1]
    if isinstance(dt, np.ndarray):
        return {"current": _stepped(current, theta[None], dt)[0]}
    ratio, shift = np.array([theta[0] / dt]), shift / dt
    lagged = lag(current, ratio)[0]
    settled, now = lagged_bends(current, ratio)
    if shift == 0.0:
        return {"current": lagged - now[0]}
    at = place_before(current.shape[1], shift)
    return {"current": _late(current[0], lagged, ratio[0], at) - _between(settled[0], now[0], at, shift < 0.0)}


def _late(current: Array, lagged: Array, ratio: float | Array, at: tuple[Index, Array]) -> Array:
    """Return the lagged current (N,) at other times, by the law of the lag between samples.

    ``ratio`` is tau over the step in which such a time lies; ``at`` the sample before each, and its share of the step.
    """
    before, share = at
    rise = current[before + 1] - current[before]
    kept = np.exp(-share / ratio) if np.all(ratio > 0.0) else (share == 0.0).astype(np.float64)
    late: Array = current[before] + share * rise + kept * (lagged - current)[before] - ratio * (1.0 - kept) * rise
    return late


def _between(settled: Array, now: Array, at: tuple[Index, Array], early: bool) -> Array:
    """Return a signal (N,) at other times, linear between samples; ``now`` is what each sample knows."""
    before, share = at
    after = before + 1
    known = (after < np.arange(len(settled))) | early
    following = np.where(known, settled[after], now[after])
    late: Array = settled[before] + share * (following - settled[before])
    return late
