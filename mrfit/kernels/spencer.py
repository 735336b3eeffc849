"""Spencer's damper: a viscous element in series with a Bouc-Wen element, two states, stiff where its damping is small.

With xi = x - y, the travel across the Bouc-Wen element, the printed equations close without the displacement:

    dxi/dt = w = (C0*v - alpha*z - K_inf*xi)/(C0 + C_inf)
    dz/dt  = w*(A - (beta + gamma*sign(w)*sign(z))*|z|^n)
    F      = C0*(v - w) + K0*x + f0

Between samples v and the parameters are linear. Each sample interval is integrated by RODAS3, an L-stable Rosenbrock
method of order 3 with an embedded error estimate (Sandu et al., Atmospheric Environment 31 (1997) 3459), in sub-steps
whose number is bounded. ``spencer_step`` is one interval. ``spencer`` takes eight vectors side by side in SIMD lanes,
each with its own sub-steps; a result does not depend on the lanes beside it.
"""

import math

import numpy as np

from mrfit.core.specs import Array
from mrfit.kernels.jit import inlined, kernel
from mrfit.kernels.powers import log2, power

# C0, C_inf, K_inf, alpha, A, beta, gamma and n; and C0, alpha and K_inf over C0 + C_inf, A, beta, gamma and n
Inner = tuple[float, float, float, float, float, float, float, float]
Element = tuple[float, float, float, float, float, float, float]
Pair = tuple[float, float]
Rates = tuple[float, float, float]
LANES = 8
# Bound on a sub-step's error estimate, as a share of the saturated element's force. The estimate is that of order 2 and
# some hundred times the error of the result.
TOLERANCE = 1e-6
_MAX_STEPS = 300
# Rows of the lanes' work array, each of LANES values: states, the element at the step's end, parameters at both ends
_XI, _Z, _DONE, _STEP, _SCALE = 0, LANES, 2 * LANES, 3 * LANES, 4 * LANES
_END, _THEN, _HERE, _ROWS = 5 * LANES, 12 * LANES, 20 * LANES, 28


@inlined
def _between(then: Inner, here: Inner, share: float) -> Inner:
    """Return parameters on the line between those at both ends of a step."""
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = then
    d0, d_inf, l_inf, delta, more, bend, turn, m = here
    viscous = c0 + share * (d0 - c0), c_inf + share * (d_inf - c_inf), k_inf + share * (l_inf - k_inf)
    shape = beta + share * (bend - beta), gamma + share * (turn - gamma), n + share * (m - n)
    return *viscous, alpha + share * (delta - alpha), growth + share * (more - growth), *shape


@inlined
def _element(inner: Inner) -> Element:
    """Return the element that parameters make."""
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = inner
    inertia = 1.0 / (c0 + c_inf)
    return c0 * inertia, alpha * inertia, k_inf * inertia, growth, beta, gamma, n


@inlined
def _rates(xi: float, z: float, v: float, element: Element) -> Rates:
    """Return w = dxi/dt, dz/dxi, and the power of z in it."""
    gain, a, k, growth, beta, gamma, n = element
    w = gain * v - a * z - k * xi
    raised = power(max(abs(z), 1e-100), n)
    return w, growth - (beta + math.copysign(gamma, w * z)) * raised, raised


@inlined
def _drift(state: Pair, rates: Rates, ends: Pair, h: float, then: Inner, here: Inner) -> Pair:
    """Return the rates at which w and dz/dxi change by time alone, as velocity and parameters do over h s."""
    xi, z = state
    w, _, raised = rates
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = then
    d0, d_inf, l_inf, delta, more, bend, turn, m = here
    side, r = math.copysign(1.0, w * z), 1.0 / h
    change = c0 * (ends[1] - ends[0]) + (d0 - c0) * ends[0] - (delta - alpha) * z - (l_inf - k_inf) * xi
    steeper = bend - beta + side * (turn - gamma)
    if m != n:
        steeper += 0.6931471805599453 * (beta + side * gamma) * log2(max(abs(z), 1e-100)) * (m - n)
    bent = more - growth - steeper * raised
    return (change - w * (d0 + d_inf - c0 - c_inf)) / (c0 + c_inf) * r, bent * r


@inlined
def _tried(
    state: Pair, rates: Rates, drift: Pair, v_end: float, elements: tuple[Element, Element], h: float
) -> tuple[float, float, float, float]:
    """Return xi and z after a sub-step of h s, and the last stage's share in both, which is its error.

    ``rates`` are those at its beginning, ``drift`` what they change by in time, per s, ``elements`` those at its ends.
    """
    xi, z = state
    w, f, _ = rates
    w_t, f_t = drift
    before, here = elements
    _, a, k, growth, _, _, n = before
    r = 1.0 / h
    f_z = -n * (growth - f) / math.copysign(max(abs(z), 1e-100), z)
    # d - J, d = 1/(h/2), has the inverse [[m22, -a], [-k*f, m11]]*inverse.
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
    w, f, _ = _rates(xi_end, z_end, v_end, here)
    p, q = w + r * (x1 - x2), w * f + r * (z1 - z2)
    x3, z3 = i11 * p + i12 * q, i21 * p + i22 * q
    xi_end, z_end = xi_end + x3, z_end + z3
    w, f, _ = _rates(xi_end, z_end, v_end, here)
    p = w + r * (x1 - x2 - 8.0 / 3.0 * x3)
    q = w * f + r * (z1 - z2 - 8.0 / 3.0 * z3)
    x4, z4 = i11 * p + i12 * q, i21 * p + i22 * q
    return xi_end + x4, z_end + z4, x4, z4


