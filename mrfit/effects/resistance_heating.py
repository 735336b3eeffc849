"""Resistance heating: the coil warms by its own losses and its resistance rises above the one the flux was made with.

    flux_measured = flux + r*integral(E*i - mean(E*i)) dt,    E(t) = integral from the record's start of i^2 dt

i current (A), flux (Wb) reconstructed as integral(u - R*i) dt with the R of the record's start, E heat over R
(A^2*s), r rise of resistance per E (ohm/A^2/s), R^2 times temperature coefficient over heat capacity. The coil does
not cool in this form: it holds for records that are short against its thermal time constant. Means are taken as in
``resistance-error``. Before the first sample that is simulated, E is the mean heating rate times the time since the
record's start, and what the recorded current made beyond that: the term does not repeat from cycle to cycle.

Source: Tang et al. eq. 3, with R*(1 + alpha*dT) for R and an adiabatic coil.
"""

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.kernels.filters import level, running_integral

SPEC = EffectSpec(
    name="resistance-heating",
    title="Coil resistance rising with the heat of its current",
    equation="flux_measured = flux + r*integral(E*i - mean(E*i)) dt,  E = integral(i^2) dt from the record's start",
    reference="Tang et al. eq. 3, with the resistance of an adiabatic coil",
    slot="record",
    outputs=("flux",),
    inputs=("current", "time", "heat_before"),
    params=(Param("r", "ohm/A^2/s", 0.0, 1.0, 0.0, text="rise of resistance per integral of i^2"),),
    neutral=(0.0,),
    aliases=("resistance-error", "integrator-offset"),
    experiment="one long record of many cycles at high current: loops widen from the first cycle to the last, where "
    "a constant error widens all alike; or measure R by a direct current before and after; alternating current "
    "tells it from an integrator's offset",
    steady=False,
)


def error(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the flux in Wb, shape (P, N), that a rise r (P, 1) in ohm/A^2/s leaves in the reconstruction."""
    current, time = channels["current"], channels["time"]
    begun = float(np.mean(current**2)) * time[0] + channels["heat_before"][0]
    heat = begun + running_integral(current**2, dt)
    drop = heat * current
    linkage = running_integral(drop - level(drop), dt)
    return theta[:, :1] * (linkage - level(linkage))
