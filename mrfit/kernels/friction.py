"""Hysteresis stepped sample by sample: Dahl and LuGre friction, and Bouc-Wen whose parameters vary on the way."""

import math

import numpy as np

from mrfit.kernels.branch import bouc_wen
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power
from mrfit.specs import Array

# Largest sub-step of the varying Bouc-Wen law in s*n: RK4 then errs by less than 1e-5 over many branches.
_STEP = 0.1


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
def lugre(v: Array, theta: Array, dt: float) -> Array:
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
    dt
        Sample interval in s.

    Returns
    -------
    Array
        In N, shape (P, N).
    """
    vectors, last = theta.shape[1], theta.shape[2] - 1
    out = np.empty((vectors, len(v)))
    for p in range(vectors):
        z = 0.0
        for j in range(len(v)):
            sigma0, sigma1, sigma2, fc, more, vs, f0 = theta[:, p, min(j, last)]
            if j > 0:
                z = _lugre_step(z, (v[j - 1], v[j]), dt, (sigma0, fc, more, vs))
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
def _to_zero(size: float, n: float, rho: float) -> float:
    """Return the travel from y = -size to 0: the integral of 1/(1 - rho*u^n), as a series for a small size."""
    ratio = rho * power(size, n)
    total, term = 1.0, 1.0
    for k in range(1, 7):
        term *= ratio
        total += term / (k * n + 1.0)
    return size * total


@kernel
def _from_zero(travel: float, n: float) -> float:
    """Return y after a small travel from 0, where dy/ds = 1 - y^n, as the first terms of its series in s^n."""
    s_n = power(travel, n)
    a1 = -1.0 / (n + 1.0)
    a2 = -n * a1 / (2.0 * n + 1.0)
    a3 = -(n * a2 + 0.5 * n * (n - 1.0) * a1 * a1) / (3.0 * n + 1.0)
    return travel * (1.0 + s_n * (a1 + s_n * (a2 + s_n * a3)))


@kernel
def _runge_kutta(y: float, h: float, n: float, factor: float) -> float:
    """Return y after a step h of dy/ds = 1 + factor*|y|^n."""
    k1 = 1.0 + factor * power(abs(y), n)
    k2 = 1.0 + factor * power(abs(y + 0.5 * h * k1), n)
    k3 = 1.0 + factor * power(abs(y + 0.5 * h * k2), n)
    k4 = 1.0 + factor * power(abs(y + h * k3), n)
    return y + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0


@kernel
def _rise(y: float, travel: float, n: float, rho: float) -> float:
    """Return y after a rise of s by ``travel``, dy/ds = 1 - y^n above zero and 1 - rho*|y|^n below.

    Steps of RK4, but of series next to zero, where |y|^n has a corner.
    """
    small = _STEP / n
    while y < 0.0 and travel > 0.0:
        if -y <= small:
            spent = _to_zero(-y, n, rho)
            if spent >= travel:
                return _runge_kutta(y, travel, n, -rho)
            y, travel = 0.0, travel - spent
        else:
            h = min(travel, 0.5 * small, max(-y - 0.5 * small, 0.25 * small))
            y = _runge_kutta(y, h, n, -rho)
            travel -= h
    if y < 0.0 or travel <= 0.0:
        return y
    if y < 1e-9:
        h = min(travel, small)
        y, travel = max(y, _from_zero(h, n)), travel - h
    steps = int(math.ceil(travel / small))
    for _ in range(steps):
        y = _runge_kutta(y, travel / steps, n, -1.0)
    return min(y, 1.0)


@kernel
def varying_bouc_wen(x: Array, rate: Array, n: Array, rho: Array) -> Array:
    """Return y = z/z_max of Bouc-Wen with parameters that vary along the samples, from y = 0 at sample 0.

    Where they do not vary, ``branch.bouc_wen`` is exact and many times faster.

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
    out = np.empty((len(rate), len(x)))
    for p in range(len(rate)):
        y = 0.0
        for j in range(len(x)):
            if j > 0 and x[j] != x[j - 1]:
                step = rate[p, j] * (x[j] - x[j - 1])
                sign = math.copysign(1.0, step)
                y = sign * _rise(sign * y, min(abs(step), 2.0 + 30.0 / n[p, j]), n[p, j], rho[p, j])
            out[p, j] = y
    return out


def hysteresis(x: Array, rate: Array, n: Array, rho: Array) -> Array:
    """Return y = z/z_max of Bouc-Wen driven by x, (P, N): by the exact branch curve unless its parameters vary.

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
