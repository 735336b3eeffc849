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
from typing import Any, NamedTuple

import numpy as np

from mrfit.core.specs import Array, Index, State, Values
from mrfit.kernels.jit import array_at, kernel
from mrfit.kernels.powers import power
from mrfit.kernels.theta import plain

# Taylor order of a table step; the tables of tests/kernels/test_branch.py stay below 3e-7 with it.
_ORDER, _TERMS = 10, 11
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
Branch = tuple[float, float, float, float]


class BranchCurve(NamedTuple):
    """One parameter vector's branch curve: quintic cells either side of s = 0, then the exponential tail.

    Attributes
    ----------
    cells
        Rows of coefficients, ``above`` of them for s > 0 and, from row ``first`` on, ``below`` for s < 0.
    h_above, h_below
        Widths of the cells in q.
    end, gap
        s at which the tail begins, and 1 - Y there.
    z_max, rate, n, rho
        Greatest state, kappa/z_max, sharpness, and (beta - gamma)/(beta + gamma).
    """

    cells: Array
    above: int
    first: int
    below: int
    h_above: float
    h_below: float
    end: float
    gap: float
    z_max: float
    rate: float
    n: float
    rho: float


@kernel
def _start_series(n: float, rho: float, a: Array) -> None:
    """Write a of Y = s*sum_j a_j*(s^n)^j, the solution of dY/ds = 1 - rho*Y^n about s = 0."""
    raised = np.zeros(_ORDER)
    a[0], raised[0] = 1.0, 1.0
    for j in range(1, _ORDER):
        a[j] = -rho * raised[j - 1] / (1.0 + n * j)
        total = 0.0
        for i in range(1, j + 1):
            total += (n * i - (j - i)) * a[i] * raised[j - i]
        raised[j] = total / j


@kernel
def _taylor_step(q: float, y: float, y_n: float, h: float, law: tuple[float, float]) -> float:
    """Return Y(q + h) from Y(q) = y > 0, y_n = y^n, where dY/dq = 2q(1 - rho*Y^n), by the Taylor series about q."""
    n, rho = law
    value, raised = np.empty(_TERMS), np.empty(_ORDER)
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
def _tabulate(law: tuple[float, float], h: float, stop: float, cells: Array, first: int, last: int) -> int:
    """Fill rows of quintic cells of |Y| over q = 0, h, 2h ... until ``stop`` is passed; return how many there are."""
    n, rho = law
    series = np.zeros(_ORDER)
    _start_series(n, rho, series)
    y, y_n, slope, bend = 0.0, 0.0, 0.0, 2.0 * h * h
    count = 0
    while first + count < last and y < stop:
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
        at = first + count
        cells[at, 0], cells[at, 1], cells[at, 2] = y, slope, 0.5 * bend
        cells[at, 3], cells[at, 4], cells[at, 5] = (
            10 * a - 4 * b + 0.5 * c,
            -15 * a + 7 * b - c,
            6 * a - 3 * b + 0.5 * c,
        )
        y, slope, bend = following, next_slope, next_bend
        count += 1
    return count


@kernel
def _cell_value(cell: Array, t: float) -> float:
    """Return the value of a cell at t from 0 to 1."""
    return float(cell[0] + t * (cell[1] + t * (cell[2] + t * (cell[3] + t * (cell[4] + t * cell[5])))))


@kernel
def _solve(cell: Array, y: float, start: float) -> float:
    """Return the place in a cell at which its value is y, by Newton's method from ``start``."""
    t = start
    for _ in range(8):
        slope = cell[1] + t * (2 * cell[2] + t * (3 * cell[3] + t * (4 * cell[4] + t * 5 * cell[5])))
        step = (_cell_value(cell, t) - y) / slope
        t = min(max(t - step, 0.0), 1.0)
        if not abs(step) > 1e-15:
            break
    return t


@kernel
def _invert(curve: BranchCurve, first: int, count: int, y: float) -> float:
    """Return q/h >= 0 at which the cells from a row on reach y > 0; their end if they do not."""
    low, high = 0, count - 1
    while low < high:
        middle = (low + high + 1) // 2
        if curve.cells[first + middle, 0] <= y:
            low = middle
        else:
            high = middle - 1
    begin = curve.cells[first + low, 0]
    share = (y - begin) / (_cell_value(curve.cells[first + low], 1.0) - begin)
    return low + _solve(curve.cells[first + low], y, math.sqrt(share) if low == 0 else share)