@inlined
def _held_step(
    state: Pair, ends: Pair, done: float, h: float, dt: float, element: Element
) -> tuple[float, float, float, float]:
    """Return the same of a sub-step ``done`` s into a step over which velocity is linear and parameters hold."""
    slope = (ends[1] - ends[0]) / dt
    v = ends[0] + slope * done
    rates = _rates(state[0], state[1], v, element)
    return _tried(state, rates, (element[0] * slope, 0.0), v + slope * h, (element, element), h)


@inlined
def _moving_step(
    state: Pair, ends: Pair, done: float, h: float, dt: float, parameters: tuple[Inner, Inner]
) -> tuple[float, float, float, float]:
    """Return the same where parameters are linear between those at both ends of the step, too."""
    then, here = parameters
    share = 1.0 / dt
    first, last = share * done, share * (done + h)
    v, v_end = ends[0] + first * (ends[1] - ends[0]), ends[0] + last * (ends[1] - ends[0])
    low, high = _between(then, here, first), _between(then, here, last)
    before = _element(low)
    rates = _rates(state[0], state[1], v, before)
    drift = _drift(state, rates, (v, v_end), h, low, high)
    return _tried(state, rates, drift, v_end, (before, _element(high)), h)


@inlined
def _factor(error: float) -> float:
    """Return the factor on a sub-step's length, error^(-3/8) within bounds."""
    fourth = math.sqrt(math.sqrt(error))
    return min(max(0.85 / (fourth * math.sqrt(fourth)), 0.1), 4.0)


@inlined
def _attempt(work: Array, ends: Pair, dt: float, limit: float, moving: bool) -> None:
    """Try one sub-step in every lane; keep it where its error estimate is within ``limit``, and set the next one."""
    for lane in range(LANES):
        xi, z, done, wish = work[_XI + lane], work[_Z + lane], work[_DONE + lane], work[_STEP + lane]
        left = dt - done
        active = left > 1e-12 * dt
        h = min(wish, left) if active else dt
        at = _END + lane
        first, shape = (work[at], work[at + LANES], work[at + 2 * LANES]), (work[at + 5 * LANES], work[at + 6 * LANES])
        element = *first, work[at + 3 * LANES], work[at + 4 * LANES], *shape
        if moving:
            parameters = _lane(work, _THEN + lane), _lane(work, _HERE + lane)
            xi_end, z_end, x4, z4 = _moving_step((xi, z), ends, done, h, dt, parameters)
        else:
            xi_end, z_end, x4, z4 = _held_step((xi, z), ends, done, h, dt, element)
        error = work[_SCALE + lane] * (element[1] * abs(z4) + element[2] * abs(x4)) + 1e-12
        error = error if error < 1e30 else 1e30
        factor = _factor(error)
        taken = active and (error <= limit or h < 1e-9 * dt)
        work[_XI + lane] = xi_end if taken else xi
        work[_Z + lane] = z_end if taken else z
        work[_DONE + lane] = done + h if taken else done
        following = max(wish, h * factor) if taken else h * min(factor, 0.9)
        work[_STEP + lane] = (h * factor if taken and h >= wish else following) if active else wish


@inlined
def _lane(work: Array, at: int) -> Inner:
    """Return eight rows of a lane."""
    first = work[at], work[at + LANES], work[at + 2 * LANES], work[at + 3 * LANES]
    return *first, work[at + 4 * LANES], work[at + 5 * LANES], work[at + 6 * LANES], work[at + 7 * LANES]


@inlined
def _interval(work: Array, ends: Pair, dt: float, moving: bool) -> None:
    """Take all lanes to the end of one sample interval in a bounded number of sub-steps."""
    for lane in range(LANES):
        work[_DONE + lane] = 0.0
    for k in range(_MAX_STEPS + 1):
        if k == _MAX_STEPS:
            for lane in range(LANES):
                work[_STEP + lane] = dt
        _attempt(work, ends, dt, 1.0 if k < _MAX_STEPS else np.inf, moving)
        done = dt
        for lane in range(LANES):
            done = min(done, work[_DONE + lane])
        if done >= dt * (1.0 - 1e-12):
            return


@kernel
def _held(work: Array, ends: Pair, dt: float) -> None:
    """Take all lanes through an interval in which parameters hold."""
    _interval(work, ends, dt, False)


