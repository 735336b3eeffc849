"""A Hammerstein-Wiener damper and its derivatives, in one pass over the samples.

    F = f0 + H{c_pre*B1 + c_post*B2},  B1 = min(max(v, -d0), d0),  B2 = v - B1,  d0 = max(a*m + b, 0),  m = M{i}

M and H are cascades of lags p/(s + p), whose last state is w, times 1 + z1*s + z2*s^2 (M: z2 = 0). All derivatives are
responses of the same cascades, hence exact for inputs linear between samples as these are:

    dF/dc_pre = H{B1},  dF/dc_post = H{B2},  dF/df0 = 1
    dF/d(a, b, a parameter of M) = H{S*(m, 1, a*dm/d..)},  S = (c_pre - c_post)*sign(v) where |v| > d0 > 0, else 0
    dF/dp_k = (1 + z1*s + z2*s^2){w - e_k}/p_k,  e_k = p_k/(s + p_k){w}: one more lag behind the last

H passes on eight inputs side by side in SIMD lanes. A vector's 15 values are c_pre, c_post, a, b, p1 ... p4, omega, xi,
q1, q2, zero, tau, f0.
"""

import math

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.kernels.jit import kernel

_LANES = 8
# Places in a vector
_A, _B, _P, _OMEGA, _XI, _Q, _ZERO, _TAU, _F0 = 2, 3, 4, 8, 9, 10, 12, 13, 14
# What is at rest at sample 0: the derivative along each value, and m
_REST, _M_REST = 15, 30
# Places in the record of a sample, which holds values less those at rest: the lanes' inputs, the four states and the
# output of H of each, the lags behind H's last, the derivatives along p1 ... p4, omega and xi, and one that stays zero.
# The lanes are B1, B2 and the inputs of the derivatives along a, b, q1, q2, zero and tau.
_X1, _X2, _X3, _X4, _OUT = _LANES, 2 * _LANES, 3 * _LANES, 4 * _LANES, 5 * _LANES
_LAGS, _SLOPES, _NONE, _RECORD = 6 * _LANES, 6 * _LANES + 4, 6 * _LANES + 10, 8 * _LANES
# Samples at a time: their records stay in a core's level 1 cache
_CHUNK = 48


@kernel
def propagator(poles: Array, dt: float, lags: bool, step: Array) -> None:
    """Fill the matrix that moves a cascade of lags p/(s + p) by one sample, for an input linear between samples.

    It is the exponential of a lower triangular matrix, by scaling, a Taylor polynomial of order 14, and squaring.

    Parameters
    ----------
    poles
        p in 1/s, shape (n,).
    dt
        Sample interval in s.
    lags
        Whether n more lags stand behind the last one, side by side, each with one of the poles.
    step
        Set to the factors, shape (n + 2, n + 2), or (2n + 2, 2n + 2) with the lags: row 2 + k gives the state k from
        the rise of the input, its value before, and the states before.
    """
    order = len(poles)
    chain = order + 2
    size = chain + order if lags else chain
    norm = 1.0
    for p in poles:
        norm = max(norm, 2.0 * abs(p) * dt)
    squarings = int(math.ceil(math.log2(norm))) + 1 if norm < 1e15 else 0
    scale = 0.5**squarings
    for i in range(size):
        for j in range(size):
            step[i, j] = 1.0 if i == j else 0.0
    for k in range(14, 0, -1):
        for i in range(size - 1, 1, -1):
            before = i - 1 if i < chain else chain - 1
            rate = poles[i - 2 if i < chain else i - chain] * dt * (scale / k)
            for j in range(before + 1):
                step[i, j] = rate * (step[before, j] - step[i, j])
            step[i, i] = 1.0 - rate * step[i, i]
        step[1, 0] = scale / k
    for _ in range(squarings):
        for i in range(size - 1, 0, -1):
            before = i - 1 if i < chain else chain - 1
            for j in range(before + 1):
                total = step[i, i] * step[i, j]
                for k in range(j, before + 1):
                    total += step[i, k] * step[k, j]
                step[i, j] = total
            step[i, i] *= step[i, i]


