"""A coil's circuit in compiled loops: the current of a flux linkage, and the flux linkage under a voltage.

``mrfit.apply.coil`` says what is solved.
"""

import math
from typing import NamedTuple

import numpy as np

from mrfit.apply.solving import root, value
from mrfit.core.specs import Array
from mrfit.kernels.filters import lag_step
from mrfit.kernels.jit import kernel
from mrfit.simulate.chain import DamperChain, Trial, commit, step, trial_of

# First width in A, or Wb, of a search, and how often it is doubled
_WIDTH, _DOUBLINGS = 1e-6, 80


class Circuit(NamedTuple):
    """Coil and amplifier: R in ohm, G in S of the eddy currents' path, greatest voltage in V, current in A; dt in s."""

    resistance: float
    conductance: float
    voltage: float
    current: float
    dt: float


@kernel
def sought(chain: DamperChain, site: Trial, dt: float, ends: tuple[float, float], load: float, target: float) -> float:
    """Return the current in A at which flux and ``load`` times it are a target, nan where none is.

    The search goes from the second of ``ends``, the current before, in steps that begin with its last change.
    """
    low = high = ends[1]
    at_low = at_high = value(chain, site, dt, low, load)
    if at_low == target:
        return low
    upwards, width = target > at_low, max(abs(ends[1] - ends[0]), _WIDTH)
    for _ in range(_DOUBLINGS):
        if upwards:
            low, at_low, high = high, at_high, high + width
            at_high = value(chain, site, dt, high, load)
        else:
            high, at_high, low = low, at_low, low - width
            at_low = value(chain, site, dt, low, load)
        if at_low <= target <= at_high:
            return root(chain, site, dt, (low, high, at_low, at_high), target, load)
        width *= 2.0
    return math.nan


@kernel
def _gone_on(chain: DamperChain, site: Trial, dt: float, current: float) -> float:
    """Take a step to a magnetising current; return the flux in Wb at its end."""
    site.given[chain.places.current] = current
    flux = step(chain, site, dt, math.nan)[0]
    commit(chain, site, dt)
    return flux


@kernel
def magnetised(chain: DamperChain, state: Array, given: Array, steps: Array, flux: Array) -> Array:
    """Return the magnetising currents (N,) in A of a flux linkage (N,), nan from the first sample that none gives.

    ``given`` (N, C) are the channels, ``steps`` (N,) in s; a negative one begins at rest. The state goes along.
    """
    found, site = np.full(len(flux), math.nan), trial_of(chain, state, np.empty(given.shape[1]))
    before = now = state[chain.places.current]
    for n in range(len(flux)):
        site.given[:] = given[n]
        before, now = now, sought(chain, site, steps[n], (before, now), 0.0, flux[n])
        if math.isnan(now):
            break
        _gone_on(chain, site, steps[n], now)
        found[n] = now
    return found


@kernel
def terminal(flux: Array, magnetising: Array, first: float, conductance: float, steps: Array) -> Array:
    """Return the terminal current (N,) in A whose lag, as ``chord_lag`` has it, is the magnetising one.

    ``first`` is the terminal current at the first sample.
    """
    found, chord = np.empty(len(flux)), 0.0
    found[0] = first
    for j in range(1, len(flux)):
        run = magnetising[j] - magnetising[j - 1]
        slope = (flux[j] - flux[j - 1]) / run if run != 0.0 else 0.0
        chord = slope if 0.0 < slope < math.inf else chord
        # the lag's output is a line over the current at the step's end
        at_zero = lag_step(magnetising[j - 1], found[j - 1], 0.0, conductance * chord, steps[j])
        at_one = lag_step(magnetising[j - 1], found[j - 1], 1.0, conductance * chord, steps[j])
        found[j] = (magnetising[j] - at_zero) / (at_one - at_zero)
    return found


@kernel
def _under(chain: DamperChain, circuit: Circuit, site: Trial, before: tuple[float, float, float], u: float) -> float:
    """Return the magnetising current at the end of a step under a voltage, from the two before and the flux."""
    dt, eddy = circuit.dt, 1.0 + circuit.conductance * circuit.resistance
    load = 0.5 * dt * circuit.resistance / eddy
    target = before[2] + dt * u / eddy - load * before[1]
    return sought(chain, site, dt, (before[0], before[1]), load, target)


