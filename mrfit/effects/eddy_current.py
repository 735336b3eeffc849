"""Eddy currents: a loss path in parallel to the magnetising inductance takes part of the current.

    flux = flux_static(i_m),    i_m = i - G*d(flux)/dt

i terminal current (A), i_m the magnetising part of it, flux (Wb), G conductance of the loss path (S), the inverse of
the equivalent circuit's core-loss resistance. The flux lags the current by G times the local inductance; the loop's
area per cycle grows in proportion to frequency as long as that lag is short.

The equation is solved by iteration. With L0 the mean inductance, w = flux - L0*i_m, and H the lag of time constant
G*L0, it reads i_m = H[i] - (w - H[w])/L0, of which the last term vanishes for a linear coil: a fixed point, reached
by steps mixed after Anderson. Where the inductance falls to a third, an error of 2e-4 of the range is left.

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, ch. 2 (core-loss resistance of the equivalent
circuit); D. G. Anderson, Journal of the ACM 12 (1965) 547 (mixing).
"""

from collections.abc import Callable

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param
from mrfit.kernels.filters import lag
from mrfit.kernels.theta import plain

# A fixed number: the flux stays a smooth function of the parameters
STEPS = 6

SPEC = EffectSpec(
    name="eddy-current",
    title="Eddy currents in the core",
    equation="flux = flux_static(i_m),  i_m = i - G*d(flux)/dt",
    reference="Fitzgerald, Kingsley, Umans, Electric Machinery, ch. 2: parallel core-loss resistance",
    slot="loop",
    outputs=("flux",),
    inputs=("current",),
    params=(Param("G", "S", 0.0, 5.0, 0.0, text="conductance of the loss path, 1 over the core-loss resistance"),),
    neutral=(0.0,),
    aliases=("probe-skew", "resistance-error", "boucwen-flux"),
    experiment="sines of one amplitude at three or more frequencies over a decade: its loop area grows with f, "
    "static hysteresis keeps its area, a resistance error's falls with 1/f; against probe skew, frequencies up to "
    "1/(2*pi*G*L), L the inductance",
)


def closed(simulate: Callable[[Array], Array], current: Array, theta: Array, dt: float) -> Array:
    """Return the flux in Wb, shape (N,), of the terminal current (N,) in A; theta is (G,) in S.

    ``simulate`` maps the magnetising current (N,) to the static flux (N,).
    """
    flux = simulate(current)
    inductance = float(np.ptp(flux)) / max(float(np.ptp(current)), 1e-300)
    ratio = theta[:1] * inductance / dt
    if not (np.isfinite(inductance) and ratio[0] > 0.0):
        return flux
    lagged = lag(plain(current)[None], ratio)[0]
    here, before = current, None
    for _ in range(STEPS):
        bend = flux - inductance * here
        there = lagged - (bend - lag(plain(bend)[None], ratio)[0]) / inductance
        step = there - here
        here = there if before is None else there - _share(step, step - before[1]) * (there - before[0])
        before = there, step
        flux = simulate(here)
    return flux


def _share(step: Array, change: Array) -> float:
    """Return by how much of the last change a step is to be taken back, so that what is left of it is least."""
    power = float(change @ change)
    return float(step @ change) / power if power > 0.0 else 0.0
