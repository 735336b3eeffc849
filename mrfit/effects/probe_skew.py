"""Probe skew: the current probe is late or early against the voltage from which the flux was integrated.

    flux_measured(t) = flux(i(t + tau)) + R*integral from t to t + tau of i

i current as recorded (A), flux (Wb), tau time (s) by which the record of the current is late; negative if it is
early. R (ohm) is the resistance by which the flux was reconstructed, 0 where it was measured: integral(u - R*i) dt used
the late current too, which leaves the charge that the record had not yet shown. That is nearly R*tau*i, half of tau
before the current, so that an inductance takes up most but not all of it. Current and charge are shifted by cubic
Lagrange interpolation, their ends held.

Source: Tang et al. eq. 3, with i(t - tau) for i; interpolation after Laakso et al., IEEE Signal Processing Magazine 13
(1996) 30.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.kernels.filters import level, running_integral, shifted
from mrfit.kernels.theta import plain

SPEC = EffectSpec(
    name="probe-skew",
    title="Current probe late or early against the voltage",
    equation="flux_measured(t) = flux(i(t + tau)) + R*integral from t to t + tau of i",
    reference="Tang et al. eq. 3, with i(t - tau) for i",
    slot="input",
    outputs=("flux",),
    inputs=("current", "flux_resistance"),
    params=(Param("tau", "s", -5e-3, 5e-3, 0.0, text="time by which the record of the current is late"),),
    neutral=(0.0,),
    aliases=("eddy-current", "resistance-error", "boucwen-flux"),
    experiment="sines up to frequencies at which eddy currents also shrink the flux, 1/(2*pi*tau): a skew turns the "
    "phase only; or both probes on one known resistor, whose current and voltage have no skew",
)


def transform(channels: dict[str, Array], theta: Array, dt: float) -> dict[str, Array]:
    """Return the current in A, shape (N,), as it was beside the voltage; theta is (tau,) in s."""
    return {"current": shifted(plain(channels["current"])[None], np.array([-theta[0] / dt]))[0]}


def error(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the flux in Wb, shape (P, N), that the reconstruction gains from a current late by tau (P, 1) in s."""
    current, tau = channels["current"], theta[:, :1]
    middle = level(current)
    charge = plain(running_integral(current - middle, dt))
    yet = shifted(np.repeat(charge[None], len(tau), axis=0), -tau[:, 0] / dt) - charge
    gained: Array = channels["flux_resistance"] * (yet + middle * tau)
    return gained
