"""Eddy currents: a loss path in parallel to the magnetising inductance, so that the flux lags the current.

    flux + tau*d(flux)/dt = flux_static(i)

i current (A), flux (Wb), tau time constant L/R_e (s) of inductance L and parallel loss resistance R_e. The loop's
area per cycle grows in proportion to frequency f as long as 2*pi*f*tau << 1.

The terminal current i = i_m + (1/R_e)*d(flux)/dt feeds the magnetising current i_m and the losses; with flux =
flux_static(i_m) this is, to first order in the losses, the lag above, with tau constant where the inductance is.

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, ch. 2 (core-loss resistance of the equivalent
circuit).
"""

from mrfit.kernels.filters import lag
from mrfit.kernels.theta import plain
from mrfit.specs import Array, EffectSpec, Param

SPEC = EffectSpec(
    name="eddy-current",
    title="Eddy currents in the core",
    equation="flux + tau*d(flux)/dt = flux_static(i)",
    reference="Fitzgerald, Kingsley, Umans, Electric Machinery, ch. 2: parallel core-loss resistance",
    slot="output",
    outputs=("flux",),
    inputs=(),
    params=(Param("tau", "s", 0.0, 0.05, 0.0, text="inductance over loss resistance"),),
    neutral=(0.0,),
    aliases=("probe-skew", "resistance-error", "boucwen-flux"),
    experiment="sines of one amplitude at three or more frequencies over a decade: its loop area grows with f, "
    "static hysteresis keeps its area, a resistance error's falls with 1/f; against probe skew, frequencies up to "
    "1/(2*pi*tau)",
)


def shape(output: Array, channels: dict[str, Array], theta: Array, dt: float) -> Array:
    """Return the flux in Wb behind the lag, shape (P, N), of the static flux (P, N) and tau (P, 1) in s."""
    return lag(plain(output), theta[:, 0] / dt)
