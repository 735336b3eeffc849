"""A quarter car on its way, in compiled loops: one control on one road, from sample to sample.

``mrfit.apply.car`` says what is simulated.
"""

import math
from typing import NamedTuple

import numpy as np

from mrfit.apply.chain import CURRENT, SMALL, WHOLE, WORK, Chain, commit, inputs, step
from mrfit.apply.solving import Inverse, Site, command, solve
from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import kernel

PASSIVE_LOW, PASSIVE_HIGH, ON_OFF, SKYHOOK, GROUNDHOOK, HYBRID = range(6)
# Entries of ``Setup.car`` and ``Setup.control``
SPRUNG, UNSPRUNG, SPRING, TYRE, TYRE_DAMPING, SOFT, REST = range(7)
NAME, DAMPING, PORTION, SAMPLE, STEPS, LOW, HIGH = range(7)
# Rows of what is kept
ACCELERATION, LOAD, TRAVEL, SPEED, BODY, WHEEL, FORCE, COMMAND, FIELD, KEPT = range(10)
# Beyond these heights and velocities the steps were too long
_BOUND = 1e3
# Of the adaptive steps: tolerances, and how many there may be in a sample interval
TOLERANCE, MOST_STEPS, _SHORTEST = 1e-6, 30, 0.01


class Setup(NamedTuple):
    """What does not change on the way.

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
        Numbers, as named above.
    road
        Height in m and its rate in m/s at steps and half-way between them, shape (2, M).
    """

    chain: Chain
    inverse: Inverse
    coil: Chain
    coil_inverse: Inverse
    motion: Index
    usual: Array
    car: Array
    control: Array
    road: Array


class Way(NamedTuple):
    """Where a car is: heights and velocities (4,), their rates (4,), states of damper and coil, force, field, command.

    The last three are in ``now``, behind them the adaptive step's size in s and the evaluations of the force.
    """

    y: Array
    rates: Array
    state: Array
    coil: Array
    now: Array
    after: Array
    work: Array
    given: Array


@kernel
def _slope(setup: Setup, y: Array, road: tuple[float, float], force: float, rates: Array) -> None:
    """Write the rates of heights and velocities under a damper's force, faded out about standstill if it is soft."""
    car = setup.car
    rolling = car[UNSPRUNG] > 0.0
    zu, vu = (y[2], y[3]) if rolling else road
    moved = force - car[REST]
    if car[SOFT] > 0.0:
        moved *= -math.expm1(-(((y[1] - vu) / car[SOFT]) ** 2))
    spring = car[SPRING] * (y[0] - zu) + moved
    rates[0], rates[1], rates[2], rates[3] = y[1], -spring / car[SPRUNG], 0.0, 0.0
    if rolling:
        tyre = car[TYRE] * (zu - road[0]) + car[TYRE_DAMPING] * (vu - road[1])
        rates[2], rates[3] = vu, (spring - tyre) / car[UNSPRUNG]


@kernel
def _channels(setup: Setup, y: Array, road: tuple[float, float], a: float, current: float, given: Array) -> None:
    """Write the damper's channels."""
    zu, vu = (y[2], y[3]) if setup.car[UNSPRUNG] > 0.0 else road
    given[:] = setup.usual
    given[setup.chain.sizes[CURRENT]] = current
    for k in range(3):
        if setup.motion[k] >= 0:
            given[setup.motion[k]] = (y[0] - zu, y[1] - vu, a)[k]


@kernel
def _keep(setup: Setup, way: Way, kept: Array, at: int, y: Array, rates: Array, force: float, field: float) -> None:  # noqa: PLR0913
    car, road = setup.car, (setup.road[0, at], setup.road[1, at])
    rolling = car[UNSPRUNG] > 0.0
    zu, vu = (y[2], y[3]) if rolling else road
    acting = force
    if car[SOFT] > 0.0:
        acting = car[REST] - (force - car[REST]) * math.expm1(-(((y[1] - vu) / car[SOFT]) ** 2))
    kept[ACCELERATION, at], kept[LOAD, at] = rates[1], car[TYRE] * (zu - road[0]) if rolling else 0.0
    kept[TRAVEL, at], kept[SPEED, at], kept[BODY, at], kept[WHEEL, at] = y[0] - zu, y[1] - vu, y[1], vu
    kept[FORCE, at], kept[COMMAND, at], kept[FIELD, at] = acting, way.now[2], field


