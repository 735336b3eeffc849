"""The exact branch curve: rate-independent Bouc-Wen hysteresis without stepping an ODE.

With n1 = n2 = n the printed law dz/dt = kappa*x' - beta*x'*|z|^n - gamma*|x'|*z*|z|^(n-1) is a differential equation
in the drive x. Let y = z/z_max, z_max = (kappa/(beta + gamma))^(1/n), s = x*kappa/z_max and
rho = (beta - gamma)/(beta + gamma). While x rises,

    dy/ds = 1 - y^n       for y > 0,
    dy/ds = 1 - rho*|y|^n for y < 0,

and a falling branch is the mirror image of a rising one. Every branch is therefore a shifted piece of ONE curve Y(s)
with Y(0) = 0. It is tabulated once per parameter vector by a Taylor method in q = sqrt(|s|), a variable in which the
corner of |y|^n at 0 is smooth, and read back by quintic Hermite cells; beyond the table 1 - Y decays as exp(-n*s).
Error <= 3e-7 for 1 <= n <= 10 (<= 2e-8 for n <= 2) at any sampling, whatever the size of a step.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrfit.core.specs import Array
from mrfit.kernels.jit import kernel
from mrfit.kernels.powers import power
from mrfit.kernels.theta import plain

# Taylor order of a table step; the tables of tests/kernels/test_branch.py stay below 3e-7 with it.
_ORDER = 10
# Below this q the curve is summed from its own power series in |s|^n, which no step in q can cross at q = 0.
_SERIES_END = 0.6
# Where the table hands over to the exponential tail: 1 - Y there; the tail's own error is its square times n/2.
_TAIL = 1e-5
# Exponent of the tail beyond which 1 - Y is below float64's resolution.
_TAIL_END = 26.0
# Cell width in q at n = 1, and how it shrinks with the sharpness of the knee at 1 and of the pole that rho < 0 brings.
_WIDTH = 0.1
# The same in units of the usual one, for rough curves
ROUGH = 2.0
_CELLS = 512
_COEFFICIENTS = 6


class Curve(NamedTuple):
    """One parameter vector's branch curve: quintic cells either side of s = 0, then the exponential tail."""

    positive: Array
    negative: Array
    h_positive: float
    h_negative: float
    n: float
    end: float
    gap: float


@kernel
def _start_series(n: float, rho: float) -> Array:
    """Return a of Y = s*sum_j a_j*(s^n)^j, the solution of dY/ds = 1 - rho*Y^n about s = 0."""
    a = np.zeros(_ORDER)
    raised = np.zeros(_ORDER)
    a[0] = raised[0] = 1.0
    for j in range(1, _ORDER):
        a[j] = -rho * raised[j - 1] / (1.0 + n * j)
        total = 0.0
        for i in range(1, j + 1):
            total += (n * i - (j - i)) * a[i] * raised[j - i]
        raised[j] = total / j
    return a


@kernel
def _taylor_step(q: float, y: float, y_n: float, h: float, law: tuple[float, float]) -> float:
    """Return Y(q + h) from Y(q) = y > 0, y_n = y^n, where dY/dq = 2q(1 - rho*Y^n), by the Taylor series about q."""
    n, rho = law
    value = np.empty(_ORDER + 1)
    raised = np.empty(_ORDER)
    value[0], raised[0] = y, y_n
    value[1] = 2.0 * q * (1.0 - rho * y_n)
    for j in range(1, _ORDER):
        total = 0.0
        for i in range(1, j + 1):
            total += (n * i - (j - i)) * value[i] * raised[j - i]
        raised[j] = total / (j * y)
        before = (1.0 if j == 1 else 0.0) - rho * raised[j - 1]
        value[j + 1] = 2.0 * (before - q * rho * raised[j]) / (j + 1)
    result = 0.0
    for j in range(_ORDER, -1, -1):
        result = result * h + value[j]
    return result


