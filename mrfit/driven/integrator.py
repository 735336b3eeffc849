"""A mass on a law, stepped by itself: Lobatto IIIA of order 4 about the law's own compiled step.

    m*a + F(x, v, …) = m*w(t)

F is taken at the middle and at the end of a trial step, the law's state along; the three accelerations and the motion
that they give agree after a few iterations (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5). The
accelerations foreseen from the last step tell the error, and a step too long is halved. A step of the law ends where
the speed turns within one of the motion. Where the shortest does not settle, as where a law sticks, its end is found by
bisection of the speed. A mass that sticks stands still: its steps end so at once, and are as long as it stands.

Of masses that differ a little, as for derivatives by differences, the others follow the steps of the first: what each
errs is then nearly the same, and their difference does not hold it.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import borrowing, kernel
from mrfit.simulate.chain import DamperChain, Trial, commit, step, trial_of

HALVINGS = 5
"""How often a sample interval may be halved, the half of the last step included."""
PER_SAMPLE = 1 << HALVINGS
_ITERATIONS, _BISECTIONS = 12, 80
# Share of the change foreseen in a step that counts as its error, from the constants of order 4
_SHARE = 0.05
# Share of the tolerance to which iterations settle, and below which the next step may be twice as long
_SETTLED, _EASY = 0.02, 0.04
# Share of the greatest speed below which a mass stands still
_STANDING = 1e-12
# How many times the tolerance one that follows another's steps may err before it halves them
_FOLLOWS = 4.0


StepPattern = NDArray[np.int8]
"""At the beginning of each step its halvings, times 16, and its iterations, 0 where they did not settle; else -1."""


class MovingMass(NamedTuple):
    """A mass, what it hangs on and what moves it.

    Attributes
    ----------
    chain
        The law.
    motion
        Places of displacement, velocity and acceleration among its channels, -1 of one that it does not take.
    others
        Its channels (N, C), or (1, C) where only the motion changes.
    push
        External force over mass in m/s^2, ``PER_SAMPLE`` values a sample interval, ((N - 1)*PER_SAMPLE + 1,).
    fine
        Time in s between two of them.
    mass
        In kg.
    """

    chain: DamperChain
    motion: Index
    others: Array
    push: Array
    fine: float
    mass: float


@borrowing
def _force(body: MovingMass, trial: Trial, moved: tuple[float, float, float], dt: float) -> float:
    """Return the law's force where a step of dt s ends in a motion."""
    for k in range(3):
        if body.motion[k] >= 0:
            trial.given[body.motion[k]] = moved[k]
    return step(body.chain, trial, dt, np.nan)[0]


@borrowing
def _write_channels(others: Array, place: float, given: Array) -> None:
    """Write the channels that do not move with the mass, linear between samples."""
    if len(others) > 1:
        n = min(int(place), len(others) - 2)
        for c in range(len(given)):
            given[c] = others[n, c] + (place - n) * (others[n + 1, c] - others[n, c])


@borrowing
def _turning(begun: tuple[float, float], end: tuple[float, float, float], h: float) -> tuple[float, float]:
    """Return the displacement at which the speed turns within h s, by a cubic, and the share of h until then, or 0."""
    (x, v), (x_end, v_end, _) = begun, end
    if not v * v_end < 0.0:
        return x, 0.0
    s = v / (v - v_end)
    # once by Newton's method on the cubic's speed
    bend, slope = 3.0 * (x_end - x) - h * (2.0 * v + v_end), h * (v + v_end) - 2.0 * (x_end - x)
    rise = 2.0 * bend + 6.0 * slope * s
    if rise != 0.0:
        s = min(max(s - (h * v + s * (2.0 * bend + 3.0 * slope * s)) / rise, 1e-6), 1.0 - 1e-6)
    return x + s * (h * v + s * (bend + s * slope)), s


@borrowing
def _take(chain: DamperChain, trial: Trial, dt: float, to: Trial) -> None:
    """Write the state behind a step as that from which another begins."""
    for k in range(chain.places.small, chain.places.whole):
        to.state[k] = trial.state[k]
    commit(chain, to, dt)


@kernel
def _half_step(
    body: MovingMass,
    trials: tuple[Trial, Trial],
    begun: tuple[float, float],
    end: tuple[float, float, float],
    h: float,
) -> tuple[float, Trial, float]:
    """Return the force at the end of h s from the first of two trials, the trial that ends there, and its length.

    A law turns where the speed does, between both ends: there a step of it ends, and the second trial begins.
    """
    trial, length = trials[0], h
    x_turn, part = _turning(begun, end, h)
    if part > 0.0:
        _force(body, trial, (x_turn, 0.0, end[2]), part * h)
        _take(body.chain, trial, part * h, trials[1])
        trial, length = trials[1], (1.0 - part) * h
    return _force(body, trial, end, length), trial, length


