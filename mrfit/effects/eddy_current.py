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

from mrfit.core.specs import Array, EffectSpec, Ends, Param, Programme, State, Steps, Values
from mrfit.kernels.filters import chord_lag, lag_step
from mrfit.kernels.theta import plain

# The circuit has one solution only where the flux rises with the magnetising current
RISING = True

# Change of the magnetising current at which the rounds end, as a share of the current's range: far below what a
# derivative by differences would see; 6 to 18 rounds reach it, of steep loops over 50
SETTLED, ROUNDS = 1e-10, 60
# Rounds in which changes fall at least by half, from twice as many on. Where flux falls behind a reversal, the circuit
# has more than one solution, and they may go on for ever
HALVED_IN = 6
# The same of one step, as a share of its currents; from so many rounds on changes fall as long as they are no rounding
CLOSE, MOST_ROUNDS, FIRST_ROUNDS = 1e-12, 40, 6

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


def rest(now: Values, theta: Values) -> State:
    """Return the magnetising current in A, and that no chord is known."""
    return now[0], 0.0


def step(
    state: State, before: Values, now: Values, theta: Ends, dt: float, flux_at: Callable[[float], float]
) -> tuple[float, State]:
    """Return the magnetising current in A at the end of a step, and the state: it and a chord in H.

    ``flux_at`` gives the static flux in Wb at the step's end for such a current, and leaves the model as it is.
    """
    magnetising, inductance = state
    conductance, current = theta[1][0], now[0]
    if conductance > 0.0 and dt > 0.0:
        flux, last = flux_at(magnetising), 0.0
        for k in range(MOST_ROUNDS):
            chord = (flux_at(current) - flux) / (current - magnetising) if current != magnetising else 0.0
            inductance = chord if chord > 0.0 else inductance
            following = lag_step(magnetising, before[0], now[0], conductance * inductance, dt)
            change = abs(following - current)
            current = following
            # with numbers of few digits changes end above that
            if change <= CLOSE * (abs(current) + abs(now[0])) or (k >= FIRST_ROUNDS and change >= last):
                break
            last = change
    return current, (current, inductance)


def closed(simulate: Callable[[Array], Array], current: Array, theta: Array, dt: Steps) -> Array:
    """Return the flux in Wb, shape (N,), of the terminal current (N,) in A; theta is (G,) in S.

    ``simulate`` maps the magnetising current (N,) to the static flux (N,).
    """
    flux, here = simulate(current), current
    extent = float(np.ptp(current))
    if not (theta[0] > 0.0 and extent > 0.0):
        return flux
    here, current, steps = plain(here), plain(current), np.atleast_1d(np.float64(dt))
    changes: list[float] = []
    while len(changes) < ROUNDS:
        here, change = chord_lag(current, here, plain(flux), theta[0], steps)
        flux = simulate(here)
        changes.append(change)
        stays = len(changes) > 2 * HALVED_IN and change > 0.5 * changes[-1 - HALVED_IN]
        if not change > SETTLED * extent or (stays and np.min(np.diff(flux) * np.diff(here)) < 0.0):
            break
    return flux
