"""Hysteretic elements one step at a time: states of many lanes go in and come out, nothing is kept in between."""

import math

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.friction import _lugre_step, _rise, _stribeck
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power

Shape = tuple[float, float, float, float]
# Bound on a sub-step's error estimate as a share of the saturated element's force: a hundredth of a simulation's
_TOLERANCE = 1e-8
_MAX_STEPS = 3000


@kernel
def bouc_wen_step(y: Array, travel: Array, rate: Array, n: Array, rho: Array) -> Array:
    """Return y = z/z_max of Bouc-Wen after a travel of its drive, all (B,); see ``friction.varying_bouc_wen``."""
    following = np.empty_like(y)
    for b in range(len(y)):
        step = rate[b] * travel[b]
        if step == 0.0:
            following[b] = y[b]
            continue
        sign = math.copysign(1.0, step)
        following[b] = sign * _rise(sign * y[b], min(abs(step), 2.0 + 30.0 / n[b]), n[b], rho[b])
    return following


@kernel
def lugre_step(z: Array, ends: Array, theta: Array, dt: float) -> tuple[Array, Array]:
    """Return force (N) and deflection (m) of LuGre friction after one step, (B,).

    ``z`` (B,) in m, ``ends`` (2, B) the velocity at both ends in m/s, ``theta`` (7, B) as in ``friction.lugre``.
    """
    force, following = np.empty_like(z), np.empty_like(z)
    for b in range(len(z)):
        sigma0, sigma1, sigma2, fc, more, vs, f0 = theta[:, b]
        after = _lugre_step(z[b], (ends[0, b], ends[1, b]), dt, (sigma0, fc, more, vs)) if dt > 0.0 else z[b]
        v = ends[1, b]
        rate = v - sigma0 * abs(v) * after / _stribeck(v, fc, more, vs)
        force[b] = f0 + sigma0 * after + sigma1 * rate + sigma2 * v
        following[b] = after
    return force, following


@kernel
def _slope(z: float, w: float, shape: tuple[float, float, float, float]) -> tuple[float, float]:
    """Return dz/dxi of a Bouc-Wen element and its derivative with respect to z."""
    growth, beta, gamma, n = shape
    size = max(abs(z), 1e-100)
    decay = (beta + math.copysign(gamma, w * z)) * power(size, n)
    return growth - decay, -n * decay / math.copysign(size, z)


@kernel
def _attempt(
    state: tuple[float, float], drive: tuple[float, float], rates: tuple[float, float], shape: Shape, h: float
) -> tuple[float, float, float]:
    """Return xi and z after a sub-step by RODAS3, as ``spencer._attempt`` takes it, and its error over alpha*z_max."""
    xi, z = state
    g, g_t = drive
    a, k = rates
    r = 1.0 / h
    w = g - a * z - k * xi
    f, f_z = _slope(z, w, shape)
    m11, m22 = 2.0 * r + k, 2.0 * r + a * f - w * f_z
    inverse = 1.0 / (m11 * m22 - a * k * f)
    i11, i12, i21, i22 = m22 * inverse, -a * inverse, -k * f * inverse, m11 * inverse
    p = w + 0.5 * h * g_t
    q = f * p
    x1, z1 = i11 * p + i12 * q, i21 * p + i22 * q
    p = w + 1.5 * h * g_t
    q = f * p + 4.0 * r * z1
    p += 4.0 * r * x1
    x2, z2 = i11 * p + i12 * q, i21 * p + i22 * q
    z_end, xi_end = z + 2.0 * z1, xi + 2.0 * x1
    w = g + h * g_t - a * z_end - k * xi_end
    p, q = w + r * (x1 - x2), w * _slope(z_end, w, shape)[0] + r * (z1 - z2)
    x3, z3 = i11 * p + i12 * q, i21 * p + i22 * q
    z_end, xi_end = z_end + z3, xi_end + x3
    w = g + h * g_t - a * z_end - k * xi_end
    p = w + r * (x1 - x2 - 8.0 / 3.0 * x3)
    q = w * _slope(z_end, w, shape)[0] + r * (z1 - z2 - 8.0 / 3.0 * z3)
    x4, z4 = i11 * p + i12 * q, i21 * p + i22 * q
    return xi_end + x4, z_end + z4, a * abs(z4) + k * abs(x4)


@kernel
def _law(theta: Array) -> tuple[float, tuple[float, float], Shape]:
    """Return what the velocity, z and xi drive the inner travel by, and the shape of the hysteretic element."""
    inverse = 1.0 / (theta[0] + theta[1])
    return theta[0] * inverse, (theta[4] * inverse, theta[3] * inverse), (theta[5], theta[6], theta[7], theta[8])


@kernel
def spencer_step(state: Array, ends: Array, x: Array, theta: Array, usual: Array, dt: float) -> tuple[Array, Array]:
    """Return force (N), (B,), and state (2, B) of Spencer's damper after one step.

    Parameters
    ----------
    state
        Travel xi (m) across the Bouc-Wen element and z (1), shape (2, B).
    ends
        Velocity at both ends of the step in m/s, linear in between, shape (2, B).
    x
        Displacement in m at its end, shape (B,).
    theta
        Parameters as in ``spencer.spencer``, shape (10, B).
    usual
        Parameters (10,) by which the sub-steps are chosen: with sub-steps of its own every current would have a small
        error of its own, and the force would jump with the current.
    dt
        Length of the step in s; 0 leaves the state as it is.
    """
    following, force = state.copy(), np.empty(len(x))
    lead, usual_rates, usual_shape = _law(usual)
    limit = _TOLERANCE * usual_rates[0] * power(usual[5] / (usual[6] + usual[7]), 1.0 / usual[8])
    for b in range(len(x)):
        gain, rates, shape = _law(theta[:, b])
        pair, done, wish = (state[0, b], state[1, b]), 0.0, dt
        other = pair
        rise = (ends[1, b] - ends[0, b]) / dt if dt > 0.0 else 0.0
        for _ in range(_MAX_STEPS):
            if dt - done <= 1e-12 * dt:
                break
            h, v = min(wish, dt - done), ends[0, b] + rise * done
            xi, z, error = _attempt(other, (lead * v, lead * rise), usual_rates, usual_shape, h)
            factor = min(max(0.85 * (limit / max(error, 1e-12 * limit)) ** 0.375, 0.1), 4.0)
            if error <= limit or h < 1e-9 * dt:
                other, done, wish = (xi, z), done + h, h * factor
                xi, z, _ = _attempt(pair, (gain * v, gain * rise), rates, shape, h)
                pair = (xi, z)
            else:
                wish = h * min(factor, 0.9)
        following[0, b], following[1, b] = pair
        w = gain * ends[1, b] - rates[0] * pair[1] - rates[1] * pair[0]
        force[b] = theta[0, b] * (ends[1, b] - w) + theta[2, b] * x[b] + theta[9, b]
    return force, following
