"""State equations of the laws, each integrated in fixed steps; written for this benchmark alone."""

import numpy as np
from numba import njit

from benchmarks.law_mismatch.motions import Array


@njit(cache=True)
def series_flow(x: Array, yield_force: Array, flow: Array, stiffness: float, soft: float, h: float) -> Array:
    """Return the force (N,) of a spring in series with a regularised Bingham element, by implicit Euler steps.

    k*(x - y) = f*(1 - exp(-|u|/e))*sign(u) + c*u,  u = dy/dt; k stiffness, e soft (m/s), f yield_force (N), c flow.
    """
    force = np.empty(len(x))
    y, u = x[0], 0.0
    for n in range(len(x)):
        f, c, pull = yield_force[n], flow[n], stiffness * (x[n] - y)
        low, high = min(0.0, pull), max(0.0, pull)
        low, high = low / (c + stiffness * h), high / (c + stiffness * h)
        u = min(max(u, low), high)
        for _ in range(60):
            bent = np.exp(-abs(u) / soft)
            error = f * (1.0 - bent) * np.sign(u) + (c + stiffness * h) * u - pull
            if error > 0.0:
                high = u
            else:
                low = u
            step = u - error / (f * bent / soft + c + stiffness * h)
            new = step if low <= step <= high else 0.5 * (low + high)
            if abs(new - u) <= 1e-12 * (abs(u) + soft):
                u = new
                break
            u = new
        y += h * u
        force[n] = stiffness * (x[n] - y)
    return force


@njit(cache=True)
def bristle(v: Array, travel: float, reach: Array, h: float) -> Array:
    """Return z (N,) of z' = v/d - |v|*z/(d*g): d travel (m), g reach (N,); exact where v and g hold over a step."""
    z = np.zeros(len(v))
    for n in range(1, len(v)):
        u, g = 0.5 * (v[n] + v[n - 1]), reach[n]
        end = np.sign(u) * g
        z[n] = end + (z[n - 1] - end) * np.exp(-abs(u) * h / (travel * g))
    return z


@njit(cache=True)
def dahl(x: Array, travel: float, power: float) -> Array:
    """Return z (N,) of dz/dx = (1 - z*sign(v))^n/d, |z| <= 1: d travel (m), n power; exact in x for any n >= 1."""
    z = np.zeros(len(x))
    for n in range(1, len(x)):
        dx = x[n] - x[n - 1]
        s = 1.0 if dx >= 0.0 else -1.0
        gap = 1.0 - s * z[n - 1]
        way = abs(dx) / travel
        if power == 1.0:
            gap *= np.exp(-way)
        elif gap > 0.0:
            gap = (gap ** (1.0 - power) + (power - 1.0) * way) ** (1.0 / (1.0 - power))
        z[n] = s * (1.0 - gap)
    return z


@njit(cache=True)
def stops(x: Array, travels: Array, weights: Array, stretch: Array) -> Array:
    """Return the sum (N,) of stop operators (Jenkins elements), weighted (J,): each follows x and slips at +-1.

    ``travels`` (J,) are those from rest to slip (m), ``stretch`` (N,) multiplies all of them.
    """
    z = np.zeros(len(travels))
    total = np.zeros(len(x))
    for n in range(1, len(x)):
        dx = (x[n] - x[n - 1]) / stretch[n]
        for j in range(len(travels)):
            z[j] = min(max(z[j] + dx / travels[j], -1.0), 1.0)
            total[n] += weights[j] * z[j]
    return total


@njit(cache=True)
def relaxed(u: Array, tau: float, h: float) -> Array:
    """Return the lagged y (N,) of tau*y' = u - y, u straight between samples, from rest at u[0]."""
    y = np.empty(len(u))
    y[0] = u[0]
    keep = np.exp(-h / tau)
    for n in range(1, len(u)):
        slope = (u[n] - u[n - 1]) / h
        y[n] = u[n] - tau * slope + (y[n - 1] - u[n - 1] + tau * slope) * keep
    return y


@njit(cache=True)
def play(u: Array, half: float) -> Array:
    """Return the play operator (N,) of half-width ``half`` from 0."""
    y = np.empty(len(u))
    last = 0.0
    for n in range(len(u)):
        last = max(u[n] - half, min(u[n] + half, last))
        y[n] = last
    return y


@njit(cache=True)
def released(u: Array, tau: float, h: float) -> Array:
    """Return y (N,) that rises with u at once and falls to it with a time constant (s)."""
    y = np.empty(len(u))
    last, keep = u[0], np.exp(-h / tau)
    for n in range(len(u)):
        last = max(u[n], u[n] + (last - u[n]) * keep)
        y[n] = last
    return y
