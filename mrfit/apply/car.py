"""A quarter of a car on a damper: equations, controls, and their simulation, many controls and roads side by side.

    m_s*z_s'' = -k_s*(z_s - z_u) - (F - F_rest)
    m_u*z_u'' =  k_s*(z_s - z_u) + (F - F_rest) - k_t*(z_u - z_0) - c_t*(z_u' - z_0')

z_s, z_u heights of the sprung and the unsprung mass above rest, z_0 the road's, F the damper's force at its
displacement z_s - z_u, F_rest what it is at rest, which the preload carries. With m_u = 0 the wheel is rigid,
z_u = z_0. The tyre can pull; a load below zero is reported.

The control is sampled: its command is held over its sample time, in which the simulation takes steps of the classic
Runge-Kutta method of order 4. At every stage the damper takes a trial step from its state at the step's beginning.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import RK45

from mrfit.apply.inverse import Inverter, prompt
from mrfit.apply.roads import Road
from mrfit.apply.stepper import State, Step, Stepper, take
from mrfit.core.progress import Progress, silent
from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.settings.apply import Amplifier

CONTROLS = ("passive-low", "passive-high", "skyhook-on-off", "skyhook", "groundhook", "hybrid")
ON_OFF = "skyhook-on-off"
_WITH_INVERSE = ("skyhook", "groundhook", "hybrid")
_REPORT = 100
# Tolerance of the adaptive simulation, and how many steps it may take in a sample interval
TOLERANCE, MOST_STEPS = 1e-6, 30
_SCALES, _SHORTEST = np.array([1e-7, 1e-6, 1e-7, 1e-6]), 0.01


@dataclass(frozen=True)
class Car:
    """Masses in kg, stiffnesses in N/m, the tyre's damping in N*s/m; ``unsprung`` 0 for a rigid wheel."""

    sprung: float = 400.0
    unsprung: float = 40.0
    spring: float = 20e3
    tyre: float = 180e3
    tyre_damping: float = 0.0

    def __post_init__(self) -> None:
        if min(self.sprung, self.spring, self.tyre) <= 0.0 or min(self.unsprung, self.tyre_damping) < 0.0:
            raise ConfigError("a car needs a sprung mass, a spring and a tyre above 0, no negative mass or damping")

    @property
    def fastest(self) -> float:
        """Its highest natural frequency in Hz, the wheel's unless that is rigid."""
        if self.unsprung == 0.0:
            return float(np.sqrt(self.spring / self.sprung) / (2.0 * np.pi))
        return float(np.sqrt((self.spring + self.tyre) / self.unsprung) / (2.0 * np.pi))

    @property
    def least_mass(self) -> float:
        """The mass that the damper's force moves first, in kg."""
        return self.sprung if self.unsprung == 0.0 else self.sprung * self.unsprung / (self.sprung + self.unsprung)


@dataclass(frozen=True)
class Control:
    """How the current is chosen.

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

    def __post_init__(self) -> None:
        if not 1e-6 <= self.sample <= 0.1 or not 1 <= self.steps <= 1000:
            raise ConfigError(
                "the control's sample time is 1 µs to 0.1 s, with 1 to 1000 steps of the simulation in it"
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


@dataclass
class _Lanes:
    """Cars side by side: what each has at the end of a step."""

    car: Car
    stepper: Stepper
    soft: float
    rest: Array
    names: tuple[str, str, str]
    accelerations: Array = field(default_factory=lambda: np.zeros((2, 0)))

    def channels(self, y: Array, road: tuple[Array, Array], a: Array, current: Array) -> dict[str, Array]:
        """Return the damper's channels of heights and velocities (4, B)."""
        zu, vu = (y[2], y[3]) if self.car.unsprung else road
        values = dict(zip(self.names, (y[0] - zu, y[1] - vu, a[0] - a[1]), strict=True))
        return {**values, "current": current}

    def softened(self, force: Array, v: Array) -> Array:
        """Return the force without what it is at rest, faded out about standstill in a soft damper."""
        moved = force - self.rest
        return moved if self.soft == 0.0 else moved * -np.expm1(-((v / self.soft) ** 2))

    def slope(self, y: Array, road: tuple[Array, Array], force: Array) -> Array:
        """Return the rates of heights and velocities (4, B) under a force beyond rest."""
        car = self.car
        zu, vu = (y[2], y[3]) if car.unsprung else road
        spring = car.spring * (y[0] - zu) + force
        body = -spring / car.sprung
        if not car.unsprung:
            return np.stack([y[1], body, np.zeros_like(body), np.zeros_like(body)])
        wheel = (spring - car.tyre * (zu - road[0]) - car.tyre_damping * (vu - road[1])) / car.unsprung
        return np.stack([y[1], body, vu, wheel])


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
    walk = _Walk(stepper, car, pairs, timing, amplifier)
    total = walk.samples
    for k in range(total):
        walk.record(k)
        if k + 1 < total:
            walk.advance(k)
        if k % _REPORT == 0 or k + 1 == total:
            progress(f"ride of {stepper.damper.name}", k + 1, total)
    return walk.rides()