@kernel
def _widths(n: float, rho: float, width: float) -> tuple[float, float]:
    """Return the cells' widths in q on either side of s = 0, of ``width`` at n = 1."""
    above = width / (1.0 + 0.2 * (n - 1.0))
    return above, above / (1.0 + max(-rho, 0.0) * (0.5 + 0.3 * (n - 1.0)))


@kernel
def prepared(
    n: float, rho: float, cells: Array, first: int, last: int
) -> tuple[int, int, int, float, float, float, float]:
    """Fill cells of the curve of a sharpness n and a ratio rho < 1; return the fields ``above`` to ``gap``."""
    h_above, h_below = _widths(n, rho, _WIDTH)
    above = _tabulate((n, 1.0), h_above, 1.0 - _TAIL, cells, 0, first)
    below = _tabulate((n, rho), h_below, 1.0, cells, first, last)
    return above, first, below, h_above, h_below, (above * h_above) ** 2, 1.0 - _cell_value(cells[above - 1], 1.0)


@kernel
def _tables(shapes: Array, width: float) -> tuple[Index, Array, Index, Array]:
    """Tabulate Y(s) once for each sharpness n and ratio rho = (beta - gamma)/(beta + gamma) < 1 among shapes (P, 2).

    ``width`` is that of the cells at n = 1.

    Returns
    -------
    which
        Table of each row, shape (P,); -1 where n <= 0, rho >= 1, or one of them is not finite.
    cells
        Rows of either sign of s, 512 for each, shape (U, 1024, 6).
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
    cells, counts = np.empty((found, 2 * _CELLS, _COEFFICIENTS)), np.empty((found, 2), dtype=np.int64)
    scales = np.empty((found, 4))
    for u in range(found):
        n, rho = shapes[distinct[u]]
        h_above, h_below = _widths(n, rho, width)
        same = 0  # the positive side depends on n alone
        while shapes[distinct[same], 0] != n:
            same += 1
        if same < u:
            counts[u, 0] = counts[same, 0]
            cells[u, : counts[u, 0]] = cells[same, : counts[u, 0]]
        else:
            counts[u, 0] = _tabulate((n, 1.0), h_above, 1.0 - _TAIL, cells[u], 0, _CELLS)
        counts[u, 1] = _tabulate((n, rho), h_below, 1.0, cells[u], _CELLS, 2 * _CELLS)
        gap = 1.0 - _cell_value(cells[u, counts[u, 0] - 1], 1.0)
        scales[u] = h_above, h_below, (counts[u, 0] * h_above) ** 2, gap
    return which, cells, counts, scales


@lru_cache(maxsize=8)
def _kept_tables(shapes: bytes, width: float) -> tuple[Index, Array, Index, Array]:
    """Return the tables of shapes (P, 2) given as bytes: those of one batch serve every log it is compared with."""
    return _tables(np.frombuffer(shapes).reshape(-1, 2).copy(), width)


@kernel
def _place(curve: BranchCurve, y: float) -> float:
    """Return the s at which Y(s) = y, -1 <= y <= 1."""
    if y == 0.0:
        return 0.0
    if y < 0.0:
        return -((_invert(curve, curve.first, curve.below, -y) * curve.h_below) ** 2)
    if y < 1.0 - curve.gap:
        return (_invert(curve, 0, curve.above, y) * curve.h_above) ** 2
    return curve.end + min(math.log(curve.gap / max(1.0 - y, 1e-16)), _TAIL_END) / curve.n


@kernel
def _value(curve: BranchCurve, s: float) -> float:
    """Return Y(s)."""
    if s > curve.end:
        return 1.0 - curve.gap * math.exp(-curve.n * (s - curve.end))
    first = curve.first if s < 0.0 else 0
    last = (curve.below if s < 0.0 else curve.above) - 1
    place = math.sqrt(abs(s)) / (curve.h_below if s < 0.0 else curve.h_above)
    k = int(place) if place < last else last
    y = _cell_value(curve.cells[first + k], place - k)
    return -y if s < 0.0 else y


@kernel
def branch_step(curve: BranchCurve, state: Branch, before: float, now: float) -> Branch:
    """Return state between -1 and 1, direction, drive at the last turn and s there, after the drive goes on to ``now``.

    However far that is, it is exact.
    """
    y, direction, turn, start = state
    if now != before:
        side = 1.0 if now > before else -1.0
        if side != direction:
            direction, turn, start = side, before, _place(curve, side * y)
        y = side * _value(curve, start + curve.rate * abs(now - turn))
    return y, direction, turn, start


def rest_on_curve(now: Values, theta: Values) -> State:
    """Return the state from which ``branch_step`` begins."""
    return 0.0, 0.0, now[0], 0.0


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
def _follow(curve: BranchCurve, x: Array, line: tuple[float, float], form: tuple[float, float], out: Array) -> None:
    """Set out = form[0]*x + form[1]*Y(line[0] + line[1]*x) over a branch, on which s does not fall."""
    zero = _first_at_least(x, line, 0.0, 0)
    end = _first_at_least(x, line, curve.end, zero)
    flat = _first_at_least(x, line, curve.end + _TAIL_END / curve.n, end)
    a, b = line
    scale, negative = 1.0 / curve.h_below**2, curve.cells[curve.first : curve.first + curve.below]
    _read_cells(x[:zero], (-a * scale, -b * scale), (form[0], -form[1]), negative, out[:zero])
    scale = 1.0 / curve.h_above**2
    _read_cells(x[zero:end], (a * scale, b * scale), form, curve.cells[: curve.above], out[zero:end])
    for j in range(end, flat):
        out[j] = form[0] * x[j] + form[1] * (1.0 - curve.gap * math.exp(-curve.n * (a + b * x[j] - curve.end)))
    for j in range(flat, len(x)):
        out[j] = form[0] * x[j] + form[1]


@kernel
def turning_points(x: Array) -> tuple[Index, int]:
    """Return the starts of the drive's branches and the number of leading samples that are finite.

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
def _simulated(x: Array, forms: Array, which: Index, cells: Array, counts: Index, scales: Array) -> Array:
    turns, finite = turning_points(x)
    out = np.empty((len(forms), len(x)))
    for p in range(len(forms)):
        slope, gain, rate, n, rho = forms[p]
        u = which[p]
        if u < 0 or not (math.isfinite(slope) and math.isfinite(gain) and math.isfinite(rate) and rate >= 0.0):
            out[p] = np.nan
            continue
        out[p, finite:] = np.nan
        h_above, h_below, end, gap = scales[u]
        curve = BranchCurve(cells[u], counts[u, 0], _CELLS, counts[u, 1], h_above, h_below, end, gap, 1.0, rate, n, rho)
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