@kernel
def _tabulate(n: float, rho: float, h: float, stop: float, cells: Array) -> int:
    """Fill quintic cells of |Y| over q = 0, h, 2h ... until ``stop`` is passed; return how many there are."""
    series = _start_series(n, rho)
    y, y_n, slope, bend = 0.0, 0.0, 0.0, 2.0 * h * h
    count = 0
    while count < len(cells) and y < stop:
        q = (count + 1) * h
        if q < _SERIES_END:
            s_n = power(q * q, n)
            following = 0.0
            for j in range(_ORDER - 1, -1, -1):
                following = following * s_n + series[j]
            following *= q * q
        else:
            following = _taylor_step(q - h, y, y_n, h, (n, rho))
        y_n = power(following, n)
        growth = 1.0 - rho * y_n
        next_slope = 2.0 * q * growth * h
        next_bend = 2.0 * h * h * growth - 2.0 * q * h * rho * n * y_n / following * next_slope
        a, b, c = following - y - slope - 0.5 * bend, next_slope - slope - bend, next_bend - bend
        cell = cells[count]
        cell[0], cell[1], cell[2] = y, slope, 0.5 * bend
        cell[3], cell[4], cell[5] = 10 * a - 4 * b + 0.5 * c, -15 * a + 7 * b - c, 6 * a - 3 * b + 0.5 * c
        y, slope, bend = following, next_slope, next_bend
        count += 1
    return count


@kernel
def _cell_value(cell: Array, t: float) -> float:
    return float(cell[0] + t * (cell[1] + t * (cell[2] + t * (cell[3] + t * (cell[4] + t * cell[5])))))


@kernel
def _invert(cells: Array, y: float) -> float:
    """Return q/h >= 0 at which the tabulated curve reaches y > 0; its end if it does not."""
    low, high = 0, len(cells) - 1
    while low < high:
        middle = (low + high + 1) // 2
        if cells[middle, 0] <= y:
            low = middle
        else:
            high = middle - 1
    cell = cells[low]
    share = (y - cell[0]) / (_cell_value(cell, 1.0) - cell[0])
    t = math.sqrt(share) if low == 0 else share
    for _ in range(8):
        slope = cell[1] + t * (2 * cell[2] + t * (3 * cell[3] + t * (4 * cell[4] + t * 5 * cell[5])))
        step = (_cell_value(cell, t) - y) / slope
        t = min(max(t - step, 0.0), 1.0)
        if not abs(step) > 1e-15:
            break
    return low + t


@kernel
def _tables(shapes: Array, width: float) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], Array]:
    """Tabulate Y(s) once for each sharpness n and ratio rho = (beta - gamma)/(beta + gamma) < 1 among shapes (P, 2).

    ``width`` is that of the cells at n = 1.

    Returns
    -------
    which
        Table of each row, shape (P,); -1 where n <= 0, rho >= 1, or one of them is not finite.
    cells
        Tables of both signs of s, shape (U, 2, 512, 6).
    counts
        Cells in use, shape (U, 2).
    scales
        h of either sign, the end of the table and 1 - Y there, shape (U, 4).
    """
    which = np.full(len(shapes), -1)
    distinct = np.empty(len(shapes), dtype=np.int64)
    found = 0
    for p in range(len(shapes)):
        n, rho = shapes[p]
        if not (math.isfinite(n) and math.isfinite(rho) and n > 0.0 and rho < 1.0):
            continue
        for u in range(found):
            if shapes[distinct[u], 0] == n and shapes[distinct[u], 1] == rho:
                which[p] = u
                break
        if which[p] < 0:
            distinct[found], which[p] = p, found
            found += 1
    cells, counts = np.empty((found, 2, _CELLS, _COEFFICIENTS)), np.empty((found, 2), dtype=np.int64)
    scales = np.empty((found, 4))
    for u in range(found):
        n, rho = shapes[distinct[u]]
        h_positive = width / (1.0 + 0.2 * (n - 1.0))
        h_negative = h_positive / (1.0 + max(-rho, 0.0) * (0.5 + 0.3 * (n - 1.0)))
        same = 0  # the positive side depends on n alone
        while shapes[distinct[same], 0] != n:
            same += 1
        if same < u:
            counts[u, 0] = counts[same, 0]
            cells[u, 0, : counts[u, 0]] = cells[same, 0, : counts[u, 0]]
        else:
            counts[u, 0] = _tabulate(n, 1.0, h_positive, 1.0 - _TAIL, cells[u, 0])
        counts[u, 1] = _tabulate(n, rho, h_negative, 1.0, cells[u, 1])
        gap = 1.0 - _cell_value(cells[u, 0, counts[u, 0] - 1], 1.0)
        scales[u] = h_positive, h_negative, (counts[u, 0] * h_positive) ** 2, gap
    return which, cells, counts, scales


