"""Bouc-Wen hysteresis with an exponent of its own for each of its two terms, stepped along the drive.

    dz/dx = kappa - beta*|z|^n1 - gamma*sign(x')*z*|z|^(n2-1)

With z_m > 0 the solution of beta*z_m^n1 + gamma*z_m^n2 = kappa, y = z/z_m, s = x*kappa/z_m and
rho = (beta*z_m^n1 - gamma*z_m^n2)/kappa, a rising branch is

    dy/ds = 1 - b*y^n1 - g*y^n2         for y > 0,
    dy/ds = 1 - b*|y|^n1 + g*|y|^n2     for y < 0,    b = (1 + rho)/2, g = (1 - rho)/2

and a falling one its mirror image. For n1 = n2 that is the law of ``kernels.branch``, whose curve has one exponent in
its tables: here the state is stepped, by RK4 in s between samples, cut where y passes 0 and near it by a series.
"""

import math

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power
from mrfit.kernels.theta import plain

# Sub-step in s times the greater exponent; share of |y| by which a sub-step may change it; |y| below which the series
# about 0 serves, whose error is of its third power; where y counts as saturated
_STEP = 0.1
_SHARE = 0.3
_SMALL = 2e-3
_SATURATED = 1.0 - 1e-13
_ITERATIONS = 100


@kernel
def _rate(y: float, n1: float, n2: float, b: float, g: float) -> float:
    """Return dy/ds of a rising branch."""
    u = abs(y)
    return 1.0 - b * power(u, n1) - math.copysign(g, y) * power(u, n2) if u > 0.0 else 1.0


@kernel
def _runge_kutta(y: float, h: float, n1: float, n2: float, b: float, g: float) -> float:
    """Return y after a sub-step h in s."""
    k1 = _rate(y, n1, n2, b, g)
    k2 = _rate(y + 0.5 * h * k1, n1, n2, b, g)
    k3 = _rate(y + 0.5 * h * k2, n1, n2, b, g)
    k4 = _rate(y + h * k3, n1, n2, b, g)
    return y + h * (k1 + 2.0 * k2 + 2.0 * k3 + k4) / 6.0


@kernel
def _more(u: float, n1: float, n2: float, b: float, g: float) -> float:
    """Return by how much the travel between 0 and a small u > 0 is more than u, to first order."""
    return b * power(u, n1) * u / (n1 + 1.0) + g * power(u, n2) * u / (n2 + 1.0) if u > 0.0 else 0.0


@kernel
def _risen(y: float, travel: float, n1: float, n2: float, b: float, g: float) -> float:
    """Return y after a rise of s by ``travel``."""
    h_most = _STEP / max(n1, n2)
    while travel > 0.0 and y < -_SMALL:
        h = min(travel, h_most, -_SHARE * y)
        y, travel = _runge_kutta(y, h, n1, n2, b, g), travel - h
    if travel > 0.0 and y < 0.0:
        left = -y + _more(-y, n1, n2, b, -g) - travel
        if left > 0.0:
            return -(left - _more(left, n1, n2, b, -g))
        y, travel = 0.0, -left
    if travel > 0.0 and y < _SMALL:
        s = y + _more(y, n1, n2, b, g) + travel
        end = _SMALL + _more(_SMALL, n1, n2, b, g)
        if s <= end:
            return s - _more(s, n1, n2, b, g)
        y, travel = _SMALL, s - end
    while travel > 0.0 and y < _SATURATED:
        h = min(travel, h_most, _SHARE * y)
        y, travel = _runge_kutta(y, h, n1, n2, b, g), travel - h
    return min(y, 1.0)


@kernel
def two_exponents_step(y: float, travel: float, rate: float, n1: float, n2: float, rho: float) -> float:
    """Return y after a travel of the drive, y, rho, n1 and n2 as above, of a rate kappa/z_m."""
    if travel == 0.0:
        return y
    way = min(rate * abs(travel), 2.0 + 32.0 / min(n1, n2))
    sign = math.copysign(1.0, travel)
    return sign * _risen(sign * y, way, n1, n2, 0.5 * (1.0 + rho), 0.5 * (1.0 - rho))


@kernel
def _simulated(x: Array, forms: Array) -> Array:
    out = np.empty((len(forms), len(x)))
    for p in range(len(forms)):
        slope, gain, rate, n1, n2, rho = forms[p]
        if not (math.isfinite(np.sum(forms[p])) and rate >= 0.0 and n1 > 0.0 and n2 > 0.0 and abs(rho) <= 1.0):
            out[p] = np.nan
            continue
        y = 0.0
        for j in range(len(x)):
            if not math.isfinite(x[j]):
                out[p, j:] = np.nan
                break
            if j > 0:
                y = two_exponents_step(y, x[j] - x[j - 1], rate, n1, n2, rho)
            out[p, j] = slope * x[j] + gain * y
    return out


def driven_by_two(drive: Array, forms: Array, dt: float) -> Array:
    """Simulate slope*x + gain*y from y = 0 at sample 0.

    Parameters
    ----------
    drive
        Drive x, shape (1, N).
    forms
        One row per parameter vector, shape (P, 6): slope (output/drive), gain (output), rate = kappa/z_m (1/drive), n1,
        n2, rho. A row that is not finite, or with rate < 0, an exponent <= 0 or rho outside -1 to 1, gives NaN.
    dt
        Does not enter.

    Returns
    -------
    Array
        Responses, shape (P, N), in the output's unit; a step's error is some 1e-7 of the gain, at any sampling.
    """
    return _simulated(plain(drive[0]), np.ascontiguousarray(forms))


@kernel
def saturation(kappa: float, beta: float, gamma: float, n1: float, n2: float) -> float:
    """Return ln z_m, the root of beta*exp(n1*w) + gamma*exp(n2*w) = kappa, by Newton's method on its logarithm."""
    w = min(math.log(kappa / beta) / n1, math.log(kappa / gamma) / n2)
    for _ in range(_ITERATIONS):
        one, other = beta * math.exp(n1 * w), gamma * math.exp(n2 * w)
        step = math.log((one + other) / kappa) * (one + other) / (n1 * one + n2 * other)
        w -= step
        if abs(step) <= 1e-15 * max(1.0, abs(w)):
            break
    return w


@kernel
def _bounds(kappa: Array, beta: Array, gamma: Array, n1: Array, n2: Array) -> Array:
    out = np.empty(len(kappa))
    for p in range(len(kappa)):
        sound = kappa[p] > 0.0 and beta[p] > 0.0 and gamma[p] > 0.0 and n1[p] > 0.0 and n2[p] > 0.0
        out[p] = math.exp(saturation(kappa[p], beta[p], gamma[p], n1[p], n2[p])) if sound else np.nan
    return out


def normal_form_of_two(kappa: Array, beta: Array, gamma: Array, n1: Array, n2: Array) -> tuple[Array, Array, Array]:
    """Return z_m, rate = kappa/z_m and rho, each (P,), of printed parameters (P,) above 0; NaN for others."""
    z_m = _bounds(*(np.ascontiguousarray(v, dtype=np.float64) for v in (kappa, beta, gamma, n1, n2)))
    with np.errstate(invalid="ignore", over="ignore"):
        return z_m, kappa / z_m, np.clip((beta * z_m**n1 - gamma * z_m**n2) / kappa, -1.0, 1.0)
