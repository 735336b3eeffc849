"""Linear blocks in continuous time, simulated exactly for inputs that are linear between samples."""

import math
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel, row
from mrfit.kernels.past import RESERVED

# Time constants in s below this one are too short for any log, and their poles too fast for the exponential
SHORTEST = 1e-9


@kernel
def exponential(matrix: Array) -> Array:
    """Return exp of a small square matrix by scaling, a Taylor polynomial of order 14, and squaring."""
    norm = np.abs(matrix).sum(axis=1).max()
    squarings = max(0, int(math.ceil(math.log2(max(norm, 1e-300)))) + 1) if norm < 1e15 else 0
    scaled = matrix / 2.0**squarings
    result = np.eye(len(matrix))
    for k in range(14, 0, -1):
        result = np.eye(len(matrix)) + scaled @ result / k
    for _ in range(squarings):
        result = result @ result
    return result


@kernel
def delayed(u: Array, shift: Array) -> Array:
    """Delay one signal by numbers of samples that need not be whole, linear between samples, its first value before.

    Parameters
    ----------
    u
        Signal, shape (N,).
    shift
        Delays in samples, >= 0, shape (P,).

    Returns
    -------
    Array
        Shape (P, N).
    """
    out = np.empty((len(shift), len(u)))
    for p in range(len(shift)):
        for j in range(len(u)):
            place = j - shift[p] if j > shift[p] else 0.0
            k = int(place)
            out[p, j] = u[k] if place == k else u[k] + (place - k) * (u[k + 1] - u[k])
    return out


@kernel
def unit_gain_filter(u: Array, poles: Array, zeros: Array, dt: float) -> Array:
    """Pass signals through a cascade of real poles with unit gain at rest and up to two zeros.

        prod_i p_i/(s + p_i) * (1 + z_1*s + z_2*s^2)

    Parameters
    ----------
    u
        Signals, shape (P, N), at rest at their first value before it.
    poles
        p_i in 1/s, shape (P, n), n >= 2.
    zeros
        z_1 (s) and z_2 (s^2), shape (P, 2).
    dt
        Sample interval in s.

    Returns
    -------
    Array
        Shape (P, N).
    """
    out = np.empty_like(u)
    for p in range(len(poles)):
        step, state, rest = cascade(poles[p], dt), np.zeros(poles.shape[1]), u[p, 0]
        for j in range(u.shape[1]):
            if j > 0:
                advance(step, state, u[p, j - 1] - rest, u[p, j] - u[p, j - 1])
            out[p, j] = passed(poles[p], zeros[p], state, u[p, j], rest)
    return out


@kernel
def cascade(poles: Array, interval: float) -> Array:
    """Return the matrix by which ``advance`` moves a cascade of poles (n,) in 1/s over an interval in s."""
    order = len(poles)
    system = np.zeros((order + 2, order + 2))
    for i in range(order):
        system[i, i] = -poles[i] * interval
        system[i, i - 1 if i else order] = poles[i] * interval
    system[order, order + 1] = 1.0
    return exponential(system)


@kernel
def advance(step: Array, state: Array, now: float, rise: float) -> None:
    """Move the states (n,) of a cascade over one interval, over which its input goes from ``now`` by ``rise``."""
    order = len(state)
    # from the last on: a state hears of those before it as they were
    for i in range(order - 1, -1, -1):
        total = step[i, order] * now + step[i, order + 1] * rise
        for k in range(i + 1):
            total += step[i, k] * state[k]
        state[i] = total


@kernel
def cascade_matrix(move: Array, poles: Any, dt: float) -> None:
    """Write the matrix that moves a cascade's input and states over dt s, the exponential of a lower triangle.

    By scaling, a Taylor polynomial of order 14, and squaring, all in place.
    """
    size, norm, scale, squarings = len(poles) + 2, 1.0, 0.5, 1
    for i in range(len(poles)):
        norm = max(norm, 2.0 * poles[i] * dt)
    for _ in range(60):
        if norm <= 1.0:
            break
        norm, scale, squarings = 0.5 * norm, 0.5 * scale, squarings + 1
    for i in range(size):
        for j in range(size):
            move[i, j] = 1.0 if i == j else 0.0
    for k in range(14, 0, -1):
        for i in range(size - 1, 1, -1):
            rate = poles[i - 2] * dt * scale / k
            for j in range(i):
                move[i, j] = rate * (move[i - 1, j] - move[i, j])
            move[i, i] = 1.0 - rate * move[i, i]
        move[1, 0] = scale / k
    for _ in range(squarings):
        _square(move, size)


@kernel
def _square(move: Array, size: int) -> None:
    """Square a lower triangle in place."""
    for i in range(size - 1, 0, -1):
        for j in range(i):
            total = move[i, i] * move[i, j]
            for m in range(j, i):
                total += move[i, m] * move[m, j]
            move[i, j] = total
        move[i, i] *= move[i, i]


@kernel
def cascade_kept(past: Any, first: int, poles: Any, dt: float) -> None:
    """Keep the matrix that moves a cascade's states over dt s in a past, behind the poles times dt it is for."""
    order, same = len(poles), True
    for i in range(order):
        same = same and past[first + i] == poles[i] * dt
    if not same:
        move = np.zeros((order + 2, order + 2))
        cascade_matrix(move, poles, dt)
        for i in range(order):
            past[first + i] = poles[i] * dt
            for k in range(order + 2):
                past[first + order * (i + 1) + 2 * i + k] = move[i + 2, k]


@kernel
def cascade_step(states: Any, poles: Any, ends: tuple[float, float], dt: float, past: Any, own: int) -> Any:
    """Return the states of a cascade of poles in 1/s, tuples, after a step over which its input goes linearly.

    The input is ``ends`` at both ends of the step. It keeps n*(n + 3) numbers for n poles in the past, from the own
    number ``own`` on.
    """
    order, first = len(poles), RESERVED + own
    following = np.zeros(order)
    cascade_kept(past, first, poles, dt)
    for i in range(order):
        at = first + order * (i + 1) + 2 * i
        following[i] = past[at] * (ends[1] - ends[0]) + past[at + 1] * ends[0]
        for k in range(i + 1):
            following[i] += past[at + 2 + k] * states[k]
    return row(following, 0, states)


@kernel
def passed(poles: Any, zeros: Any, state: Any, now: float, rest: float) -> float:
    """Return the output of a cascade with two zeros, whose input is ``now`` and was ``rest`` at rest.

    w is the last state, s*w = p_n*(w_before - w), and s^2*w likewise from s*w_before.
    """
    order = len(poles)
    before, last = poles[order - 2], poles[order - 1]
    inner = state[order - 3] if order > 2 else now - rest
    rate_before = before * (inner - state[order - 2])
    rate = last * (state[order - 2] - state[order - 1])
    found: float = rest + state[order - 1] + zeros[0] * rate + zeros[1] * last * (rate_before - rate)
    return found
