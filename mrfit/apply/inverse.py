"""The current that gives a force.

A damper's force at the end of a step is a function F(i) of the current its base sees, its state and its motion given.
Where every parameter that depends on current enters linearly, F is a polynomial on each piece of the current's range:
of order 2 or less it is solved in closed form, as the inverse-tanh paper does. Every other F is searched on a grid for
the first pair of currents between which it passes the force, and solved there by Newton's method, kept within the pair
by bisection. Of several currents that give a force the
least is taken, which heats the coil least; two of them within one cell of the grid are passed over. A force that no
current gives is answered by the current whose force is nearest, and flagged.

The current's own dynamics (``current-lag``, ``slow-release``, ``current-filter``, M(s) of ``hammerstein-wiener``,
residual magnetism and saturation) are inverted behind it, step by step: the command, held over the step, at whose end
the base sees the current wanted, within what coil and amplifier allow. A dead time is foreseen where the motion is
known in advance.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mrfit.apply.damper import Damper
from mrfit.apply.stepper import Channels, State, Stepper, take
from mrfit.core import registry
from mrfit.core.specs import Array, Index
from mrfit.settings.apply import Amplifier

# Grid points of a piece of the current's range: a polynomial of order 2 has three
EXPLICIT, SEARCHED = 3, 17
# Force at which a search ends, and up to which it counts as reached, as shares of the largest force at hand
_ENOUGH, EXACT = 1e-13, 1e-9
_STEPS, _GOLDEN = 80, 45
# Points of the grid beside which an extremum is looked for, the best first
_CANDIDATES = 2
# Difference of current for Newton's slope, as a share of a piece
_DIFFERENCE = 1e-7
REACHED, BELOW, ABOVE, BETWEEN = 0, -1, 1, 2
FLAGS = {REACHED: "reached", BELOW: "below reach", ABOVE: "above reach", BETWEEN: "in a gap"}
"""What a flag says of a force: it can lie in a gap where a parameter jumps at some current."""

Function = Callable[[Array, NDArray[np.int64]], Array]
"""F(values, lanes): a function at one value for each lane of a list."""


@dataclass(frozen=True)
class Solution:
    """Currents for forces; all arrays (B,).

    Attributes
    ----------
    field
        Current in A for the base to see.
    force
        What it gives.
    low, high
        Least and greatest force that any current gives.
    flag
        One of ``FLAGS``.
    """

    field: Array
    force: Array
    low: Array
    high: Array
    flag: NDArray[np.int64]


def commands(amplifier: Amplifier, damper: Damper, before: Array, dt: float) -> tuple[Array, Array]:
    """Return the least and greatest command in A at the end of a step, given the one before (B,)."""
    least = damper.low if amplifier.least is None else amplifier.least
    low, high = np.full_like(before, least), np.full_like(before, amplifier.most * damper.high)
    if amplifier.rate is not None:
        low, high = np.maximum(low, before - amplifier.rate * dt), np.minimum(high, before + amplifier.rate * dt)
    if amplifier.voltage is not None:
        change = dt / amplifier.inductance
        low = np.maximum(low, before + change * (-amplifier.voltage - amplifier.resistance * before))
        high = np.minimum(high, before + change * (amplifier.voltage - amplifier.resistance * before))
    # a command that must fall because its limit fell does so as fast as it can
    return np.minimum(low, high), np.maximum(low, high)


class Inverter:
    """Finds currents for a stepper's forces."""

    def __init__(self, stepper: Stepper, amplifier: Amplifier | None = None) -> None:
        self.stepper, self.damper = stepper, stepper.damper
        self.amplifier = amplifier or Amplifier()
        self.explicit = is_explicit(self.damper) and not stepper.bends
        self.pieces = pieces_of(self.damper)
        count = EXPLICIT if self.explicit else SEARCHED
        self._grid = np.concatenate([np.linspace(low, high, count) for low, high in self.pieces])
        self._count = count

    def solve(self, state: State, channels: Channels, dt: float, desired: Array) -> Solution:
        """Return the currents for desired forces (B,) at the end of a step of dt s to ``channels``."""
        lanes, points = len(desired), len(self._grid)
        moved = {**channels, "current": np.zeros(lanes)}

        def force(current: Array, chosen: NDArray[np.int64]) -> Array:
            given = {n: np.asarray(c)[chosen] for n, c in moved.items()}
            return self.stepper.inner(take(state, chosen), given, dt, current)

        every = np.arange(lanes)
        at = np.tile(self._grid, (lanes, 1))
        values = force(at.ravel(), np.repeat(every, points)).reshape(lanes, points)
        solve = self._by_formula if self.explicit else self._by_search
        return solve(force, at, values, desired)

    def _by_formula(self, force: Function, at: Array, values: Array, desired: Array) -> Solution:
        """Solve the polynomial of each piece; its extremum joins the grid."""
        found = np.full(len(desired), np.nan)
        extra = []
        for k, (low, high) in enumerate(self.pieces):
            f0, fm, f1 = values[:, 3 * k : 3 * k + 3].T
            bend, slope = 2.0 * (f0 - 2.0 * fm + f1), -3.0 * f0 + 4.0 * fm - f1
            share = _least_root(bend, slope, f0 - desired)
            found = np.where(np.isnan(found), low + share * (high - low), found)
            with np.errstate(all="ignore"):
                vertex = np.nan_to_num(-slope / (2.0 * bend), nan=0.0, posinf=0.0, neginf=0.0)
            extra.append(low + np.clip(vertex, 0.0, 1.0) * (high - low))
        lanes = np.arange(len(desired))
        more = np.stack(extra, axis=1)
        beside = force(more.ravel(), np.repeat(lanes, more.shape[1])).reshape(more.shape)
        at, values = np.hstack([at, more]), np.hstack([values, beside])
        return _finished(force, at, values, desired, found)

    def _by_search(self, force: Function, at: Array, values: Array, desired: Array) -> Solution:
        """Solve between the first two points of the grid that have the force between them."""
        at, values = self._sharpened(force, at, values, desired)
        above = values >= desired[:, None]
        passing = above[:, 1:] != above[:, :-1]
        # two points of different pieces are one current, where the force may jump
        passing &= np.diff(at, axis=1) > 1e-12 * max(1.0, abs(self.damper.high))
        lanes = np.flatnonzero(passing.any(axis=1))
        first = passing[lanes].argmax(axis=1)
        found = np.full(len(desired), np.nan)
        if len(lanes):
            ends = at[lanes, first], at[lanes, first + 1]
            found[lanes] = root(force, lanes, ends, (values[lanes, first], values[lanes, first + 1]), desired[lanes])
        return _finished(force, at, values, desired, found)

    def _sharpened(self, force: Function, at: Array, values: Array, desired: Array) -> tuple[Array, Array]:
        """Add the extrema next to the best points of lanes whose force no point of the grid passes."""
        out = np.flatnonzero((desired > values.max(axis=1)) | (desired < values.min(axis=1)))
        if not len(out):
            return at, values
        distance = np.pad(np.abs(values[out] - desired[out, None]), ((0, 0), (1, 1)), constant_values=np.inf)
        middle = distance[:, 1:-1]
        lowest = (middle <= distance[:, :-2]) & (middle <= distance[:, 2:])
        ranked = np.argsort(np.where(lowest, middle, np.inf), axis=1, kind="stable")
        along, given = [at], [values]
        for best in ranked[:, :_CANDIDATES].T:
            peak, beside = at[:, :1].copy(), values[:, :1].copy()
            lanes, found = self._extremum(force, (at, values), out, best, desired)
            peak[lanes, 0] = found
            if len(lanes):
                beside[lanes, 0] = force(found, lanes)
            along.append(peak)
            given.append(beside)
        points = np.hstack(along)
        order = np.argsort(points, axis=1, kind="stable")
        return np.take_along_axis(points, order, axis=1), np.take_along_axis(np.hstack(given), order, axis=1)

    def _extremum(
        self, force: Function, grid: tuple[Array, Array], lanes: Index, best: Index, desired: Array
    ) -> tuple[Index, Array]:
        """Return the lanes that have an extremum beside a point of the grid, and where, by golden section."""
        at, values = grid
        own = best % self._count
        # a parabola through the point and both beside it says whether anything lies between them
        inner = _bent_inwards(at[lanes], values[lanes], best, own, self._count)
        lanes, best, own = lanes[inner], best[inner], own[inner]
        if not len(lanes):
            return lanes, np.empty(0)
        rows = np.arange(len(lanes))
        sign = np.where(desired[lanes] > values[lanes].max(axis=1), 1.0, -1.0)
        low = at[lanes][rows, best - (own > 0)]
        high = at[lanes][rows, best + (own < self._count - 1)]
        golden = (np.sqrt(5.0) - 1.0) / 2.0
        for _ in range(_GOLDEN):
            left, right = high - golden * (high - low), low + golden * (high - low)
            better = sign * force(left, lanes) > sign * force(right, lanes)
            low, high = np.where(better, low, left), np.where(better, right, high)
        return lanes, 0.5 * (low + high)

    def command(self, state: State, channels: Channels, dt: float, field: Array) -> Array:
        """Return the commands in A, held over the step, at whose end the base sees currents (B,), within limits.

        Where none does, the nearest that the amplifier can give.
        """
        before = state.given["current"]
        low, high = commands(self.amplifier, self.damper, before, dt)
        if not self.stepper.lagging:
            return np.asarray(np.clip(field, low, high))

        def seen(command: Array, chosen: NDArray[np.int64]) -> Array:
            given = {n: np.asarray(c)[chosen] for n, c in channels.items()}
            return self.stepper.field(take(state, chosen), {**given, "current": command}, dt)

        every = np.arange(len(field))
        at_low, at_high = seen(low, every), seen(high, every)
        result = np.where(field <= at_low, low, high)
        lanes = np.flatnonzero((at_low < field) & (field < at_high))
        if len(lanes):
            result[lanes] = root(seen, lanes, (low[lanes], high[lanes]), (at_low[lanes], at_high[lanes]), field[lanes])
        return result


