"""A quarter car on its way, in compiled loops: one control on one road, from sample to sample.

``mrfit.apply.car`` says what is simulated.
"""

import math
from typing import NamedTuple

import numpy as np

from mrfit.apply.solving import Inverse, allowed, command, solve
from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import borrowing, kernel, part
from mrfit.simulate.chain import DamperChain, Trial, commit, inputs, step

# Controls, in the order of ``car.CONTROLS``
_PASSIVE_HIGH, _ON_OFF, _SKYHOOK, _HYBRID = 1, 2, 3, 5
# Rows of ``Setup.course``
ACCELERATION, _LOAD, _TRAVEL, _SPEED, _BODY, _WHEEL, _FORCE, _COMMAND, _FIELD, KEPT_ROWS = range(10)
# Beyond these heights and velocities the steps were too long
_BOUND = 1e3
# Of the adaptive steps: tolerances, and how many there may be in a sample interval
_TOLERANCE, _MOST_STEPS, _SHORTEST = 1e-6, 30, 0.01
# Row of ``Way.stages`` at which a trial ends, behind those of seven stages
_END = 7


class QuarterCarNumbers(NamedTuple):
    """A car's masses in kg, spring and tyre in N/m, tyre's damping in N*s/m.

    ``soft`` is the velocity in m/s about standstill in which the damper's force fades, ``rest`` that force at rest, N.
    """

    sprung: float
    unsprung: float
    spring: float
    tyre: float
    tyre_damping: float
    soft: float
    rest: float


class ControlNumbers(NamedTuple):
    """A control's number, damping in N*s/m and share of skyhook; sample time in s, steps in it, range in A."""

    name: int
    damping: float
    share: float
    sample: float
    steps: int
    low: float
    high: float


class Setup(NamedTuple):
    """A ride: all that holds on the way.

    Attributes
    ----------
    chain, inverse
        The damper and its inverse.
    coil, coil_inverse
        The same without the dead times before its field.
    motion
        Places of displacement, velocity and acceleration among its channels, -1 of one it does not take.
    usual
        Channels that stay as they are, shape (C,).
    car, control
        Numbers of both.
    road
        Height in m and its rate in m/s at steps and half-way between them, shape (2, M).
    course
        Filled on the way, shape (KEPT_ROWS, M), in the order of ``car.Ride``. One array: kernels count references to
        each array of a tuple that they pass on.
    """

    chain: DamperChain
    inverse: Inverse
    coil: DamperChain
    coil_inverse: Inverse
    motion: Index
    usual: Array
    car: QuarterCarNumbers
    control: ControlNumbers
    road: Array
    course: Array


class Way(NamedTuple):
    """A car under way.

    Attributes
    ----------
    y, rates
        Heights and velocities (4,), and their rates.
    damper, coil
        Steps that both try.
    now
        Force, field, command, the adaptive step's size in s and the evaluations of the force, (5,).
    stages
        Rates at the stages of a step, and heights and velocities at the end of a trial, (8, 4).
    """

    y: Array
    rates: Array
    damper: Trial
    coil: Trial
    now: Array
    stages: Array


@borrowing
def _faded(car: QuarterCarNumbers, v: float, force: float) -> float:
    """Return a force less that at rest, faded out about standstill if the damper is soft there."""
    moved, soft = force - car.rest, car.soft
    return moved * -math.expm1(-((v / soft) ** 2)) if soft > 0.0 else moved


@borrowing
def _wheel(car: QuarterCarNumbers, y: Array, road: tuple[float, float]) -> tuple[float, float]:
    """Return height and velocity of the wheel, the road's if it is rigid."""
    return (y[2], y[3]) if car.unsprung > 0.0 else road


@borrowing
def _slope(car: QuarterCarNumbers, y: Array, road: tuple[float, float], force: float, rates: Array) -> None:
    """Write the rates of heights and velocities under a damper's force."""
    zu, vu = _wheel(car, y, road)
    spring = car.spring * (y[0] - zu) + _faded(car, y[1] - vu, force)
    rates[0], rates[1], rates[2], rates[3] = y[1], -spring / car.sprung, 0.0, 0.0
    if car.unsprung > 0.0:
        tyre = car.tyre * (zu - road[0]) + car.tyre_damping * (vu - road[1])
        rates[2], rates[3] = vu, (spring - tyre) / car.unsprung


@borrowing
def _channels(setup: Setup, way: Way, y: Array, road: tuple[float, float], a: float) -> None:
    """Write the damper's channels."""
    given, (zu, vu) = way.damper.given, _wheel(setup.car, y, road)
    for c in range(len(given)):
        given[c] = setup.usual[c]
    given[setup.chain.places.current] = way.now[2]
    for k in range(3):
        if setup.motion[k] >= 0:
            given[setup.motion[k]] = (y[0] - zu, y[1] - vu, a)[k]