@kernel
def _delay(work: Array, current: Array, shift: float, span: tuple[int, int]) -> None:
    """Put the current ``shift`` samples ago, less its first value, and its slope per sample where M looks for them.

    It is linear between samples and its first value before. The slope at a sample is that before it, which a longer
    delay meets.
    """
    first, samples = span
    late = min(max(shift, 0.0), float(len(current)))
    whole = int(math.floor(late))
    share = 1.0 - (late - whole)
    for j in range(samples):
        k, value, slope = first + j - whole - 1, 0.0, 0.0
        if k >= 0:
            slope = current[k + 1] - current[k]
            value = current[k] - current[0] + share * slope
        work[_RECORD * (j + 1) + 4] = value
        work[_RECORD * (j + 1) + 5] = slope


@kernel
def _magnetise(work: Array, values: Array, step: Array, state: Array, samples: int) -> None:
    """Set lane a to m, less m at rest, and leave M's states where _incline looks; state (3,) is carried along."""
    q2, lead = values[_Q + 1], 1.0 / values[_ZERO]
    r1, n1, a11 = step[2, 0], step[2, 1], step[2, 2]
    r2, n2, a21, a22 = step[3, 0], step[3, 1], step[3, 2], step[3, 3]
    now, m1, m2 = state
    for j in range(samples):
        place = _RECORD * (j + 1)
        rise = work[place + 4] - now
        m2 = r2 * rise + n2 * now + a21 * m1 + a22 * m2
        m1 = r1 * rise + n1 * now + a11 * m1
        now = work[place + 4]
        work[place + 2] = m2 + lead * q2 * (m1 - m2)
        work[place + 6] = m1
        work[place + 7] = m2
    state[0], state[1], state[2] = now, m1, m2


@kernel
def _incline(work: Array, values: Array, dt: float, step: Array, state: Array, samples: int) -> None:
    """Set lanes q1, q2, zero, tau to dm/d.. from what _delay and _magnetise left; state (8,) is carried along."""
    q1, q2, lead = values[_Q], values[_Q + 1], 1.0 / values[_ZERO]
    r1, n1, a11 = step[2, 0], step[2, 1], step[2, 2]
    r2, n2, a21, a22 = step[3, 0], step[3, 1], step[3, 2], step[3, 3]
    r3, n3, a31, a32, a33 = step[4, 0], step[4, 1], step[4, 2], step[4, 3], step[4, 4]
    r4, n4, a41, a42, a44 = step[5, 0], step[5, 1], step[5, 2], step[5, 3], step[5, 5]
    now, m1, m2, e1, e2, slope, t1, t2 = state
    for j in range(samples):
        place = _RECORD * (j + 1)
        rise, bend = work[place + 4] - now, -work[place + 5] / dt - slope
        e1 = r3 * rise + n3 * now + a31 * m1 + a32 * m2 + a33 * e1
        e2 = r4 * rise + n4 * now + a41 * m1 + a42 * m2 + a44 * e2
        t2 = r2 * bend + n2 * slope + a21 * t1 + a22 * t2
        t1 = r1 * bend + n1 * slope + a11 * t1
        now, slope, m1, m2 = work[place + 4], -work[place + 5] / dt, work[place + 6], work[place + 7]
        rate = q2 * (m1 - m2)
        work[place + 4] = (m2 - e1 + lead * (rate - q1 * (m2 - e1))) / q1
        work[place + 5] = (m2 - e2 + lead * (rate - q2 * (m2 - e2))) / q2
        work[place + 6] = -lead * lead * rate
        work[place + 7] = t2 + lead * q2 * (t1 - t2)
    state[0], state[1], state[2], state[3], state[4] = now, m1, m2, e1, e2
    state[5], state[6], state[7] = slope, t1, t2


@kernel
def _hold(work: Array, samples: int) -> None:
    """Set lane a to m, less m at rest, and lanes q1, q2, zero, tau to dm/d.. under a constant current: all zero."""
    for j in range(samples):
        place = _RECORD * (j + 1)
        for k in range(2, _LANES):
            work[place + k] = 0.0


@kernel
def _mapped(v: float, m: float, values: Array) -> tuple[float, float, float]:
    """Return B1 and B2, the parts of the velocity before and after yield, and S."""
    corner = values[_A] * m + values[_B]
    corner = 0.0 if corner < 0.0 else corner
    if abs(v) <= corner:
        return v, 0.0, 0.0
    before, gap = math.copysign(corner, v), values[0] - values[1]
    return before, v - before, (math.copysign(1.0, v) * gap if corner != 0.0 else 0.0)