def is_explicit(damper: Damper) -> bool:
    """Return whether its force is a polynomial of current, of order 2 or less, on every piece of the range."""
    dependence = damper.dependence
    spec = registry.load("model", damper.model.partition("+")[0]).SPEC
    if dependence is None or "current" in spec.inputs:
        return False
    for name, order in damper.orders:
        orders = {piece.order for piece in dependence.pieces(order)}
        plain = name in spec.linear and not str(order).strip().startswith("log")
        if orders - ({0, 1, 2} if plain else {0}):
            return False
    return True


def pieces_of(damper: Damper) -> list[tuple[float, float]]:
    """Return the pieces of the current's range between the breaks of its parameters; a break is of the piece below."""
    breaks = {p.high for _, o in damper.orders for p in damper.dependence.pieces(o)} if damper.dependence else set()
    edges = sorted({damper.low, damper.high, *breaks})
    return [(low if k == 0 else float(np.nextafter(low, np.inf)), edges[k + 1]) for k, low in enumerate(edges[:-1])]


def root(
    function: Function, lanes: NDArray[np.int64], ends: tuple[Array, Array], values: tuple[Array, Array], target: Array
) -> Array:
    """Return where a function, on either side of the target at two ends, takes it: Newton's steps, else bisection."""
    (low, high), (f_low, f_high) = ends, values
    low, high = low.copy(), high.copy()
    rising = f_high > f_low
    with np.errstate(all="ignore"):
        at = low + np.clip((target - f_low) / (f_high - f_low), 0.0, 1.0) * (high - low)
    best, error = at.copy(), np.full(len(at), np.inf)
    active = np.arange(len(at))
    for _ in range(_STEPS):
        size = np.maximum(np.abs(f_low), np.abs(f_high))[active]
        width = high[active] - low[active]
        # the difference for the slope stays between the ends
        shift = _DIFFERENCE * (ends[1] - ends[0])[active]
        shift = np.where(at[active] + shift > ends[1][active], -shift, shift)
        both = function(np.concatenate([at[active], at[active] + shift]), np.tile(lanes[active], 2))
        here, beside = both[: len(active)], both[len(active) :]
        off = here - target[active]
        better = np.abs(off) < error[active]
        best[active] = np.where(better, at[active], best[active])
        error[active] = np.where(better, np.abs(off), error[active])
        too_high = (off > 0.0) == rising[active]
        high[active] = np.where(too_high, at[active], high[active])
        low[active] = np.where(too_high, low[active], at[active])
        with np.errstate(all="ignore"):
            newton = at[active] - off * shift / (beside - here)
        inside = (newton > low[active]) & (newton < high[active])
        at[active] = np.where(inside, newton, 0.5 * (low[active] + high[active]))
        done = (np.abs(off) <= _ENOUGH * size) | (width <= 4.0 * np.spacing(np.abs(at[active])))
        active = active[~done]
        if not len(active):
            break
    return best


