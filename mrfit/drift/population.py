"""Mean and variance of a population of units from one value a unit whose own variance is known.

y_i ~ N(μ, ω² + c_i) with known c_i. Of the true ω², Q(ω²) = Σ (y_i − μ̂)²/(ω² + c_i) is χ² of n − 1 degrees of freedom.
Draws of χ² give draws of ω², and with them of μ: generalised pivotal quantities (Iyer, Wang and Mathew 2004). They are
exact where all c_i are equal. Intervals, tolerance intervals and predictions are quantiles over the draws.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri, stdtr, stdtrit

from mrfit.core.specs import Array, Index

PIVOT_DRAWS = 4000
UNITS_NEEDED = 3
"""Units from which a variance between them is estimated."""
TOLERANCE_CONTENT, CONFIDENCE_OF_TOLERANCE = 0.95, 0.95
ODD_UNIT_LEVEL = 0.01
"""Probability that a sound population has a unit which is said to stand out, all units and parameters together."""
ODD_CANDIDATES = 2
# Least variance between units that is distinguished from none, as a share of the greatest that the data allow
VARIANCE_GRID, LEAST_SHARE = 600, 1e-9
# Degrees of freedom of units with heavy tails, and steps to their mean
HEAVY_DEGREES, REWEIGHTINGS = 4.0, 20
BISECTIONS = 40


@dataclass(frozen=True)
class Population:
    """Distribution of a quantity over units, with what the data leave open of it.

    Attributes
    ----------
    values, variances
        Of every unit (N,), on the scale of the search, and their known variances.
    mean, variance
        Estimates of μ and, by restricted likelihood, of ω².
    means, sigmas
        Draws of μ and ω (B,).
    degrees
        Of Student's t that the units follow; infinite for normal ones.
    """

    values: Array
    variances: Array
    mean: float
    variance: float
    means: Array
    sigmas: Array
    degrees: float = math.inf

    @property
    def mean_interval(self) -> tuple[float, float]:
        """95 % interval of the population's mean."""
        return _ends(self.means)

    @property
    def sigma_interval(self) -> tuple[float, float]:
        """95 % interval of the standard deviation between units."""
        return _ends(self.sigmas)

    @cached_property
    def tolerance(self) -> tuple[float, float]:
        """Interval that holds 95 % of all units with 95 % confidence."""
        off = np.abs(self.means - self.mean)
        low, high = np.zeros(PIVOT_DRAWS), off + 3.0 * self.sigmas
        sigmas = np.maximum(self._scales, 1e-300)
        for _ in range(BISECTIONS):
            middle = (low + high) / 2.0
            held = self._share((middle - off) / sigmas) - self._share((-middle - off) / sigmas)
            low, high = (
                np.where(held < TOLERANCE_CONTENT, middle, low),
                np.where(held < TOLERANCE_CONTENT, high, middle),
            )
        half = float(np.quantile(high, CONFIDENCE_OF_TOLERANCE))
        return self.mean - half, self.mean + half

    @property
    def limits(self) -> tuple[float, float]:
        """One-sided bounds: 95 % of all units are above the first, 95 % below the second, each with 95 % confidence."""
        quantile = ndtri(TOLERANCE_CONTENT) if self.degrees == math.inf else stdtrit(self.degrees, TOLERANCE_CONTENT)
        reach = float(quantile) * self._scales
        return (
            float(np.quantile(self.means - reach, 1.0 - CONFIDENCE_OF_TOLERANCE)),
            float(np.quantile(self.means + reach, CONFIDENCE_OF_TOLERANCE)),
        )

    @property
    def _scales(self) -> Array:
        """Draws of the scale of the law of units (B,)."""
        scales: Array = self.sigmas * (1.0 if self.degrees == math.inf else math.sqrt(1.0 - 2.0 / self.degrees))
        return scales

    def _share(self, places: Array) -> Array:
        """Return the share of units below places in scales."""
        share = ndtr(places) if self.degrees == math.inf else stdtr(self.degrees, places)
        return np.asarray(share, dtype=np.float64)

    @property
    def scores(self) -> Array:
        """Distance of every unit from the mean in standard deviations (N,)."""
        scores: Array = (self.values - self.mean) / np.sqrt(np.maximum(self.variance + self.variances, 1e-300))
        return scores

    def probability(self, value: float, variance: float) -> float:
        """Return the probability that another unit lies as far from the mean, whatever the direction."""
        spread = np.sqrt(np.maximum(self.sigmas**2 + variance, 1e-300))
        return float(np.mean(2.0 * ndtr(-np.abs(value - self.means) / spread)))


def population(values: Array, variances: Array, lost: int = 0, seed: int = 0) -> Population:
    """Return the distribution of values (N,) with known variances (N,) over at least three units.

    ``lost`` are degrees of freedom that a regression on the same values took.
    """
    grid, mean, precision, squares = _profile(values, variances)
    rng = np.random.default_rng(seed)
    chi = rng.chisquare(max(len(values) - 1 - lost, 1), PIVOT_DRAWS)
    # Q falls with ω²: where it starts below a draw, ω² is none
    drawn = np.interp(-chi, -squares, grid)
    means = np.interp(drawn, grid, mean) + rng.standard_normal(PIVOT_DRAWS) / np.sqrt(np.interp(drawn, grid, precision))
    best = _restricted(values, variances)
    weights = 1.0 / (best + variances)
    return Population(
        values, variances, float(weights @ values / weights.sum()), best, means, np.sqrt(np.maximum(drawn, 0.0))
    )


