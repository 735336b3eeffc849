"""The current for a series of desired forces: each sample's inverse behind the last, state and coil carried along."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrfit.apply.damper import Damper
from mrfit.apply.following import inverted
from mrfit.apply.framed import FramedResult
from mrfit.apply.inverse import FLAGS, Inverter, prompt
from mrfit.apply.solving import REACHED
from mrfit.apply.stepper import Stepper
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array, Index, Mask
from mrfit.io.schemas.apply import AmplifierEntry, DamperEntry, InversionRow
from mrfit.settings.apply import Amplifier
from mrfit.simulate.chain import followed

if TYPE_CHECKING:
    from pandas import DataFrame

# Samples between two reports of progress
_BLOCK = 1000


@dataclass(frozen=True, repr=False)
class Inversion(FramedResult):
    """Currents for a series of desired forces; arrays (N,), SI.

    Attributes
    ----------
    damper
        Whose currents.
    amplifier
        What coil and amplifier allow.
    dt
        Sample interval in s.
    time, desired
        When which force was wanted.
    current
        Command in A, held from a sample back to the one before.
    wanted, field
        Current that the base had to see for the desired force, and what it saw under the command.
    force
        Force that the whole model gives under the command.
    asked, inner
        What the force before the parts ``behind`` it had to be, and what it is; without such parts desired and force.
    low, high
        Least and greatest such force that any current gives at this motion.
    flag
        Whether the force asked can be reached, one of ``FLAGS``.
    limited
        Where the coil or the amplifier kept the field from what was wanted, or its command had to come before the
        first sample.
    explicit
        Whether currents were found in closed form.
    dead_time
        Time in s by which commands were sent earlier, since the field answers later.
    behind, lasting
        Parts of the model behind the force that the current gives, and for how many s it is felt there.
    """

    damper: Damper
    amplifier: Amplifier
    dt: float
    time: Array
    desired: Array
    current: Array
    wanted: Array
    field: Array
    force: Array
    asked: Array
    inner: Array
    low: Array
    high: Array
    flag: Index
    limited: Mask
    explicit: bool
    dead_time: float
    behind: tuple[str, ...]
    lasting: float

    @property
    def free(self) -> Mask:
        """Samples whose force only such forces have made as could be reached and were not held back."""
        bad = (self.flag != REACHED) | self.limited
        places = np.arange(len(bad))
        last = np.maximum.accumulate(np.where(bad, places, -1))
        return np.asarray(places - last > np.ceil(self.lasting / self.dt))

    @property
    def summary(self) -> InversionRow:
        """Numbers that are printed and stand in the JSON file, there with the motion's name."""
        reached = self.flag == REACHED
        free = self.free
        off = np.abs(self.force - self.desired)
        size = float(np.max(np.abs(self.desired), initial=0.0)) or 1.0
        return InversionRow(
            damper=DamperEntry(**asdict(self.damper)),
            amplifier=AmplifierEntry(**asdict(self.amplifier)),
            samples=len(self.time),
            dt=self.dt,
            explicit=self.explicit,
            shares={text: float(np.mean(self.flag == flag)) for flag, text in FLAGS.items()},
            limited=float(np.mean(self.limited & reached)),
            greatest_error_where_reached=float(off[free].max()) if free.any() else None,
            rms_error=float(np.sqrt(np.mean(off**2))),
            rms_error_over_peak=float(np.sqrt(np.mean(off**2))) / size,
            dead_time=self.dead_time,
            behind=self.behind,
        )

    def to_frame(self) -> "DataFrame":
        """Return every sample."""
        from pandas import DataFrame

        given = ("time", "desired", "current", "wanted", "field", "force", "asked", "inner")
        names = (*given, "low", "high", "flag", "limited")
        return DataFrame({n: getattr(self, n) for n in names})


def inversion(
    damper: Damper,
    motion: Mapping[str, Array],
    desired: Array,
    dt: float,
    amplifier: Amplifier | None = None,
    progress: Progress = silent,
) -> Inversion:
    """Return the currents for a series of desired forces at a given motion.

    Parameters
    ----------
    damper
        The damper.
    motion
        Channels (N,) that its model needs, the current excepted.
    desired
        Forces in N or torques in N*m, shape (N,).
    dt
        Sample interval in s.
    amplifier
        What coil and amplifier allow.
    progress
        Called as ``progress(what, done, total)``.
    """
    amplifier = amplifier or Amplifier()
    bare, dead = prompt(damper)
    # what a delay shows late was made by the motion and the current of before: it is undone in the force desired
    inverter, whole = Inverter(Stepper(bare.without("delay"), shortest=dt), amplifier), Stepper(bare, shortest=dt)
    stepper, behind = inverter.stepper, whole.behind
    desired = np.asarray(desired, dtype=np.float64)
    asked = whole.undone(desired[None], dt)[0] if behind else desired
    start = min(max(damper.low, 0.0), damper.high)
    given = stepper.complete({**motion, "current": np.full(len(desired), start)})
    state, found = stepper.rest(_first(motion, start))[0], np.empty((len(desired), 7))
    for first in range(0, len(desired), _BLOCK):
        block = slice(first, first + _BLOCK)
        found[block] = inverted(stepper.chain, inverter.inverse, state, given[block], asked[block], dt)
        progress("currents", min(first + _BLOCK, len(desired)), len(desired))
    command, wanted, field, inner, low, high, flag = found.T.copy()
    late = round(dead / dt)
    current = np.concatenate([command[late:], np.full(min(late, len(desired)), command[-1])])
    time = np.arange(len(desired), dtype=np.float64) * np.float64(dt)
    limited = np.abs(field - wanted) > 1e-9 * max(1.0, damper.high)
    limited[:late] = True
    force = _given(damper, motion, current, dt) if behind or dead > 0.0 else inner
    return Inversion(
        damper, amplifier, dt, time, desired, current, wanted, field, force, asked, inner, low, high,
        flag.astype(np.int64), limited, inverter.explicit, dead, behind, whole.lasting,
    )  # fmt: skip


def _first(motion: Mapping[str, Array], current: float) -> dict[str, Array]:
    return {**{n: c[:1] for n, c in motion.items()}, "current": np.full(1, current)}


def _given(damper: Damper, motion: Mapping[str, Array], current: Array, dt: float) -> Array:
    """Return the force (N,) of the whole model under commands; the first has had an interval to act."""
    stepper = Stepper(damper, shortest=dt)
    given, state = stepper.complete({**motion, "current": current}), stepper.rest(_first(motion, current[0]))[0]
    return np.asarray(followed(stepper.chain, state, given, np.full(len(given), dt))[:, 0].copy())
