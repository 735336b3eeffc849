"""Weights of samples by what the best law leaves: so much in this condition, so much at this travel since a reversal.

Errors of laws are ten times larger at full current than without, and larger near reversals; springs and masses are the
same everywhere. Ordinary least squares would listen to the former alone.
"""

from collections.abc import Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.discover.invariance.estimate import GramTable, rows_of, table
from mrfit.discover.invariance.setting import RegressionData, State
from mrfit.discover.policy import STANDARD


def equal(setting: RegressionData) -> list[Array]:
    """Return weights of 1, per record (n,), 0 for rows that do not count."""
    return list(setting.compared)


def weights_of(setting: RegressionData, state: State) -> list[Array]:
    """Return weights of mean square 1, per record (n,), by what the best law with the effects of a state leaves."""
    made = table(setting, equal(setting), state)
    errors = residuals(setting, state, made)
    mean = np.array([float(np.mean(e**2)) for e in errors])
    mean += STANDARD.weight_floor**2 * float(np.median(mean)) + setting.noise**2 + np.finfo(float).tiny
    edges = setting.scales.travel * np.array(STANDARD.weight_edges)
    places = [np.searchsorted(edges, setting.row_means(k, _padded(setting, k))) for k in range(len(setting.records))]
    factors = np.ones(len(edges) + 1)
    for k in range(len(factors)):
        own = np.concatenate([e[p == k] ** 2 / m for e, p, m in zip(errors, places, mean, strict=True)])
        if len(own) > STANDARD.weight_rows:
            factors[k] = np.clip(own.mean(), *STANDARD.weight_bounds)
    found = [c / np.sqrt(m * factors[p]) for c, m, p in zip(setting.compared, mean, places, strict=True)]
    size = np.sqrt(np.mean(np.concatenate(found) ** 2))
    return [f / size for f in found]


def _padded(setting: RegressionData, at: int) -> Array:
    """Return the travel since a reversal (L + N,), 0 in the lead-in."""
    return np.concatenate([np.zeros(setting.records[at].lead), setting.motions[at].since])


def residuals(setting: RegressionData, state: State, made: GramTable, level: int | None = None) -> list[Array]:
    """Return the residual of the best law with the effects of a state, unweighted, per record (n,), over the range."""
    gram = made.total
    found = made.solve(gram, effects=0) if level is None else made.solve(gram, level, effects=0)
    rows = rows_of(setting, state)
    return [
        c * (t - law @ found[: made.size]) for c, t, law in zip(setting.compared, rows.target, rows.law, strict=True)
    ]


def rms(parts: Sequence[Array]) -> float:
    """Return the root mean square of some rows."""
    return float(np.sqrt(np.mean(np.concatenate(list(parts)) ** 2)))
