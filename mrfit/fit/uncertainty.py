"""How far the data determine the parameters: intervals that allow for correlated noise, and what cannot be had at all.

The residuals of a simulated model are correlated from sample to sample, so the covariance is the sandwich J⁺ Γ J⁺ᵀ with
Γ the long-run covariance of the scores J_t·e_t (Newey & West 1987, bandwidth of Andrews 1991), not σ²(JᵀJ)⁻¹.
A direction of the parameter space along which the 95 % interval is wider than the bounds is not determined by the data:
every parameter that leans on it is reported as unbounded.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import stats

from mrfit.specs import Array

# Central differences in cube coordinates: truncation ~1e-8, table noise 1e-9 / 1e-4 = 1e-5 of a column
STEP = 1e-4
# A singular value below this share of the largest is rounding, whatever the noise
RANK_TOLERANCE = 1e-7
# Squared weight on undetermined directions above which a parameter counts as undetermined itself
LEAN = 1e-3
# Score series are summed in blocks to at most this length: the long-run covariance stays, the lags get fewer
SERIES = 2000


@dataclass(frozen=True)
class Uncertainty:
    """Covariance of the free parameters in cube coordinates, split into what the data determine and what they do not.

    Attributes
    ----------
    covariance
        Over the determined directions only, shape (F, F).
    null
        Orthonormal basis of the undetermined directions, shape (F, U).
    singular_values
        Of the Jacobian in cube coordinates, scaled to RMS per sample, shape (F,).
    degrees
        Degrees of freedom: effective number of independent samples less the rank.
    """

    covariance: Array
    null: Array
    singular_values: Array
    degrees: float

    @property
    def rank(self) -> int:
        """Number of determined directions."""
        return len(self.covariance) - int(self.null.shape[1])

    def half_width(self, gradient: Array) -> float:
        """Return the 95 % half-width of a quantity with gradient (F,), infinite where the data leave it open."""
        norm = float(gradient @ gradient)
        if norm == 0.0:
            return 0.0
        if self.null.size and float(np.sum((gradient @ self.null) ** 2)) > LEAN * norm:
            return np.inf
        quantile = float(stats.t.ppf(0.975, max(self.degrees, 1.0)))
        variance = float(np.dot(gradient, self.covariance @ gradient))
        return quantile * math.sqrt(max(variance, 0.0))


def sensitivities(simulate: Callable[[Array], Array], point: Array) -> Array:
    """Return d(simulate)/d(point) by central differences pointing into the cube: (P, F) -> (P, N) gives (N, F)."""
    upper = np.minimum(point + STEP, 1.0)
    lower = np.maximum(point - STEP, 0.0)
    free = len(point)
    points = np.tile(point, (2 * free, 1))
    points[np.arange(free), np.arange(free)] = upper
    points[free + np.arange(free), np.arange(free)] = lower
    rows = simulate(points)
    jacobian: Array = ((rows[:free] - rows[free:]) / (upper - lower)[:, None]).T
    return jacobian


def bandwidth(scores: Array) -> int:
    """Return Andrews' AR(1) plug-in bandwidth of the Bartlett kernel for score series (N, F), at most N // 4."""
    if len(scores) < 8:
        return 0
    lead, lag = scores[1:], scores[:-1]
    power = np.sum(lag**2, axis=0)
    rho = np.clip(np.sum(lead * lag, axis=0) / np.where(power > 0, power, 1.0), -0.995, 0.995)
    variance = np.sum((lead - rho * lag) ** 2, axis=0) ** 2
    numerator = np.sum(4 * rho**2 * variance / ((1 - rho) ** 6 * (1 + rho) ** 2))
    denominator = np.sum(variance / (1 - rho) ** 4)
    if denominator <= 0:
        return 0
    return int(min(1.1447 * (numerator / denominator * len(scores)) ** (1 / 3), len(scores) // 4))


def long_run_covariance(scores: Array) -> Array:
    """Return the sum over all lags of the autocovariance of (N, F) scores, Bartlett weights, (F, F)."""
    if len(scores) > SERIES:
        starts = np.linspace(0, len(scores), SERIES, endpoint=False).astype(np.int64)
        scores = np.add.reduceat(scores, starts, axis=0)
    width = bandwidth(scores)
    total: Array = scores.T @ scores
    for lag in range(1, width + 1):
        cross = scores[lag:].T @ scores[:-lag]
        total = total + (1 - lag / (width + 1)) * (cross + cross.T)
    return total


def effective_samples(residuals: list[Array]) -> float:
    """Return the number of independent samples the residual series are worth, from their lag-one correlation."""
    total = 0.0
    for series in residuals:
        power = float(series @ series)
        rho = float(series[1:] @ series[:-1]) / power if power > 0 else 0.0
        rho = min(max(rho, 0.0), 0.9999)
        total += len(series) * (1 - rho) / (1 + rho)
    return total


def analyse(jacobians: list[Array], residuals: list[Array]) -> Uncertainty:
    """Return the uncertainty of a least-squares optimum.

    Parameters
    ----------
    jacobians
        For each independent record the sensitivities (N_s, F) of weighted residuals in cube coordinates.
    residuals
        For each record the weighted residuals (N_s,).
    """
    samples = sum(len(r) for r in residuals)
    stacked = np.vstack(jacobians)
    _, singular, vt = np.linalg.svd(np.linalg.qr(stacked, mode="r"))
    directions = vt.T
    scores = [(j @ directions) * r[:, None] for j, r in zip(jacobians, residuals, strict=True)]
    gamma = sum((long_run_covariance(s) for s in scores), np.zeros((len(singular), len(singular))))
    usable = singular > RANK_TOLERANCE * max(float(singular[0]), 1e-300)
    inverse = np.where(usable, 1.0 / np.where(usable, singular, 1.0) ** 2, 0.0)
    covariance = inverse[:, None] * gamma * inverse[None, :]
    wide = ~usable | (2 * 1.96 * np.sqrt(np.maximum(np.diag(covariance), 0.0)) > 1.0)
    covariance[wide, :] = 0.0
    covariance[:, wide] = 0.0
    degrees = effective_samples(residuals) - float(np.sum(~wide))
    return Uncertainty(
        covariance=directions @ covariance @ directions.T,
        null=directions[:, wide],
        singular_values=singular / np.sqrt(samples),
        degrees=degrees,
    )
