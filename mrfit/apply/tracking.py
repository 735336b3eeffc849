"""Errors of a damper that tracks desired forces: schemes of control, errors by region, and costs of the current's lag.

The wanted current is the inverse's, within the inverse-tanh paper's eq. 10: the least current where the desired force
would push or is less than the damper's least, the greatest where it is more than its greatest. Regions are the paper's:
I where the wanted current rests at its least or greatest, II where it varies, III from a step between the two until the
force has come within 5 % of what that current gives at rest.

Schemes: ``feedforward`` sends the inverse of field and coil, and of what lies behind the force, since the motion is
known ahead; ``feedback`` a PI controller's current on the error of the force; ``both`` adds the controller's to the
inverse's; ``uninverted`` sends the wanted current as it is, without making up for the lag.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrfit.apply.damper import Damper
from mrfit.apply.following import Course, Lane, Scheme, tracked
from mrfit.apply.framed import FramedResult
from mrfit.apply.inverse import Inverter, prompt
from mrfit.apply.laws import Law
from mrfit.apply.motion import Motion
from mrfit.apply.stepper import Stepper
from mrfit.apply.tested import NamedMotion, beyond_tests
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array, Mask
from mrfit.errors import ConfigError
from mrfit.io.schemas.apply import AmplifierEntry, DamperEntry, GainsEntry, LagCost, Region, TrackFile, TrackingRow
from mrfit.settings.apply import Amplifier

if TYPE_CHECKING:
    from pandas import DataFrame

SCHEMES = ("feedforward", "feedback", "both", "uninverted")
# Region III ends when the force has come this near to what it steps to, as a share
_SETTLED = 0.05


@dataclass(frozen=True)
class Gains:
    """PI controller on the force's error: A per N, and A per N and s; None: found from the damper.

    By default an error of the damper's whole reach is answered by 0.3 of the current's range, and by as much again
    every 5 ms that it lasts.
    """

    proportional: float | None = None
    integral: float | None = None

    def of(self, damper: Damper, reach: float) -> tuple[float, float]:
        """Return both gains, given the forces between least and greatest current, in N."""
        each = (damper.high - damper.low) / max(reach, 1e-9)
        proportional = 0.3 * each if self.proportional is None else self.proportional
        return proportional, proportional / 0.005 if self.integral is None else self.integral


@dataclass(frozen=True)
class TrackingCase:
    """One law tracked by one scheme; arrays (N,).

    Attributes
    ----------
    motion, law, scheme
        Names.
    lag
        Whether the current lagged.
    time, desired, feasible, force
        Times, what the law asks for, the part of it that eq. 10 grants, and what the damper gave.
    wanted, command, field
        Currents: the inverse's, the command, what the fluid saw.
    region
        1, 2 or 3 at every sample.
    """

    motion: str
    law: str
    scheme: str
    lag: bool
    time: Array
    desired: Array
    feasible: Array
    force: Array
    wanted: Array
    command: Array
    field: Array
    region: Array
    velocity: Array

    @property
    def judged(self) -> Array:
        """Samples that count: the first tenth of a second, in which states settle, does not."""
        return np.asarray(self.time >= min(0.1, 0.2 * self.time[-1]))

    @property
    def error(self) -> float:
        """Rms error against the feasible force, over the rms force."""
        return self._relative(self.judged)

    @property
    def error_to_desired(self) -> float:
        """Rms error against the desired force, over the rms of that."""
        kept = self.judged
        off, size = self.force[kept] - self.desired[kept], self.desired[kept]
        return float(np.sqrt(np.mean(off**2) / np.mean(size**2))) if np.any(size) else float("nan")

    @property
    def err_peak(self) -> float:
        """Err_rms_f: rms error over the greatest force (inverse-tanh paper eq. 12)."""
        kept = self.judged
        off = self.force[kept] - self.feasible[kept]
        return float(np.sqrt(np.mean(off**2)) / np.max(np.abs(self.force[kept])))

    @property
    def err_energy(self) -> float:
        """Err_energy: missing share of the energy absorbed (inverse-tanh paper eq. 13), as a positive number."""
        kept = self.judged
        work = [float(np.trapezoid((f * self.velocity)[kept], self.time[kept])) for f in (self.force, self.feasible)]
        return abs(work[0] - work[1]) / abs(work[0]) if work[0] else float("nan")

    @property
    def regions(self) -> tuple[Region, Region, Region]:
        """Errors of regions I, II and III; their squares add up to that of the whole, as the paper's do."""
        kept, found = self.judged, []
        for number in (1, 2, 3):
            own = kept & (self.region == number)
            whole = float(np.sum(self.force[kept] ** 2))
            off = float(np.sum((self.force[own] - self.feasible[own]) ** 2))
            error = float(np.sqrt(off / whole)) if own.any() else float("nan")
            found.append(Region(error=error, share=float(own.sum() / kept.sum())))
        return found[0], found[1], found[2]

    def _relative(self, kept: Array) -> float:
        off, size = self.force[kept] - self.feasible[kept], self.force[kept]
        return float(np.sqrt(np.mean(off**2) / np.mean(size**2))) if np.any(size) else float("nan")

    def numbers(self) -> TrackingRow:
        """Return its errors."""
        return TrackingRow(
            motion=self.motion,
            law=self.law,
            scheme=self.scheme,
            lag=self.lag,
            error=self.error,
            error_to_desired=self.error_to_desired,
            err_rms_f=self.err_peak,
            err_energy=self.err_energy,
            regions=self.regions,
            greatest_command=float(np.max(self.command)),
        )


