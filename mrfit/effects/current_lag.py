"""Current lag: the magnetic field, and with it the yield force, follows the current behind a first-order lag.

    d(i_sim)/dt = (i(t - t_d) - i_sim)/tau

i current (A), i_sim the current that the base sees (A), tau time constant (s), 1/nu of inverse-tanh paper, which has
0.02 s, t_d dead time before the field moves (s). A record does not show when between two samples a step was made: t_d
also takes up that, which else would bias tau, and may come out below 0 by a part of a sample. Between samples the
current is a parabola, since straight lines would blur its edges by dt^2/6 and tau be short of that; i_sim starts at the
first sample. No sample knows of those after it, but where t_d is below 0.

Source: inverse-tanh paper eq. 9; the simplest M(s) of Savaia et al. eq. 7, with its delay.
"""

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Index, Invariance, Param, Steps
from mrfit.kernels import uneven
from mrfit.kernels.filters import lag, lagged_bends, place
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


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the current in A, shape (N,), that the field corresponds to; theta is (tau, t_d) in s."""
    if isinstance(dt, np.ndarray):
        return {"current": _unevenly(plain(channels["current"]), float(theta[0]), float(theta[1]), dt)}
    current, ratio, shift = plain(channels["current"])[None], np.array([theta[0] / dt]), theta[1] / dt
    lagged = lag(current, ratio)[0]
    settled, now = lagged_bends(current, ratio)
    if shift == 0.0:
        return {"current": lagged - now[0]}
    at = place(current.shape[1], shift)
    return {"current": _late(current[0], lagged, ratio[0], at) - _between(settled[0], now[0], at, shift < 0.0)}


def _unevenly(current: Array, tau: float, dead: float, steps: Array) -> Array:
    """Return the same at uneven steps (N,), of a time constant and a dead time in s."""
    lagged = uneven.lag(current[None], np.array([tau]), steps)[0]
    settled, now = uneven.lagged_bends(current[None], np.array([tau]), steps)
    if dead == 0.0:
        return np.asarray(lagged - now[0])
    at = uneven.place(steps, dead)
    late = _late(current, lagged, tau / steps[at[0] + 1], at)
    return late - _between(settled[0], now[0], at, dead < 0.0)


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
