"""Hysteresis stepped sample by sample: Dahl and LuGre friction, and Bouc-Wen whose parameters vary on the way."""

import math

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.branch import bouc_wen
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power

# Bouc-Wen that varies. Up to this y^n a series serves; in between, a sub-step in s*n, with which RK4 errs by less than
# 1e-5 over many branches; from this -ln(1 - y^n) on a closed form; and where y counts as saturated.
_SMALL = 0.1
_STEP = 0.14
_DEEP = 6.0
_SATURATED = 1.0 - 1e-13


@kernel
def dahl(x: Array, rate: Array) -> Array:
    """Return Dahl's state y: dy = rate*(dx - |dx|*y), from y = 0 at sample 0; exact for every step.

    Parameters
    ----------
    x
        Displacement, shape (N,).
    rate
        Inverse of the travel over which friction turns over, shape (P, M): M = 1, or M = N with the value of sample j
        for the step that ends there.

    Returns
    -------
    Array
        States between -1 and 1, shape (P, N).
    """
    out = np.empty((len(rate), len(x)))
    last = rate.shape[1] - 1
    for p in range(len(rate)):
        y = 0.0
        for j in range(len(x)):
            if j > 0:
                step = x[j] - x[j - 1]
                y += -math.expm1(-rate[p, min(j, last)] * abs(step)) * (math.copysign(1.0, step) - y)
            out[p, j] = y
    return out


@kernel
def _stribeck(v: float, fc: float, more: float, vs: float) -> float:
    """Return fc + more*exp(-(v/vs)^2), its last term dropped where it is below 1e-11 of itself at rest."""
    return fc + more * math.exp(-((v / vs) ** 2)) if abs(v) < 5.0 * vs else fc


@kernel
def _follow(turn: float) -> tuple[float, float, float]:
    """Return the integrals of exp(x - 1)^turn, times 1, x and x^2, times turn, over x from 0 to 1."""
    whole = -math.expm1(-turn)
    if turn > 0.5:
        first = 1.0 - whole / turn
        return whole, first, 1.0 - 2.0 * first / turn
    first, second, term = 0.0, 0.0, 0.5 * turn
    for k in range(3, 15):
        first += term
        second += term * 2.0 / k
        term *= -turn / k
    return whole, first, second


@kernel
def _lugre_piece(z: float, ends: tuple[float, float], dt: float, shape: tuple[float, float, float, float]) -> float:
    """Return the deflection after v went linearly, without a change of sign, between two values in a time dt.

    In the variable tau = integral of sigma0*|v|/g, dz/dtau = sign(v)*g/sigma0 - z, with g taken as a parabola in tau.
    """
    v0, v1 = ends
    sigma, fc, more, vs = shape
    sign, middle = (1.0 if v0 + v1 > 0.0 else -1.0), 0.5 * (v0 + v1)
    g0, gm, g1 = _stribeck(v0, fc, more, vs), _stribeck(middle, fc, more, vs), _stribeck(v1, fc, more, vs)
    r0, rm, r1 = abs(v0) / g0, abs(middle) / gm, abs(v1) / g1
    total = (r0 + 4.0 * rm + r1) / 6.0
    turn, half = sigma * dt * total, (5.0 * r0 + 8.0 * rm - r1) / (24.0 * total)
    whole, first, second = _follow(turn)
    bend = ((gm - g0) / half - (g1 - g0)) / (half - 1.0)
    target = g0 * whole + (g1 - g0 - bend) * first + bend * second
    return z * (1.0 - whole) + sign * target / sigma


@kernel
def _lugre_step(z: float, ends: tuple[float, float], dt: float, shape: tuple[float, float, float, float]) -> float:
    """Return the deflection after one sample interval, cut where v passes 0 and eighths of Stribeck's velocity.

    The cuts move with the parameters, so that the result is as smooth in them as the equation.
    """
    v0, v1 = ends
    if v0 == v1:
        return _lugre_piece(z, ends, dt, shape) if v0 != 0.0 else z
    width = 0.125 * shape[3] if shape[2] != 0.0 else math.inf
    sign = 1.0 if v1 > v0 else -1.0
    at, stop = sign * v0, sign * v1  # seen along the velocity's direction, at rises to stop
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
            z = _lugre_piece(z, (sign * at, sign * following), dt * (following - at) / (stop - sign * v0), shape)
        if following >= stop:
            break
        at = following
    return z