@dataclass(frozen=True, repr=False)
class TrackingStudy(FramedResult):
    """Every law by every scheme on every motion, and the settings."""

    damper: Damper
    plant: Damper
    amplifier: Amplifier
    gains: tuple[float, float]
    dead_time: float
    cases: tuple[TrackingCase, ...]
    limits: tuple[str, ...] = ()

    @property
    def notes(self) -> list[str]:
        """Limits of the errors: a plant that is the model itself, motions that leave the fit's tests."""
        alone = self.plant == self.damper
        lag = "those of lag and limits alone" if self.lag_costs else "those of the scheme alone"
        said = f"The plant is the model itself: errors are {lag}, not the model's. Another fit as plant shows those."
        return [*([said] if alone else []), *self.limits]

    @property
    def document(self) -> TrackFile:
        """All but the courses, as its file has it."""
        return TrackFile(
            fit=self.damper.name,
            damper=DamperEntry(**asdict(self.damper)),
            plant=DamperEntry(**asdict(self.plant)),
            amplifier=AmplifierEntry(**asdict(self.amplifier)),
            gains=GainsEntry(proportional=self.gains[0], integral=self.gains[1]),
            dead_time=self.dead_time,
            cases=[c.numbers() for c in self.cases],
            lag_costs=self.lag_costs,
            notes=self.notes,
        )

    @property
    def lag_costs(self) -> list[LagCost]:
        """Costs of the lag: the error of every case beside that of the same without lag."""
        without = {(c.motion, c.law, c.scheme): c.error for c in self.cases if not c.lag}
        return [
            LagCost(motion=c.motion, law=c.law, scheme=c.scheme, error=c.error, without_lag=without[key])
            for c in self.cases
            if c.lag and (key := (c.motion, c.law, c.scheme)) in without
        ]

    def to_frame(self) -> "DataFrame":
        """Return the errors."""
        from pandas import DataFrame

        rows = []
        for c in self.cases:
            row = {k: v for k, v in asdict(c.numbers()).items() if k != "regions"}
            for number, region in enumerate(c.regions, start=1):
                row |= {f"region_{number}": region.error, f"share_{number}": region.share}
            rows.append(row)
        return DataFrame(rows)


@dataclass(frozen=True)
class Demand:
    """Desired forces (N,) of a law at a motion."""

    law: str
    force: Array


def demands_of(laws: Sequence[Law], motion: Motion, damper: Damper) -> list[Demand]:
    """Return the forces of laws at a motion."""
    x, v, _ = damper.motion
    return [Demand(law.name, law.force(motion.channels[x], motion.channels[v])) for law in laws]


def tracking(  # noqa: PLR0913
    damper: Damper,
    plant: Damper,
    tasks: Sequence[tuple[Motion, Sequence[Demand]]],
    schemes: Sequence[str],
    amplifier: Amplifier | None = None,
    gains: Gains | None = None,
    progress: Progress = silent,
) -> TrackingStudy:
    """Track desired forces.

    Parameters
    ----------
    damper
        Whose inverse the controller has.
    plant
        The damper that answers: the same one, or one that is more than its model.
    tasks
        Motions, and what is wanted at each.
    schemes
        Of ``SCHEMES``.
    amplifier
        What coil and amplifier allow.
    gains
        Of the PI controller.
    progress
        Called as ``progress(what, done, total)``.

    Raises
    ------
    ConfigError
        If a scheme is unknown.
    """
    for scheme in schemes:
        if scheme not in SCHEMES:
            raise ConfigError(f"--scheme takes {', '.join(SCHEMES)}, not '{scheme}'")
    amplifier, gains = amplifier or Amplifier(), gains or Gains()
    variants = {True: (damper, plant)}
    lagless = damper.lagless(), plant.lagless()
    if lagless != (damper, plant):
        variants[False] = lagless
    cases: list[TrackingCase] = []
    found = (0.0, 0.0)
    for lag, pair in variants.items():
        for motion, demands in tasks:
            lanes = [(d, s) for d in demands for s in schemes]
            loop = _Loop(pair, motion, lanes, amplifier, gains, lag)
            for number, (demand, scheme) in enumerate(lanes):
                loop.follow(demand, scheme)
                what = f"tracking on {motion.name}" + ("" if lag else ", no lag")
                progress(what, (number + 1) * motion.samples, len(lanes) * motion.samples)
            cases += loop.cases
            found = found if any(found) else loop.gains
    x, v, _ = damper.motion
    limits = beyond_tests(damper, [NamedMotion(m.name, m.channels[x], m.channels[v]) for m, _ in tasks])
    return TrackingStudy(damper, plant, amplifier, found, prompt(damper)[1], tuple(cases), tuple(limits))


