"""The inverse in compiled loops: the current that gives a force at a step's end, and the command that brings it.

``mrfit.apply.inverse`` says what is solved and how.
"""

import math
from typing import NamedTuple

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import borrowing, kernel, part
from mrfit.simulate.chain import DamperChain, Trial, inputs, step, trial_of

REACHED, BELOW, ABOVE, BETWEEN = 0.0, -1.0, 1.0, 2.0
# Force at which a search ends, and up to which it counts as reached, as shares of the largest force at hand
_ENOUGH, _EXACT = 1e-13, 1e-9
_STEPS, _GOLDEN = 80, 45
# Points of the grid beside which an extremum is looked for, the best first
_CANDIDATES = 2
# Difference of current for Newton's slope, as a share of a piece
_DIFFERENCE = 1e-7
_SHARE = (math.sqrt(5.0) - 1.0) / 2.0
Ends = tuple[float, float, float, float]


class CommandLimits(NamedTuple):
    """Limits of the command: least and greatest in A, rate in A/s, coil and amplifier in V, ohm and H; nan for none."""

    low: float
    high: float
    rate: float
    voltage: float
    resistance: float
    inductance: float


class Inverse(NamedTuple):
    """The currents among which an inverse searches.

    Attributes
    ----------
    grid
        Currents in A at which the force is looked at, ``points`` for each piece of the range.
    explicit, lagging
        Whether the force is a polynomial on each piece; whether the current has a memory.
    limits
        Of the command.
    """

    grid: Array
    points: int
    explicit: bool
    lagging: bool
    limits: CommandLimits


@borrowing
def value(chain: DamperChain, site: Trial, dt: float, at: float, load: float) -> float:
    """Return the force where the base sees a current, and ``load`` times it; load nan: what it sees of a command.

    A negative dt asks for what stands still.
    """
    if dt < 0.0:
        site.given[chain.places.current] = at
    if load == load:
        return step(chain, site, dt, at)[1] + load * at
    site.given[chain.places.current] = at
    return inputs(chain, site, dt)


@borrowing
def root(chain: DamperChain, site: Trial, dt: float, ends: Ends, target: float, load: float) -> float:
    """Return the place of a target between two ends of ``value``: Newton's steps, else bisection."""
    low, high, f_low, f_high = ends
    rising, first, last = f_high > f_low, low, high
    share = min(max((target - f_low) / (f_high - f_low), 0.0), 1.0) if f_high != f_low else 0.5
    at = low + share * (high - low)
    best, error, size = at, math.inf, max(abs(f_low), abs(f_high))
    for _ in range(_STEPS):
        # the difference for the slope stays between the ends
        shift = _DIFFERENCE * (last - first)
        shift = -shift if at + shift > last else shift
        here = value(chain, site, dt, at, load)
        off = here - target
        if abs(off) < error:
            best, error = at, abs(off)
        if (off > 0.0) == rising:
            high = at
        else:
            low = at
        if abs(off) <= _ENOUGH * size or high - low <= 4.0 * np.spacing(abs(at)):
            break
        newton = at - off * shift / (value(chain, site, dt, at + shift, load) - here)
        at = newton if low < newton < high else 0.5 * (low + high)
    return best


@part
def _least_root(bend: float, slope: float, rest: float) -> float:
    """Return the least s in [0, 1] with bend*s^2 + slope*s + rest = 0, nan where there is none."""
    inside = slope**2 - 4.0 * bend * rest
    if inside < 0.0:
        return math.nan
    half = -0.5 * (slope + math.copysign(math.sqrt(inside), slope))
    found = math.nan
    for s in (half / bend, rest / half):
        if -1e-12 <= s <= 1.0 + 1e-12 and not s > found:
            found = min(max(s, 0.0), 1.0)
    return found


@part
def _extremum(
    chain: DamperChain, inverse: Inverse, site: Trial, dt: float, values: Array, wanted: tuple[int, float]
) -> tuple[float, float]:
    """Return an extremum beside a point of the grid and its force, by golden section; nan where there is none.

    ``wanted`` is the point, and 1.0 for a maximum or -1.0 for a minimum.
    """
    grid, count, (best, sign) = inverse.grid, inverse.points, wanted
    own = best % count
    middle = best + (1 if own == 0 else 0) - (1 if own == count - 1 else 0)
    x0, x1, x2 = grid[middle - 1], grid[middle], grid[middle + 1]
    before = (values[middle] - values[middle - 1]) / (x1 - x0)
    after = (values[middle + 1] - values[middle]) / (x2 - x1)
    # a parabola through the point and both beside it says whether anything lies between them
    vertex = 0.5 * (x0 + x1) - before * (x2 - x0) / (2.0 * (after - before))
    if not x0 < vertex < x2:
        return math.nan, math.nan
    low, high = grid[best - (1 if own > 0 else 0)], grid[best + (1 if own < count - 1 else 0)]
    for _ in range(_GOLDEN):
        left, right = high - _SHARE * (high - low), low + _SHARE * (high - low)
        if sign * value(chain, site, dt, left, 0.0) > sign * value(chain, site, dt, right, 0.0):
            high = right
        else:
            low = left
    at = 0.5 * (low + high)
    return at, value(chain, site, dt, at, 0.0)


