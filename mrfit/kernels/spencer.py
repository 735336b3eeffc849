"""Spencer's damper: a viscous element in series with a Bouc-Wen element, two states, stiff where its damping is small.

With xi = x - y, the travel across the Bouc-Wen element, the printed equations close without the displacement:

    dxi/dt = w = (C0*v - alpha*z - K_inf*xi)/(C0 + C_inf)
    dz/dt  = w*(A - (beta + gamma*sign(w)*sign(z))*|z|^n)
    F      = C0*(v - w) + K0*x + f0

Between samples v and the parameters are linear. Each sample interval is integrated by RODAS3, an L-stable Rosenbrock
method of order 3 with an embedded error estimate (Sandu et al., Atmospheric Environment 31 (1997) 3459), in sub-steps
whose number is bounded. ``spencer_step`` is one interval. Where the parameters hold, ``spencer`` takes eight vectors
side by side in SIMD lanes, each with its own sub-steps; a lane's result does not depend on its neighbours.
"""

import math

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power

Inner = tuple[float, float, float, float, float, float, float, float]
LANES = 8
# Bound on a sub-step's error estimate, as a share of the saturated element's force. The estimate is that of order 2 and
# some hundred times the error of the result.
TOLERANCE = 1e-6
_MAX_STEPS = 300
# Rows of the lanes' work array, each of LANES values.
_XI, _Z, _DONE, _STEP = 0, LANES, 2 * LANES, 3 * LANES
_GAIN, _ALPHA, _K, _SCALE = 4 * LANES, 5 * LANES, 6 * LANES, 7 * LANES
_A, _BETA, _GAMMA, _N = 8 * LANES, 9 * LANES, 10 * LANES, 11 * LANES
_ROWS = 12


@kernel
def _attempt(work: Array, v: float, slope: float, dt: float, limit: float) -> None:
    """Try one sub-step in every lane; keep it where its error estimate is within ``limit``, and set the next one."""
    for lane in range(LANES):
        xi, z, done, wish = work[_XI + lane], work[_Z + lane], work[_DONE + lane], work[_STEP + lane]
        a, k, gain, n = work[_ALPHA + lane], work[_K + lane], work[_GAIN + lane], work[_N + lane]
        growth, beta, gamma = work[_A + lane], work[_BETA + lane], work[_GAMMA + lane]
        left = dt - done
        active = left > 1e-12 * dt
        h = min(wish, left) if active else dt
        r = 1.0 / h
        g, g_t = gain * (v + slope * done), gain * slope
        w = g - a * z - k * xi
        size = max(abs(z), 1e-100)
        decay = (beta + math.copysign(gamma, w * z)) * power(size, n)
        f = growth - decay
        f_z = -n * decay / math.copysign(size, z)
        # d - J, d = 1/(h/2), has the inverse [[m22, -a], [-k*f, m11]]*inverse.
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
        decay = (beta + math.copysign(gamma, w * z_end)) * power(abs(z_end), n)
        p, q = w + r * (x1 - x2), w * (growth - decay) + r * (z1 - z2)
        x3, z3 = i11 * p + i12 * q, i21 * p + i22 * q
        z_end, xi_end = z_end + z3, xi_end + x3
        w = g + h * g_t - a * z_end - k * xi_end
        decay = (beta + math.copysign(gamma, w * z_end)) * power(abs(z_end), n)
        p = w + r * (x1 - x2 - 8.0 / 3.0 * x3)
        q = w * (growth - decay) + r * (z1 - z2 - 8.0 / 3.0 * z3)
        x4, z4 = i11 * p + i12 * q, i21 * p + i22 * q
        error = work[_SCALE + lane] * (a * abs(z4) + k * abs(x4)) + 1e-12
        error = error if error < 1e30 else 1e30
        fourth = math.sqrt(math.sqrt(error))
        factor = min(max(0.85 / (fourth * math.sqrt(fourth)), 0.1), 4.0)  # error^(-3/8)
        taken = active and (error <= limit or h < 1e-9 * dt)
        work[_XI + lane] = xi_end + x4 if taken else xi
        work[_Z + lane] = z_end + z4 if taken else z
        work[_DONE + lane] = done + h if taken else done
        following = max(wish, h * factor) if taken else h * min(factor, 0.9)
        work[_STEP + lane] = (h * factor if taken and h >= wish else following) if active else wish