@kernel
def normal(kappa: float, beta: float, gamma: float, n: float) -> tuple[float, float, float, float]:
    """Return the numbers ``z_max`` to ``rho`` of a curve, of printed Bouc-Wen parameters."""
    z_max = power(kappa / (beta + gamma), 1.0 / n)
    return z_max, kappa / z_max, n, (beta - gamma) / (beta + gamma)


def curve_of(z_max: float, rate: float, n: float, rho: float) -> BranchCurve:
    """Return the branch curve of what ``normal`` gives; its cells are without gaps between them."""
    cells = np.empty((2 * _CELLS, _COEFFICIENTS))
    above, first, below, h_above, h_below, end, gap = prepared(n, rho, cells, _CELLS, 2 * _CELLS)
    rows = np.vstack([cells[:above], cells[first : first + below]])
    return BranchCurve(rows, above, above, below, h_above, h_below, end, gap, z_max, rate, n, rho)


def numbers_of(curve: BranchCurve) -> Array:
    """Return a curve as numbers, which ``curve_at`` reads."""
    return np.concatenate([np.array(curve[1:], dtype=np.float64), curve.cells.ravel()])


@kernel
def curve_at(place: Any) -> BranchCurve:
    """Return the curve whose numbers begin at a pointer."""
    rows, fields = int(place[0] + place[2]), 11
    cells = array_at(place, fields + _COEFFICIENTS * rows)[fields:].reshape((rows, _COEFFICIENTS))
    scales = place[3], place[4], place[5], place[6], place[7], place[8], place[9], place[10]
    return BranchCurve(cells, int(place[0]), int(place[1]), int(place[2]), *scales)
