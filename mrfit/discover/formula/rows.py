"""Rows of a search: the scaled variables of every record, and columns of terms beside the best law.

Columns are projected off the nuisance (Frisch and Waugh): an error of the law is then not taken for a term.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.discover.formula.factors import Term
from mrfit.discover.invariance.setting import RegressionData
from mrfit.discover.policy import STANDARD


@dataclass(frozen=True)
class Scale:
    """Origin and size of a variable in SI: scaled it is (u - origin)/size."""

    origin: float
    size: float


Scales = dict[str, Scale]
Samples = tuple[dict[str, Array], ...]
"""Scaled variables (L + N,) of every record, by name."""


def scales_of(setting: RegressionData) -> Scales:
    """Return the scales of the variables of some records."""
    own, records = setting.scales, setting.records
    fast = max(
        float(np.percentile(np.abs(r.measured(r.channels[r.motion[2]])), STANDARD.fast_percentile)) for r in records
    )
    warm = [r.measured(w) for r in records if (w := r.warmth) is not None]
    warmth = np.concatenate(warm) if warm else np.zeros(1)
    return {
        "x": Scale(setting.middle, own.travel),
        "v": Scale(0.0, own.speed),
        "a": Scale(0.0, fast),
        "i": Scale(0.0, own.control),
        "T": Scale(float(warmth.mean()), max(float(np.ptp(warmth)), 1e-9)),
        "t": Scale(0.0, max(float(r.channels["time"][-1]) for r in records)),
        "L": Scale(0.0, own.span),
    }


def samples_of(setting: RegressionData, scales: Scales) -> Samples:
    """Return the scaled variables of every record but the law's force, held at what is far outside the visited."""
    found = []
    for r in setting.records:
        raw = {"x": r.place, "v": r.speed, "a": r.channels[r.motion[2]], "i": r.control}
        raw |= {"t": np.maximum(r.channels["time"], 0.0), "T": np.zeros(len(r.speed)) + scales["T"].origin}
        raw |= {} if r.warmth is None else {"T": r.warmth}
        most = STANDARD.formula_furthest
        found.append({n: np.clip((u - scales[n].origin) / scales[n].size, -most, most) for n, u in raw.items()})
    return tuple(found)


def moving(samples: Samples, scales: Scales) -> frozenset[str]:
    """Return the variables that move by enough to be told."""
    current, warmth = (np.concatenate([s[n] for s in samples]) for n in "iT")
    warm = scales["T"].size > STANDARD.formula_warming and np.std(warmth) > STANDARD.moving_control
    told = {"i": np.std(current) > STANDARD.moving_control, "T": warm}
    return frozenset("xvat") | {n for n, moves in told.items() if moves}


@dataclass(frozen=True)
class FormulaRows:
    """Rows of all records, one after the other.

    Attributes
    ----------
    setting
        The data, with the nuisance.
    scales, samples
        The variables; ``L`` is among them.
    weights
        Of the rows (n,).
    """

    setting: RegressionData
    scales: Scales
    samples: Samples
    weights: Array

    @cached_property
    def law(self) -> Array:
        """Nuisance (n, p), unweighted, columns of unit RMS."""
        return self._raw_law / self.unit

    @cached_property
    def _raw_law(self) -> Array:
        records = range(len(self.setting.records))
        return np.concatenate([self.setting.row_means(k, self.setting.law(k, {}).values) for k in records])

    @cached_property
    def unit(self) -> Array:
        """RMS of the nuisance's columns (p,)."""
        return np.asarray(np.sqrt(np.mean(self._raw_law**2, axis=0)) + STANDARD.law_jitter)

    @cached_property
    def weighed(self) -> Array:
        """Nuisance (n, p), weighted."""
        return np.asarray(self.law * self.weights[:, None])

    @cached_property
    def target(self) -> Array:
        """Output over its range (n,)."""
        return np.concatenate(self.setting.targets)

    @cached_property
    def groups(self) -> list[Index]:
        """Rows of each group."""
        names = np.concatenate(self.setting.groups)
        return [np.flatnonzero(names == g) for g in range(self.setting.count)]

    @cached_property
    def grams(self) -> Array:
        """Gram matrices (G, p, p) of the weighted nuisance, one a group."""
        return np.array([self.weighed[g].T @ self.weighed[g] for g in self.groups])

    @cached_property
    def _basis(self) -> tuple[Array, Array]:
        n, p = self.weighed.shape
        q, r = np.linalg.qr(np.vstack([self.weighed, np.sqrt(STANDARD.law_ridge * n) * np.eye(p)]))
        return q[:n], r

    @cached_property
    def projected_target(self) -> Array:
        """Weighted output that no law makes (n,)."""
        return self.project(self.target)

    def project(self, columns: Array) -> Array:
        """Return columns (n, …), weighted, less what a law makes of them."""
        weighed = (columns.T * self.weights).T
        basis = self._basis[0]
        return np.asarray(weighed - basis @ (basis.T @ weighed))

    def column(self, term: Term) -> Array:
        """Return a term's rows (n,)."""
        gauge = self.gauge(term)
        return np.concatenate([self.setting.row_means(k, term.of(s, gauge)) for k, s in enumerate(self.samples)])

    def gauge(self, term: Term) -> float:
        """Return the mean of a term's gain over all rows, 0 where it has none: that part is the law's."""
        if (gain := term.gain) is None:
            return 0.0
        rows = [self.setting.row_means(k, gain.of(s[gain.variable])) for k, s in enumerate(self.samples)]
        return float(np.concatenate(rows).mean())

    def columns(self, terms: Sequence[Term]) -> Array:
        """Return the rows of several terms (n, K)."""
        return np.column_stack([self.column(t) for t in terms])

    def law_beside(self, force: Array) -> Array:
        """Return the coefficients (p,) of the best law, of unit columns, beside a force (n,) over the range."""
        basis, triangle = self._basis
        return np.asarray(np.linalg.solve(triangle, basis.T @ ((self.target - force) * self.weights)))

    def parts(self, rows: Array) -> tuple[Array, ...]:
        """Return rows (n,) record by record."""
        return tuple(np.split(rows, np.cumsum([len(t) for t in self.setting.targets])[:-1]))

    def with_weights(self, weights: Sequence[Array]) -> "FormulaRows":
        """Return the same with other weights of the rows."""
        return replace(self, weights=np.concatenate(list(weights)))

    def with_law_force(self, force: Array) -> "FormulaRows":
        """Return the same with the force of the best law beside a force (n,) as the variable ``L``."""
        law = self.law_beside(force) / self.unit
        samples = tuple({**s, "L": self.setting.law(k, {}).values @ law} for k, s in enumerate(self.samples))
        return replace(self, samples=samples)