def _bent_inwards(at: Array, values: Array, best: Index, own: Index, count: int) -> NDArray[np.bool_]:
    """Return whether a parabola through the best points (L,) of rows and their neighbours has its vertex among them."""
    rows = np.arange(len(best))
    middle = best + (own == 0) - (own == count - 1)
    (x0, x1, x2), (f0, f1, f2) = ((v[rows, middle - 1], v[rows, middle], v[rows, middle + 1]) for v in (at, values))
    with np.errstate(all="ignore"):
        before, after = (f1 - f0) / (x1 - x0), (f2 - f1) / (x2 - x1)
        vertex = 0.5 * (x0 + x1) - before * (x2 - x0) / (2.0 * (after - before))
    return np.asarray((vertex > x0) & (vertex < x2))


def _least_root(bend: Array, slope: Array, rest: Array) -> Array:
    """Return the least s in [0, 1] with bend*s^2 + slope*s + rest = 0, nan where there is none."""
    with np.errstate(all="ignore"):
        half = -0.5 * (slope + np.copysign(np.sqrt(slope**2 - 4.0 * bend * rest), slope))
        both = np.stack([half / bend, rest / half])
        both = np.where((both >= -1e-12) & (both <= 1.0 + 1e-12), np.clip(both, 0.0, 1.0), np.nan)
        return np.asarray(np.fmin(both[0], both[1]))


