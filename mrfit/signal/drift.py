"""Steady drift within a record: a level or a gain that moves slowly with time, which no input explains.

A residual is projected on Legendre polynomials of time, P_n(t) for the level and P_n(t) times the output for the gain.
Noise puts power into all of them, smoothly with n; a drift puts its own into the first few. The power of the higher
orders, extrapolated in n, says how much of the first ones is noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.special import fdtri

from mrfit.core.counting import few
from mrfit.core.specs import Array
from mrfit.io.schemas.fit import DriftRow

# Orders a drift is described by, and those that tell the noise
DRIFT_ORDER, FIRST_ORDER, LAST = 4, 5, 20
# Fewest orders that tell the noise, and how likely noise may seem a drift
FEWEST_ORDERS, DRIFT_CHANCE_MAX = 5, 3e-5
# Steepest fall of the noise's power with the order, as of a random walk: n to the power -3
STEEPEST = 3.0
# Samples whose columns are factored at once
DRIFT_ROWS = 1 << 16
# Groups of neighbouring samples that a long record is taken as
DRIFT_GROUPS = 1 << 14
# Smaller drifts, in shares of what is left, matter to nobody
VISIBLE = 0.3


@dataclass(frozen=True)
class SteadyDrift:
    """A steady drift of a record.

    Attributes
    ----------
    level, gain
        What the drifts of level and gain add to the output (N,), in its unit; zero where there is none.
    level_rate, gain_rate
        Range of the level over the record's duration, in the output's unit per second, and of the gain in 1/s, both
        with the sign of the last minus the first value.
    """

    level: Array
    gain: Array
    level_rate: float
    gain_rate: float

    @property
    def bend(self) -> Array:
        """What the level's drift adds beyond a straight line (N,), which no effect of the library does."""
        time = np.linspace(-1.0, 1.0, len(self.level))
        return self.level - np.polyval(np.polyfit(time, self.level, 1), time)

    @property
    def total(self) -> Array:
        """What both add to the output (N,)."""
        return self.level + self.gain


def steady_drift(residual: Array, output: Array, dt: float, cycles: int = 0) -> SteadyDrift | None:
    """Return the steady drift in a residual (N,), None where it is no more than noise.

    Parameters
    ----------
    residual
        What the inputs do not explain of an output, in its unit.
    output
        The output or what the inputs explain of it (N,): a gain's drift is proportional to it.
    dt
        Sample interval in s.
    cycles
        Cycles in the record; orders as fast as these tell nothing of the noise. 0 for a record without cycles.
    """
    last = min(LAST, cycles) if cycles else LAST
    if last - FIRST_ORDER + 1 < FEWEST_ORDERS or len(residual) < 4 * LAST:
        return None
    moving = output - output.mean()
    slope = np.asarray(np.gradient(moving), dtype=np.float64)
    slope = slope * float(np.std(moving) / max(np.std(slope), 1e-300))
    parts: list[Array] = []
    rates: list[float] = []
    carriers_of: tuple[list[Array], ...] = ([np.ones(len(residual))], [moving, slope])
    for carriers in carriers_of:
        trend, factor = _trend(residual - sum(parts, np.zeros(len(residual))), carriers, last)
        parts.append(trend)
        rates.append(float(np.ptp(factor) * np.sign(factor[-1] - factor[0])) / (len(residual) * dt))
    if not any(np.any(part) for part in parts):
        return None
    return SteadyDrift(parts[0], parts[1], rates[0], rates[1])


def _trend(residual: Array, carriers: list[Array], last: int) -> tuple[Array, Array]:
    """Return the drift on some carriers (N,), and the factor of the first (N,); zeros where it is noise."""
    none = np.zeros(len(residual))
    if not all(np.any(c) for c in carriers):
        return none, none
    orders, count = last + 1, len(carriers)
    triangle, projected = _factored(residual, carriers, last)
    coefficients = np.linalg.lstsq(triangle, projected, rcond=None)[0]
    # power per order: what its columns, orthogonal but for the carriers, hold of the residual
    scale = np.abs(np.diag(triangle))
    power = np.sum((coefficients * scale).reshape(count, orders) ** 2, axis=0)
    noise, degrees = _noise_power(power, float(count))
    score = np.max(power[1:3] / np.maximum(noise[1:3], 1e-300))
    drifting = coefficients.reshape(count, orders)[:, : DRIFT_ORDER + 1].copy()
    drifting[:, 0] = 0.0
    time = np.linspace(-1.0, 1.0, len(residual))
    factors = [np.asarray(legendre.legval(time, row), dtype=np.float64) for row in drifting]
    trend = sum((c * f for c, f in zip(carriers, factors, strict=True)), none)
    left = float(np.std(residual - trend))
    # either of two orders may be the drift's
    limit = fdtri(count, degrees, 1.0 - DRIFT_CHANCE_MAX / 2.0)
    if score <= limit or float(np.std(trend)) <= VISIBLE * left:
        return none, none
    return trend, factors[0]