@borrowing
def _keep(setup: Setup, way: Way, at: int, y: Array, rates: Array, made: tuple[float, float]) -> None:
    """Keep a sample of the course, of a force and a field."""
    course, road = setup.course, (setup.road[0, at], setup.road[1, at])
    zu, vu = _wheel(setup.car, y, road)
    course[ACCELERATION, at] = rates[1]
    course[_LOAD, at] = setup.car.tyre * (zu - road[0]) if setup.car.unsprung > 0.0 else 0.0
    course[_TRAVEL, at], course[_SPEED, at], course[_BODY, at], course[_WHEEL, at] = y[0] - zu, y[1] - vu, y[1], vu
    course[_FORCE, at] = setup.car.rest + _faded(setup.car, y[1] - vu, made[0]) if setup.car.soft > 0.0 else made[0]
    course[_COMMAND, at], course[_FIELD, at] = way.now[2], made[1]


@borrowing
def wanted(control: ControlNumbers, v: float, body: float, wheel: float) -> float:
    """Return the force in N that a control wants, 0 where the damper would have to push."""
    sky = control.damping * body if body * v > 0.0 else 0.0
    ground = -control.damping * wheel if -wheel * v > 0.0 else 0.0
    if control.name == _HYBRID:
        return float(control.share * sky + (1.0 - control.share) * ground)
    return float(sky if control.name == _SKYHOOK else ground)


@part
def _chosen(setup: Setup, way: Way, road: tuple[float, float]) -> None:
    """Choose the command of a sample."""
    control, y, sample = setup.control, way.y, setup.control.sample
    _, vu = _wheel(setup.car, y, road)
    v, body = y[1] - vu, y[1]
    if control.name < _SKYHOOK:
        on = control.name == _PASSIVE_HIGH or (control.name == _ON_OFF and body * v >= 0.0)
        low, high = allowed(setup.coil_inverse, way.coil.state[setup.coil.places.current], sample)
        way.now[2] = min(max(control.high if on else control.low, low), high)
    else:
        # as if the motion stayed for a sample: what comes is not known
        _channels(setup, way, y, road, way.rates[1] - way.rates[3])
        force = wanted(control, v, body, vu) + setup.car.rest
        field = solve(setup.chain, setup.inverse, way.damper, sample, force)[0]
        way.now[2] = command(setup.coil, setup.coil_inverse, way.coil, sample, field)
    if setup.coil_inverse.lagging:
        _channels(setup, way, y, road, 0.0)
        for k in range(setup.coil.places.small):
            way.coil.after[k] = way.coil.state[k]
        inputs(setup.coil, way.coil, sample)
        commit(setup.coil, way.coil, sample)
    else:
        way.coil.state[setup.coil.places.current] = way.now[2]


@borrowing
def _record(setup: Setup, way: Way, k: int) -> None:
    at = 2 * k * setup.control.steps
    road = (setup.road[0, at], setup.road[1, at])
    _slope(setup.car, way.y, road, way.now[0], way.rates)
    _chosen(setup, way, road)
    _keep(setup, way, at, way.y, way.rates, (way.now[0], way.now[1]))


@borrowing
def _trial(
    setup: Setup, way: Way, road: tuple[float, float], before: Array, dt: float, rates: Array
) -> tuple[float, float]:
    """Write the slope at a step's end; return force and field there, the damper's state left to commit."""
    y = way.stages[_END]
    # the acceleration that a model branches by is the last stage's: its own follows from the force sought
    _channels(setup, way, y, road, before[1] - before[3])
    force, _, field = step(setup.chain, way.damper, dt, np.nan)
    _slope(setup.car, y, road, force, rates)
    return force, field


@borrowing
def _move_end(way: Way, h: float, rates: Array) -> None:
    """Put a trial's end h s ahead along a slope."""
    for i in range(4):
        way.stages[_END, i] = way.y[i] + h * rates[i]


@borrowing
def _advance(setup: Setup, way: Way, k: int) -> None:
    """Go on to the next sample by steps of the classic Runge-Kutta method."""
    steps = setup.control.steps
    h, stages = setup.control.sample / steps, way.stages
    one, two, three, four = stages[0], stages[1], stages[2], stages[3]
    for i in range(4):
        one[i] = way.rates[i]
    for j in range(steps):
        at = 2 * (k * steps + j)
        middle, end = (setup.road[0, at + 1], setup.road[1, at + 1]), (setup.road[0, at + 2], setup.road[1, at + 2])
        if j > 0:
            _slope(setup.car, way.y, (setup.road[0, at], setup.road[1, at]), way.now[0], one)
            _keep(setup, way, at, way.y, one, (way.now[0], way.now[1]))
        _move_end(way, 0.5 * h, one)
        made = _trial(setup, way, middle, one, 0.5 * h, two)
        # of the two stages there the first, which shows a force that flips from one to the next
        _keep(setup, way, at + 1, way.stages[_END], two, made)
        _move_end(way, 0.5 * h, two)
        _trial(setup, way, middle, two, 0.5 * h, three)
        _move_end(way, h, three)
        _trial(setup, way, end, three, h, four)
        for i in range(4):
            way.y[i] = way.y[i] + h / 6.0 * (one[i] + 2.0 * two[i] + 2.0 * three[i] + four[i])
        _move_end(way, 0.0, four)
        way.now[0], way.now[1] = _trial(setup, way, end, four, h, one)
        commit(setup.chain, way.damper, h)