class _Walk:
    """A simulation on its way."""

    def __init__(
        self,
        stepper: Stepper,
        car: Car,
        pairs: Sequence[tuple[Control, Road]],
        timing: Timing,
        amplifier: Amplifier | None,
    ) -> None:
        self.pairs, self.timing, self.stepper = pairs, timing, stepper
        count, damper = len(pairs), stepper.damper
        self.samples = 1 + max(round(min(road.duration, timing.until) / timing.sample) for _, road in pairs)
        self.h = timing.sample / timing.steps
        times = np.arange(2 * timing.steps * (self.samples - 1) + 1, dtype=np.float64) * np.float64(self.h / 2.0)
        by_road = {road: road.height(times) for road in dict.fromkeys(road for _, road in pairs)}
        # height and its rate at whole and half steps, (2, 2*N + 1, B)
        self.road = np.stack([np.stack([by_road[road][k] for _, road in pairs], axis=-1) for k in (0, 1)])
        self.inverter = Inverter(stepper, amplifier)
        # a dead time cannot be made up for where the motion is not known in advance: the rest of the coil is inverted
        self.coil = Inverter(Stepper(prompt(damper)[0]), amplifier)
        self.current = np.full(count, damper.low)
        still = {n: np.zeros(count) for n in damper.motion}
        self.state = stepper.rest({**still, "current": self.current})
        self.coil_state = self.coil.stepper.rest({**still, "current": self.current})
        at_rest = stepper.step(self.state, {**still, "current": self.current}, 0.0)
        self.lanes = _Lanes(car, stepper, timing.soft, at_rest.force, damper.motion)
        self.y, self.force, self.field = np.zeros((4, count)), at_rest.force, at_rest.field
        self.rates = np.zeros((4, count))
        names = ("acceleration", "tyre", "travel", "speed", "body", "wheel", "force", "current", "field")
        self.kept = {n: np.zeros((len(times), count)) for n in names}

    def record(self, k: int) -> None:
        """Choose the command of a sample, and keep what is there."""
        at = 2 * k * self.timing.steps
        road = (self.road[0, at], self.road[1, at])
        self.rates = self.slope(self.y, road, self.force)
        wheel = self.y[2:] if self.lanes.car.unsprung else np.stack(road)
        self.current = self._command(self.y[:2] - wheel, wheel)
        self._keep(at, self.y, self.rates, self.force, self.field)

    def _keep(self, at: int, y: Array, rates: Array, force: Array, field: Array) -> None:
        road, car = self.road[:, at], self.lanes.car
        wheel = y[2:] if car.unsprung else road
        tyre = car.tyre * (y[2] - road[0]) if car.unsprung else np.zeros_like(force)
        travel = y[:2] - wheel
        acting = self.lanes.softened(force, travel[1]) + self.lanes.rest
        values = (rates[1], tyre, *travel, y[1], wheel[1], acting, self.current, field)
        for name, value in zip(self.kept, values, strict=True):
            self.kept[name][at] = value

    def slope(self, y: Array, road: Sequence[Array], force: Array) -> Array:
        """Return the rates of heights and velocities under a damper's force."""
        v = y[1] - (y[3] if self.lanes.car.unsprung else road[1])
        return self.lanes.slope(y, (road[0], road[1]), self.lanes.softened(force, v))

    def take_over(self, done: Step, y: Array, road: tuple[Array, Array]) -> None:
        """Go on from the end of a step."""
        self.state, self.force, self.field, self.y = done.state, done.force, done.field, y
        self.rates = self.slope(y, road, done.force)

    def _trial(self, y: Array, at: int, before: Array, dt: float) -> tuple[Array, Array, Array, State]:
        """Return slope, force and field where a step of dt ends in y, and the damper's state there."""
        road = (self.road[0, at], self.road[1, at])
        # the acceleration that a model branches by is the last stage's: its own follows from the force sought
        channels = self.lanes.channels(y, road, before[[1, 3]], self.current)
        done = self.stepper.step(self.state, channels, dt)
        return self.slope(y, road, done.force), done.force, done.field, done.state

    def advance(self, k: int) -> None:
        """Go on to the next sample.

        Raises
        ------
        DataError
            If a lane leaves all bounds.
        """
        h, y = self.h, self.y
        with np.errstate(all="ignore"):
            for step in range(self.timing.steps):
                at = 2 * (k * self.timing.steps + step)
                one = self.rates if step == 0 else self.slope(y, tuple(self.road[:, at]), self.force)
                if step:
                    self._keep(at, y, one, self.force, self.field)
                middle = y + 0.5 * h * one
                two, force, field, _ = self._trial(middle, at + 1, one, 0.5 * h)
                # of the two stages there the first, which shows a force that flips from one to the next
                self._keep(at + 1, middle, two, force, field)
                three = self._trial(y + 0.5 * h * two, at + 1, two, 0.5 * h)[0]
                four = self._trial(y + h * three, at + 2, three, h)[0]
                y = y + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
                _, self.force, self.field, self.state = self._trial(y, at + 2, four, h)
        self.y = y
        if not np.isfinite(y).all() or np.abs(y).max() > 1e3:
            raise DataError(
                f"'{self.stepper.damper.name}': the simulation leaves all bounds at {k * self.timing.sample:.3g} s "
                f"with steps of {h:g} s: take shorter ones (--steps)"
            )

    def _command(self, travel: Array, wheel: Array) -> Array:
        """Return the commands (B,) of the controls."""
        damper, v = self.stepper.damper, travel[1]
        current, body = self.current.copy(), self.y[1]
        wanted = np.zeros_like(v)
        for lane, (control, _) in enumerate(self.pairs):
            if control.name == ON_OFF:
                current[lane] = damper.high if body[lane] * v[lane] >= 0.0 else damper.low
            elif control.name == "passive-high":
                current[lane] = damper.high
            wanted[lane] = desired(control, v[lane], body[lane], wheel[1, lane])
        lanes = np.array([k for k, (c, _) in enumerate(self.pairs) if c.name in _WITH_INVERSE], dtype=np.int64)
        if len(lanes):
            state = take(self.state, lanes)
            rates = (
                self.rates[[1, 3]][:, lanes] if self.lanes.car.unsprung else self.rates[[1, 1]][:, lanes] * [[1], [0]]
            )
            values = (*travel[:, lanes], rates[0] - rates[1])
            channels = {**dict(zip(damper.motion, values, strict=True)), "current": current[lanes]}
            # as if the motion stayed for a sample: what comes is not known
            dt = self.timing.sample
            field = self.inverter.solve(state, channels, dt, wanted[lanes] + self.lanes.rest[lanes]).field
            current[lanes] = self.coil.command(take(self.coil_state, lanes), channels, dt, field)
            if self.coil.stepper.lagging:
                given = {**dict(zip(damper.motion, (*travel, np.zeros_like(v)), strict=True)), "current": current}
                self.coil_state = self.coil.stepper.coil(self.coil_state, given, dt)
        return current

    def rides(self) -> list[Ride]:
        """Return every lane, as long as its road."""
        found = []
        for lane, (control, road) in enumerate(self.pairs):
            count = 1 + 2 * self.timing.steps * round(min(road.duration, self.timing.until) / self.timing.sample)
            values = [v[:count, lane].copy() for v in self.kept.values()]
            found.append(Ride(control, road, np.arange(count, dtype=np.float64) * np.float64(0.5 * self.h), *values))
        return found