@kernel
def _enter(work: Array, v: Array, values: Array, span: tuple[int, int]) -> None:
    """Set the lanes' inputs from m and its derivatives in their places."""
    first, samples = span
    a, rest = values[_A], values[_REST : _REST + _P]
    for j in range(samples):
        place = _RECORD * (j + 1)
        m = values[_M_REST] + work[place + 2]
        before, after, turned = _mapped(v[first + j], m, values)
        work[place] = before - rest[0]
        work[place + 1] = after - rest[1]
        work[place + 2] = turned * m - rest[2]
        work[place + 3] = turned - rest[3]
        for k in range(4, _LANES):
            work[place + k] = turned * a * work[place + k]


@kernel
def _filter(work: Array, poles: Array, zeros: tuple[float, float], step: Array, samples: int) -> None:
    """Pass all lanes through H."""
    first, second = zeros
    p3, p4 = poles[2], poles[3]
    r1, n1, a11 = step[2, 0], step[2, 1], step[2, 2]
    r2, n2, a21, a22 = step[3, 0], step[3, 1], step[3, 2], step[3, 3]
    r3, n3, a31, a32, a33 = step[4, 0], step[4, 1], step[4, 2], step[4, 3], step[4, 4]
    r4, n4, a41, a42, a43, a44 = step[5, 0], step[5, 1], step[5, 2], step[5, 3], step[5, 4], step[5, 5]
    for j in range(samples):
        old, new = _RECORD * j, _RECORD * j + _RECORD
        for lane in range(_LANES):
            now = work[old + lane]
            rise = work[new + lane] - now
            x1, x2 = work[old + _X1 + lane], work[old + _X2 + lane]
            x3, x4 = work[old + _X3 + lane], work[old + _X4 + lane]
            y1 = r1 * rise + n1 * now + a11 * x1
            y2 = r2 * rise + n2 * now + a21 * x1 + a22 * x2
            y3 = r3 * rise + n3 * now + a31 * x1 + a32 * x2 + a33 * x3
            y4 = r4 * rise + n4 * now + a41 * x1 + a42 * x2 + a43 * x3 + a44 * x4
            rate = p4 * (y3 - y4)
            work[new + _X1 + lane] = y1
            work[new + _X2 + lane] = y2
            work[new + _X3 + lane] = y3
            work[new + _X4 + lane] = y4
            work[new + _OUT + lane] = y4 + first * rate + second * p4 * (p3 * (y2 - y3) - rate)


@kernel
def _whole(work: Array, place: int, values: Array) -> float:
    """Return the sum of the first two lanes in the force."""
    total: float = values[0] * work[place] + values[1] * work[place + 1]
    return total


@kernel
def _behind(work: Array, values: Array, zeros: tuple[float, float], step: Array, samples: int) -> None:
    """Set the derivatives along p1 ... p4, omega and xi from the lags behind H's last, fed by the whole force."""
    (first, second), omega = zeros, values[_OMEGA]
    p3, p4 = values[_P + 2], values[_P + 3]
    for j in range(samples):
        old, new = _RECORD * j, _RECORD * j + _RECORD
        now, x1, x2 = _whole(work, old, values), _whole(work, old + _X1, values), _whole(work, old + _X2, values)
        x3, x4 = _whole(work, old + _X3, values), _whole(work, old + _X4, values)
        rise = _whole(work, new, values) - now
        for k in range(4):
            total = step[6 + k, 0] * rise + step[6 + k, 1] * now + step[6 + k, 2] * x1 + step[6 + k, 3] * x2
            total += step[6 + k, 4] * x3 + step[6 + k, 5] * x4
            work[new + _LAGS + k] = total + step[6 + k, 6 + k] * work[old + _LAGS + k]
        x2, x3, x4 = _whole(work, new + _X2, values), _whole(work, new + _X3, values), _whole(work, new + _X4, values)
        rate = p4 * (x3 - x4)
        bend = p4 * (p3 * (x2 - x3) - rate)
        for k in range(4):
            p = values[_P + k]
            left = x4 - work[new + _LAGS + k]
            left_rate = rate - p * left
            work[new + _SLOPES + k] = (left + first * left_rate + second * (bend - p * left_rate)) / p
        work[new + _SLOPES + 4] = -(first * rate + 2.0 * second * bend) / omega
        work[new + _SLOPES + 5] = 2.0 / omega * rate


