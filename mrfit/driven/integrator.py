"""A mass on a law, stepped by itself: Lobatto IIIA of order 4 about the law's own compiled step.

    m*a + F(x, v, …) = m*w(t)

F is taken at the middle and at the end of a trial step, the law's state along; the three accelerations and the motion
that they give agree after a few iterations (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5). The
accelerations foreseen from the last step tell the error, and a step too long is halved. A step of the law ends where
the speed turns within one of the motion. Where the shortest does not settle, as where a law sticks, its end is found by
bisection of the speed.

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
def moved_mass(body: MovingMass, tolerance: float, speed: float, pattern: StepPattern, follows: bool) -> Array:
    """Return displacement, velocity, acceleration and force (4, N) of a mass that begins at rest, on a law at rest.

    The tolerance is the error of a step as a share of the greatest speed so far, which is a first guess in m/s before.
    Its steps are written to a pattern, or are those of one that it follows.
    """
    chain, push, fine = body.chain, body.push, body.fine
    samples = (len(push) - 1) // PER_SAMPLE + 1
    out = np.full((4, samples), np.nan)
    start = trial_of(chain, np.zeros(chain.places.whole), body.others[0].copy())
    half = Trial(np.zeros(chain.places.whole), start.given, start.after, start.work)
    turn = Trial(np.zeros(chain.places.whole), start.given, start.after, start.work)
    x, v, k, place = 0.0, 0.0, 1, 0
    force = _force(body, start, (x, v, 0.0), -1.0)
    commit(chain, start, -1.0)
    a = push[0] - force / body.mass
    # accelerations of the last step, at its beginning and middle, and its length
    first, middle, before, refused = a, a, 1, -1
    out[0, 0], out[1, 0], out[2, 0], out[3, 0] = x, v, a, force
    while place < len(push) - 1 and math.isfinite(x + v + a):
        least, most = 0, tolerance
        if follows and pattern[place] >= 0 and place != refused:
            k, least, most = pattern[place] >> 4, pattern[place] & 15, _FOLLOWS * tolerance
        width = PER_SAMPLE >> k
        h, limit, ratio = fine * width, most * speed, width / before
        bend, slope = 2.0 * (first - 2.0 * middle + a), first - 4.0 * middle + 3.0 * a
        seen_half, seen_end = a + 0.5 * ratio * (slope + 0.5 * ratio * bend), a + ratio * (slope + ratio * bend)
        begun = (x, v, a, seen_half, seen_end)
        x_end, v_end, a_half, a_end, f_end, settled = _step(
            body, (start, half, turn), (place, width, least), begun, limit
        )
        error = _SHARE * h * (abs(a_half - seen_half) + abs(a_end - seen_end)) / limit
        if not (settled > 0 and error <= 1.0) and k < HALVINGS - 1:
            k, refused = k + 1, place
            continue
        if not follows:
            pattern[place] = (k << 4) + settled
        if settled > 0:
            for s in range(chain.places.whole):
                start.state[s] = turn.state[s]
            first, middle = a, a_half
        else:
            v_end = _stuck(body, start, (x, v), h, push[place + width])
            a_end, x_end = (v_end - v) / h, x + 0.5 * h * (v + v_end)
            f_end = _force(body, start, (x_end, v_end, a_end), h)
            commit(chain, start, h)
            first = middle = a_end
        x, v, a, force, before = x_end, v_end, a_end, f_end, width
        speed, place = max(speed, abs(v)), place + width
        if place % PER_SAMPLE == 0:
            n = place // PER_SAMPLE
            out[0, n], out[1, n], out[2, n], out[3, n] = x, v, a, force
        if error < _EASY and k > 0 and place % (2 * width) == 0:
            k -= 1
    return out
