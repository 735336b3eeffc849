"""Rows of a repair: the residual of a fitted base, its sensitivities, and the terms that it may lack."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array, Index
from mrfit.discover.evidence.refit import Refit
from mrfit.discover.invariance.base import none
from mrfit.discover.invariance.nuisance import Scales
from mrfit.discover.invariance.records import Record, with_steady_currents
from mrfit.discover.invariance.setting import RegressionData, setting_of
from mrfit.discover.policy import STANDARD
from mrfit.discover.repair.terms import LawTerm, TermInputs
from mrfit.fit.diagnostics.uncertainty import sensitivities

TINY = 1e-300


@dataclass(frozen=True)
class FittedBase:
    """A fitted base on some records.

    Attributes
    ----------
    records
        The records.
    response, sensitivities
        Its response (L + N,) on each, and the sensitivities (L + N, K) to its free parameters.
    left
        Residual of each (N,), from simulations of every logged sample.
    """

    records: tuple[Record, ...]
    response: tuple[Array, ...]
    sensitivities: tuple[Array, ...]
    left: tuple[Array, ...]


def fitted_base(base: Refit, records: Sequence[Record], left: Sequence[Array]) -> FittedBase:
    """Return a base at the parameters of its fit: a joint fit beside a term moves them, to first order as these say."""
    responses, found, records = [], [], with_steady_currents(records)
    for record in records:
        drive = np.ascontiguousarray(np.stack([record.channels[n] for n in base.assembly.spec.inputs]))

        def simulated(points: Array, drive: Array = drive, dt: float = record.dt) -> Array:
            return base.assembly.simulate(drive, base.cube.to_theta(points), dt)

        responses.append(simulated(base.point[None])[0])
        found.append(sensitivities(simulated, base.point))
    return FittedBase(tuple(records), tuple(responses), tuple(found), tuple(left))


@dataclass(frozen=True)
class RepairRows:
    """Rows of some records, one after the other, over the range of the output.

    Attributes
    ----------
    setting
        The records.
    terms
        Terms that the law may lack.
    base, columns
        Sensitivities (n, K) and terms (n, C), of unit RMS.
    target
        Residual of the base (n,).
    units
        RMS of the columns of both (K + C,).
    conditions
        Condition of each row (n,), or its piece of a record where conditions are few.
    """

    setting: RegressionData
    terms: tuple[LawTerm, ...]
    base: Array
    columns: Array
    target: Array
    units: Array
    conditions: Index

    @property
    def scales(self) -> Scales:
        """Scales of the columns."""
        return self.setting.scales

    def grams(self, columns: Array | None = None) -> Array:
        """Return the Gram matrices (G, M, M) of [base | columns | target], one a condition."""
        whole = np.column_stack([self.base, self.columns if columns is None else columns, self.target])
        own = [whole[self.conditions == g] for g in range(1 + int(self.conditions.max()))]
        return np.array([w.T @ w for w in own])


def rows_of(base: FittedBase, terms: tuple[LawTerm, ...], like: RepairRows | None = None) -> RepairRows:
    """Return the rows of a base's records, on the scales of other rows where these are given."""
    records = base.records
    setting = setting_of(records, none(records).terms, [], STANDARD, scales=like.scales if like else None)
    scales, own, found, left = setting.scales, [], [], []
    for k, (r, response) in enumerate(zip(records, base.response, strict=True)):
        drive = TermInputs(r.speed, r.control, response, r.dt)
        own.append(setting.row_means(k, base.sensitivities[k]))
        found.append(setting.row_means(k, np.column_stack([t.column(drive, scales) for t in terms])))
        left.append(setting.row_means(k, np.concatenate([np.zeros(r.lead), base.left[k]])) / scales.span)
    whole = np.column_stack([np.concatenate(own), np.concatenate(found)])
    units = like.units if like else np.sqrt(np.mean(whole**2, axis=0)) + TINY
    at = np.concatenate(setting.groups)
    count = own[0].shape[1]
    scaled = whole / units
    return RepairRows(setting, terms, scaled[:, :count], scaled[:, count:], np.concatenate(left), units, at)


def shifted(rows: RepairRows, rng: np.random.Generator) -> Array:
    """Return the terms (n, C) shifted round in time within each record by a random share of it: what chance makes."""
    ends = np.cumsum([len(t) for t in rows.setting.targets])[:-1]
    parts = np.split(rows.columns, ends)
    shares = STANDARD.repair_shift + (1.0 - 2.0 * STANDARD.repair_shift) * rng.random(len(parts))
    return np.concatenate([np.roll(p, round(q * len(p)), axis=0) for p, q in zip(parts, shares, strict=True)])
