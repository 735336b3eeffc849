"""Steps of hysteretic elements: LuGre's bristles, and Bouc-Wen's element where no branch curve serves."""

import math

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.branch import bouc_wen
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power

Shape = tuple[float, float, float, float]
# LuGre whose parameters move: parts of a step for a change of them by their own size
_PARTS, _MOST_PARTS = 64.0, 400
# Bouc-Wen: error of a sub-step as a share of the saturated state, and how many a step may have
_EXACT, _MOST_STEPS = 1e-10, 2000


@kernel
def stribeck_curve(v: float, fc: float, more: float, vs: float) -> float:
    """Return fc + more*exp(-(v/vs)^2), its last term dropped where it is below 1e-11 of itself at rest."""
    return fc + more * math.exp(-((v / vs) ** 2)) if abs(v) < 5.0 * vs else fc


@kernel
def between(then: Shape, here: Shape, share: float) -> Shape:
    """Return parameters on the line from those of a step's beginning to those of its end."""
    (a0, b0, c0, d0), (a1, b1, c1, d1) = then, here
    return a0 + share * (a1 - a0), b0 + share * (b1 - b0), c0 + share * (c1 - c0), d0 + share * (d1 - d0)


@kernel
def _follow(turn: float) -> tuple[float, float, float]:
    """Return the integrals of exp(x - 1)^turn, times 1, x and x^2, times turn, over x from 0 to 1."""
    if turn > 0.5:
        whole = -math.expm1(-turn)
        first = 1.0 - whole / turn
        return whole, first, 1.0 - 2.0 * first / turn
    # the last by its series with terms 2/(k + 2)!, the others from it; a step in C takes 59 ns so, and 86 ns with three
    # series whose terms follow from one another
    s = turn * turn
    even = 1.0 / 2520.0 + s * (1.0 / 181440.0 + s * (1.0 / 19958400.0 + s * (1.0 / 3113510400.0)))
    odd = 1.0 / 20160.0 + s * (1.0 / 1814400.0 + s * (1.0 / 239500800.0 + s * (1.0 / 43589145600.0)))
    even = 1.0 / 3.0 + s * (1.0 / 60.0 + s * even)
    odd = 1.0 / 12.0 + s * (1.0 / 360.0 + s * odd)
    second = turn * (even - turn * odd)
    first = 0.5 * turn * (1.0 - second)
    return turn * (1.0 - first), first, second


@kernel
def _lugre_piece(z: float, ends: tuple[float, float], dt: float, then: Shape, here: Shape) -> float:
    """Return the deflection after v went linearly, without a change of sign, between two values in a time dt.

    In the variable tau = integral of sigma0*|v|/g, dz/dtau = sign(v)*g/sigma0 - z, with g/sigma0 a parabola in tau.
    """
    v0, v1 = ends
    sign, vm = (1.0 if v0 + v1 > 0.0 else -1.0), 0.5 * (v0 + v1)
    sigma0, fc0, more0, vs0 = then
    sigma1, fc1, more1, vs1 = here
    sigmam = 0.5 * (sigma0 + sigma1)
    # as shares of the middle's stiffness
    g0 = stribeck_curve(v0, fc0, more0, vs0) * (sigmam / sigma0 if sigma0 != sigmam else 1.0)
    gm = stribeck_curve(vm, 0.5 * (fc0 + fc1), 0.5 * (more0 + more1), 0.5 * (vs0 + vs1))
    g1 = stribeck_curve(v1, fc1, more1, vs1) * (sigmam / sigma1 if sigma1 != sigmam else 1.0)
    r0, rm, r1 = abs(v0) / g0, abs(vm) / gm, abs(v1) / g1
    total = (r0 + 4.0 * rm + r1) / 6.0
    half = (5.0 * r0 + 8.0 * rm - r1) / (24.0 * total)
    whole, first, second = _follow(sigmam * dt * total)
    bend = ((gm - g0) / half - (g1 - g0)) / (half - 1.0)
    return z * (1.0 - whole) + sign * (g0 * whole + (g1 - g0 - bend) * first + bend * second) / sigmam


@kernel
def _lugre_part(z: float, ends: tuple[float, float], dt: float, then: Shape, here: Shape) -> float:
    """Return the deflection after a part of a step, cut where v passes 0 and eighths of Stribeck's velocity.

    The cuts move with the parameters, so that the result is as smooth in them as the equation.
    """
    v0, v1 = ends
    if v0 == v1:
        return _lugre_piece(z, ends, dt, then, here) if v0 != 0.0 else z
    width = 0.125 * min(then[3], here[3]) if then[2] != 0.0 or here[2] != 0.0 else math.inf
    sign = 1.0 if v1 > v0 else -1.0
    at, stop = sign * v0, sign * v1  # seen along the velocity's direction, at rises to stop
    start, low = at, then
    for _ in range(80):
        if at < -32.0 * width:
            following = -32.0 * width
        elif at < 0.0:
            following = min((math.floor(at / width * (1.0 - 1e-12)) + 1.0) * width, 0.0) if width < math.inf else 0.0
        elif at < 32.0 * width and width < math.inf:
            following = (math.floor(at / width * (1.0 + 1e-12)) + 1.0) * width
        else:
            following = stop
        following = min(following, stop)
        if following > at:
            share = (following - at) / (stop - start)
            high = here
            if following < stop:
                high = between(then, here, (following - start) / (stop - start))
            z = _lugre_piece(z, (sign * at, sign * following), dt * share, low, high)
            low = high
        if following >= stop:
            break
        at = following
    return z


@kernel
def _change(before: float, now: float) -> float:
    """Return the change of a value as a share of the smaller of both."""
    return abs(now - before) / max(min(abs(before), abs(now)), 1e-300) if now != before else 0.0