@kernel
def lugre(v: Array, theta: Array, steps: Array) -> Array:
    """Return the force of LuGre friction, from z = 0 at sample 0, with v linear between samples.

        F = f0 + sigma0*z + sigma1*dz/dt + sigma2*v
        dz/dt = v - sigma0*|v|*z/g(v),    g = Fc + dF*exp(-(v/vs)^2)

    Parameters
    ----------
    v
        Velocity in m/s, shape (N,).
    theta
        sigma0 (N/m), sigma1, sigma2 (N*s/m), Fc, dF (N), vs (m/s), f0 (N), shape (7, P, M): M = 1, or M = N with the
        values of sample j for the step that ends there.
    steps
        Time from each sample to that before in s, shape (1,) or (N,).

    Returns
    -------
    Array
        In N, shape (P, N).
    """
    vectors, last, last_step = theta.shape[1], theta.shape[2] - 1, len(steps) - 1
    out = np.empty((vectors, len(v)))
    for p in range(vectors):
        z = 0.0
        for j in range(len(v)):
            sigma0, sigma1, sigma2, fc, more, vs, f0 = theta[:, p, min(j, last)]
            if j > 0:
                z = _lugre_step(z, (v[j - 1], v[j]), steps[min(j, last_step)], (sigma0, fc, more, vs))
            rate = v[j] - sigma0 * abs(v[j]) * z / _stribeck(v[j], fc, more, vs)
            out[p, j] = f0 + sigma0 * z + sigma1 * rate + sigma2 * v[j]
    return out


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


@kernel
def _travel(y: float, n: float, rho: float) -> float:
    """Return the travel from 0 to y >= 0 where dy/ds = 1 - rho*y^n: a series for rho*y^n up to ``_SMALL``."""
    ratio = rho * power(y, n)
    total, term = 1.0, 1.0
    for k in range(1, 8):
        term *= ratio
        total += term / (k * n + 1.0)
    return y * total


@kernel
def _reached(travel: float, n: float, rho: float) -> float:
    """Return y after a travel from 0, the inverse of ``_travel``: first terms of its series, and a step of Newton."""
    s_n = rho * power(travel, n)
    a1 = -1.0 / (n + 1.0)
    a2 = -n * a1 / (2.0 * n + 1.0)
    a3 = -(n * a2 + 0.5 * n * (n - 1.0) * a1 * a1) / (3.0 * n + 1.0)
    y = travel * (1.0 + s_n * (a1 + s_n * (a2 + s_n * a3)))
    return y - (_travel(y, n, rho) - travel) * (1.0 - rho * power(y, n)) if y > 0.0 else 0.0


@kernel
def _fall(u: float, travel: float, n: float, rho: float) -> tuple[float, float]:
    """Return u = |y| after it fell at du/ds = -(1 - rho*u^n), to 0 at most, and the travel that is left."""
    while travel > 0.0 and abs(rho) * power(u, n) > _SMALL:
        h = min(travel, 0.5 * _STEP / n, 0.3 * u)
        k1 = 1.0 - rho * power(u, n)
        k2 = 1.0 - rho * power(max(u - 0.5 * h * k1, 0.0), n)
        k3 = 1.0 - rho * power(max(u - 0.5 * h * k2, 0.0), n)
        k4 = 1.0 - rho * power(max(u - h * k3, 0.0), n)
        u, travel = max(u - h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0, 0.0), travel - h
    if travel <= 0.0:
        return u, 0.0
    left = _travel(u, n, rho) - travel
    return (_reached(left, n, rho), 0.0) if left > 0.0 else (0.0, -left)


@kernel
def _gain(depth: float, n: float) -> float:
    """Return d(depth)/ds where depth = -ln(1 - y^n)."""
    return n * power(-math.expm1(-depth), 1.0 - 1.0 / n) if n > 1.0 else n


@kernel
def _saturate(y: float, travel: float, n: float) -> float:
    """Return y after a travel at dy/ds = 1 - y^n, from a y^n of ``_SMALL`` or more.

    Steps of RK4 in -ln(1 - y^n), a variable in which the approach to 1 is a straight line; far along it, its first two
    terms are integrated in closed form.
    """
    depth = -math.log1p(-power(y, n))
    while travel > 0.0 and depth < _DEEP:
        h = min(travel, _STEP * (0.5 + depth) / n)
        k1 = _gain(depth, n)
        k2 = _gain(depth + 0.5 * h * k1, n)
        k3 = _gain(depth + 0.5 * h * k2, n)
        k4 = _gain(depth + h * k3, n)
        depth, travel = depth + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0, travel - h
    left = math.exp(-depth)
    if travel > 0.0:
        start = 1.0 - 1.0 / n
        left = 1.0 / ((1.0 / left - start) * math.exp(min(n * travel, 50.0)) + start)
    return power(1.0 - left, 1.0 / n)


