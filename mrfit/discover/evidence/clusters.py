"""Intervals that know that the model is not quite right: how far apart the conditions pull its parameters."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from mrfit.core.specs import Array
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.rules import counted
from mrfit.fit.diagnostics.uncertainty import Uncertainty, excess


@dataclass(frozen=True)
class ClusteredUncertainty(Uncertainty):
    """Uncertainty no smaller than the scatter between conditions demands.

    Attributes
    ----------
    between
        Covariance that this scatter alone tells (F, F).
    conditions
        Number of conditions.
    """

    between: Array
    conditions: int


def clustered(
    within: Uncertainty, jacobians: Sequence[Array], residuals: Sequence[Array], conditions: Sequence[str]
) -> Uncertainty:
    """Return an uncertainty no smaller than the scatter between conditions demands.

    Within a condition a wrong form errs everywhere alike, however long the record; only other conditions tell. The
    covariance is the cluster-robust sandwich with each condition's residual freed of its own leverage,
    e_c -> (1 - H_cc)^(-1/2) e_c, and is widened by Student's t of conditions - 1. Where the long-run covariance within
    records is larger, that stays.

    Source: R. M. Bell, D. F. McCaffrey, Survey Methodology 28 (2002) 169 (CR2).

    Parameters
    ----------
    within
        From the noise within records.
    jacobians, residuals
        For each record the sensitivities (N_s, F) and residuals (N_s,), as ``within`` was made from.
    conditions
        Test condition of each record.
    """
    names = list(dict.fromkeys(conditions))
    if len(names) < STANDARD.fewest_clusters:
        return within
    samples = sum(len(r) for r in residuals)
    scale = within.singular_values * np.sqrt(samples)
    closed = ~within.open & (scale > 0.0)
    basis = within.directions[:, closed] / scale[closed]
    scores = np.stack([_score(basis, jacobians, residuals, [c == n for c in conditions]) for n in names])
    # records of different conditions err independently, however smooth the residual of each is
    degrees = max(within.degrees, len(names) - 1.0)
    ratio = stdtrit(len(names) - 1, STANDARD.quantile) / stdtrit(degrees, STANDARD.quantile)
    between = basis @ (scores.T @ scores) @ basis.T
    wider = within.covariance + excess(ratio**2 * between, within.covariance)
    own = {**vars(within), "covariance": wider, "degrees": degrees}
    return ClusteredUncertainty(**own, between=between, conditions=len(names))


def score(found: Uncertainty, place: int, distance: float, numbers: int) -> float:
    """Return the distance of a parameter from neutral in standard errors, fewer where few conditions tell them.

    Beside the interval stands the normal score of Student's t by the scatter between conditions alone. Its degrees of
    freedom are the conditions, less the numbers that they tell. The smaller one counts.

    Parameters
    ----------
    found
        Uncertainty of the free parameters in the cube.
    place
        Place of the parameter among them.
    distance
        Its distance from neutral in the cube.
    numbers
        Numbers that the conditions tell together: the strengths of the effect.
    """
    width = found.bounded_half_width(np.eye(len(found.open))[place])
    if not width > 0.0:
        return 0.0
    own = float(STANDARD.half_width * abs(distance) / width)
    if not isinstance(found, ClusteredUncertainty) or not found.between[place, place] > 0.0:
        return own
    scattered = abs(distance) / float(np.sqrt(found.between[place, place]))
    return min(own, counted(scattered, found.conditions - numbers, STANDARD))


def _score(basis: Array, jacobians: Sequence[Array], residuals: Sequence[Array], members: Sequence[bool]) -> Array:
    """Return the scores of a condition's residual along directions orthonormal over all, corrected for leverage."""
    columns = np.vstack([j @ basis for j, m in zip(jacobians, members, strict=True) if m])
    errors = np.concatenate([r for r, m in zip(residuals, members, strict=True) if m])
    leverages, vectors = np.linalg.eigh(columns.T @ columns)
    corrected = 1.0 / np.sqrt(1.0 - np.clip(leverages, 0.0, STANDARD.leverage_max))
    return vectors @ (corrected * (vectors.T @ (columns.T @ errors)))