@part
def _sharpened(chain: DamperChain, inverse: Inverse, site: Trial, dt: float, values: Array, desired: float
               ) -> tuple[Array, Array]:  # fmt: skip
    """Return the grid and its forces with the extrema next to the best points, where none passes the force."""
    grid, found = inverse.grid, 0
    at, given = np.empty(len(grid) + _CANDIDATES), np.empty(len(grid) + _CANDIDATES)
    at[: len(grid)], given[: len(grid)] = grid, values
    sign = 1.0 if desired > values.max() else -1.0
    left = np.abs(values - desired)
    chosen = np.full(_CANDIDATES, -1)
    for candidate in range(_CANDIDATES):
        nearest = math.inf
        for k in range(len(grid)):
            lowest = (k == 0 or left[k] <= left[k - 1]) and (k == len(grid) - 1 or left[k] <= left[k + 1])
            if lowest and left[k] < nearest and k != chosen[0]:
                nearest, chosen[candidate] = left[k], k
        if chosen[candidate] >= 0:
            peak, force = _extremum(chain, inverse, site, dt, values, (chosen[candidate], sign))
            if peak == peak:
                at[len(grid) + found], given[len(grid) + found] = peak, force
                found += 1
    order = np.argsort(at[: len(grid) + found], kind="mergesort")
    return at[order], given[order]


@part
def _by_formula(inverse: Inverse, values: Array, desired: float) -> tuple[float, Array]:
    """Return the least current of the polynomials, or nan, and where their extrema are."""
    found, extrema = math.nan, np.empty(len(inverse.grid) // 3)
    for k in range(len(extrema)):
        low, high = inverse.grid[3 * k], inverse.grid[3 * k + 2]
        f0, fm, f1 = values[3 * k], values[3 * k + 1], values[3 * k + 2]
        bend, slope = 2.0 * (f0 - 2.0 * fm + f1), -3.0 * f0 + 4.0 * fm - f1
        if not found == found:
            found = low + _least_root(bend, slope, f0 - desired) * (high - low)
        vertex = -slope / (2.0 * bend)
        extrema[k] = low + (min(max(vertex, 0.0), 1.0) if math.isfinite(vertex) else 0.0) * (high - low)
    return found, extrema


@kernel
def solve(chain: DamperChain, inverse: Inverse, site: Trial, dt: float, desired: float
          ) -> tuple[float, float, float, float, float]:  # fmt: skip
    """Return current, force, least and greatest force, and a flag, see ``inverse.Solution``."""
    at, values = inverse.grid, np.empty(len(inverse.grid))
    for k in range(len(at)):
        values[k] = value(chain, site, dt, at[k], 0.0)
    found = math.nan
    if inverse.explicit:
        found, extrema = _by_formula(inverse, values, desired)
        beside = np.empty(len(extrema))
        for k in range(len(extrema)):
            beside[k] = value(chain, site, dt, extrema[k], 0.0)
        at, values = np.concatenate((at, extrema)), np.concatenate((values, beside))
    else:
        if desired > values.max() or desired < values.min():
            at, values = _sharpened(chain, inverse, site, dt, values, desired)
        for k in range(len(at) - 1):
            # two points of different pieces are one current, where the force may jump
            passing = (values[k] >= desired) != (values[k + 1] >= desired)
            if passing and at[k + 1] - at[k] > 1e-12 * max(1.0, abs(at[len(at) - 1])):
                found = root(chain, site, dt, (at[k], at[k + 1], values[k], values[k + 1]), desired, 0.0)
                break
    field = found
    if not found == found:
        nearest = np.abs(values - desired).min() * (1.0 + 1e-12)
        field = math.inf
        for k in range(len(at)):
            # of equally near currents the least
            if abs(values[k] - desired) <= nearest:
                field = min(field, at[k])
    given = value(chain, site, dt, field, 0.0)
    low, high = min(values.min(), given), max(values.max(), given)
    size = max(np.abs(values).max(), 1e-30)
    flag = BELOW if desired < low else ABOVE if desired > high else BETWEEN
    return field, given, low, high, REACHED if abs(given - desired) <= _EXACT * size else flag


@borrowing
def allowed(inverse: Inverse, before: float, dt: float) -> tuple[float, float]:
    """Return the least and greatest command in A at the end of a step, given the one before."""
    low, high, rate, voltage, resistance, inductance = inverse.limits
    if rate == rate:
        low, high = max(low, before - rate * dt), min(high, before + rate * dt)
    if voltage == voltage:
        low = max(low, before + dt / inductance * (-voltage - resistance * before))
        high = min(high, before + dt / inductance * (voltage - resistance * before))
    # a command that must fall because its limit fell does so as fast as it can
    return min(low, high), max(low, high)


@borrowing
def command(chain: DamperChain, inverse: Inverse, site: Trial, dt: float, field: float) -> float:
    """Return the command in A, held over the step, at whose end the base sees a current, or is nearest to it."""
    low, high = allowed(inverse, site.state[chain.places.current], dt)
    if not inverse.lagging:
        return min(max(field, low), high)
    at_low, at_high = value(chain, site, dt, low, math.nan), value(chain, site, dt, high, math.nan)
    if field <= at_low or field >= at_high:
        return low if field <= at_low else high
    return root(chain, site, dt, (low, high, at_low, at_high), field, math.nan)


@kernel
def solved(chain: DamperChain, inverse: Inverse, states: Array, given: Array, dt: float, desired: Array) -> Array:
    """Return ``solve`` of many lanes, from states (B, S) to channels (B, C), (B, 5)."""
    found = np.empty((len(states), 5))
    for b in range(len(states)):
        found[b] = solve(chain, inverse, trial_of(chain, states[b], given[b].copy()), dt, desired[b])
    return found


@kernel
def commanded(chain: DamperChain, inverse: Inverse, states: Array, given: Array, dt: float, fields: Array) -> Array:
    """Return ``command`` of many lanes, (B,)."""
    found = np.empty(len(states))
    for b in range(len(states)):
        found[b] = command(chain, inverse, trial_of(chain, states[b], given[b].copy()), dt, fields[b])
    return found
