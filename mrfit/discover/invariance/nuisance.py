"""Forces that any law may make: odd in the motion, blind to place, time and temperature, forgetting.

They are columns of a regression, level by level, each times powers of the current at the same instant:

    0 base        a constant of the instruments; the base's own linear terms
    1 static      v;  tanh(v/(s*V))
    2 travel      z' = (sign(v) - z)*|v|/d, times 1 and sech^2(v/(s*V)); half the last stroke times z*sech^2;
                  (x - mean x)*sech^2, which is memory for motions about one middle
    3 time        LP_tau[tanh(v/(s*V))*i^p], the current inside
    4 relaxation  (LP_tau[v] - v)*i^p, p >= 1

V is the speed that 99 % of the samples stay below, X the largest half stroke, w the fastest circular frequency.
Memories end at ``horizon`` times 0.2*X of travel and 0.4/w of time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.channels import unit_of
from mrfit.core.specs import Array
from mrfit.discover.invariance.records import Record
from mrfit.discover.policy import STANDARD
from mrfit.kernels.filters import lag
from mrfit.kernels.memory import since_reversal, travel_memory

NUISANCE_LEVELS = ("base", "static", "travel", "time", "relaxation")


@dataclass(frozen=True)
class Scales:
    """Scales of the columns, over all records.

    Attributes
    ----------
    speed, travel, control
        V, X and the largest current.
    rate
        w in rad/s.
    order
        Powers of the current that the levels of the records can tell apart.
    span
        Range of the output.
    unit
        Of the place.
    horizon
        Factor on the longest memories, a power of 2.
    """

    speed: float
    travel: float
    control: float
    rate: float
    order: int
    span: float
    unit: str = "m"
    horizon: float = 1.0

    @property
    def lengths(self) -> tuple[float, ...]:
        """Lengths of travel over which a law forgets, in units of X."""
        return _further(STANDARD.travel_lengths, self.horizon)

    @property
    def longest(self) -> float:
        """Longest memory in time, in s."""
        return self.times(STANDARD.slow_times)[-1]

    def times(self, of: Sequence[float]) -> tuple[float, ...]:
        """Return time constants in s."""
        return tuple(t / self.rate for t in _further(of, self.horizon))


def _further(memories: Sequence[float], horizon: float) -> tuple[float, ...]:
    """Return memories, and the longest doubled until a factor is reached."""
    return (*memories, *(memories[-1] * 2.0**k for k in range(1, int(np.log2(horizon)) + 1)))


def scales_of(records: Sequence[Record], horizon: float = 1.0) -> Scales:
    """Return the scales of some records."""
    control = max(float(np.max(np.abs(r.control))) for r in records)
    peak = max(control, 1e-9)
    tenths = np.concatenate([np.round(r.measured(r.control) / peak * STANDARD.control_steps) for r in records])
    levels, counts = np.unique(tenths, return_counts=True)
    told = int(np.sum(counts > STANDARD.control_level * counts.sum()))
    outputs = [r.output for r in records]
    return Scales(
        speed=max(float(np.percentile(np.abs(r.measured(r.speed)), STANDARD.fast_percentile)) for r in records),
        travel=max(float(np.ptp(r.measured(r.place))) / 2 for r in records),
        control=peak,
        rate=2.0 * np.pi * max(r.fastest for r in records),
        order=min(max(told - 1, 0), STANDARD.static_powers),
        span=max(float(o.max()) for o in outputs) - min(float(o.min()) for o in outputs),
        unit=unit_of(records[0].motion[0]),
        horizon=horizon,
    )


@dataclass(frozen=True)
class RecordMotion:
    """Forces of one record's motion alone, (L + N, ·) each, before any current; see the levels above.

    ``since`` (N,) is the travel since the motion turned.
    """

    base: Array
    static: Array
    travel: Array
    slow: Array
    relaxation: Array
    since: Array


def motion_of(record: Record, base: Array, scales: Scales) -> RecordMotion:
    """Return the columns that the motion of a record makes, beside the base's own terms (L + N, K)."""
    v, x = record.speed, record.place
    at = {
        s: np.tanh(v / (s * scales.speed))
        for s in {
            *STANDARD.static_steepness,
            *STANDARD.travel_near,
            *STANDARD.stroke_near,
            *STANDARD.place_near,
            *STANDARD.slow_steepness,
        }
    }
    near = {s: 1.0 - at[s] ** 2 for s in {*STANDARD.travel_near, *STANDARD.stroke_near, *STANDARD.place_near}}
    z = travel_memory(v * record.dt, np.array(scales.lengths) * scales.travel)
    since, half = since_reversal(x, STANDARD.swing * scales.travel)
    known = half > 0.0
    stroke = np.where(known, half, np.median(half[known]) if known.any() else scales.travel) / scales.travel
    middle = (x - np.mean(record.measured(x))) / scales.travel
    travel = [zd * f for zd in z for f in (1.0, *(near[s] for s in STANDARD.travel_near))]
    travel += [stroke * z[k] * near[s] for k in STANDARD.stroke_lengths for s in STANDARD.stroke_near]
    travel += [middle * near[s] for s in STANDARD.place_near]
    return RecordMotion(
        base=base,
        static=np.column_stack([v / scales.speed, *(at[s] for s in STANDARD.static_steepness)]),
        travel=np.column_stack(travel),
        slow=np.column_stack([at[s] for s in STANDARD.slow_steepness]),
        relaxation=_lagging(v[:, None] / scales.speed, scales.times(STANDARD.relaxation_times), record.dt)
        - v[:, None] / scales.speed,
        since=record.measured(since),
    )


