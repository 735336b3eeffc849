"""A study of a quarter car: every control on every road, with and without lag, and what makes it chatter."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

import numpy as np

from mrfit.apply.car import AdaptiveCheck, Car, Control, Ride, Timing, adaptive, drive, rms
from mrfit.apply.chatter import OR, SOFTENING, told_apart
from mrfit.apply.damper import Damper
from mrfit.apply.framed import FramedResult
from mrfit.apply.roads import Road
from mrfit.apply.stepper import Stepper
from mrfit.apply.tested import NamedMotion, beyond_tests
from mrfit.core import registry
from mrfit.core.grouping import grouped
from mrfit.core.progress import Progress, silent
from mrfit.io.schemas import apply as schemas
from mrfit.settings.apply import Amplifier

if TYPE_CHECKING:
    from pandas import DataFrame

# Fixed and adaptive steps agree if their rms accelerations differ by less than this share
_AGREE = 0.02


@dataclass(frozen=True, repr=False)
class QuarterCar(FramedResult):
    """A study: what was asked, and every ride in numbers.

    Attributes
    ----------
    damper, car, timing, amplifier
        What was simulated.
    controls, roads
        What it was driven by; a random road has its seed in it.
    rows
        One of each control on each road, with the lag and, where there is one, without.
    checks
        By control, on the first road: the adaptive simulation beside the fixed steps.
    rides
        Their courses, for figures.
    """

    damper: Damper
    car: Car
    timing: Timing
    amplifier: Amplifier
    controls: tuple[Control, ...]
    roads: tuple[Road, ...]
    rows: tuple[schemas.RideRow, ...]
    checks: tuple[tuple[str, AdaptiveCheck], ...]
    rides: tuple[Ride, ...]

    @property
    def lags(self) -> bool:
        """Whether the damper's current lags."""
        return any(not row.lag for row in self.rows)

    @property
    def findings(self) -> list[str]:
        """Findings in words: chatter and its cause, and disagreement of fixed and adaptive steps."""
        found = [*self._limits(), *_chatter_in_words(self.rows, _branches(self.damper))]
        by_control = {
            row.control: row for row in self.rows if row.lag == self.rows[0].lag and row.road == self.rows[0].road
        }
        agreeing = []
        for name, check in self.checks:
            fixed = by_control[name].acceleration
            if np.isnan(check.acceleration):
                found.append(
                    f"{name} on {self.roads[0].name}: the adaptive simulation came to {check.ended:.3g} s of "
                    f"{check.duration:g} s within its bound on steps; the fixed steps alone stand for the rest"
                )
            elif abs(check.acceleration - fixed) > _AGREE * fixed:
                found.append(
                    f"{name} on {self.roads[0].name}: fixed steps ({fixed:.4g} m/s²) and adaptive ones "
                    f"({check.acceleration:.4g} m/s²) disagree by more than {100 * _AGREE:g} %"
                )
            else:
                agreeing.append(name)
        if agreeing:
            found.append(
                f"Fixed and adaptive steps agree within {100 * _AGREE:g} % on {self.roads[0].name}: "
                f"{', '.join(agreeing)}."
            )
        return found

    def _limits(self) -> list[str]:
        """Return warnings of rides beyond the damper's tests, and beyond a linear tyre."""
        said = beyond_tests(
            self.damper, [NamedMotion(f"{r.control.name} on {r.road.name}", r.travel, r.speed) for r in self.rides]
        )
        lifted = [row for row in self.rows if row.lag and row.least_load is not None and row.least_load < 0.0]
        if lifted:
            roads = ", ".join(dict.fromkeys(row.road for row in lifted))
            said.append(
                f"The tyre's load falls below 0 in {len(lifted)} of {len(self.rides)} rides ({roads}): there a wheel "
                "would leave the road, where the linear tyre pulls."
            )
        return said

    @property
    def document(self) -> schemas.QuarterCarFile:
        """All but the courses, as its file has it."""
        return schemas.QuarterCarFile(
            fit=self.damper.name,
            damper=schemas.DamperEntry(**asdict(self.damper)),
            car=schemas.CarEntry(**asdict(self.car)),
            timing=schemas.TimingEntry(**asdict(self.timing)),
            amplifier=schemas.AmplifierEntry(**asdict(self.amplifier)),
            controls=[schemas.ControlEntry(**asdict(c)) for c in self.controls],
            roads=[{"name": r.name, **asdict(r)} for r in self.roads],  # type: ignore[call-overload]
            rows=list(self.rows),
            checks=[schemas.CheckRow(control=name, **asdict(check)) for name, check in self.checks],
            findings=self.findings,
        )

    def to_frame(self) -> "DataFrame":
        """Return the rows, what was found of chatter beside them."""
        from pandas import DataFrame

        return DataFrame(
            [{**{k: v for k, v in asdict(r).items() if k != "chatter"}, **asdict(r.chatter)} for r in self.rows]
        )


def _branches(damper: Damper) -> bool:
    spec = registry.load("model", damper.model.partition("+")[0]).SPEC
    return damper.motion[2] in spec.inputs


def _chatter_in_words(rows: Sequence[schemas.RideRow], branches: bool) -> list[str]:
    """Return a sentence on every cause of chatter and limit cycles, with its rides."""
    odd = [(row.chatter, row) for row in rows if row.chatter.found or row.chatter.limit_cycle]
    alike = grouped(((one.cause, row.lag, one.found, bool(one.limit_cycle)), row) for one, row in odd)
    return [
        f"{_rides(some)} {' and '.join(_kinds(some))}. Cause: {_cause(cause, some, branches)}."
        for (cause, *_), some in alike.items()
    ]