@kernel
def _slot(column: int) -> int:
    """Return the place in a record of the derivative along a parameter."""
    if column < _P:
        return _OUT + column
    if column < _Q:
        return _SLOPES + column - _P
    return _OUT + 4 + column - _Q if column < _F0 else _NONE


@kernel
def _leave(work: Array, values: Array, columns: Index, span: tuple[int, int], out: Array) -> None:
    """Set a span of one vector's out, (1 + C, N)."""
    (first, samples), pre, post, offset = span, values[0], values[1], values[_F0]
    pre_rest, post_rest = values[_REST], values[_REST + 1]
    for j in range(samples):
        place = _RECORD * (j + 1) + _OUT
        out[0, first + j] = pre * (work[place] + pre_rest) + post * (work[place + 1] + post_rest) + offset
    for c in range(len(columns)):
        slot, rest = _slot(columns[c]), values[_REST + columns[c]]
        for j in range(samples):
            out[1 + c, first + j] = work[_RECORD * (j + 1) + slot] + rest


@kernel
def _evaluate(drive: Array, values: Array, dt: float, columns: Index, work: Array, out: Array) -> None:
    """Set one vector's out, (1 + C, N); values are the vector and, after it, room for what is at rest."""
    (velocity, current), total = drive, drive.shape[1]
    poles, turn = values[_P:_OMEGA], 1.0 / values[_OMEGA]
    zeros = (2.0 * values[_XI] * turn, turn * turn)
    moving, behind, inclined = False, False, False
    for value in current:
        moving = moving or value != current[0]
    for column in columns:
        behind = behind or _P <= column < _Q
        inclined = inclined or (moving and _Q <= column < _F0)
    magnetic, hysteretic, state = np.empty((6, 6)), np.empty((10, 10)), np.zeros(11)
    if moving:
        propagator(values[_Q:_ZERO], dt, inclined, magnetic)
    propagator(poles, dt, behind, hysteretic)
    before, after, turned = _mapped(velocity[0], current[0], values)
    values[_REST:] = 0.0
    values[_REST], values[_REST + 1], values[_REST + 2] = before, after, turned * current[0]
    values[_REST + 3], values[_REST + _F0], values[_M_REST] = turned, 1.0, current[0]
    work[:] = 0.0
    for first in range(0, total, _CHUNK):
        samples = min(_CHUNK, total - first)
        if moving:
            _delay(work, current, values[_TAU] / dt, (first, samples))
            _magnetise(work, values, magnetic, state[:3], samples)
            if inclined:
                _incline(work, values, dt, magnetic, state[3:], samples)
        else:
            _hold(work, samples)
        _enter(work, velocity, values, (first, samples))
        _filter(work, poles, zeros, hysteretic, samples)
        if behind:
            _behind(work, values, zeros, hysteretic, samples)
        _leave(work, values, columns, (first, samples), out)
        for k in range(_RECORD):
            work[k] = work[_RECORD * samples + k]


@kernel
def wiener(drive: Array, theta: Array, dt: float, columns: Index) -> Array:
    """Return the damper's force and its derivatives with respect to some parameters.

    Parameters
    ----------
    drive
        Velocity (m/s) and current (A), shape (2, N); both filters are at rest at sample 0. M does nothing to a constant
        current, and is left out.
    theta
        Parameter vectors, shape (P, 15).
    dt
        Sample interval in s.
    columns
        Parameters asked for, 0 ... 14, in any order, shape (C,). Lags are run for p1 ... p4, omega and xi only.

    Returns
    -------
    Array
        Force in N, shape (P, 1 + C, N): F, then dF/dtheta of each column, in N per its unit. A vector with a value
        that is not finite gives NaN.
    """
    out = np.empty((len(theta), 1 + len(columns), drive.shape[1]))
    if drive.shape[1] == 0:
        return out
    work, values = np.empty(_RECORD * (_CHUNK + 1)), np.empty(_M_REST + 1)
    for p in range(len(theta)):
        finite = True
        for k in range(_REST):
            values[k] = theta[p, k]
            finite = finite and math.isfinite(values[k])
        if finite:
            _evaluate(drive, values, dt, columns, work, out[p])
        else:
            out[p] = np.nan
    return out