@kernel
def wanted(control: Array, v: float, body: float, wheel: float) -> float:
    """Return the force in N that a control wants, 0 where the damper would have to push."""
    sky = control[DAMPING] * body if body * v > 0.0 else 0.0
    ground = -control[DAMPING] * wheel if -wheel * v > 0.0 else 0.0
    if control[NAME] == HYBRID:
        return float(control[PORTION] * sky + (1.0 - control[PORTION]) * ground)
    return float(sky if control[NAME] == SKYHOOK else ground)


@kernel
def _chosen(setup: Setup, way: Way, road: tuple[float, float]) -> None:
    """Choose the command of a sample."""
    control, y, sample = setup.control, way.y, setup.control[SAMPLE]
    zu, vu = (y[2], y[3]) if setup.car[UNSPRUNG] > 0.0 else road
    v, body = y[1] - vu, y[1]
    if control[NAME] == ON_OFF:
        way.now[2] = control[HIGH] if body * v >= 0.0 else control[LOW]
    elif control[NAME] == PASSIVE_HIGH:
        way.now[2] = control[HIGH]
    elif control[NAME] >= SKYHOOK:
        # as if the motion stayed for a sample: what comes is not known
        _channels(setup, y, road, way.rates[1] - way.rates[3], way.now[2], way.given)
        force = wanted(control, v, body, vu) + setup.car[REST]
        site = Site(way.state, way.given, way.after, way.work)
        field = solve(setup.chain, setup.inverse, site, sample, force)[0]
        site = Site(way.coil, way.given, way.after, way.work)
        way.now[2] = command(setup.coil, setup.coil_inverse, site, sample, field)
    if setup.coil_inverse.flags[1] > 0:
        _channels(setup, y, road, 0.0, way.now[2], way.given)
        for k in range(setup.coil.sizes[SMALL]):
            way.after[k] = way.coil[k]
        inputs(setup.coil, way.coil, way.given, sample, way.after, way.work)
        commit(setup.coil, way.coil, way.after, sample)


@kernel
def _record(setup: Setup, way: Way, kept: Array, k: int) -> None:
    at = 2 * k * int(setup.control[STEPS])
    road = (setup.road[0, at], setup.road[1, at])
    _slope(setup, way.y, road, way.now[0], way.rates)
    _chosen(setup, way, road)
    _keep(setup, way, kept, at, way.y, way.rates, way.now[0], way.now[1])


@kernel
def _trial(  # noqa: PLR0913
    setup: Setup, way: Way, y: Array, road: tuple[float, float], before: Array, dt: float, rates: Array
) -> tuple[float, float]:
    """Write the slope where a step of dt ends in y; return force and field there, the state in ``after``."""
    # the acceleration that a model branches by is the last stage's: its own follows from the force sought
    _channels(setup, y, road, before[1] - before[3], way.now[2], way.given)
    force, _, field = step(setup.chain, way.state, way.given, dt, np.nan, way.after, way.work)
    _slope(setup, y, road, force, rates)
    return force, field


@kernel
def _advance(setup: Setup, way: Way, kept: Array, k: int) -> None:
    """Go on to the next sample by steps of the classic Runge-Kutta method."""
    steps = int(setup.control[STEPS])
    h = setup.control[SAMPLE] / steps
    one, two, three, four = way.rates.copy(), np.empty(4), np.empty(4), np.empty(4)
    for j in range(steps):
        at = 2 * (k * steps + j)
        middle, end = (setup.road[0, at + 1], setup.road[1, at + 1]), (setup.road[0, at + 2], setup.road[1, at + 2])
        if j > 0:
            _slope(setup, way.y, (setup.road[0, at], setup.road[1, at]), way.now[0], one)
            _keep(setup, way, kept, at, way.y, one, way.now[0], way.now[1])
        inside = way.y + 0.5 * h * one
        force, field = _trial(setup, way, inside, middle, one, 0.5 * h, two)
        # of the two stages there the first, which shows a force that flips from one to the next
        _keep(setup, way, kept, at + 1, inside, two, force, field)
        _trial(setup, way, way.y + 0.5 * h * two, middle, two, 0.5 * h, three)
        _trial(setup, way, way.y + h * three, end, three, h, four)
        way.y[:] = way.y + h / 6.0 * (one + 2.0 * two + 2.0 * three + four)
        way.now[0], way.now[1] = _trial(setup, way, way.y, end, four, h, one)
        commit(setup.chain, way.state, way.after, h)