@kernel
def begun(setup: Setup, current: float) -> Way:
    """Return a car at rest on a damper at rest under a command."""
    room, work = max(setup.chain.places.whole, setup.coil.places.whole), setup.chain.places.work
    after, given, work_room = np.empty(room), setup.usual.copy(), np.empty(max(work, setup.coil.places.work))
    damper = Trial(np.zeros(setup.chain.places.whole), given, after, work_room)
    coil = Trial(np.zeros(setup.coil.places.whole), given, after, work_room)
    way = Way(np.zeros(4), np.zeros(4), damper, coil, np.zeros(5), np.zeros((_END + 1, 4)))
    way.now[2], way.now[3] = current, setup.control.sample
    _channels(setup, way, way.y, (0.0, 0.0), 0.0)
    way.now[0], _, way.now[1] = step(setup.chain, way.damper, -1.0, np.nan)
    commit(setup.chain, way.damper, -1.0)
    step(setup.coil, way.coil, -1.0, np.nan)
    commit(setup.coil, way.coil, -1.0)
    return way


@borrowing
def driven(setup: Setup, way: Way, first: int, last: int, samples: int) -> int:
    """Simulate samples ``first`` to ``last``; return the sample at which the car left all bounds, -1 if it did not."""
    for k in range(first, last):
        _record(setup, way, k)
        if k + 1 < samples:
            _advance(setup, way, k)
            for i in range(4):
                if not abs(way.y[i]) <= _BOUND:
                    return k
    return -1


@borrowing
def _road_at(road: Array, spacing: float, t: float) -> tuple[float, float]:
    """Return height and rate at a time, by the cubics between points of the road."""
    n = min(max(int(t / spacing), 0), road.shape[1] - 2)
    s = t / spacing - n
    z0, z1, r0, r1 = road[0, n], road[0, n + 1], road[1, n] * spacing, road[1, n + 1] * spacing
    bend, turn = 3.0 * (z1 - z0) - 2.0 * r0 - r1, r0 + r1 - 2.0 * (z1 - z0)
    return z0 + s * (r0 + s * (bend + s * turn)), (r0 + s * (2.0 * bend + 3.0 * s * turn)) / spacing


@kernel
def _adapted(setup: Setup, way: Way, k: int) -> bool:
    """Go on to the next sample by steps of Dormand and Prince; return whether a bounded number sufficed."""
    sample = setup.control.sample
    spacing = 0.5 * sample / setup.control.steps
    start, done, size = k * sample, 0.0, min(way.now[3], sample)
    stages, y1, fixed, made = way.stages, way.stages[_END], way.rates.copy(), (0.0, 0.0)
    stages[0] = way.rates
    scales = np.array([1e-7, 1e-6, 1e-7, 1e-6])
    for _ in range(_MOST_STEPS):
        while True:
            h = min(size, sample - done)
            for s in range(1, 7):
                y1[:] = way.y
                for j in range(s):
                    y1 += h * _TABLEAU[s, j] * stages[j]
                dt = _TABLEAU[s, 6] * h
                made = _trial(setup, way, _road_at(setup.road, spacing, start + done + dt), fixed, dt, stages[s])
            way.now[4] += 6.0
            error = 0.0
            for i in range(4):
                off = 0.0
                for s in range(7):
                    off += _ERRORS[s] * stages[s, i]
                error += (h * off / (scales[i] + _TOLERANCE * max(abs(way.y[i]), abs(y1[i])))) ** 2
            error = math.sqrt(error / 4.0)
            if error < 1.0:
                break
            size = h * max(0.2, 0.9 * error**-0.2) if error < math.inf else 0.2 * h
            if not size > 1e-14:
                return False
        finished = done + h >= sample * (1.0 - 1e-12)
        size = h * min(10.0, 0.9 * error**-0.2 if error > 0.0 else 10.0)
        commit(setup.chain, way.damper, h)
        way.y[:], way.rates[:], (way.now[0], way.now[1]) = y1, stages[6], made
        stages[0], fixed[:], done = stages[6], stages[6], done + h
        # the next sample may begin with a step that was good here, but for the last, which is cut
        way.now[3] = max(way.now[3] if finished else size, _SHORTEST * sample)
        if finished:
            return True
    return False


@kernel
def adapted(setup: Setup, way: Way, samples: int) -> int:
    """Simulate all samples by adaptive steps; return the one at which their number did not suffice, -1 if it did."""
    for k in range(samples):
        _record(setup, way, k)
        if k + 1 < samples and not _adapted(setup, way, k):
            return k
    return -1


# Weights of the stages before each stage, and of the time at which it is in the last column
_TABLEAU = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0, 1 / 5],
        [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0, 3 / 10],
        [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0, 4 / 5],
        [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0, 8 / 9],
        [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0, 1.0],
        [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84, 1.0],
    ]
)
# What the method of order 5 is off that of order 4 by
_ERRORS = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
