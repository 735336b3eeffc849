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
# The same by its Taylor series: share by which z may change in the step that is left
_FAR = 0.5
# Travel, in units of that over which it turns, after which it is saturated wherever it began; and how far it may lag
# behind a saturation that moves, whose square is left out
_SETTLED, _LAG = 30.0, 1e-4
_DIVERGED = 1e100


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
    return travel * (kappa - (beta + math.copysign(1.0, travel * z) * gamma) * power(abs(z), n))


@kernel
def _taylor(
    rise: tuple[float, float], fall: tuple[float, float], n: tuple[float, float], logarithm: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return Taylor coefficients 1 to 8 of u over its value at first, u' = (A - B*u^n) of u in these units.

    A, B and n are lines, given by value and slope; ``logarithm`` that of the value at first. With L = ln u and W = u^n,
    u*L' = u' and W' = W*(n*L)', whose coefficients times their order are l and e.
    """
    (a0, a1), (b0, b1), (n0, n1) = rise, fall, n
    u1 = a0 - b0
    l1 = u1
    e1 = n0 * l1 + n1 * logarithm
    w1 = e1
    u2 = (a1 - b0 * w1 - b1) * 0.5
    l2 = 2.0 * u2 - l1 * u1
    e2 = n0 * l2 + n1 * 2.0 * l1
    w2 = (e1 * w1 + e2) * 0.5
    u3 = -(b0 * w2 + b1 * w1) * (1.0 / 3.0)
    l3 = 3.0 * u3 - l1 * u2 - l2 * u1
    e3 = n0 * l3 + n1 * (3.0 / 2.0) * l2
    w3 = (e1 * w2 + e2 * w1 + e3) * (1.0 / 3.0)
    u4 = -(b0 * w3 + b1 * w2) * 0.25
    l4 = 4.0 * u4 - l1 * u3 - l2 * u2 - l3 * u1
    e4 = n0 * l4 + n1 * (4.0 / 3.0) * l3
    w4 = (e1 * w3 + e2 * w2 + e3 * w1 + e4) * 0.25
    u5 = -(b0 * w4 + b1 * w3) * (1.0 / 5.0)
    l5 = 5.0 * u5 - l1 * u4 - l2 * u3 - l3 * u2 - l4 * u1
    e5 = n0 * l5 + n1 * (5.0 / 4.0) * l4
    w5 = (e1 * w4 + e2 * w3 + e3 * w2 + e4 * w1 + e5) * (1.0 / 5.0)
    u6 = -(b0 * w5 + b1 * w4) * (1.0 / 6.0)
    l6 = 6.0 * u6 - l1 * u5 - l2 * u4 - l3 * u3 - l4 * u2 - l5 * u1
    e6 = n0 * l6 + n1 * (6.0 / 5.0) * l5
    w6 = (e1 * w5 + e2 * w4 + e3 * w3 + e4 * w2 + e5 * w1 + e6) * (1.0 / 6.0)
    u7 = -(b0 * w6 + b1 * w5) * (1.0 / 7.0)
    l7 = 7.0 * u7 - l1 * u6 - l2 * u5 - l3 * u4 - l4 * u3 - l5 * u2 - l6 * u1
    e7 = n0 * l7 + n1 * (7.0 / 6.0) * l6
    w7 = (e1 * w6 + e2 * w5 + e3 * w4 + e4 * w3 + e5 * w2 + e6 * w1 + e7) * (1.0 / 7.0)
    return u1, u2, u3, u4, u5, u6, u7, -(b0 * w7 + b1 * w6) * 0.125


@kernel
def _saturated(turns: float, then: Shape, here: Shape) -> float:
    """Return the deflection at a step's end of an element that has long turned, 0 where it cannot be told.

    u = s*(1 - (ln s)'/(n*turns)), s = (kappa/(beta + gamma))^(1/n); ``turns`` is kappa times the travel.
    """
    kappa, beta, gamma, n = here
    both = beta + gamma
    if not min(both, then[1] + then[2]) > 0.0:
        return 0.0
    size = power(kappa / both, 1.0 / n)
    drift = (kappa - then[0]) / kappa - (both - then[1] - then[2]) / both
    bend = n - then[3]
    if bend != 0.0:
        drift -= bend * math.log(size)
    behind = drift * size / (n * n * turns)
    return size * (1.0 - behind) if turns * min(n, 1.0) > _SETTLED * size and abs(behind) < _LAG else 0.0


@kernel
def _bouc_wen_far(z: float, share: float, travel: float, then: Shape, here: Shape) -> tuple[float, float]:
    """Return z where it is near to 0 next, and the share of a step there; at the step's end if it never is."""
    for k in range(_MOST_STEPS):
        kappa, beta, gamma, n = between(then, here, share)
        left, turn, side = 1.0 - share, travel / z if z != 0.0 else math.inf, math.copysign(1.0, travel * z)
        whole = turn * power(abs(z), n)
        rise, fall = turn * kappa, whole * (beta + side * gamma)
        if side > 0.0 and max(rise, fall) * left > _SETTLED:
            size = _saturated(abs(travel) * left * min(kappa, here[0]), then, here)
            if size > 0.0:
                z, share = math.copysign(size, travel), 1.0
                break
        h, slope = left, abs(rise - fall)
        if not slope * left <= _FAR:
            # one that is more than saturated comes down fast, but not to 0
            if not abs(fall) > abs(rise):
                break
            h = _FAR / slope
        bend, logarithm = here[3] - then[3], 0.0
        if bend != 0.0:
            logarithm = math.log(abs(z))
        shapes = whole * ((here[1] - then[1]) + side * (here[2] - then[2]))
        u1, u2, u3, u4, u5, u6, u7, u8 = _taylor(
            (rise, turn * (here[0] - then[0])), (fall, shapes), (n, bend), logarithm
        )
        fourth = h * h * (h * h)
        error = abs(u8) * fourth * fourth
        if error > _EXACT:
            h *= 0.9 * math.exp(0.125 * math.log(_EXACT / error))
        if h < left and share + h == share:
            # it grows without bounds before the step's end
            z, share = math.copysign(math.inf, z), 1.0
            break
        series = u1 + h * (u2 + h * (u3 + h * (u4 + h * (u5 + h * (u6 + h * (u7 + h * u8))))))
        z, share = z * (1.0 + h * series), share + h
        if h == left or k == _MOST_STEPS - 1:
            share = 1.0
            break
    return z, share


@kernel
def bouc_wen_step(z: float, travel: float, then: Shape, here: Shape) -> float:
    """Return z after a step of a travel, dz = kappa*dx - (beta*dx + gamma*|dx|*sign(z))*|z|^n.

    By its Taylor series of order 8 where z stays away from 0, about which it has none, to 1e-10 of z. Else by Dormand's
    and Prince's method of order 5, in sub-steps of bounded number whose error is 1e-10 of saturation.

    Parameters
    ----------
    z
        State before it.
    travel
        Of the drive, which is linear in time, in its unit.
    then, here
        kappa, beta, gamma (1 over the unit) and n (1) at both ends, linear in between.
    """
    # where parameters move, an element above saturation may grow without bounds; then nothing is left to follow
    if travel == 0.0 or not abs(z) < _DIVERGED:
        return z
    z, share = _bouc_wen_far(z, 0.0, travel, then, here)
    if share >= 1.0:
        return z
    kappa, beta, gamma, n = here
    # the saturation; a loop that hardens has none
    scale = power(kappa / (abs(beta) + abs(gamma)), 1.0 / n)
    limit = _EXACT * scale
    h = min(1.0, 0.2 * scale / (kappa * abs(travel)))
    for _ in range(_MOST_STEPS):
        h = min(h, 1.0 - share)
        k1 = _slope(z, share, travel, then, here)
        k2 = _slope(z + h * k1 / 5.0, share + h / 5.0, travel, then, here)
        k3 = _slope(z + h * (3.0 * k1 + 9.0 * k2) / 40.0, share + 0.3 * h, travel, then, here)
        to = h * (44.0 / 45.0 * k1 - 56.0 / 15.0 * k2 + 32.0 / 9.0 * k3)
        k4 = _slope(z + to, share + 0.8 * h, travel, then, here)
        to = 19372.0 / 6561.0 * k1 - 25360.0 / 2187.0 * k2 + 64448.0 / 6561.0 * k3 - 212.0 / 729.0 * k4
        k5 = _slope(z + h * to, share + 8.0 / 9.0 * h, travel, then, here)
        to = 9017.0 / 3168.0 * k1 - 355.0 / 33.0 * k2 + 46732.0 / 5247.0 * k3 + 49.0 / 176.0 * k4
        k6 = _slope(z + h * (to - 5103.0 / 18656.0 * k5), share + h, travel, then, here)
        to = 35.0 / 384.0 * k1 + 500.0 / 1113.0 * k3 + 125.0 / 192.0 * k4 - 2187.0 / 6784.0 * k5 + 11.0 / 84.0 * k6
        k7 = _slope(z + h * to, share + h, travel, then, here)
        off = 71.0 / 57600.0 * k1 - 71.0 / 16695.0 * k3 + 71.0 / 1920.0 * k4 - 17253.0 / 339200.0 * k5
        error = abs(h * (off + 22.0 / 525.0 * k6 - k7 / 40.0)) / limit
        if error <= 1.0 or h < 1e-9:
            z, share = _bouc_wen_far(z + h * to, share + h, travel, then, here)
            if share >= 1.0:
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
