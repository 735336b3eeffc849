"""Effects that a base has itself: their force lies in the span of its own linear terms."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.invariance.base import Base
from mrfit.discover.invariance.estimate import table
from mrfit.discover.invariance.records import Record
from mrfit.discover.invariance.sensitivity import ExaminedEffect, added
from mrfit.discover.invariance.setting import RegressionData
from mrfit.discover.policy import STANDARD, Policy


def owns(base: Base, records: Sequence[Record], effect: ExaminedEffect, policy: Policy) -> bool:
    """Return whether the force that an effect adds at its neutral shape is a sum of a base's own terms and a constant.

    A spring of the base is at rest somewhere else, and the law has a constant of its own.
    """
    if effect.constant and base.offset:
        return True
    if not effect.adds or not base.terms[0].shape[1]:
        return False
    force = np.concatenate([r.measured(added(effect, r, with_unit_strength(effect))) for r in records])
    terms = np.vstack([t[r.lead :] for t, r in zip(base.terms, records, strict=True)])
    terms = np.column_stack([terms, np.ones(len(terms))])
    return bool(explained(terms, force) > policy.owned)


def explained(terms: Array, force: Array) -> float:
    """Return the share of a force's square (N,) that lies in the span of some terms (N, K)."""
    power = float(force @ force)
    if power == 0.0:
        return 0.0
    found = np.linalg.lstsq(terms, force, rcond=STANDARD.owned_rank)[0]
    return 1.0 - float(np.sum((force - terms @ found) ** 2)) / power


def strength_in(
    setting: RegressionData, weights: Sequence[Array], effect: ExaminedEffect, output: Sequence[Array]
) -> float:
    """Return the strength of an effect that adds a force in the output of a model, beside the best law for it.

    Parameters
    ----------
    setting
        Records ready to be regressed.
    weights
        Of each row, per record (n,).
    effect
        The effect, at its neutral shape.
    output
        What the model gives for each row over the range, per record (n,).
    """
    unit = with_unit_strength(effect)
    columns = [
        [setting.row_means(at, added(effect, record, unit)) / setting.scales.span]
        for at, record in enumerate(setting.records)
    ]
    made = table(replace(setting, targets=tuple(output)), weights, {}, columns)
    return float(made.solve(made.total, effects=1)[made.size] / made.scales[0] * effect.value(unit))


def with_unit_strength(effect: ExaminedEffect) -> Array:
    """Return the parameters (Q,) of an effect of strength 1, of -1 where only those below zero are physical."""
    return effect.at(np.array(effect.spec.neutral), 0, 1.0 if effect.of(0).high > 0.0 else -1.0)


def lawful(base: Base, records: Sequence[Record], effects: Sequence[ExaminedEffect], law: Sequence[Array]) -> Base:
    """Return a base without the terms that break an invariance which the base has no effect of its own for.

    A term such as v + Omega*x, set free beside v, is a spring: what it has beyond the other forces of a law (``law``,
    (L + N, p) per record) is the force of an effect.

    Parameters
    ----------
    base
        The base.
    records
        The records.
    effects
        Effects that are not the base's own.
    law
        Forces of any law, per record.
    """
    count = base.terms[0].shape[1]
    adding = [e for e in effects if e.adds]
    if not count or not adding:
        return base
    force = np.vstack(
        [np.stack([r.measured(added(e, r, with_unit_strength(e))) for e in adding], axis=1) for r in records]
    )
    terms = np.vstack([t[r.lead :] for t, r in zip(base.terms, records, strict=True)])
    forces = np.vstack([c[r.lead :] for c, r in zip(law, records, strict=True)])
    every = max(len(terms) // STANDARD.owned_samples, 1)
    left = _beyond(forces[::every], np.hstack([terms, force])[::every])
    size = np.sqrt(np.sum(left**2, axis=0)) + 1e-300
    cosines = (left / size).T @ (left / size)
    kept = ~np.any(np.abs(cosines[:count, count:]) > STANDARD.effect_force, axis=1) | (size[:count] < STANDARD.no_force)
    return replace(base, terms=tuple(t[:, kept] for t in base.terms))


def _beyond(columns: Array, values: Array) -> Array:
    """Return the part of values (N, K) that no combination of columns (N, p) makes."""
    scaled = columns / (np.sqrt(np.mean(columns**2, axis=0)) + 1e-300)
    gram = scaled.T @ scaled
    gram[np.diag_indices_from(gram)] += 1e-9 * len(scaled)
    return values - scaled @ np.linalg.solve(gram, scaled.T @ values)