def _rides(rows: Sequence[schemas.RideRow]) -> str:
    by_road = grouped((row.road, row.control) for row in rows)
    text = "; ".join(f"{', '.join(controls)} on {road}" for road, controls in by_road.items())
    return text + ("" if rows[0].lag else ", without lag")


def _kinds(rows: Sequence[schemas.RideRow]) -> list[str]:
    """Return the behaviour of rides of one kind in words."""
    several, kinds, s = [row.chatter for row in rows], [], "s" if len(rows) == 1 else ""
    if several[0].found:
        share, swing = _span([100.0 * c.share for c in several], 0), _span([c.swing for c in several], 3)
        rate = _span([c.rate for c in several], 0)
        kinds.append(f"chatter{s} at {rate} Hz for {share} % of the time, {swing} N a swing")
    if several[0].limit_cycle:
        rate = _span([c.limit_cycle for c in several], 3)
        kinds.append(f"go{'es' if s else ''} on oscillating at {rate} Hz on the level road (limit cycle)")
    return kinds


def _span(values: Sequence[float], digits: int) -> str:
    """Return a number, or the least and greatest of several, whole where they are great or have no digits asked for."""
    ends = [f"{v:.{digits}g}" if digits and v < 1000.0 else f"{v:.0f}" for v in (min(values), max(values))]
    return " to ".join(dict.fromkeys(ends))


def _cause(cause: str, rows: Sequence[schemas.RideRow], branches: bool) -> str:
    """Return the cause of rides in words, with what is left without it."""
    causes = {
        "lag": "the current's lag",
        "sample time": "the control's sample time (a quarter of it tried)",
        "pre-yield slope": f"the pre-yield slope (faded out below {1e3 * SOFTENING:g} mm/s)",
    }
    named = [c for c in cause.split(OR) if c in causes]
    if not named:
        return "none of lag, sample time and pre-yield slope alone; what is left is the switching of the control's law"
    weights = [dict(row.chatter.evidence) for row in rows]
    shares = [100.0 * one[f"without {c}"] / one["as it is"] for one in weights for c in named]
    text = f"{OR.join(causes[c] for c in named)}: without it {_span(shares, 2)} % of swing × time is left"
    if branches and cause == "pre-yield slope":
        text += "; the model branches by the sign of an acceleration that its own force makes"
    return text


def quarter_car(  # noqa: PLR0913
    damper: Damper,
    car: Car,
    controls: Sequence[Control],
    roads: Sequence[Road],
    timing: Timing,
    amplifier: Amplifier | None = None,
    check: bool = True,
    progress: Progress = silent,
) -> QuarterCar:
    """Drive a car on a damper under every control and on every road.

    Parameters
    ----------
    damper
        The damper, with its lag; what delays a rig's record only (``delay``) is left out.
    car
        Masses, spring, tyre.
    controls, roads
        What to simulate.
    timing
        Sample time of the control, and steps within it.
    amplifier
        What coil and amplifier allow.
    check
        Whether to simulate every control on the first road adaptively too.
    progress
        Called as ``progress(what, done, total)``.
    """
    amplifier = amplifier or Amplifier()
    damper = damper.without("delay")
    prompt = damper.lagless()
    pairs = [(control, road) for road in roads for control in controls]
    steppers = {True: Stepper(damper)} | ({False: Stepper(prompt)} if prompt != damper else {})
    rows: list[schemas.RideRow] = []
    rides: list[Ride] = []
    for lag, stepper in steppers.items():

        def again(some: Sequence[Ride], changed: Timing, lagless: bool, own: Stepper = stepper) -> list[Ride]:
            chosen = Stepper(prompt) if lagless else own
            return drive(chosen, car, [(r.control, r.road) for r in some], changed, amplifier, progress)

        found = drive(stepper, car, pairs, timing, amplifier, progress)
        chatter = told_apart(found, timing, car.fastest, again, lag and len(steppers) > 1)
        rows += [_row(ride, car, lag, one) for ride, one in zip(found, chatter, strict=True)]
        rides += found if lag else []
    checks = []
    for k, control in enumerate(controls if check else ()):
        progress("adaptive check", k, len(controls))
        checks.append((control.name, adaptive(steppers[True], car, (control, roads[0]), timing, amplifier)))
    progress("adaptive check", len(controls), len(controls))
    return QuarterCar(
        damper, car, timing, amplifier, tuple(controls), tuple(roads), tuple(rows), tuple(checks), tuple(rides)
    )


def _row(ride: Ride, car: Car, lag: bool, chatter: schemas.Chatter) -> schemas.RideRow:
    static = (car.sprung + car.unsprung) * 9.81
    rolling = car.unsprung > 0.0
    on = ride.time >= ride.road.settled
    load, travel = ride.tyre_load[on], ride.travel[on]
    return schemas.RideRow(
        road=ride.road.name,
        control=ride.control.name,
        lag=lag,
        acceleration=rms(ride.acceleration[on]),
        tyre_load=rms(load) / static if rolling else float("nan"),
        least_load=1.0 - float(np.max(load)) / static if rolling else float("nan"),
        travel=rms(travel),
        greatest_travel=float(np.max(np.abs(travel))),
        current=float(np.mean(ride.current[on])),
        chatter=chatter,
    )