@dataclass(frozen=True)
class Columns:
    """A nuisance: values (L + N, p), and where each level's columns end."""

    values: Array
    ends: tuple[int, ...]


def columns(motion: RecordMotion, control: Array, dt: float, scales: Scales) -> Columns:
    """Return the nuisance of a motion at a current (L + N,)."""
    powers = (control / scales.control)[:, None] ** np.arange(scales.order + 1)
    few = powers[:, : STANDARD.memory_powers + 1]
    slow = _products(motion.slow, few)
    taus = scales.times(STANDARD.slow_times)
    widths = (
        1 + motion.base.shape[1] * few.shape[1],
        motion.static.shape[1] * powers.shape[1],
        motion.travel.shape[1] * few.shape[1],
        slow.shape[1] * len(taus),
        motion.relaxation.shape[1] * (few.shape[1] - 1),
    )
    ends = tuple(int(n) for n in np.cumsum(widths))
    values = np.empty((len(powers), ends[-1]))
    values[:, 0] = 1.0
    _fill(values[:, 1 : ends[0]], motion.base, few)
    _fill(values[:, ends[0] : ends[1]], motion.static, powers)
    _fill(values[:, ends[1] : ends[2]], motion.travel, few)
    values[:, ends[2] : ends[3]] = _lagging(slow, taus, dt)
    _fill(values[:, ends[3] :], motion.relaxation, few[:, 1:])
    return Columns(values, ends)


def _fill(place: Array, values: Array, powers: Array) -> None:
    """Write every column (N, K) times every power (N, P) to its place (N, K*P)."""
    for p in range(powers.shape[1]):
        np.multiply(values, powers[:, p : p + 1], out=place[:, p :: powers.shape[1]])


def _products(values: Array, powers: Array) -> Array:
    """Return every column times every power, (N, K*P)."""
    made = np.empty((len(values), values.shape[1] * powers.shape[1]))
    _fill(made, values, powers)
    return made


def _lagging(values: Array, times: Sequence[float], dt: float) -> Array:
    """Return every column (N, K) behind a first-order lag of every time constant, (N, K*T)."""
    rows = np.ascontiguousarray(values.T)
    return np.hstack([lag(rows, np.full(len(rows), tau / dt)).T for tau in times])
