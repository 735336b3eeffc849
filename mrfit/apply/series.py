"""The current for a series of desired forces: each sample's inverse behind the last, state and coil carried along."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mrfit.apply.damper import Damper
from mrfit.apply.inverse import FLAGS, REACHED, Inverter, prompt
from mrfit.apply.stepper import Stepper
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.io.schemas.apply import AmplifierEntry, DamperEntry, InversionRow
from mrfit.settings.apply import Amplifier

if TYPE_CHECKING:
    from pandas import DataFrame

# Samples between two reports of progress
_REPORT = 200


@dataclass(frozen=True)
class Inversion:
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
    flag: NDArray[np.int64]
    limited: NDArray[np.bool_]
    explicit: bool
    dead_time: float
    behind: tuple[str, ...]
    lasting: float

    @property
    def free(self) -> NDArray[np.bool_]:
        """Samples whose force only such forces have made as could be reached and were not held back."""
        bad = (self.flag != REACHED) | self.limited
        places = np.arange(len(bad))
        last = np.maximum.accumulate(np.where(bad, places, -1))
        return np.asarray(places - last > np.ceil(self.lasting / self.dt))

    @property
    def summary(self) -> InversionRow:
        """What is printed and stands in the JSON file, there with the motion's name."""
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
    inverter = Inverter(Stepper(bare), amplifier)
    walk = _together if inverter.stepper.static_behind_field else _one_by_one
    behind = inverter.stepper.behind
    asked = inverter.stepper.undone(np.asarray(desired, dtype=np.float64)[None], dt)[0] if behind else desired
    found = walk(inverter, motion, asked, dt, progress)
    late = round(dead / dt)
    current = np.concatenate([found["current"][late:], np.full(min(late, len(desired)), found["current"][-1])])
    time = np.arange(len(desired), dtype=np.float64) * np.float64(dt)
    limited = np.abs(found["field"] - found["wanted"]) > 1e-9 * max(1.0, damper.high)
    limited[:late] = True
    kept = {n: found[n] for n in ("wanted", "field", "inner", "low", "high")}
    force = _given(damper, motion, current, dt, progress) if behind or dead > 0.0 else found["inner"]
    return Inversion(
        damper, amplifier, dt, time, desired, current, **kept, force=force, asked=asked,
        flag=found["flag"].astype(np.int64), limited=limited, explicit=inverter.explicit, dead_time=dead,
        behind=behind, lasting=inverter.stepper.lasting,
    )  # fmt: skip


def _given(damper: Damper, motion: Mapping[str, Array], current: Array, dt: float, progress: Progress) -> Array:
    """Return the force (N,) of the whole model under commands; the first has had an interval to act."""
    stepper, force = Stepper(damper), np.empty(len(current))
    given = {**motion, "current": current}
    state = stepper.rest({n: c[:1] for n, c in given.items()})
    for k in range(len(force)):
        done = stepper.step(state, {n: c[k : k + 1] for n, c in given.items()}, dt)
        force[k], state = done.force[0], done.state
        if k % _REPORT == 0 or k + 1 == len(force):
            progress("forces", k + 1, len(force))
    return force


def _together(
    inverter: Inverter, motion: Mapping[str, Array], desired: Array, dt: float, progress: Progress
) -> dict[str, Array]:
    """Return the inverse of a damper whose force has no memory: of all samples at once, then the coil's one by one."""
    stepper, damper = inverter.stepper, inverter.damper
    channels = {**motion, "current": np.full(len(desired), damper.low)}
    rest = stepper.rest(channels)
    one = inverter.solve(rest, channels, dt, desired)
    field, current = one.field, np.empty(len(desired))
    if stepper.lagging or not inverter.amplifier.unlimited:
        field = np.empty(len(desired))
        state = stepper.rest({n: c[:1] for n, c in channels.items()})
        for k in range(len(desired)):
            now = {n: c[k : k + 1] for n, c in channels.items()}
            now["current"] = inverter.command(state, now, dt, one.field[k : k + 1])
            state = stepper.coil(state, now, dt)
            current[k], field[k] = now["current"][0], state.seen["current"][0]
            if k % _REPORT == 0:
                progress("currents", k, len(desired))
    else:
        current = field
    progress("currents", len(desired), len(desired))
    return {
        "current": current, "wanted": one.field, "field": field, "inner": stepper.inner(rest, channels, dt, field),
        "low": one.low, "high": one.high, "flag": one.flag.astype(np.float64),
    }  # fmt: skip


def _one_by_one(
    inverter: Inverter, motion: Mapping[str, Array], desired: Array, dt: float, progress: Progress
) -> dict[str, Array]:
    names = ("current", "wanted", "field", "inner", "low", "high", "flag")
    found = {n: np.empty(len(desired)) for n in names}
    stepper = inverter.stepper

    def channels(k: int, current: Array) -> dict[str, Array]:
        return {**{n: c[k : k + 1] for n, c in motion.items()}, "current": current}

    current = np.array([min(max(inverter.damper.low, 0.0), inverter.damper.high)])
    state = stepper.rest(channels(0, current))
    for k in range(len(desired)):
        # the first sample has had an interval to get there
        one = inverter.solve(state, channels(k, current), dt, desired[k : k + 1])
        current = inverter.command(state, channels(k, current), dt, one.field)
        done = stepper.step(state, channels(k, current), dt)
        state = done.state
        values = current, one.field, done.field, done.inner, one.low, one.high, one.flag
        for name, value in zip(names, values, strict=True):
            found[name][k] = value[0]
        if k % _REPORT == 0 or k + 1 == len(desired):
            progress("currents", k + 1, len(desired))
    return found