@kernel
def _interval(work: Array, v: float, slope: float, dt: float) -> None:
    """Take all lanes to the end of one sample interval in a bounded number of sub-steps."""
    for lane in range(LANES):
        work[_DONE + lane] = 0.0
    for _ in range(_MAX_STEPS):
        _attempt(work, v, slope, dt, 1.0)
        done = dt
        for lane in range(LANES):
            done = min(done, work[_DONE + lane])
        if done >= dt * (1.0 - 1e-12):
            return
    for lane in range(LANES):
        work[_STEP + lane] = dt
    _attempt(work, v, slope, dt, np.inf)


@kernel
def _set_parameters(work: Array, theta: Array, first: int, tolerance: float) -> None:
    """Load the lanes' parameters; lanes beyond the last vector repeat it."""
    for lane in range(LANES):
        p = min(first + lane, theta.shape[1] - 1)
        inverse = 1.0 / (theta[0, p] + theta[1, p])
        alpha, growth, beta = theta[4, p], theta[5, p], theta[6, p]
        gamma, n = theta[7, p], theta[8, p]
        work[_GAIN + lane] = theta[0, p] * inverse
        work[_ALPHA + lane] = alpha * inverse
        work[_K + lane] = theta[3, p] * inverse
        work[_A + lane], work[_BETA + lane], work[_GAMMA + lane], work[_N + lane] = growth, beta, gamma, n
        z_max = power(growth / (beta + gamma), 1.0 / n)
        work[_SCALE + lane] = 1.0 / (tolerance * alpha * inverse * z_max)


@kernel
def _bounded(theta: Array) -> bool:
    """Return whether one vector's values (10,) are finite and give a passive, bounded element."""
    good = np.isfinite(theta).all() and theta[0] + theta[1] > 0.0 and theta[0] >= 0.0
    return bool(good and (theta[3:6] >= 0.0).all() and theta[6] + theta[7] > 0.0 and theta[8] > 0.0)


@kernel
def spencer(x: Array, v: Array, theta: Array, steps: Array, tolerance: float) -> Array:
    """Simulate the damper from rest (xi = z = 0) at sample 0.

    Parameters
    ----------
    x, v
        Displacement in m, velocity in m/s, shape (N,).
    theta
        C0, C_inf, K0, K_inf (N*s/m, N/m), alpha (N), A, beta, gamma (1/m), n (1), f0 (N), shape (10, P).
    steps
        Time from each sample to that before in s, shape (1,) or (N,).
    tolerance
        Bound on a sub-step's error estimate, as a share of the saturated element's force, as ``TOLERANCE``.

    Returns
    -------
    Array
        Force in N, shape (P, N); NaN from the first sample at which a drive is not finite, and of vectors without a
        bounded response.
    """
    vectors, last_step = theta.shape[1], len(steps) - 1
    out = np.empty((vectors, len(x)))
    for first in range(0, vectors, LANES):
        lanes = min(LANES, vectors - first)
        work = np.zeros(_ROWS * LANES)
        work[_STEP : _STEP + LANES] = steps[min(1, last_step)]
        _set_parameters(work, theta, first, tolerance)
        finite = True
        for j in range(len(x)):
            finite = finite and math.isfinite(x[j]) and math.isfinite(v[j])
            if j > 0 and finite:
                dt = steps[min(j, last_step)]
                _interval(work, v[j - 1], (v[j] - v[j - 1]) / dt, dt)
            for lane in range(lanes):
                p = first + lane
                w = (
                    work[_GAIN + lane] * v[j]
                    - work[_ALPHA + lane] * work[_Z + lane]
                    - work[_K + lane] * work[_XI + lane]
                )
                out[p, j] = theta[0, p] * (v[j] - w) + theta[2, p] * x[j] + theta[9, p] if finite else np.nan
    for p in range(vectors):
        if not _bounded(theta[:, p]):
            out[p] = np.nan
    return out


@kernel
def _between(then: Inner, here: Inner, share: float) -> Inner:
    """Return parameters on the line between those at both ends of a step."""
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = then
    d0, d_inf, l_inf, delta, more, bend, turn, m = here
    viscous = c0 + share * (d0 - c0), c_inf + share * (d_inf - c_inf), k_inf + share * (l_inf - k_inf)
    shape = beta + share * (bend - beta), gamma + share * (turn - gamma), n + share * (m - n)
    return *viscous, alpha + share * (delta - alpha), growth + share * (more - growth), *shape


@kernel
def _rates(state: tuple[float, float], v: float, theta: Inner) -> tuple[float, float, float]:
    """Return w = dxi/dt, dz/dxi, and the power of z in it."""
    xi, z = state
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = theta
    w = (c0 * v - alpha * z - k_inf * xi) / (c0 + c_inf)
    raised = power(max(abs(z), 1e-100), n)
    return w, growth - (beta + math.copysign(gamma, w * z)) * raised, raised


