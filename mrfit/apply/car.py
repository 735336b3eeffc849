"""A quarter of a car on a damper: equations, controls, and their simulation, many controls and roads side by side.

    m_s*z_s'' = -k_s*(z_s - z_u) - (F - F_rest)
    m_u*z_u'' =  k_s*(z_s - z_u) + (F - F_rest) - k_t*(z_u - z_0) - c_t*(z_u' - z_0')

z_s, z_u heights of the sprung and the unsprung mass above rest, z_0 the road's, F the damper's force at its
displacement z_s - z_u, F_rest what it is at rest, which the preload carries. With m_u = 0 the wheel is rigid,
z_u = z_0. The tyre can pull; a load below zero is reported.

The control is sampled: its command is held over its sample time, in which the simulation takes steps of the classic
Runge-Kutta method of order 4. At every stage the damper takes a trial step from its state at the step's beginning.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np

from mrfit.apply import walk
from mrfit.apply.inverse import Inverter, prompt
from mrfit.apply.roads import Road
from mrfit.apply.stepper import Stepper
from mrfit.core.arguments import check_arguments
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.core.workers import give_up, in_order
from mrfit.errors import ConfigError, DataError
from mrfit.settings.apply import Amplifier
from mrfit.settings.shared import CORES

CONTROLS = ("passive-low", "passive-high", "skyhook-on-off", "skyhook", "groundhook", "hybrid")
ON_OFF = "skyhook-on-off"
WITH_DESIRED_DAMPING = ("skyhook", "groundhook", "hybrid")


@check_arguments
@dataclass(frozen=True)
class Car:
    """Masses in kg, stiffnesses in N/m, the tyre's damping in N*s/m; ``unsprung`` 0 for a rigid wheel."""

    sprung: float = 400.0
    unsprung: float = 40.0
    spring: float = 20e3
    tyre: float = 180e3
    tyre_damping: float = 0.0

    def __post_init__(self) -> None:
        for name in ("sprung", "unsprung", "spring", "tyre", "tyre_damping"):
            value, may_be_zero = getattr(self, name), name in ("unsprung", "tyre_damping")
            if not (value > 0.0 or (may_be_zero and value == 0.0)):
                least = "0 or more" if may_be_zero else "a number above 0"
                raise ConfigError(f"--{name.replace('_', '-')} takes {least}, not {value:g}")

    @property
    def fastest(self) -> float:
        """Its highest natural frequency in Hz, the wheel's unless that is rigid."""
        if self.unsprung == 0.0:
            return float(np.sqrt(self.spring / self.sprung) / (2.0 * np.pi))
        return float(np.sqrt((self.spring + self.tyre) / self.unsprung) / (2.0 * np.pi))


@check_arguments
@dataclass(frozen=True)
class Control:
    """A control, which chooses the current.

    Attributes
    ----------
    name
        One of ``CONTROLS``.
    damping
        Desired damping in N*s/m of skyhook, groundhook and hybrid.
    share
        Of skyhook in the hybrid.
    """

    name: str
    damping: float = 2000.0
    share: float = 0.5

    def __post_init__(self) -> None:
        if self.name not in CONTROLS:
            raise ConfigError(f"--control takes {', '.join(CONTROLS)}, not '{self.name}'")


@check_arguments
@dataclass(frozen=True)
class Timing:
    """Sample time of the control in s, and steps of the simulation within it.

    To tell what makes a force chatter, ``soft`` m/s about standstill in which it fades to nothing; ``until`` in s the
    simulation ends, if not before.
    """

    sample: float = 1e-3
    steps: int = 2
    soft: float = 0.0
    until: float = np.inf

    def samples(self, road: Road) -> int:
        """Return the number of the control's samples on a road."""
        return 1 + max(round(min(road.duration, self.until) / self.sample), 0)

    def __post_init__(self) -> None:
        if not 1e-6 <= self.sample <= 0.1 or not 1 <= self.steps <= 1000:
            raise ConfigError(
                f"--sample takes 1e-06 to 0.1 s and --steps 1 to 1000, not {self.sample:g} s and {self.steps}"
            )


@dataclass(frozen=True)
class Ride:
    """A car on a road; arrays at the simulation's steps and half-way between them, (N,).

    What happens between two steps, where a force that jumps is one thing at either end and another in the middle, would
    else stay hidden.

    Attributes
    ----------
    control, road
        Which.
    time
        In s.
    acceleration
        Of the sprung mass in m/s^2.
    tyre_load
        Beyond the static one, in N; zeros with a rigid wheel.
    travel, speed
        Displacement and velocity of the damper in m and m/s.
    body, wheel
        Velocities of the masses in m/s.
    force, current, field
        Of the damper in N, commanded and seen by the fluid in A.
    """

    control: Control
    road: Road
    time: Array
    acceleration: Array
    tyre_load: Array
    travel: Array
    speed: Array
    body: Array
    wheel: Array
    force: Array
    current: Array
    field: Array


def rms(values: Array) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


# Samples after which a ride sees whether it is waited for
_BLOCK = 1000
# Courses of roads that are remembered
_ROADS = 8


@dataclass(frozen=True)
class StartedRide:
    """A control and a road, the car on it as it is simulated, and how far that has come."""

    control: Control
    road: Road
    setup: walk.Setup
    way: walk.Way