@lru_cache(maxsize=8)
def _kept_tables(shapes: bytes, width: float) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], Array]:
    """Return the tables of shapes (P, 2) given as bytes: those of one batch serve every log it is compared with."""
    return _tables(np.frombuffer(shapes).reshape(-1, 2).copy(), width)


@kernel
def _place(curve: Curve, y: float) -> float:
    """Return the s at which Y(s) = y, -1 <= y <= 1."""
    if y < 0.0:
        return float(-((_invert(curve.negative, -y) * curve.h_negative) ** 2))
    if y == 0.0:
        return 0.0
    if y < 1.0 - curve.gap:
        return float((_invert(curve.positive, y) * curve.h_positive) ** 2)
    return float(curve.end + min(math.log(curve.gap / max(1.0 - y, 1e-16)), _TAIL_END) / curve.n)


@kernel
def _value(curve: Curve, s: float) -> float:
    """Return Y(s)."""
    if s > curve.end:
        return 1.0 - curve.gap * math.exp(-curve.n * (s - curve.end))
    cells, h = (curve.negative, curve.h_negative) if s < 0.0 else (curve.positive, curve.h_positive)
    place = math.sqrt(abs(s)) / h
    k = int(place) if place < len(cells) - 1 else len(cells) - 1
    y = _cell_value(cells[k], place - k)
    return -y if s < 0.0 else y


@kernel
def _first_at_least(x: Array, line: tuple[float, float], s: float, low: int) -> int:
    """Return the first index >= low at which s = line[0] + line[1]*x, not falling with the index, is at least s."""
    high = len(x)
    while low < high:
        middle = (low + high) // 2
        if line[0] + line[1] * x[middle] >= s:
            high = middle
        else:
            low = middle + 1
    return low


@kernel
def _read_cells(x: Array, line: tuple[float, float], form: tuple[float, float], cells: Array, out: Array) -> None:
    """Set out = form[0]*x + form[1]*|Y| where q/h = sqrt(line[0] + line[1]*x) lies inside the cells."""
    last = len(cells) - 1
    for j in range(len(x)):
        s = line[0] + line[1] * x[j]
        place = math.sqrt(s if s > 0.0 else 0.0)
        # Compared as floats: what is not a number or too great for an integer must not become an index.
        k = int(place) if place < last else last
        t = place - k
        y = cells[k, 3] + t * (cells[k, 4] + t * cells[k, 5])
        y = cells[k, 0] + t * (cells[k, 1] + t * (cells[k, 2] + t * y))
        out[j] = form[0] * x[j] + form[1] * y


@kernel
def _follow(curve: Curve, x: Array, line: tuple[float, float], form: tuple[float, float], out: Array) -> None:
    """Set out = form[0]*x + form[1]*Y(line[0] + line[1]*x) over a branch, on which s does not fall."""
    zero = _first_at_least(x, line, 0.0, 0)
    end = _first_at_least(x, line, curve.end, zero)
    flat = _first_at_least(x, line, curve.end + _TAIL_END / curve.n, end)
    a, b = line
    scale = 1.0 / curve.h_negative**2
    _read_cells(x[:zero], (-a * scale, -b * scale), (form[0], -form[1]), curve.negative, out[:zero])
    scale = 1.0 / curve.h_positive**2
    _read_cells(x[zero:end], (a * scale, b * scale), form, curve.positive, out[zero:end])
    for j in range(end, flat):
        out[j] = form[0] * x[j] + form[1] * (1.0 - curve.gap * math.exp(-curve.n * (a + b * x[j] - curve.end)))
    for j in range(flat, len(x)):
        out[j] = form[0] * x[j] + form[1]


@kernel
def turning_points(x: Array) -> tuple[NDArray[np.int64], int]:
    """Return where the drive's branches start and how many leading samples are finite.

    Parameters
    ----------
    x
        Drive, shape (N,).

    Returns
    -------
    turns
        One signed sample number per branch, shape (B,): +j where x rises from sample j - 1 to j after it last fell or
        rested since the start, -j where it falls. A flat sample keeps the previous direction. No parameter enters.
    finite
        Number of samples before the first that is not finite.
    """
    turns = np.empty(len(x), dtype=np.int64)
    count, direction = 0, 0
    for j in range(len(x)):
        if not math.isfinite(x[j]):
            return turns[:count].copy(), j
        if j == 0 or x[j] == x[j - 1]:
            continue
        now = 1 if x[j] > x[j - 1] else -1
        if now != direction:
            turns[count] = now * j
            count += 1
            direction = now
    return turns[:count].copy(), len(x)