@kernel
def _foreseen(last: tuple[float, float, float], ratio: float) -> tuple[float, float]:
    """Return the accelerations at middle and end of a step, from those of the last, whose length is 1/ratio of its."""
    first, middle, a = last
    bend, slope = 2.0 * (first - 2.0 * middle + a), first - 4.0 * middle + 3.0 * a
    return a + 0.5 * ratio * (slope + 0.5 * ratio * bend), a + ratio * (slope + ratio * bend)


@kernel
def _step(  # fmt: skip
    body: MovingMass,
    trials: tuple[Trial, Trial, Trial],
    span: tuple[int, int, int],
    begun: tuple[float, float, float, float, float],
    limit: float,
) -> tuple[float, float, float, float, float, int]:
    """Return displacement, velocity, accelerations at middle and end, force, and iterations, 0 if they did not settle.

    ``span`` are its place, its width and the least iterations; ``begun`` are displacement, velocity, acceleration and
    the accelerations foreseen. The state behind the step goes to the last of the trials.
    """
    place, width, least = span
    x, v, a, a_half, a_end = begun
    h, change = body.fine * width, math.inf
    w_half, w_end = body.push[place + width // 2], body.push[place + width]
    start, half, turn = trials
    x_end, v_end, force, settled = x, v, 0.0, 0
    for done in range(1, _ITERATIONS + 1):
        x_half = x + 0.5 * h * v + h * h / 96.0 * (7.0 * a + 6.0 * a_half - a_end)
        v_half = v + h / 24.0 * (5.0 * a + 8.0 * a_half - a_end)
        x_end, v_end = x + h * v + h * h / 6.0 * (a + 2.0 * a_half), v + h / 6.0 * (a + 4.0 * a_half + a_end)
        _write_channels(body.others, (place + 0.5 * width) / PER_SAMPLE, start.given)
        force, last, length = _half_step(body, (start, turn), (x, v), (x_half, v_half, a_half), 0.5 * h)
        _take(body.chain, last, length, half)
        new_half = w_half - force / body.mass
        _write_channels(body.others, (place + width) / PER_SAMPLE, start.given)
        force, last, length = _half_step(body, (half, turn), (x_half, v_half), (x_end, v_end, a_end), 0.5 * h)
        new_end = w_end - force / body.mass
        before, change = change, abs(new_half - a_half) + abs(new_end - a_end)
        a_half, a_end = new_half, new_end
        if h * change <= _SETTLED * limit and done >= least:
            _take(body.chain, last, length, turn)
            settled = done
        if settled > 0 or not (change < 0.7 * before or done < least):
            break
    return x_end, v_end, a_half, a_end, force, settled


@borrowing
def _stuck(body: MovingMass, trial: Trial, begun: tuple[float, float], h: float, push: float) -> float:
    """Return the speed at the end of a step at which mass times its change over h is what push leaves of the force."""
    x, v = begun
    reach, low, high = max(abs(push) * h, 1e-12), math.nan, math.nan
    end = v
    for _ in range(_BISECTIONS):
        if low == low and high == high:
            end = 0.5 * (low + high)
        else:
            end = v - reach if low != low else v + reach
        moved = (x + 0.5 * h * (v + end), end, (end - v) / h)
        above = (end - v) / h - push + _force(body, trial, moved, h) / body.mass > 0.0
        if low != low or high != high:
            # the side sought is found, or further away
            reach *= 1.0 if above != (low != low) else 4.0
        if above:
            high = end
        else:
            low = end
    return end


@kernel
def _jump(body: MovingMass, trial: Trial, x: float, least: float, h: float) -> float:
    """Return the jump in the acceleration where the speed turns."""
    behind = _force(body, trial, (x, least, 0.0), h)
    return abs(behind - _force(body, trial, (x, -least, 0.0), h)) / body.mass


@kernel
def _slipped(
    body: MovingMass, trial: Trial, begun: tuple[float, float, float], h: float, push: tuple[float, float], least: float
) -> tuple[float, float, float]:
    """Return displacement, speed and acceleration at the end of a step in which a law may stick or slip.

    The force jumps where the mass comes to a stand, turns or is released, at a time within the step. Until there and
    from there on, what accelerates it is constant or linear. ``push`` is that at both ends of the step; a mass slower
    than ``least`` stands.
    """
    x, v, a = begun
    end = _stuck(body, trial, (x, v), h, push[1])
    a_end, rise = (end - v) / h, push[1] - push[0]
    if abs(v) <= least:
        if abs(end) <= least:
            return x, 0.0, 0.0
        if a_end * (a_end - rise) >= 0.0:
            return x + h * h * (0.5 * a_end - rise / 3.0), h * (a_end - 0.5 * rise), a_end
        free = h * a_end / rise
        return x + free * free * a_end / 6.0, 0.5 * free * a_end, a_end
    if (end * v > 0.0 and abs(end) > least) or not v * a < 0.0:
        return x + 0.5 * h * (v + end), end, a_end
    moves = min(h, -v / a)
    x, left, way = x + 0.5 * moves * v, h - moves, math.copysign(least, -v)
    a_end = push[1] - _force(body, trial, (x, way, 0.0), h) / body.mass
    if not a_end * way > 0.0:
        return x, 0.0, 0.0
    return x + 0.5 * left * left * a_end, left * a_end, a_end


@kernel
def _trials(body: MovingMass) -> tuple[Trial, Trial, Trial]:
    """Return a trial from which a step begins, one for its middle and one for its end, or where the speed turns."""
    size = body.chain.places.whole
    start = trial_of(body.chain, np.zeros(size), body.others[0].copy())
    half = Trial(np.zeros(size), start.given, start.after, start.work)
    return start, half, Trial(np.zeros(size), start.given, start.after, start.work)


@kernel
def _settle(body: MovingMass, trial: Trial, moved: tuple[float, float, float], h: float) -> float:
    """Return the force where a step of h s ends in a motion, which is taken."""
    force = _force(body, trial, moved, h)
    commit(body.chain, trial, h)
    return force


@kernel
def _copy_state(trial: Trial, to: Trial) -> None:
    for s in range(len(to.state)):
        to.state[s] = trial.state[s]


@kernel
def _write(out: Array, n: int, found: tuple[float, float, float, float]) -> None:
    for k in range(4):
        out[k, n] = found[k]


@kernel
def moved_mass(body: MovingMass, tolerance: float, speed: float, pattern: StepPattern, follows: bool) -> Array:
    """Return displacement, velocity, acceleration and force (4, N) of a mass that begins at rest, on a law at rest.

    The tolerance is the error of a step as a share of the greatest speed so far, which is a first guess in m/s before.
    Its steps are written to a pattern, or are those of one that it follows.
    """
    push, fine = body.push, body.fine
    out = np.full((4, (len(push) - 1) // PER_SAMPLE + 1), np.nan)
    start, half, turn = _trials(body)
    x, v, k, place = 0.0, 0.0, 1, 0
    force = _settle(body, start, (x, v, 0.0), -1.0)
    a = push[0] - force / body.mass
    # accelerations of the last step, at its beginning and middle, and its length
    first, middle, before, refused, stands = a, a, 1, -1, False
    _write(out, 0, (x, v, a, force))
    while place < len(push) - 1 and math.isfinite(x + v + a):
        least, most = 0, tolerance
        if follows and pattern[place] >= 0 and place != refused:
            k, least, most = pattern[place] >> 4, pattern[place] & 15, _FOLLOWS * tolerance
        width = PER_SAMPLE >> k
        h, limit, standing = fine * width, most * speed, _STANDING * speed
        pushes = push[place], push[place + width]
        if stands:
            x_end, v_end, a_end = _slipped(body, start, (x, v, a), h, pushes, standing)
            settled, error, accepted = 0, 0.0, abs(v_end) <= standing
        else:
            seen_half, seen_end = _foreseen((first, middle, a), width / before)
            x_end, v_end, a_half, a_end, f_end, settled = _step(
                body, (start, half, turn), (place, width, least), (x, v, a, seen_half, seen_end), limit
            )
            error = _SHARE * h * (abs(a_half - seen_half) + abs(a_end - seen_end)) / limit
            accepted = settled > 0 and error <= 1.0
        if not accepted and k < HALVINGS - 1:
            k, refused = k + 1, place
            continue
        if not accepted and v * v_end < 0.0 and h * _jump(body, start, x, standing, h) > limit:
            settled = 0
        if not follows:
            pattern[place] = (k << 4) + settled
        if settled > 0:
            _copy_state(turn, start)
            first, middle = a, a_half
        else:
            if not stands:
                x_end, v_end, a_end = _slipped(body, start, (x, v, a), h, pushes, standing)
            f_end = _settle(body, start, (x_end, v_end, a_end), h)
            first = middle = a_end
        stands = settled == 0 and abs(v_end) <= standing
        x, v, a, force, before = x_end, v_end, a_end, f_end, width
        speed, place = max(speed, abs(v)), place + width
        if place % PER_SAMPLE == 0:
            _write(out, place // PER_SAMPLE, (x, v, a, force))
        k -= 1 if error < _EASY and k > 0 and place % (2 * width) == 0 else 0
    return out