class _Loop:
    """Control loops side by side, one lane for every demand and scheme."""

    def __init__(
        self,
        pair: tuple[Damper, Damper],
        motion: Motion,
        lanes: Sequence[tuple[Demand, str]],
        amplifier: Amplifier,
        gains: Gains,
        lag: bool,
    ) -> None:
        self.motion, self.lag, self.damper = motion, lag, pair[0]
        model, dead = prompt(pair[0])
        self.ahead = round(dead / motion.dt)
        self.plant = Stepper(pair[1], shortest=motion.dt)
        self.inverter = Inverter(Stepper(model.without("delay"), shortest=motion.dt), amplifier)
        whole, desired = Stepper(model, shortest=motion.dt), np.stack([d.force for d, _ in lanes])
        # what the force must be before what lies behind it, for the lanes that make up for lags
        self.behind = bool(whole.behind)
        asked = whole.undone(desired, motion.dt) if self.behind else desired
        self.asked = {id(d): one for (d, _), one in zip(lanes, asked, strict=True)}
        self.cases: list[TrackingCase] = []
        self.gains = gains.of(self.damper, self._reach())

    def follow(self, demand: Demand, scheme: str) -> None:
        """Run a lane: choose the commands of all samples, and let model and plant answer."""
        motion, low, model = self.motion, self.damper.low, self.inverter.stepper
        held = {**motion.channels, "current": np.full(motion.samples, low)}
        start = {n: c[:1] for n, c in held.items()}
        proportional, integral = self.gains
        chosen = Scheme(
            scheme in ("feedback", "both"), scheme != "feedback", scheme == "uninverted", self.behind,
            float(proportional), float(integral), self.ahead, float(low),
        )  # fmt: skip
        lane = Lane(
            model.chain, self.inverter.inverse, self.plant.chain, model.complete(held), self.plant.complete(held),
            np.ascontiguousarray(demand.force, dtype=np.float64), self.asked[id(demand)].copy(),
            chosen, model.rest(start)[0], self.plant.rest(start)[0],
        )  # fmt: skip
        own = Course(*np.zeros((len(Course._fields), motion.samples)))
        tracked(lane, motion.dt, own)
        region = regions(own.wanted, own.saturated > 0.0, own.force, own.feasible)
        self.cases.append(
            TrackingCase(
                motion.name, demand.law, scheme, self.lag, motion.time, demand.force, own.feasible, own.force,
                own.wanted, own.command, own.field, region, motion.channels[self.damper.motion[1]],
            )
        )  # fmt: skip

    def _reach(self) -> float:
        """Return the median over the motion of what the current moves the force by, in N."""
        stepper, some = self.inverter.stepper, slice(None, None, max(1, self.motion.samples // 200))
        motion = {n: c[some] for n, c in self.motion.channels.items()}
        count = len(next(iter(motion.values())))
        ends = []
        for current in (self.damper.low, self.damper.high):
            given = {**motion, "current": np.full(count, current)}
            ends.append(stepper.inner(stepper.rest(given), given, self.motion.dt, given["current"]))
        return float(np.median(np.abs(ends[1] - ends[0])))


def regions(wanted: Array, saturated: Mask, force: Array, feasible: Array) -> Array:
    """Return the region, 1, 2 or 3, of every sample.

    Parameters
    ----------
    wanted
        Current in A that the inverse asks for.
    saturated
        Whether it rests at its least or greatest.
    force, feasible
        What the damper gives, and what the wanted current gives at rest, in N.
    """
    region = np.where(saturated, 1.0, 2.0)
    span = float(np.ptp(wanted))
    if span <= 0.0:
        return region
    steps = np.flatnonzero(saturated[1:] & (np.abs(np.diff(wanted)) > 0.5 * span)) + 1
    for step in steps:
        near = np.abs(force[step:] - feasible[step:]) <= _SETTLED * np.maximum(np.abs(feasible[step:]), 1e-9)
        ends = int(np.argmax(near)) if near.any() else len(near)
        region[step : step + ends] = 3.0
    return region