@kernel
def _rise(y: float, travel: float, n: float, rho: float) -> float:
    """Return y after a rise of s by ``travel``, dy/ds = 1 - y^n above zero and 1 - rho*|y|^n below."""
    if y < 0.0:
        u, travel = _fall(-y, travel, n, rho)
        y = -u
    if travel <= 0.0 or y > _SATURATED:
        return y
    y = abs(y)  # no negative zero, of which there is no power
    if power(y, n) < _SMALL:
        s = _travel(y, n, 1.0) + travel
        knee = power(_SMALL, 1.0 / n)
        beyond = s - _travel(knee, n, 1.0)
        if beyond <= 0.0:
            return _reached(s, n, 1.0)
        y, travel = knee, beyond
    return min(_saturate(y, travel, n), 1.0)


@kernel
def _continued(x: Array, shape: tuple[Array, Array, Array], rests: Index, known: Array) -> Array:
    """Return the states (P, N) of which the first ``rests`` (P,), 1 or more, are ``known`` (P, M)."""
    rate, n, rho = shape
    out = np.empty((len(rate), len(x)))
    for p in range(len(rate)):
        for j in range(rests[p]):
            out[p, j] = known[p, j]
        y = known[p, rests[p] - 1]
        for j in range(rests[p], len(x)):
            if x[j] != x[j - 1]:
                step = rate[p, j] * (x[j] - x[j - 1])
                sign = math.copysign(1.0, step)
                y = sign * _rise(sign * y, min(abs(step), 2.0 + 30.0 / n[p, j]), n[p, j], rho[p, j])
            out[p, j] = y
    return out


def varying_bouc_wen(x: Array, rate: Array, n: Array, rho: Array) -> Array:
    """Return y = z/z_max of Bouc-Wen with parameters that vary along the samples, from y = 0 at sample 0.

    Up to the sample at which a vector's parameters first vary the curve of ``branch.bouc_wen`` is read, which is exact.

    Parameters
    ----------
    x
        Drive, shape (N,).
    rate, n, rho
        kappa/z_max, n and (beta - gamma)/(beta + gamma), shapes (P, N): the values of sample j hold for the step that
        ends there. A step of saturated travel takes no more sub-steps than one of (2 + 30/n).

    Returns
    -------
    Array
        Shape (P, N), within -1 and 1; the share of the saturated state is kept where the parameters change.
    """
    moved = np.any([values != values[:, :1] for values in (rate, n, rho)], axis=0)
    rests = np.where(moved.any(axis=1), moved.argmax(axis=1), len(x))
    known, longest = np.zeros((len(rate), 1)), int(rests.max(initial=0))
    if longest > 1:
        first = [values[:, :1] for values in (rate, n, rho)]
        known = bouc_wen(x[:longest], np.hstack([np.zeros_like(rate[:, :1]), np.ones_like(rate[:, :1]), *first]))
    stepped: Array = _continued(x, (rate, n, rho), rests, known)
    return stepped


def hysteresis(x: Array, rate: Array, n: Array, rho: Array) -> Array:
    """Return y = z/z_max of Bouc-Wen driven by x, (P, N): by the exact branch curve until its parameters first vary.

    Parameters
    ----------
    x
        Drive, shape (N,).
    rate, n, rho
        As in ``varying_bouc_wen``, shapes (P, 1) or (P, N).
    """
    first = [values[:, :1] for values in (rate, n, rho)]
    if all(v.shape[1] == 1 or np.array_equal(v, np.broadcast_to(v[:, :1], v.shape)) for v in (rate, n, rho)):
        nothing, one = np.zeros_like(first[0]), np.ones_like(first[0])
        return bouc_wen(x, np.hstack([nothing, one, *first]))
    return varying_bouc_wen(x, *(np.ascontiguousarray(np.broadcast_to(v, (len(v), len(x)))) for v in (rate, n, rho)))