def bouc_wen(x: Array, forms: Array, coarseness: float = 1.0) -> Array:
    """Simulate slope*x + gain*y, y = z/z_max of rate-independent Bouc-Wen driven by x, from y = 0 at sample 0.

    Parameters
    ----------
    x
        Drive, shape (N,); from its first sample that is not finite the response is NaN.
    forms
        One row per parameter vector, shape (P, 5): slope (output/drive), gain (output), rate = kappa/z_max (1/drive),
        n, rho = (beta - gamma)/(beta + gamma). A row that is not finite, or with rate < 0, n <= 0 or rho >= 1, gives
        NaN.
    coarseness
        Width of the curve's cells in units of the usual one; with ``ROUGH`` the error is some 1e-5 of the gain.

    Returns
    -------
    Array
        Responses, shape (P, N), in the output's unit.
    """
    return _simulated(x, forms, *_kept_tables(forms[:, 3:].tobytes(), coarseness * _WIDTH))


def driven(drive: Array, forms: Array, dt: float) -> Array:
    """Return ``bouc_wen`` of the one input of a model, shape (1, N), for its forms (P, 5); dt does not enter."""
    return bouc_wen(plain(drive[0]), forms)


def driven_roughly(drive: Array, forms: Array, dt: float) -> Array:
    """Return the same to some 1e-5 of the gain, in less time."""
    return bouc_wen(plain(drive[0]), forms, ROUGH)


@kernel
def _simulated(
    x: Array, forms: Array, which: NDArray[np.int64], cells: Array, counts: NDArray[np.int64], scales: Array
) -> Array:
    turns, finite = turning_points(x)
    out = np.empty((len(forms), len(x)))
    for p in range(len(forms)):
        slope, gain, rate, n, _ = forms[p]
        u = which[p]
        if u < 0 or not (math.isfinite(slope) and math.isfinite(gain) and math.isfinite(rate) and rate >= 0.0):
            out[p] = np.nan
            continue
        out[p, finite:] = np.nan
        h_positive, h_negative, end, gap = scales[u]
        positive, negative = cells[u, 0, : counts[u, 0]], cells[u, 1, : counts[u, 1]]
        curve = Curve(positive, negative, h_positive, h_negative, n, end, gap)
        rest = finite if len(turns) == 0 else abs(turns[0])
        for j in range(rest):
            out[p, j] = slope * x[j]
        y = 0.0
        for b in range(len(turns)):
            direction = 1.0 if turns[b] > 0 else -1.0
            start, stop = abs(turns[b]), finite if b + 1 == len(turns) else abs(turns[b + 1])
            step = direction * rate
            offset = _place(curve, direction * y) - step * x[start - 1]
            _follow(curve, x[start:stop], (offset, step), (slope, direction * gain), out[p, start:stop])
            y = direction * _value(curve, offset + step * x[stop - 1])
    return out


def normal_form(kappa: Array, beta: Array, gamma: Array, n: Array) -> tuple[Array, Array, Array]:
    """Return z_max, rate = kappa/z_max and rho = (beta - gamma)/(beta + gamma) of printed Bouc-Wen parameters.

    The unit of the rate is that of kappa, where z has none. Values for which z has no bound give NaN.
    """
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        z_max = (kappa / (beta + gamma)) ** (1.0 / n)
        return z_max, kappa / z_max, (beta - gamma) / (beta + gamma)


def printed_form(rate: Array, n: Array, rho: Array, z_max: Array) -> tuple[Array, Array, Array]:
    """Return kappa, beta and gamma of printed Bouc-Wen parameters, the inverse of ``normal_form`` for a given z_max."""
    kappa = rate * z_max
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        total = kappa / z_max**n
    return kappa, 0.5 * total * (1.0 + rho), 0.5 * total * (1.0 - rho)


def curve_of(n: float, rho: float) -> Curve:
    """Return the branch curve of a sharpness n and a ratio rho, its tables as ``bouc_wen`` reads them."""
    _, cells, counts, scales = _kept_tables(np.array([[n, rho]]).tobytes(), _WIDTH)
    h_positive, h_negative, end, gap = scales[0].tolist()
    positive, negative = cells[0, 0, : counts[0, 0]], cells[0, 1, : counts[0, 1]]
    return Curve(positive, negative, h_positive, h_negative, n, end, gap)