def desired(control: Control, v: float, body: float, wheel: float) -> float:
    """Return the force in N that a control wants, 0 where the damper would have to push.

    Source: skyhook, D. Karnopp, M. Crosby, R. Harwood, J. Eng. Ind. 96 (1974) 619; groundhook, M. Valasek et al.,
    Vehicle System Dynamics 27 (1997) 5.
    """
    sky = control.damping * body if body * v > 0.0 else 0.0
    ground = -control.damping * wheel if -wheel * v > 0.0 else 0.0
    if control.name == "hybrid":
        return control.share * sky + (1.0 - control.share) * ground
    return sky if control.name == "skyhook" else ground


@dataclass(frozen=True)
class Check:
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
) -> Check:
    """Simulate one car by scipy's RK45, which chooses its steps, from sample to sample of the control."""
    walk = _Walk(stepper, car, [pair], timing, amplifier)
    chosen = _Adaptive(walk, pair[1])
    seen = np.empty(walk.samples)
    for k in range(walk.samples):
        walk.record(k)
        seen[k] = walk.rates[1, 0]
        if k + 1 < walk.samples and not chosen.advance(k):
            return Check(float("nan"), chosen.evaluations, k * timing.sample, pair[1].duration)
    settled = np.arange(walk.samples) * timing.sample >= pair[1].settled
    return Check(rms(seen[settled]), chosen.evaluations, pair[1].duration, pair[1].duration)


