"""Resistance error: the coil resistance by which the flux was reconstructed is not that of the coil.

    flux_measured = flux - dR*integral(i - mean(i)) dt

i current (A), flux (Wb) reconstructed as integral(u - R*i) dt, dR = R used - R of the coil (ohm). Constant and drift
were taken from the measured flux, so they are taken from this term: the mean of i and the mean of the integral, both
under a Hann window, which an unfinished cycle does not bias. The loop's area per cycle falls in proportion to 1/f.

Source: Tang et al. eq. 3, with R + dR for R.
"""

from mrfit.core.specs import Array, EffectSpec, Param, Programme
from mrfit.kernels.filters import level, running_integral

SPEC = EffectSpec(
    name="resistance-error",
    title="Wrong coil resistance in the flux reconstruction",
    equation="flux_measured = flux - dR*integral(i - mean(i)) dt",
    reference="Tang et al. eq. 3, with R + dR for R",
    slot="record",
    outputs=("flux",),
    inputs=("current",),
    params=(
        Param("dR", "ohm", -5.0, 5.0, 0.0, text="resistance used minus resistance of the coil", symbol=r"\Delta R"),
    ),
    neutral=(0.0,),
    aliases=("eddy-current", "probe-skew", "resistance-heating", "boucwen-flux"),
    experiment="sines of one amplitude at three or more frequencies: its loop area falls with 1/f; or measure R by a "
    "direct current before and after each test, which also tells a constant error from heating",
    asks=(Programme(frequencies=3),),
)


def error(channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the flux in Wb, shape (P, N), that the error dR (P, 1) in ohm leaves in the reconstruction."""
    current = channels["current"]
    charge = running_integral(current - level(current), dt)
    return -theta[:, :1] * (charge - level(charge))
