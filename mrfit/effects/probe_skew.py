"""Probe skew: the current probe is late or early against the voltage from which the flux was integrated.

    flux_measured(t) = flux(i(t + tau))

i current as recorded (A), flux (Wb), tau time (s) by which the record of the current is late; negative if it is
early. The current is shifted by cubic Lagrange interpolation, its ends held.

The reconstruction integral(u - R*i) dt used the late current too, which adds R*tau*i to the measured flux: a term in
phase with the current that the base's inductance takes up. An inductance fitted beside this effect is L + R*tau.

Source: Tang et al. eq. 3, with i(t - tau) for i; interpolation after Laakso et al., IEEE Signal Processing Magazine 13
(1996) 30.
"""

import numpy as np

from mrfit.kernels.filters import shifted
from mrfit.kernels.theta import plain
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="probe-skew",
    title="Current probe late or early against the voltage",
    equation="flux_measured(t) = flux(i(t + tau))",
    reference="Tang et al. eq. 3, with i(t - tau) for i",
    slot="input",
    outputs=("flux",),
    inputs=("current",),
    params=(Param("tau", "s", -5e-3, 5e-3, 0.0, text="time by which the record of the current is late"),),
    neutral=(0.0,),
    aliases=("eddy-current", "resistance-error", "boucwen-flux"),
    experiment="sines up to frequencies at which eddy currents also shrink the flux, 1/(2*pi*tau): a skew turns the "
    "phase only; or both probes on one known resistor, whose current and voltage have no skew",
)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the current in A, shape (N,), as it was beside the voltage; theta is (tau,) in s."""
    return {"current": shifted(plain(channels["current"])[None], np.array([-theta[0] / dt]))[0]}
