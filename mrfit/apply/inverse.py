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

from dataclasses import dataclass, replace

import numpy as np

from mrfit.apply.damper import Damper
from mrfit.apply.solving import ABOVE, BELOW, BETWEEN, REACHED, CommandLimits, Inverse, commanded, solved
from mrfit.apply.stepper import Channels, Stepper
from mrfit.core import registry
from mrfit.core.specs import Array, Index
from mrfit.errors import ConfigError
from mrfit.settings.apply import Amplifier

# Grid points of a piece of the current's range: a polynomial of order 2 has three
EXPLICIT, SEARCHED = 3, 17
FLAGS = {REACHED: "reached", BELOW: "below reach", ABOVE: "above reach", BETWEEN: "in a gap"}
"""What a flag says of a force: it can lie in a gap where a parameter jumps at some current."""


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
    flag: Index


class Inverter:
    """Finds currents for a stepper's forces."""

    def __init__(self, stepper: Stepper, amplifier: Amplifier | None = None) -> None:
        self.stepper, self.damper = stepper, stepper.damper
        self.amplifier = amplifier or Amplifier()
        self.explicit = is_explicit(self.damper) and not stepper.bends
        count = EXPLICIT if self.explicit else SEARCHED
        grid = np.concatenate([np.linspace(low, high, count) for low, high in pieces_of(self.damper)])
        one = self.amplifier
        least = self.damper.low if one.least is None else one.least
        most = one.most * self.damper.high
        if least > most:
            raise ConfigError(f"--least {least:g} A lies above the greatest command, {most:.4g} A; give a lower one")
        limits = (least, most, one.rate, one.voltage, one.resistance, one.inductance)
        known = CommandLimits(*(float(np.nan if v is None else v) for v in limits))
        self.inverse = Inverse(grid, count, self.explicit, bool(stepper.lagging), known)

    def solve(self, state: Array, channels: Channels, dt: float, desired: Array) -> Solution:
        """Return the currents for desired forces (B,) at the end of a step of dt s to ``channels``."""
        given = self.stepper.complete({**channels, "current": np.zeros(len(desired))})
        wanted = np.ascontiguousarray(desired, dtype=np.float64)
        found = solved(self.stepper.chain, self.inverse, state, given, dt, wanted)
        field, force, low, high, flag = found.T.copy()
        return Solution(field, force, low, high, flag.astype(np.int64))

    def command(self, state: Array, channels: Channels, dt: float, field: Array) -> Array:
        """Return the commands in A, held over the step, at whose end the base sees currents (B,), within limits.

        Where none does, the nearest that the amplifier can give.
        """
        given = self.stepper.complete(channels)
        return commanded(self.stepper.chain, self.inverse, state, given, dt, np.asarray(field, dtype=np.float64))


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


def prompt(damper: Damper) -> tuple[Damper, float]:
    """Return a damper without the dead times before its field, and their sum in s."""
    names = ("current-lag.t_d", "current-filter.tau", *(("tau",) if damper.model.startswith("hammerstein") else ()))
    dead = sum(max(value, 0.0) for name, value in damper.parameters if name in names)
    parameters = tuple((name, 0.0 if name in names else value) for name, value in damper.parameters)
    return replace(damper, parameters=parameters), dead
