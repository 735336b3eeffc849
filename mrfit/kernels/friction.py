"""Hysteresis stepped sample by sample: Dahl and LuGre friction, and Bouc-Wen whose parameters vary on the way."""

import math

import numpy as np

from mrfit.kernels.branch import bouc_wen
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power
from mrfit.specs import Array

# Largest sub-step of the varying Bouc-Wen law in s*n: RK4 then errs by less than 1e-6 over a whole branch.
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
def _stribeck(v: float, fc: float, fs: float, vs: float) -> float:
    return fc + (fs - fc) * math.exp(-((v / vs) ** 2))


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
    sigma, fc, fs, vs = shape
    sign, middle = (1.0 if v0 + v1 > 0.0 else -1.0), 0.5 * (v0 + v1)
    g0, gm, g1 = _stribeck(v0, fc, fs, vs), _stribeck(middle, fc, fs, vs), _stribeck(v1, fc, fs, vs)
    r0, rm, r1 = abs(v0) / g0, abs(middle) / gm, abs(v1) / g1
    total = (r0 + 4.0 * rm + r1) / 6.0
    turn, half = sigma * dt * total, (5.0 * r0 + 8.0 * rm - r1) / (24.0 * total)
    whole, first, second = _follow(turn)
    bend = ((gm - g0) / half - (g1 - g0)) / (half - 1.0)
    target = g0 * whole + (g1 - g0 - bend) * first + bend * second
    return z * (1.0 - whole) + sign * target / sigma


@kernel
def _lugre_step(z: float, ends: tuple[float, float], dt: float, shape: tuple[float, float, float, float]) -> float:
    """Return the deflection after one sample interval, cut where v passes 0 and quarters of Stribeck's velocity.

    The cuts move with the parameters, so that the result is as smooth in them as the equation.
    """
    v0, v1 = ends
    if v0 == v1:
        return _lugre_piece(z, ends, dt, shape) if v0 != 0.0 else z
    width = 0.25 * shape[3] if shape[1] != shape[2] else math.inf
    sign = 1.0 if v1 > v0 else -1.0
    at, stop = sign * v0, sign * v1  # seen along the velocity's direction, at rises to stop
    for _ in range(40):
        if at < -16.0 * width:
            following = -16.0 * width
        elif at < 0.0:
            following = min((math.floor(at / width * (1.0 - 1e-12)) + 1.0) * width, 0.0) if width < math.inf else 0.0
        elif at < 16.0 * width and width < math.inf:
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
def lugre(v: Array, theta: Array, dt: float) -> tuple[Array, Array]:
    """Return the LuGre bristles' deflection and its rate, from z = 0 at sample 0, with v linear between samples.

        dz/dt = v - sigma0*|v|*z/g(v),    g = Fc + (Fs - Fc)*exp(-(v/vs)^2)

    Parameters
    ----------
    v
        Velocity in m/s, shape (N,).
    theta
        sigma0 (N/m), Fc, Fs (N), vs (m/s), shape (4, P, M): M = 1, or M = N with the values of sample j for the step
        that ends there.
    dt
        Sample interval in s.

    Returns
    -------
    z, rate
        In m and m/s, shapes (P, N).
    """
    vectors, last = theta.shape[1], theta.shape[2] - 1
    z, rate = np.empty((vectors, len(v))), np.empty((vectors, len(v)))
    for p in range(vectors):
        state = 0.0
        for j in range(len(v)):
            m = min(j, last)
            shape = (theta[0, p, m], theta[1, p, m], theta[2, p, m], theta[3, p, m])
            if j > 0:
                state = _lugre_step(state, (v[j - 1], v[j]), dt, shape)
            z[p, j] = state
            rate[p, j] = v[j] - shape[0] * abs(v[j]) * state / _stribeck(v[j], shape[1], shape[2], shape[3])
    return z, rate


@kernel
def _rise(y: float, travel: float, n: float, rho: float) -> float:
    """Return y after a rise of s by ``travel``, dy/ds = 1 - y^n above zero and 1 - rho*|y|^n below, by RK4."""
    for negative in (True, False):
        if (y >= 0.0 and negative) or travel <= 0.0:
            continue
        steps = int(math.ceil(travel * n / _STEP))
        h = travel / steps
        factor = -rho if negative else -1.0
        for _ in range(steps):
            k1 = 1.0 + factor * power(abs(y), n)
            k2 = 1.0 + factor * power(abs(y + 0.5 * h * k1), n)
            k3 = 1.0 + factor * power(abs(y + 0.5 * h * k2), n)
            k4 = 1.0 + factor * power(abs(y + h * k3), n)
            following = y + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0
            if negative and following >= 0.0:
                # s from y to 0 by Simpson's rule on ds/dy, exact enough since a step is short.
                spent = -y * (1.0 / k1 + 4.0 / (1.0 + factor * power(0.5 * abs(y), n)) + 1.0) / 6.0
                y, travel = 0.0, max(travel - spent, 0.0)
                break
            y = following
            travel -= h
        if negative and y < 0.0:
            return y
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
    if all(
        np.array_equal(values, np.broadcast_to(start, values.shape))
        for values, start in zip((rate, n, rho), first, strict=True)
    ):
        nothing, one = np.zeros_like(first[0]), np.ones_like(first[0])
        return bouc_wen(x, np.hstack([nothing, one, *first]))
    return varying_bouc_wen(x, *(np.ascontiguousarray(np.broadcast_to(v, (len(v), len(x)))) for v in (rate, n, rho)))