@kernel
def _moving(work: Array, ends: Pair, dt: float) -> None:
    """Take all lanes through an interval over which parameters are linear."""
    _interval(work, ends, dt, True)


@kernel
def _set_parameters(work: Array, theta: Array, first: int, j: int, tolerance: float) -> None:
    """Load the lanes' parameters of sample j, behind those before; lanes beyond the last vector repeat it."""
    for lane in range(LANES):
        p, at = min(first + lane, theta.shape[1] - 1), _HERE + lane
        for k in range(8):
            work[_THEN + k * LANES + lane] = work[at + k * LANES]
        here = theta[0, p, j], theta[1, p, j], theta[3, p, j], theta[4, p, j], theta[5, p, j], theta[6, p, j]
        inner = *here, theta[7, p, j], theta[8, p, j]
        for k in range(8):
            work[at + k * LANES] = inner[k]
        element = _element(inner)
        for k in range(7):
            work[_END + k * LANES + lane] = element[k]
        _, a, _, growth, beta, gamma, n = element
        work[_SCALE + lane] = 1.0 / (tolerance * a * power(growth / (beta + gamma), 1.0 / n))


@kernel
def _bounded(theta: Array) -> bool:
    """Return whether one vector's values (10, M) are finite and give a passive, bounded element at every sample."""
    good = np.isfinite(theta).all() and (theta[0] + theta[1] > 0.0).all() and (theta[0] >= 0.0).all()
    return bool(good and (theta[3:6] >= 0.0).all() and (theta[6] + theta[7] > 0.0).all() and (theta[8] > 0.0).all())


@kernel
def spencer(x: Array, v: Array, theta: Array, steps: Array, tolerance: float) -> Array:
    """Simulate the damper from rest (xi = z = 0) at sample 0.

    Parameters
    ----------
    x, v
        Displacement in m, velocity in m/s, shape (N,).
    theta
        C0, C_inf, K0, K_inf (N*s/m, N/m), alpha (N), A, beta, gamma (1/m), n (1), f0 (N), shape (10, P, M): M = 1, or
        M = N with the values of sample j, linear between samples.
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
    vectors, varying, last_step = theta.shape[1], theta.shape[2] > 1, len(steps) - 1
    out = np.empty((vectors, len(x)))
    for first in range(0, vectors, LANES):
        lanes = min(LANES, vectors - first)
        work = np.zeros(_ROWS * LANES)
        work[_STEP : _STEP + LANES] = steps[min(1, last_step)]
        _set_parameters(work, theta, first, 0, tolerance)
        finite = True
        for j in range(len(x)):
            finite = finite and math.isfinite(x[j]) and math.isfinite(v[j])
            m = j if varying else 0
            if j > 0 and finite:
                dt = steps[min(j, last_step)]
                if varying:
                    _set_parameters(work, theta, first, j, tolerance)
                    _moving(work, (v[j - 1], v[j]), dt)
                else:
                    _held(work, (v[j - 1], v[j]), dt)
            for lane in range(lanes):
                p, at = first + lane, _END + lane
                w = work[at] * v[j] - work[at + LANES] * work[_Z + lane] - work[at + 2 * LANES] * work[_XI + lane]
                out[p, j] = theta[0, p, m] * (v[j] - w) + theta[2, p, m] * x[j] + theta[9, p, m] if finite else np.nan
    for p in range(vectors):
        if not _bounded(theta[:, p]):
            out[p] = np.nan
    return out


@inlined
def _is_held(then: Inner, here: Inner) -> bool:
    """Return whether parameters are the same at both ends of a step."""
    c0, c_inf, k_inf, alpha, growth, beta, gamma, n = then
    d0, d_inf, l_inf, delta, more, bend, turn, m = here
    viscous = c0 == d0 and c_inf == d_inf and k_inf == l_inf
    return viscous and alpha == delta and growth == more and beta == bend and gamma == turn and n == m


@kernel
def spencer_step(
    state: tuple[float, float, float], ends: Pair, dt: float, then: Inner, here: Inner
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
    element = _element(here)
    _, a, k, growth, beta, gamma, n = element
    held = _is_held(then, here)
    scale = 1.0 / (TOLERANCE * a * power(growth / (beta + gamma), 1.0 / n))
    done = 0.0
    for attempt in range(_MAX_STEPS + 1):
        last = attempt == _MAX_STEPS
        h = dt - done if last else min(wish, dt - done)
        if held:
            xi_end, z_end, x4, z4 = _held_step((xi, z), ends, done, h, dt, element)
        else:
            xi_end, z_end, x4, z4 = _moving_step((xi, z), ends, done, h, dt, (then, here))
        error = min(scale * (a * abs(z4) + k * abs(x4)) + 1e-12, 1e30)
        factor = _factor(error)
        if error <= 1.0 or h < 1e-9 * dt or last:
            xi, z, done = xi_end, z_end, done + h
            wish = h * factor if h >= wish else max(wish, h * factor)
        else:
            wish = h * min(factor, 0.9)
        if dt - done <= 1e-12 * dt:
            break
    return xi, z, wish
