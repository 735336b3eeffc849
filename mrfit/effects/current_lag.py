"""Current lag: the magnetic field, and with it the yield force, follows the current behind a first-order lag.

    d(i_sim)/dt = (i - i_sim)/tau

i current (A), i_sim the current that the base sees (A), tau time constant (s), 1/nu of inverse-tanh paper, which has
0.02 s.
The lag is exact for a current that is linear between samples; i_sim starts at the first sample.

Source: inverse-tanh paper eq. 9; the simplest M(s) of Savaia et al. eq. 7.
"""

import numpy as np

from mrfit.kernels.filters import lag
from mrfit.kernels.theta import plain
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="current-lag",
    title="Field lagging the current",
    equation="d(i_sim)/dt = (i - i_sim)/tau",
    reference="inverse-tanh paper eq. 9",
    slot="input",
    outputs=("force", "torque"),
    inputs=("current",),
    params=(Param("tau", "s", 0.0, 0.5, 0.0, text="time constant of the field"),),
    neutral=(0.0,),
    aliases=("delay", "residual-magnetism"),
    experiment="current steps at constant speed, up and down, to several levels: a lag rises exponentially, a delay "
    "keeps the edge, residual magnetism leaves an error that does not decay; sines at constant current cannot show "
    "it",
)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the current in A, shape (N,), that the field corresponds to; theta is (tau,) in s."""
    return {"current": lag(plain(channels["current"])[None], np.array([theta[0] / dt]))[0]}
