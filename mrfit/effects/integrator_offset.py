"""Integrator offset: a constant voltage in the integrator's input, so that the flux drifts along a straight line.

    flux_measured = flux + offset*(t - mean(t))

t time (s), flux (Wb), offset voltage (V). It shows where the flux was recorded by an integrating instrument, or where
the reconstruction could not take the drift away; the flux stage removes it from all that repeats in whole cycles. The
term needs the time: it does not repeat from cycle to cycle.

Source: Tang et al. eq. 3, with u + offset for u.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="integrator-offset",
    title="Drift of the flux integrator",
    equation="flux_measured = flux + offset*(t - mean(t))",
    reference="Tang et al. eq. 3, with u + offset for u",
    slot="record",
    outputs=("flux",),
    inputs=("time",),
    params=(Param("offset", "V", -0.1, 0.1, 0.0, role="offset", text="voltage at the integrator", symbol="u_0"),),
    neutral=(0.0,),
    aliases=("resistance-heating",),
    experiment="record with the leads shorted and no current: an offset goes on drifting, heating does not",
    steady=False,
)


def error(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the drift in Wb, shape (P, N), of an offset (P, 1) in V."""
    time = channels["time"]
    drift: Array = theta[:, :1] * (time - np.mean(time))
    return drift