def heavy_tailed(values: Array, variances: Array, seed: int = 0) -> Population:
    """Return the distribution of values (N,) whose units follow Student's t of few degrees.

    Draws are of the posterior of the scale on a grid, with the prior 1/σ, and of the mean about its best value there.
    """
    rng, nu = np.random.default_rng(seed), HEAVY_DEGREES
    spread = float(np.var(values, ddof=1)) + 1e-300
    grid = np.geomspace(1e-6, 1e3, VARIANCE_GRID) * spread
    scales = grid[:, None] + variances
    mean = np.full(len(grid), float(np.median(values)))
    for _ in range(REWEIGHTINGS):
        weights = (nu + 1.0) / (nu * scales + (values - mean[:, None]) ** 2)
        mean = np.sum(weights * values, axis=1) / weights.sum(axis=1)
    ratios = (values - mean[:, None]) ** 2 / (nu * scales)
    precision = np.sum((nu + 1.0) / (nu + 3.0) / scales, axis=1)
    logarithm = -0.5 * np.sum(np.log(scales) + (nu + 1.0) * np.log1p(ratios), axis=1) - 0.5 * np.log(precision)
    # the grid is even in the logarithm, so that the prior 1/σ is flat on it
    share = np.exp(logarithm - logarithm.max())
    place = rng.choice(len(grid), PIVOT_DRAWS, p=share / share.sum())
    best, wider = int(np.argmax(logarithm)), nu / (nu - 2.0)
    means = mean[place] + rng.standard_normal(PIVOT_DRAWS) / np.sqrt(precision[place])
    sigmas = np.sqrt(grid[place] * wider)
    return Population(values, variances, float(mean[best]), float(grid[best]) * wider, means, sigmas, nu)


def _profile(values: Array, variances: Array) -> tuple[Array, Array, Array, Array]:
    """Return a grid of ω² (G,) and there the mean, its precision and the weighted sum of squares."""
    spread = float(np.var(values, ddof=1)) + float(np.mean(variances)) + 1e-300
    grid = np.concatenate([[0.0], np.geomspace(LEAST_SHARE, 1e4, VARIANCE_GRID) * spread])
    weights = 1.0 / np.maximum(grid[:, None] + variances, 1e-12 * spread)
    precision = weights.sum(axis=1)
    mean = weights @ values / precision
    squares = np.sum(weights * (values - mean[:, None]) ** 2, axis=1)
    return grid, mean, precision, squares


def _restricted(values: Array, variances: Array) -> float:
    """Return the variance between units of greatest restricted likelihood, 0 where they differ no more than c_i say."""
    grid, _, _, _ = _profile(values, variances)

    def slope(omega: Array) -> Array:
        """Return the derivative of the restricted log-likelihood at variances (G,)."""
        weights = 1.0 / np.maximum(omega[:, None] + variances, 1e-300)
        total = weights.sum(axis=1)
        rest = values - (weights @ values / total)[:, None]
        change: Array = np.sum(weights**2 * rest**2, axis=1) - total + np.sum(weights**2, axis=1) / total
        return change

    rising = slope(grid[1:]) > 0.0
    if not rising.any():
        return 0.0
    last = int(np.flatnonzero(rising)[-1]) + 1
    low, high = grid[last], grid[min(last + 1, VARIANCE_GRID)]
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if slope(np.array([middle]))[0] > 0.0 else (low, middle)
    return float((low + high) / 2.0)


def odd_units(values: Array, variances: Array, tests: int) -> list[tuple[int, float, float]]:
    """Return the units that stand out: place, studentised residual against all others, probability of one so far off.

    The unit farthest off is judged against all others, which do not include it; if it stands out, the next one is.

    Parameters
    ----------
    values, variances
        Of every unit (N,).
    tests
        Units and parameters together that are judged, by whose number the probabilities are multiplied.
    """
    left: Index = np.arange(len(values))
    found: list[tuple[int, float, float]] = []
    while len(left) > UNITS_NEEDED and len(found) < len(values) // 4:
        whole = _moments(values[left], variances[left])
        judged = []
        for at in np.argsort(-np.abs(whole))[:ODD_CANDIDATES]:
            others = np.delete(left, at)
            rest = population(values[others], variances[others])
            here = left[at]
            error = math.sqrt(max(rest.variance + variances[here] + float(np.var(rest.means)), 1e-300))
            probability = min(1.0, tests * rest.probability(float(values[here]), float(variances[here])))
            judged.append((int(here), float(values[here] - rest.mean) / error, probability))
        worst = min(judged, key=lambda one: (one[2], -abs(one[1])))
        if worst[2] >= ODD_UNIT_LEVEL:
            break
        found.append(worst)
        left = left[left != worst[0]]
    return found


def _moments(values: Array, variances: Array) -> Array:
    """Return distances from the weighted mean (N,) in standard deviations."""
    omega = _restricted(values, variances)
    weights = 1.0 / np.maximum(omega + variances, 1e-300)
    scores: Array = (values - weights @ values / weights.sum()) * np.sqrt(weights)
    return scores


def without(values: Array, variances: Array, odd: Sequence[int], lost: int = 0) -> Population:
    """Return the distribution over all units but odd ones; units stay among the values."""
    kept = np.setdiff1d(np.arange(len(values)), odd)
    return replace(population(values[kept], variances[kept], lost), values=values, variances=variances)


def _ends(draws: Array) -> tuple[float, float]:
    low, high = np.quantile(draws, (0.025, 0.975))
    return float(low), float(high)