def _factored(residual: Array, carriers: list[Array], last: int) -> tuple[Array, Array]:
    """Return R and Qᵀ·residual of the QR factors of the carriers times polynomials of time, made part by part."""
    time, columns = _shortened(np.linspace(-1.0, 1.0, len(residual)), np.stack([*carriers, residual], axis=1))
    triangle = np.empty((0, (last + 1) * len(carriers) + 1))
    for begin in range(0, len(time), DRIFT_ROWS):
        rows = slice(begin, begin + DRIFT_ROWS)
        polynomials = np.asarray(legendre.legvander(time[rows], last), dtype=np.float64)
        own = [columns[rows, k, None] * polynomials for k in range(len(carriers))]
        stacked = np.vstack([triangle, np.hstack([*own, columns[rows, -1:]])])
        triangle = np.asarray(np.linalg.qr(stacked, mode="r"))
    return triangle[:-1, :-1], triangle[:-1, -1]


def _shortened(time: Array, columns: Array) -> tuple[Array, Array]:
    """Return fewer rows with the same sums of products: of a long record, the R factors of neighbouring rows (N, C).

    Over so few neighbours the polynomials of time hardly move.
    """
    each = len(time) // DRIFT_GROUPS
    if each < 2 * columns.shape[1]:
        return time, columns
    whole, width = DRIFT_GROUPS * each, columns.shape[1]
    factors = np.linalg.qr(columns[:whole].reshape(DRIFT_GROUPS, each, width), mode="r")
    middles = np.repeat(time[:whole].reshape(DRIFT_GROUPS, each).mean(axis=1), width)
    return np.concatenate([middles, time[whole:]]), np.vstack([np.reshape(factors, (-1, width)), columns[whole:]])


def _noise_power(power: Array, count: float) -> tuple[Array, float]:
    """Return the noise's power at every order, from a power law through the higher ones, and its degrees of freedom."""
    orders = np.arange(len(power), dtype=np.float64)
    slow, fast = np.array_split(np.flatnonzero(orders >= FIRST_ORDER), 2)
    ratio = float(np.mean(power[slow])) / max(float(np.mean(power[fast])), 1e-300)
    apart = float(np.log(orders[fast].mean() / orders[slow].mean()))
    exponent = float(np.clip((np.log(max(ratio, 1e-300)) + np.sqrt(4.0 / (count * len(fast)))) / apart, 0.0, STEEPEST))
    law = np.maximum(orders, 1.0) ** -exponent
    high = orders >= FIRST_ORDER
    found: Array = float(np.mean(power[high] / law[high])) * law
    return found, count * float(np.sum(high))


def drift_row(condition: str, segment: str, drift: SteadyDrift) -> DriftRow:
    """Return a drift as fit.json and discovery.json have it."""
    return DriftRow(
        condition=condition,
        segment=segment,
        level_rate=drift.level_rate if np.any(drift.level) else 0.0,
        gain_rate=drift.gain_rate if np.any(drift.gain) else 0.0,
    )


def drift_words(rows: Sequence[DriftRow]) -> str:
    """Return what drifts in which records in one sentence; rates are in the output's SI unit."""
    parts = []
    for name, what, unit in (("level_rate", "level", "per second"), ("gain_rate", "gain", "% per second")):
        moving = [r for r in rows if getattr(r, name)]
        if moving:
            fastest = max((getattr(r, name) for r in moving), key=abs)
            rate = float(fastest) * (100.0 if name == "gain_rate" else 1.0)
            conditions = list(dict.fromkeys(r.condition for r in moving))
            parts.append(f"the output's {what} drifts in {few(conditions, 3)} (by up to {rate:.3g} {unit})")
    follows = list(dict.fromkeys(r.follows for r in rows if r.follows))
    if follows:
        worst = max((r for r in rows if r.follows), key=lambda r: r.rate)
        parts.append(
            f"what {' and '.join(follows)} would explain grows or falls with time, by up to {worst.rate:.3g} per "
            f"second in {worst.condition}"
        )
    return (
        f"{'; '.join(parts)}: steadily within the record, which no input explains; it is not counted as noise; fit "
        "blocks of it, by `mrfit segment --blocks 20`, and `mrfit drift` says which parameter moves"
    )