def _finished(force: Function, at: Array, values: Array, desired: Array, found: Array) -> Solution:
    """Return the solution: the currents found, else the nearest; a last step of Newton's where rounding asks for it."""
    lanes = np.arange(len(desired))
    distance = np.abs(values - desired[:, None])
    # of equally near currents the least
    nearest = np.where(distance <= distance.min(axis=1, keepdims=True) * (1.0 + 1e-12), at, np.inf).min(axis=1)
    field = np.where(np.isnan(found), nearest, found)
    given = force(field, lanes)
    size = np.maximum(np.abs(values).max(axis=1), 1e-30)
    low, high = np.minimum(values.min(axis=1), given), np.maximum(values.max(axis=1), given)
    exact = np.abs(given - desired) <= EXACT * size
    flag = np.where(exact, REACHED, np.where(desired < low, BELOW, np.where(desired > high, ABOVE, BETWEEN)))
    return Solution(field, given, low, high, flag.astype(np.int64))


def prompt(damper: Damper) -> tuple[Damper, float]:
    """Return a damper without the dead times before its field, and their sum in s."""
    names = ("current-lag.t_d", "current-filter.tau", *(("tau",) if damper.model.startswith("hammerstein") else ()))
    dead = sum(max(value, 0.0) for name, value in damper.parameters if name in names)
    parameters = tuple((name, 0.0 if name in names else value) for name, value in damper.parameters)
    return replace(damper, parameters=parameters), dead
