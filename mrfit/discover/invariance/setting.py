"""The data of an examination: records, the nuisance of each, and the rows of the regression."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.discover.invariance.nuisance import Columns, RecordMotion, Scales, columns, motion_of, scales_of
from mrfit.discover.invariance.records import Record
from mrfit.discover.invariance.sensitivity import ExaminedEffect, changed, moved
from mrfit.discover.policy import STANDARD, Policy

State = Mapping[str, Array]
"""Effects that are taken to be there, each with its parameters (Q,)."""


@dataclass(frozen=True)
class RegressionData:
    """Records ready to be regressed.

    Attributes
    ----------
    records
        The records.
    scales, motions
        What their columns are measured by, and what each one's motion makes.
    every
        Samples of each record that make a row.
    targets
        Output of each row over its range, per record (n,).
    compared
        Whether each row counts, 1 or 0, per record (n,).
    groups
        Group of each row, per record (n,): conditions, or pieces of few.
    known
        Effects by name.
    """

    records: tuple[Record, ...]
    scales: Scales
    motions: tuple[RecordMotion, ...]
    every: tuple[int, ...]
    targets: tuple[Array, ...]
    compared: tuple[Array, ...]
    groups: tuple[Index, ...]
    known: Mapping[str, ExaminedEffect]
    _made: dict[tuple[int, bytes], Columns] = field(default_factory=dict, repr=False)

    @property
    def count(self) -> int:
        """Groups."""
        return 1 + max(int(g.max()) for g in self.groups)

    @property
    def rows(self) -> int:
        """Rows."""
        return sum(len(t) for t in self.targets)

    @property
    def middle(self) -> float:
        """Middle of the longest stroke."""
        longest = max(self.records, key=lambda r: float(np.ptp(r.measured(r.place))))
        place = longest.measured(longest.place)
        return 0.5 * float(place.max() + place.min())

    @property
    def noise(self) -> float:
        """RMS of the noise of the rows over the range of the output."""
        squares = [len(t) * r.noise**2 / k for t, r, k in zip(self.targets, self.records, self.every, strict=True)]
        return float(np.sqrt(sum(squares) / self.rows)) / self.scales.span

    def row_means(self, at: int, values: Array) -> Array:
        """Return the means (n, …) over the samples of each row of values (L + N, …) of one record."""
        record, every = self.records[at], self.every[at]
        own = values[record.lead :]
        if every == 1:
            return own
        count = len(own) // every
        return own[: count * every].reshape(count, every, *own.shape[1:]).mean(axis=1)

    def control(self, at: int, state: State) -> Array:
        """Return the current (L + N,) that the law of one record sees."""
        record = self.records[at]
        current = record.control
        for name, theta in state.items():
            if self.known[name].moves:
                current = moved(self.known[name], record, current, theta)
        return current

    def law(self, at: int, state: State) -> Columns:
        """Return the nuisance (L + N, p) of one record, at the current that the law sees."""
        return self.law_at(at, self.control(at, state))

    def law_at(self, at: int, current: Array) -> Columns:
        """Return the nuisance (L + N, p) of one record at a current (L + N,)."""
        key = (at, current.tobytes() if self.records[at].moves else current[-1:].tobytes())
        if key not in self._made:
            if len(self._made) > STANDARD.kept_laws * len(self.records):
                self._made.clear()
            self._made[key] = columns(self.motions[at], current, self.records[at].dt, self.scales)
        return self._made[key]

    def passed(self, at: int, state: State, values: Array) -> Array:
        """Return columns of force (L + N, p) as the effects that scale or shape it let them pass."""
        for slot in ("theta", "output"):
            for name, theta in state.items():
                effect = self.known[name]
                if effect.spec.slot == slot:
                    values = changed(effect, self.records[at], theta, values)
        return values


def setting_of(
    records: Sequence[Record],
    base: Sequence[Array],
    effects: Sequence[ExaminedEffect],
    policy: Policy,
    horizon: float = 1.0,
    scales: Scales | None = None,
) -> RegressionData:
    """Return records ready to be regressed, with the base's own terms (L + N, K) of each; scales may be given."""
    scales = scales or scales_of(records, horizon)
    every = tuple(_row(r) for r in records)
    targets = [_targets(r, k) / scales.span for r, k in zip(records, every, strict=True)]
    return RegressionData(
        records=tuple(records),
        scales=scales,
        motions=tuple(motion_of(r, b, scales) for r, b in zip(records, base, strict=True)),
        every=every,
        targets=tuple(targets),
        compared=_compared(records, every),
        groups=_groups(records, [len(t) for t in targets], policy),
        known={e.name: e for e in effects},
    )


def _row(record: Record) -> int:
    longest = min(STANDARD.row_moving if record.moves else STANDARD.row_still, STANDARD.row_of_cycle / record.fastest)
    return max(int(round(longest / record.dt)), 1)


def _targets(record: Record, every: int) -> Array:
    return _row_means(record.output, every)


def _compared(records: Sequence[Record], every: Sequence[int]) -> tuple[Array, ...]:
    """Return 1 for each row without a clipped sample, 0 for others, per record (n,); 1 for all if no row has none."""
    own = [np.ones(len(r.output)) if r.compared is None else r.compared for r in records]
    rows = tuple(np.floor(_row_means(o, k)) for o, k in zip(own, every, strict=True))
    return rows if any(r.any() for r in rows) else tuple(np.ones_like(r) for r in rows)


def _row_means(values: Array, every: int) -> Array:
    count = len(values) // every
    means: Array = values[: count * every].reshape(count, every).mean(axis=1)
    return means


def _groups(records: Sequence[Record], rows: Sequence[int], policy: Policy) -> tuple[Index, ...]:
    """Return the group of each row: its condition, or, where these are few, one of several pieces of its record."""
    names = sorted({r.condition for r in records})
    if len(names) >= policy.fewest_groups:
        return tuple(np.full(n, names.index(r.condition)) for r, n in zip(records, rows, strict=True))
    pieces, total, found, first = policy.pieces, sum(rows), [], 0
    for n in rows:
        own = max(int(round(pieces * n / total)), 1)
        found.append(first + np.minimum(np.arange(n) * own // n, own - 1))
        first += own
    return tuple(found)