class _Adaptive:
    """Steps of RK45 instead of a walk's; the damper's trial steps begin where the last accepted one ended."""

    def __init__(self, walk: _Walk, road: Road) -> None:
        self.walk, self.road, self.since, self.size, self.evaluations = walk, road, 0.0, walk.timing.sample, 0

    def advance(self, k: int) -> bool:
        """Go on to the next sample; return whether that took a bounded number of steps."""
        walk, sample = self.walk, self.walk.timing.sample
        self.since = k * sample
        solver = RK45(
            self._slope,
            self.since,
            walk.y[:, 0],
            self.since + sample,
            rtol=TOLERANCE,
            atol=_SCALES,  # type: ignore[arg-type]
            first_step=min(self.size, sample) * (1.0 - 1e-9),
        )
        for _ in range(MOST_STEPS):
            solver.step()
            if solver.status == "failed":
                break
            self._commit(solver.t, solver.y)
            # the next sample may begin with a step that was good here, but for the last, which is cut
            self.size = max(self.size if solver.status == "finished" else solver.h_abs, _SHORTEST * sample)
            if solver.status == "finished":
                break
        self.evaluations += solver.nfev
        return bool(solver.status == "finished")

    def _at(self, t: float, y: Array) -> tuple[Array, tuple[Array, Array], dict[str, Array]]:
        at, column = self.road.height(np.array([t])), y[:, None]
        return column, at, self.walk.lanes.channels(column, at, self.walk.rates[[1, 3]], self.walk.current)

    def _slope(self, t: float, y: Array) -> Array:
        column, at, channels = self._at(t, y)
        dt = t - self.since
        force = self.walk.stepper.step(self.walk.state, channels, dt).force if dt > 0.0 else self.walk.force
        return np.asarray(self.walk.slope(column, at, force)[:, 0])

    def _commit(self, t: float, y: Array) -> None:
        column, at, channels = self._at(t, y)
        done = self.walk.stepper.step(self.walk.state, channels, t - self.since)
        self.walk.take_over(done, column, at)
        self.since = t
