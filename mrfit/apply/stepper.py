"""A damper stepped in time: one interface for every model and effect, many lanes side by side.

``rest`` gives the states of dampers that have stood still, ``step`` the force at the end of a step and the next states,
of the same definitions that a fit simulates. States are rows of an array and never changed, so that a step can be tried
with several currents or motions and thrown away. Motion is linear over a step. The current is what a controller
commands: it is held over a step at its value at the step's end; with ``held=False`` it is linear, as between the
samples of a log.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from mrfit.apply.damper import Damper
from mrfit.apply.undone import lasting, undone
from mrfit.core.specs import Array, Steps
from mrfit.errors import DataError
from mrfit.simulate import chain as columns
from mrfit.simulate.chain import advanced, followed
from mrfit.simulate.program import DEFAULTS, DamperProgram

Channels = Mapping[str, Array]
# Shortest step in s for which what is read late is kept in full
_SHORTEST = 1e-4


@dataclass(frozen=True)
class StepEnd:
    """The end of a step.

    Attributes
    ----------
    force
        Force or torque, shape (B,).
    inner
        The same before the effects behind the base that have memory (``force-filter``, ``delay``).
    field
        Current in A that the base sees.
    state
        To go on from, shape (B, S).
    """

    force: Array
    inner: Array
    field: Array
    state: Array


class Stepper:
    """Steps a damper; see the module, and ``DamperProgram`` for parameters that are ``moving``."""

    def __init__(
        self, damper: Damper, held: bool = True, shortest: float = _SHORTEST, moving: Collection[str] = ()
    ) -> None:
        self.damper, self.shortest = damper, shortest
        self.program = DamperProgram(damper.model, damper.theta[0], damper.dependence, held, shortest, moving)
        self.chain, self.inputs = self.program.chain, self.program.channels
        self.behind = tuple(name for name, _, _ in self.program.behind)
        self.lagging = tuple(name for name, _, _ in self.program.before)
        self.bends = bool((self.chain.elements["kind"] == columns.SHAPING).any())

    def complete(self, channels: Channels) -> Array:
        """Return the channels that the model needs, (B, C), those that nobody gave at their usual value.

        Raises
        ------
        DataError
            If one is missing.
        """
        if missing := [n for n in self.inputs if n not in channels and n not in DEFAULTS]:
            raise DataError(f"'{self.damper.name}' needs {' and '.join(missing)}")
        lanes = len(channels["current"])
        given = {n: c for n, c in channels.items() if n not in self.program.unasked}
        rows = [given[n] if n in given else np.full(lanes, DEFAULTS[n]) for n in self.inputs]
        return np.ascontiguousarray(np.stack(rows, axis=1), dtype=np.float64)

    def rest(self, channels: Channels) -> Array:
        """Return the states (B, S) of dampers that have stood still at these channels (B,)."""
        given = self.complete(channels)
        nothing = np.zeros((len(given), self.chain.places.whole))
        return advanced(self.chain, nothing, given, -1.0, np.full(len(given), np.nan))[1]

    def step(self, state: Array, channels: Channels, dt: float, field: Array | None = None) -> StepEnd:
        """Take a step of dt s to channels (B,), or one in which the base sees a given current."""
        given = self.complete(channels)
        fields = np.full(len(given), np.nan) if field is None else np.asarray(field, dtype=np.float64)
        found, following = advanced(self.chain, state, given, dt, fields)
        force, inner, seen = found.T.copy()
        return StepEnd(force, inner, seen, following)

    def inner(self, state: Array, channels: Channels, dt: float, field: Array) -> Array:
        """Return the force at the end of a step, before what is ``behind`` it, where the base sees a current (B,)."""
        return self.step(state, channels, dt, field).inner

    @property
    def lasting(self) -> float:
        """Return for how many s the force is felt in what lies ``behind`` it."""
        return lasting(self.program)

    def undone(self, desired: Array, dt: float) -> Array:
        """Return the forces (L, N) before what lies ``behind`` them of those desired, which are known ahead."""
        return undone(self.program, desired, dt)


def simulate(stepper: Stepper, channels: Channels, dt: Steps) -> Array:
    """Return the force (N,) of a log's channels (N,), step by step; what ``Assembly.simulate`` gives at once."""
    given = stepper.complete(channels)
    state = stepper.rest({n: c[:1] for n, c in channels.items()})[0]
    steps = np.array(np.broadcast_to(np.asarray(dt, dtype=np.float64), (len(given),)))
    steps[0] = 0.0
    return np.asarray(followed(stepper.chain, state, given, steps)[:, 0].copy())