@kernel
def begun(setup: Setup, current: float) -> Way:
    """Return a car at rest on a damper at rest under a command."""
    room = np.empty(max(setup.chain.sizes[WHOLE], setup.coil.sizes[WHOLE]))
    work = np.empty(max(setup.chain.sizes[WORK], setup.coil.sizes[WORK]))
    states = np.zeros(setup.chain.sizes[WHOLE]), np.zeros(setup.coil.sizes[WHOLE])
    way = Way(np.zeros(4), np.zeros(4), states[0], states[1], np.zeros(5), room, work, setup.usual.copy())
    way.now[2], way.now[3] = current, setup.control[SAMPLE]
    _channels(setup, way.y, (0.0, 0.0), 0.0, current, way.given)
    way.now[0], _, way.now[1] = step(setup.chain, way.state, way.given, -1.0, np.nan, way.after, way.work)
    commit(setup.chain, way.state, way.after, -1.0)
    step(setup.coil, way.coil, way.given, -1.0, np.nan, way.after, way.work)
    commit(setup.coil, way.coil, way.after, -1.0)
    return way


@kernel
def driven(setup: Setup, way: Way, kept: Array, first: int, last: int, samples: int) -> int:
    """Simulate samples ``first`` to ``last``; return the sample at which the car left all bounds, -1 if it did not."""
    for k in range(first, last):
        _record(setup, way, kept, k)
        if k + 1 < samples:
            _advance(setup, way, kept, k)
            if not np.abs(way.y).max() <= _BOUND:
                return k
    return -1


@kernel
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
    sample = setup.control[SAMPLE]
    spacing = 0.5 * sample / int(setup.control[STEPS])
    start, done, size = k * sample, 0.0, min(way.now[3], sample)
    stages, y1, fixed = np.empty((7, 4)), np.empty(4), way.rates.copy()
    stages[0] = way.rates
    scales = np.array([1e-7, 1e-6, 1e-7, 1e-6])
    for _ in range(MOST_STEPS):
        while True:
            h = min(size, sample - done)
            for s in range(1, 7):
                y1[:] = way.y
                for j in range(s):
                    y1 += h * _TABLEAU[s, j] * stages[j]
                at = start + done + _TABLEAU[s, 6] * h
                dt = _TABLEAU[s, 6] * h
                force, field = _trial(setup, way, y1, _road_at(setup.road, spacing, at), fixed, dt, stages[s])
            way.now[4] += 6.0
            error = 0.0
            for i in range(4):
                off = 0.0
                for s in range(7):
                    off += _ERRORS[s] * stages[s, i]
                error += (h * off / (scales[i] + TOLERANCE * max(abs(way.y[i]), abs(y1[i])))) ** 2
            error = math.sqrt(error / 4.0)
            if error < 1.0:
                break
            size = h * max(0.2, 0.9 * error**-0.2) if error < math.inf else 0.2 * h
            if not size > 1e-14:
                return False
        finished = done + h >= sample * (1.0 - 1e-12)
        size = h * min(10.0, 0.9 * error**-0.2 if error > 0.0 else 10.0)
        commit(setup.chain, way.state, way.after, h)
        way.y[:], way.rates[:], way.now[0], way.now[1] = y1, stages[6], force, field
        stages[0], fixed[:], done = stages[6], stages[6], done + h
        # the next sample may begin with a step that was good here, but for the last, which is cut
        way.now[3] = max(way.now[3] if finished else size, _SHORTEST * sample)
        if finished:
            return True
    return False


@kernel
def adapted(setup: Setup, way: Way, kept: Array, first: int, last: int, samples: int) -> int:
    """Do the same by adaptive steps; return the sample at which their number did not suffice, -1 if it did."""
    for k in range(first, last):
        _record(setup, way, kept, k)
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