def drive(
    stepper: Stepper,
    car: Car,
    pairs: Sequence[tuple[Control, Road]],
    timing: Timing,
    amplifier: Amplifier | None = None,
    progress: Progress = silent,
) -> list[Ride]:
    """Simulate a car under several controls and roads, as many lanes, by fixed steps.

    Raises
    ------
    DataError
        If a lane leaves all bounds: the steps are too long for the damper's stiffest part.
    """
    total, done, rides = sum(timing.samples(road) for _, road in pairs), 0, []

    def ride_of(started: StartedRide) -> Ride:
        setup, samples = started.setup, timing.samples(started.road)
        for first in range(0, samples, _BLOCK):
            left = walk.driven(setup, started.way, first, min(first + _BLOCK, samples), samples)
            if left >= 0:
                raise DataError(
                    f"'{stepper.damper.name}': the simulation leaves all bounds at {left * timing.sample:.3g} s "
                    f"with steps of {timing.sample / timing.steps:g} s: take shorter ones (--steps)"
                )
            give_up()
        time = np.arange(setup.course.shape[1], dtype=np.float64) * np.float64(0.5 * timing.sample / timing.steps)
        return Ride(started.control, started.road, time, *setup.course)

    # set up one after the other, so that a road's course is computed once; the loops are compiled and leave the
    # interpreter's lock to each other
    started = (StartedRide(*pair, *setup_of(stepper, car, pair, timing, amplifier)) for pair in pairs)
    for ride in in_order(ride_of, started, CORES):
        rides.append(ride)
        done += timing.samples(ride.road)
        progress(f"ride of {stepper.damper.name}", done, total)
    return rides


def desired(control: Control, v: float, body: float, wheel: float) -> float:
    """Return the force in N that a control wants, 0 where the damper would have to push.

    Source: skyhook, D. Karnopp, M. Crosby, R. Harwood, J. Eng. Ind. 96 (1974) 619; groundhook, M. Valasek et al.,
    Vehicle System Dynamics 27 (1997) 5.
    """
    return walk.wanted(_numbers(control, Timing(), 0.0, 0.0), v, body, wheel)


def _numbers(control: Control, timing: Timing, low: float, high: float) -> walk.ControlNumbers:
    number = CONTROLS.index(control.name)
    sizes = float(control.damping), float(control.share), float(timing.sample)
    return walk.ControlNumbers(number, *sizes, timing.steps, float(low), float(high))


@lru_cache(_ROADS)
def _heights(road: Any, points: int, spacing: float) -> Array:
    """Return height and its rate (2, M) of a road, under which several controls are driven."""
    return np.ascontiguousarray(np.stack(road.height(np.arange(points, dtype=np.float64) * np.float64(spacing))))


def setup_of(
    stepper: Stepper, car: Car, pair: tuple[Control, Road], timing: Timing, amplifier: Amplifier | None
) -> tuple[walk.Setup, walk.Way]:
    """Return a ride, and where it begins."""
    damper, (control, road) = stepper.damper, pair
    points = 2 * timing.steps * (timing.samples(road) - 1) + 1
    # a dead time cannot be made up for where the motion is not known in advance: the rest of the coil is inverted
    coil = Inverter(Stepper(prompt(damper)[0], shortest=stepper.shortest), amplifier)
    still = {n: np.zeros(1) for n in damper.motion} | {"current": np.full(1, damper.low)}
    rest = stepper.step(stepper.rest(still), still, 0.0).force[0]
    masses = (car.sprung, car.unsprung, car.spring, car.tyre, car.tyre_damping, timing.soft, rest)
    setup = walk.Setup(
        stepper.chain, Inverter(stepper, amplifier).inverse, coil.stepper.chain, coil.inverse,
        np.array([stepper.inputs.index(n) if n in stepper.inputs else -1 for n in damper.motion]),
        stepper.complete(still)[0], walk.QuarterCarNumbers(*map(float, masses)),
        _numbers(control, timing, damper.low, damper.high),
        _heights(cast(Hashable, road), points, 0.5 * timing.sample / timing.steps),
        np.zeros((walk.KEPT_ROWS, points)),
    )  # fmt: skip
    limits = coil.inverse.limits
    return setup, walk.begun(setup, float(np.clip(damper.low, limits.low, limits.high)))


@dataclass(frozen=True)
class AdaptiveCheck:
    """The adaptive simulation beside the fixed steps.

    Attributes
    ----------
    acceleration
        Rms of the sprung acceleration in m/s^2; nan where it did not come to an end.
    evaluations
        Of the damper's force.
    ended
        Time in s it came to.
    """

    acceleration: float
    evaluations: int
    ended: float
    duration: float


def adaptive(
    stepper: Stepper, car: Car, pair: tuple[Control, Road], timing: Timing, amplifier: Amplifier | None = None
) -> AdaptiveCheck:
    """Simulate one car from sample to sample by Dormand's and Prince's method, which chooses its steps."""
    samples = timing.samples(pair[1])
    setup, way = setup_of(stepper, car, pair, timing, amplifier)
    left = walk.adapted(setup, way, samples)
    evaluations = int(way.now[4])
    if left >= 0:
        return AdaptiveCheck(float("nan"), evaluations, left * timing.sample, pair[1].duration)
    seen = setup.course[walk.ACCELERATION, :: 2 * timing.steps]
    settled = np.arange(samples) * timing.sample >= pair[1].settled
    return AdaptiveCheck(rms(seen[settled]), evaluations, pair[1].duration, pair[1].duration)