@kernel
def lugre_step(z: float, ends: tuple[float, float], dt: float, then: Shape, here: Shape) -> float:
    """Return the deflection of LuGre's bristles in m after a step of dt s.

    Parameters
    ----------
    z
        Deflection before it, m.
    ends
        Velocity at both ends in m/s, linear in between.
    dt
        In s.
    then, here
        sigma0 (N/m), Fc, dF (N) and vs (m/s) at both ends, linear in between.
    """
    first, second = _change(then[0], here[0]), _change(then[1], here[1])
    change = max(max(first, second), max(_change(then[2], here[2]), _change(then[3], here[3])))
    parts = int(min(1.0 + _PARTS * change, _MOST_PARTS))
    low, v0 = then, ends[0]
    for k in range(parts):
        high, v1 = here, ends[1]
        if k < parts - 1:
            share = (k + 1.0) / parts
            high, v1 = between(then, here, share), ends[0] + share * (ends[1] - ends[0])
        z = _lugre_part(z, (v0, v1), dt / parts if parts > 1 else dt, low, high)
        low, v0 = high, v1
    return z


@kernel
def _slope(z: float, share: float, travel: float, then: Shape, here: Shape) -> float:
    """Return dz/d(share of a step) of Bouc-Wen's element."""
    kappa, beta, gamma, n = between(then, here, share)
    return travel * (kappa - (beta + math.copysign(gamma, travel * z)) * power(abs(z), n))


@kernel
def bouc_wen_step(z: float, travel: float, then: Shape, here: Shape) -> float:
    """Return z after a step of a travel, dz = kappa*dx - (beta*dx + gamma*|dx|*sign(z))*|z|^n.

    By Dormand's and Prince's method of order 5, in sub-steps of bounded number whose error is 1e-10 of saturation.

    Parameters
    ----------
    z
        State before it.
    travel
        Of the drive, which is linear in time, in its unit.
    then, here
        kappa, beta, gamma (1 over the unit) and n (1) at both ends, linear in between.
    """
    if travel == 0.0:
        return z
    kappa, beta, gamma, n = here
    # the saturation; a loop that hardens has none
    scale = power(kappa / (abs(beta) + abs(gamma)), 1.0 / n)
    limit = _EXACT * scale
    done, h = 0.0, min(1.0, 0.2 * scale / (kappa * abs(travel)))
    k1 = _slope(z, 0.0, travel, then, here)
    for _ in range(_MOST_STEPS):
        h = min(h, 1.0 - done)
        k2 = _slope(z + h * k1 / 5.0, done + h / 5.0, travel, then, here)
        k3 = _slope(z + h * (3.0 * k1 + 9.0 * k2) / 40.0, done + 0.3 * h, travel, then, here)
        to = h * (44.0 / 45.0 * k1 - 56.0 / 15.0 * k2 + 32.0 / 9.0 * k3)
        k4 = _slope(z + to, done + 0.8 * h, travel, then, here)
        to = 19372.0 / 6561.0 * k1 - 25360.0 / 2187.0 * k2 + 64448.0 / 6561.0 * k3 - 212.0 / 729.0 * k4
        k5 = _slope(z + h * to, done + 8.0 / 9.0 * h, travel, then, here)
        to = 9017.0 / 3168.0 * k1 - 355.0 / 33.0 * k2 + 46732.0 / 5247.0 * k3 + 49.0 / 176.0 * k4
        k6 = _slope(z + h * (to - 5103.0 / 18656.0 * k5), done + h, travel, then, here)
        to = 35.0 / 384.0 * k1 + 500.0 / 1113.0 * k3 + 125.0 / 192.0 * k4 - 2187.0 / 6784.0 * k5 + 11.0 / 84.0 * k6
        k7 = _slope(z + h * to, done + h, travel, then, here)
        off = 71.0 / 57600.0 * k1 - 71.0 / 16695.0 * k3 + 71.0 / 1920.0 * k4 - 17253.0 / 339200.0 * k5
        error = abs(h * (off + 22.0 / 525.0 * k6 - k7 / 40.0)) / limit
        if error <= 1.0 or h < 1e-9:
            z, done, k1 = z + h * to, done + h, k7
            if done >= 1.0:
                break
        h *= min(max(0.9 * math.exp(-0.2 * math.log(max(error, 1e-10))), 0.2), 5.0)
    return z


@kernel
def combine(state: Array, gain: Array, weights: Array, signals: Array) -> None:
    """Turn states into gain*state + sum_k weights_k*signals_k, in place.

    Parameters
    ----------
    state
        Shape (P, N).
    gain
        Shape (P, M), M = 1 or N.
    weights
        Shape (K, P, M).
    signals
        Shape (K, N).
    """
    varying = gain.shape[1] > 1
    for p in range(len(state)):
        for j in range(state.shape[1]):
            state[p, j] *= gain[p, j if varying else 0]
        for k in range(len(signals)):
            if varying:
                for j in range(state.shape[1]):
                    state[p, j] += weights[k, p, j] * signals[k, j]
            else:
                for j in range(state.shape[1]):
                    state[p, j] += weights[k, p, 0] * signals[k, j]


def hysteresis(x: Array, rate: Array, n: Array, rho: Array) -> Array:
    """Return y = z/z_max of Bouc-Wen driven by x (N,), (P, N), by the exact branch curve.

    ``rate``, ``n`` and ``rho`` are kappa/z_max, n and (beta - gamma)/(beta + gamma), shapes (P, 1).
    """
    return bouc_wen(x, np.hstack([np.zeros_like(rate), np.ones_like(rate), rate, n, rho]))
