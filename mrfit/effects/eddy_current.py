"""Eddy currents: a loss path in parallel to the magnetising inductance takes part of the current.

    flux = flux_static(i_m),    i_m = i - G*d(flux)/dt

i terminal current (A), i_m the magnetising part of it, flux (Wb), G conductance of the loss path (S), the inverse of
the equivalent circuit's core-loss resistance. The flux lags the current by G times the local inductance; the loop's
area per cycle grows in proportion to frequency as long as that lag is short.

Over one interval flux and magnetising current lie on the chord between their values at its ends, of inductance
L = d(flux)/d(i_m), and the terminal current on a straight line: i_m is then the lag of i with time constant G*L. The
chords are found by iteration, from those of the static flux; each round is a lag with the chords of the last.

Source: A. E. Fitzgerald, C. Kingsley, S. D. Umans, Electric Machinery, ch. 2 (core-loss resistance of the equivalent
circuit).
"""

from collections.abc import Callable

import numpy as np

from mrfit.core.specs import Array, EffectSpec, Param, Programme, Steps
from mrfit.kernels.filters import chord_lag
from mrfit.kernels.theta import plain

# Change of the magnetising current at which the rounds end, as a share of the current's range, each change being a
# tenth or less of the last: far below what a derivative by differences would see; 6 to 18 rounds reach it
SETTLED, ROUNDS = 1e-10, 60

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
    asks=(Programme(frequencies=3, ratio=10.0),),
)


def closed(simulate: Callable[[Array], Array], current: Array, theta: Array, dt: Steps) -> Array:
    """Return the flux in Wb, shape (N,), of the terminal current (N,) in A; theta is (G,) in S.

    ``simulate`` maps the magnetising current (N,) to the static flux (N,).
    """
    flux, here = simulate(current), current
    extent = float(np.ptp(current))
    if not (theta[0] > 0.0 and extent > 0.0):
        return flux
    for _ in range(ROUNDS):
        there = chord_lag(plain(current), plain(here), plain(flux), theta[0], np.atleast_1d(np.float64(dt)))
        change = float(np.max(np.abs(there - here)))
        here, flux = there, simulate(there)
        if not change > SETTLED * extent:
            break
    return flux