@kernel
def _at_most(
    chain: DamperChain, circuit: Circuit, site: Trial, before: tuple[float, float, float], current: float
) -> float:
    """Return the magnetising current at the end of a step at which the terminal current is a given one."""
    r, g, dt = circuit.resistance, circuit.conductance, circuit.dt
    if g <= 0.0:
        return current
    eddy = 1.0 + g * r
    share = dt / (g * eddy)
    target = before[2] + share * (current * eddy - 0.5 * g * r * before[1])
    return sought(chain, site, dt, (before[0], before[1]), share * (1.0 + 0.5 * g * r), target)


@kernel
def energised(chain: DamperChain, circuit: Circuit, state: Array, given: Array, flux: Array, voltage: Array) -> Array:
    """Return voltage, flux, magnetising and terminal current (N, 4) of a coil from rest under steps of voltage.

    The voltage is that of ``voltage`` (N,), held over the step that ends at its sample; where this is nan, the one that
    brings ``flux`` (N,), or what the limits leave of it.
    """
    r, g, dt = circuit.resistance, circuit.conductance, circuit.dt
    eddy = 1.0 + g * r
    found, site = np.full((len(flux), 4), math.nan), trial_of(chain, state, np.empty(given.shape[1]))
    site.given[:] = given[0]
    before, now, there = 0.0, 0.0, _gone_on(chain, site, -1.0, 0.0)
    found[0] = 0.0, there, 0.0, 0.0
    for n in range(1, len(flux)):
        site.given[:] = given[n]
        u, last = voltage[n], (before, now, there)
        if math.isnan(u):
            to = sought(chain, site, dt, (before, now), 0.0, flux[n])
            # a flux that no current gives is striven for with all there is
            u = math.copysign(math.inf, flux[n] - there)
            if not math.isnan(to):
                u = eddy * (flux[n] - there) / dt + 0.5 * r * (now + to)
            if abs((to + g * u) / eddy) > circuit.current:
                to = _at_most(chain, circuit, site, last, math.copysign(circuit.current, u))
                reached = value(chain, site, dt, to, 0.0)
                u = eddy * (reached - there) / dt + 0.5 * r * (now + to)
            u = min(max(u, -circuit.voltage), circuit.voltage)
        to = _under(chain, circuit, site, last, u)
        if math.isnan(to):
            break
        before, now, there = now, to, _gone_on(chain, site, dt, to)
        found[n] = u, there, now, (now + g * u) / eddy
    return found


@kernel
def energised_by_flux(
    chain: DamperChain, circuit: Circuit, state: Array, given: Array, flux: Array, voltage: Array
) -> Array:
    """Return the same of a model that gives the current of a flux linkage, which is its first channel there."""
    r, dt, found = circuit.resistance, circuit.dt, np.full((len(flux), 4), math.nan)
    site = trial_of(chain, state, given[0].copy())
    before, now, current = 0.0, 0.0, _gone_on(chain, site, -1.0, 0.0)
    found[0] = 0.0, 0.0, current, current
    for n in range(1, len(flux)):
        site.given[:] = given[n]
        u = voltage[n]
        if math.isnan(u):
            to = flux[n]
            needed = value(chain, site, dt, to, 0.0)
            if abs(needed) > circuit.current:
                needed = math.copysign(circuit.current, needed)
                to = sought(chain, site, dt, (before, now), 0.0, needed)
            u = (to - now) / dt + 0.5 * r * (current + needed)
            u = min(max(u, -circuit.voltage), circuit.voltage)
        to = now + dt * u
        if r > 0.0:
            load = 2.0 / (dt * r)
            to = sought(chain, site, dt, (before, now), load, load * to - current)
        if math.isnan(to):
            break
        before, now, current = now, to, _gone_on(chain, site, dt, to)
        found[n] = u, now, current, current
    return found
