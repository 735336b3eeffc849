"""Slow release: the field follows a current that rises at once, and one that falls only by a part.

    i_eff = (1 - h)*i + h*y,    y = i where |i| rises above |y|,    else dy/dt = (i - y)/tau

i current (A), i_eff the current that the base sees (A), y what is released slowly (A), h its share (1), tau its time
constant (s). Parts of the current above and below 0 are followed each by itself. The current is linear between samples
and at rest at the first. Chains of particles form faster than they break up, and a core gives up its remanence slowly:
the force is late when a current goes, and not when it comes.

Source: first-order lag of the field, inverse-tanh paper eq. 9, for the way down only.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Breaks, EffectSpec, Ends, Invariance, Param, State, Steps, Values
from mrfit.kernels.elements import response_of
from mrfit.kernels.filters import release, released
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="slow-release",
    title="Field released slowly by a falling current",
    equation="i_eff = (1 - h)*i + h*y,  y = i where |i| rises above |y|, else dy/dt = (i - y)/tau",
    reference="inverse-tanh paper eq. 9, for the way down only",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(
        Param("h", "1", 0.0, 0.98, 0.0, text="share of the field that is released slowly"),
        Param("tau", "s", 1e-3, 2.0, 0.1, "log", "shape", "time constant of the release"),
    ),
    neutral=(0.0, 0.1),
    aliases=("current-lag", "residual-magnetism"),
    experiment="current steps up and down at constant speed, each level held until the force rests: the force rises at "
    "once and falls slowly, a lag is slow both ways, residual magnetism leaves an error that does not decay",
    breaks=Breaks(Invariance.CURRENT, sign=1),
)


def rest(now: Values, theta: Values) -> State:
    """Return the parts of the current above and below 0 in A, at rest."""
    return max(now[0], 0.0), max(-now[0], 0.0)


def step(state: State, before: Values, now: Values, theta: Ends, dt: float) -> tuple[float, State]:
    """Return the current in A that the field corresponds to at the end of a step, and the parts."""
    h, tau = theta[1]
    above, below = state
    if dt > 0.0:
        decay = math.exp(-dt / tau)
        follow = -math.expm1(-dt / tau) * tau / dt
        above = release(above, before[0], now[0], decay, follow)
        below = release(below, -before[0], -now[0], decay, follow)
    return now[0] + h * (above - below - now[0]), (above, below)


_stepped = response_of(SPEC, rest, step)


def transform(channels: dict[str, Array], theta: Array, dt: Steps) -> dict[str, Array]:
    """Return the current in A, shape (N,), that the field corresponds to; theta is (h, tau), tau in s."""
    current = plain(channels["current"])
    if isinstance(dt, np.ndarray):
        return {"current": _stepped(current[None], theta[None], dt)[0]}
    slow = released(current, float(theta[1] / dt))
    return {"current": current + float(theta[0]) * (slow - current)}
