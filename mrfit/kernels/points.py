"""Characteristic points of force-velocity loops: start values for fits, cheap and never raising on finite data."""

from collections.abc import Mapping

import numpy as np

from mrfit.core.specs import Array, ModelSpec

_BINS = 40


def inside(spec: ModelSpec, found: Mapping[str, float]) -> dict[str, float]:
    """Return the finite values of the model's parameters, moved to the nearest bound where outside."""
    held = [p for p in spec.params if np.isfinite(found.get(p.name, np.nan))]
    return {p.name: float(np.clip(found[p.name], p.low, p.high)) for p in held}


def largest(values: Array) -> float:
    """Return the greatest magnitude, 0 of an empty array."""
    return float(np.max(np.abs(values), initial=0.0))


def post_yield_line(v: Array, force: Array) -> dict[str, float]:
    """Return fy, C_inf, f0 of the line fy*sign(v) + C_inf*v + f0 by least squares over |v| >= max|v|/2.

    Parameters
    ----------
    v, force
        Velocity in m/s (rad/s) and force in N (N*m), shape (N,).
    """
    fast = np.abs(v) >= 0.5 * largest(v)
    scale = largest(v) or 1.0
    columns = np.column_stack([np.sign(v[fast]), v[fast] / scale, np.ones(int(fast.sum()))])
    fy, slope, f0 = np.linalg.lstsq(columns, force[fast], rcond=1e-9)[0]
    return {"fy": float(fy), "C_inf": float(slope / scale), "f0": float(f0)}


def yield_velocity(v: Array, force: Array) -> float:
    """Return the velocity over which the force rises to its post-yield line.

    vy = integral of 1 - (F - f0 - C_inf*v)*sign(v)/fy over |v|: vy of 1 - exp(-|v|/vy), 0.7/C0 of tanh(C0*v), and
    half the corner velocity of a biviscous curve. Both branches of a loop enter:
    where its half-width is greater than vy, it is returned in its place.
    """
    line = post_yield_line(v, force)
    speed = np.abs(v)
    slow = np.argsort(speed)[: max(2, int(np.count_nonzero(speed < 0.7 * largest(v))))]
    if not line["fy"] or len(slow) < 2:
        return 0.0
    share = (force[slow] - line["f0"] - line["C_inf"] * v[slow]) * np.sign(v[slow]) / line["fy"]
    return float(np.trapezoid(1.0 - share, speed[slow]))


def half_width(v: Array, a: Array, force: Array) -> float:
    """Return half the velocity between the branches of rising (a > 0) and falling velocity where the force is zero."""
    return _half_gap(force, a, v)


def loop_height(v: Array, a: Array, force: Array) -> float:
    """Return half the force between the branches of falling and rising (a > 0) velocity where the velocity is zero."""
    return -_half_gap(v, a, force)


def _half_gap(of: Array, a: Array, value: Array) -> float:
    """Return half the mean difference of ``value``, a > 0 less a < 0, interpolated at the zeros of ``of``."""
    before = np.flatnonzero((of[:-1] < 0) != (of[1:] < 0))
    if not len(before):
        return 0.0
    share = of[before] / (of[before] - of[before + 1])
    at = value[before] + share * (value[before + 1] - value[before])
    rising = a[before] + share * (a[before + 1] - a[before]) > 0
    if rising.all() or not rising.any():
        return 0.0
    return float(0.5 * (at[rising].mean() - at[~rising].mean()))


def _branch_curve(v: Array, force: Array, grid: Array) -> Array:
    """Return the mean force in velocity bins centred on the grid, interpolated where a bin is empty."""
    if not len(v):
        return np.zeros(len(grid))
    step = grid[1] - grid[0]
    cell = np.clip(np.rint((v - grid[0]) / step).astype(np.int64), 0, len(grid) - 1)
    count = np.bincount(cell, minlength=len(grid))
    total = np.bincount(cell, weights=force, minlength=len(grid))
    centre = np.bincount(cell, weights=v, minlength=len(grid))
    held = count > 0
    return np.interp(grid, centre[held] / count[held], total[held] / count[held])


def tanh_points(x: Array, v: Array, force: Array) -> dict[str, float]:
    """Return start values of fy*tanh(a1*v + a2*x) + c*v + k*x + f0 from the points of its force-velocity loop.

    Pm is the point of the greatest velocity, Pi where upper and lower branch meet, P0 and Pc where the upper branch
    crosses zero force and zero velocity. c is the slope of the centre line from Pi to Pm (eq. 2), fy that line's force
    at v = 0, a1 = (slope from P0 to Pc - c)/fy (eq. 3), a2 = -a1*v0/x0 (eq. 6), k from the height of the loop near the
    greatest velocity (eq. 7), f0 the mean of the forces at the greatest and the least velocity.

    Parameters
    ----------
    x, v, force
        Displacement in m, velocity in m/s, force in N, shape (N,); best of whole cycles of a sine.

    Notes
    -----
    Source: inverse-tanh paper, section 2.1. It says that fy may be extracted from Pc. The force there, about
    fy*tanh(a2*x_max), is 32 to 45 % below the fitted fy of its Table 2, whose estimates are 5 to 16 % above.
    """
    speed, stroke = largest(v), 0.5 * float(np.ptp(x))
    if not speed or not stroke:
        return {}
    grid = np.linspace(-speed, speed, 2 * _BINS + 1)
    above = x > 0.5 * (np.max(x) + np.min(x))
    upper, lower = _branch_curve(v[above], force[above], grid), _branch_curve(v[~above], force[~above], grid)
    f0 = 0.5 * float(upper[-1] + lower[-1] + upper[0] + lower[0]) / 2
    upper, lower = upper - f0, lower - f0
    centre = 0.5 * (upper + lower)
    height = (upper - lower)[_BINS:]
    closed = np.flatnonzero(height <= 0.05 * height[0])
    meet = _BINS + min(max(int(closed[0]) if len(closed) else _BINS // 2, _BINS // 4), 3 * _BINS // 4)
    c = (centre[-1] - centre[meet]) / (speed - grid[meet])
    fy = centre[-1] - c * speed
    crossing = _BINS - np.flatnonzero(upper[_BINS::-1] <= 0)[:1]
    v0 = float(grid[crossing[0]]) if len(crossing) else -0.5 * speed
    if len(crossing) and crossing[0] < _BINS:
        low, high = upper[crossing[0]], upper[crossing[0] + 1]
        v0 -= low / (high - low) * (grid[1] - grid[0]) if high > low else 0.0
    v0 = min(v0, -1e-3 * speed)
    a1 = (upper[_BINS] / -v0 - c) / fy if fy else np.nan
    x0 = stroke * np.sqrt(max(1.0 - (v0 / speed) ** 2, 0.01))
    near = int(0.9 * _BINS)
    k = height[near] / (2 * stroke * np.sqrt(1 - (near / _BINS) ** 2))
    return {"fy": float(fy), "c": float(c), "f0": f0, "k": float(k), "a1": float(a1), "a2": float(-a1 * v0 / x0)}