@kernel
def _tried(
    state: tuple[float, float], ends: tuple[float, float], h: float, then: Inner, here: Inner
) -> tuple[float, float, float, float]:
    """Return xi and z after a sub-step of h s, and the last stage's share in both, which is its error."""
    xi, z = state
    v, v_end = ends
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = then
    inertia = 1.0 / (c0 + c_inf)
    w, f, raised = _rates(state, v, then)
    a, k, r, size = alpha * inertia, k_inf * inertia, 1.0 / h, max(abs(z), 1e-100)
    side = math.copysign(1.0, w * z)
    decay = (beta + side * gamma) * raised
    # how w and dz/dxi change by time alone, as velocity and parameters do
    moved = (here[0] * v_end - c0 * v - (here[3] - alpha) * z - (here[2] - k_inf) * xi) * inertia
    w_t = (moved - (here[0] - c0) * (v_end - v) * inertia - w * (here[0] + here[1] - c0 - c_inf) * inertia) * r
    f_t = (here[4] - growth - (here[5] - beta + side * (here[6] - gamma)) * raised) * r
    if here[7] != n:
        f_t -= decay * math.log(size) * (here[7] - n) * r
    f_z = -n * decay / math.copysign(size, z)
    m11, m22 = 2.0 * r + k, 2.0 * r + a * f - w * f_z
    inverse = 1.0 / (m11 * m22 - a * k * f)
    i11, i12, i21, i22 = m22 * inverse, -a * inverse, -k * f * inverse, m11 * inverse
    p = w + 0.5 * h * w_t
    q = f * p + 0.5 * h * w * f_t
    x1, z1 = i11 * p + i12 * q, i21 * p + i22 * q
    p = w + 1.5 * h * w_t
    q = f * p + 1.5 * h * w * f_t + 4.0 * r * z1
    p += 4.0 * r * x1
    x2, z2 = i11 * p + i12 * q, i21 * p + i22 * q
    xi_end, z_end = xi + 2.0 * x1, z + 2.0 * z1
    w, f, _ = _rates((xi_end, z_end), v_end, here)
    p, q = w + r * (x1 - x2), w * f + r * (z1 - z2)
    x3, z3 = i11 * p + i12 * q, i21 * p + i22 * q
    xi_end, z_end = xi_end + x3, z_end + z3
    w, f, _ = _rates((xi_end, z_end), v_end, here)
    p = w + r * (x1 - x2 - 8.0 / 3.0 * x3)
    q = w * f + r * (z1 - z2 - 8.0 / 3.0 * z3)
    x4, z4 = i11 * p + i12 * q, i21 * p + i22 * q
    return xi_end + x4, z_end + z4, x4, z4


@kernel
def spencer_step(
    state: tuple[float, float, float], ends: tuple[float, float], dt: float, then: Inner, here: Inner
) -> tuple[float, float, float]:
    """Return xi (m), z (1) and the length in s of the next sub-step to try, after a step.

    Parameters
    ----------
    state
        The same before it; a length of 0 tries the whole step.
    ends
        Velocity at both ends in m/s.
    dt
        In s, > 0.
    then, here
        C0, C_inf, K_inf, alpha, A, beta, gamma and n at both ends, linear in between.
    """
    xi, z, wish = state
    wish = wish if wish > 0.0 else dt
    inertia = 1.0 / (here[0] + here[1])
    a, k = here[3] * inertia, here[2] * inertia
    scale = 1.0 / (TOLERANCE * a * power(here[4] / (here[5] + here[6]), 1.0 / here[7]))
    done = 0.0
    for attempt in range(_MAX_STEPS + 1):
        last = attempt == _MAX_STEPS
        h = dt - done if last else min(wish, dt - done)
        before, after = done / dt, (done + h) / dt
        v0, v1 = ends[0] + before * (ends[1] - ends[0]), ends[0] + after * (ends[1] - ends[0])
        own = _tried((xi, z), (v0, v1), h, _between(then, here, before), _between(then, here, after))
        error = min(scale * (a * abs(own[3]) + k * abs(own[2])) + 1e-12, 1e30)
        fourth = math.sqrt(math.sqrt(error))
        factor = min(max(0.85 / (fourth * math.sqrt(fourth)), 0.1), 4.0)  # error^(-3/8)
        if error <= 1.0 or h < 1e-9 * dt or last:
            xi, z, done = own[0], own[1], done + h
            wish = h * factor if h >= wish else max(wish, h * factor)
        else:
            wish = h * min(factor, 0.9)
        if dt - done <= 1e-12 * dt:
            break
    return xi, z, wish
