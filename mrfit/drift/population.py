"""Mean and variance of a population of units from one value a unit whose own variance is known.

y_i ~ N(μ, ω² + c_i) with known c_i. Of the true ω², Q(ω²) = Σ (y_i − μ̂)²/(ω² + c_i) is χ² of n − 1 degrees of freedom.
Draws of χ² give draws of ω², and with them of μ: generalised pivotal quantities (Iyer, Wang and Mathew 2004). They are
exact where all c_i are equal. Intervals of the mean and of the standard deviation are quantiles over the draws.

Few units do not show whether their tails are those of the normal law. Tolerance intervals take Student's t whose
degrees of freedom are unknown (Lange, Little and Taylor 1989): draws of the posterior of degrees, scale and mean. A
value is a unit of that law and the normal error of its fit, which must not hide the tails.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq
from scipy.special import gammaln, ndtr, stdtr, stdtrit

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
TAIL_DEGREES, TAIL_PRIOR = np.array([3.0, 4.0, 6.0, 10.0, 1e6]), np.array([0.125, 0.125, 0.125, 0.125, 0.5])
"""Degrees of freedom of Student's t that units may follow, the last as good as normal, and their prior."""
# Degrees from which on the law is taken as normal, and logarithms of g at which laws of fewer are summed
NORMAL_FROM, MIXED_LOGARITHMS = 1e3, np.linspace(-14.0, 3.0, 52)
# Scales of these laws, over the variance of the values, and steps to the mean at each
TAIL_SCALES, REWEIGHTINGS = np.geomspace(1e-4, 1e2, 120), 8
BISECTIONS = 26
# Distances of a law's centre from an interval's, in scales, at which the interval is computed
OFF_CENTRE_PLACES = 33


@dataclass(frozen=True)
class Population:
    """Distribution of a quantity over units, with what the data leave open of it.

    Attributes
    ----------
    values, variances
        Of every unit (N,), on the scale of the search, and their known variances.
    mean, variance
        Estimates of μ and, by restricted likelihood, of ω², of all units but odd ones.
    means, sigmas
        Draws of μ and ω (B,), of the same.
    design
        Columns of the mean: ones, and the covariates of every unit less their mean (N, P).
    """

    values: Array
    variances: Array
    mean: float
    variance: float
    means: Array
    sigmas: Array
    design: Array

    @property
    def mean_interval(self) -> tuple[float, float]:
        """95 % interval of the population's mean."""
        return _ends(self.means)

    @property
    def sigma_interval(self) -> tuple[float, float]:
        """95 % interval of the standard deviation between units."""
        return _ends(self.sigmas)

    @property
    def untold(self) -> bool:
        """Whether units scatter so much less than their known variances that hardly a draw of σ is above 0."""
        return self.sigma_interval[1] == 0.0

    @cached_property
    def tails(self) -> tuple[Array, Array, Array]:
        """Draws (B,) of degrees, mean and scale of the law of all units, odd ones among them.

        The prior of the scale is that of Jeffreys for normal units; the mean is normal about its best value.
        """
        rng, y = np.random.default_rng(0), self.values
        grid = TAIL_SCALES * (float(np.var(y, ddof=1)) + 1e-300)
        nu, scales = TAIL_DEGREES[:, None, None], grid[:, None] + self.variances
        mean = np.full((len(TAIL_DEGREES), len(grid), 1), float(np.median(y)))
        for _ in range(REWEIGHTINGS):
            weights = (nu + 1.0) / (nu * scales + (y - mean) ** 2)
            beta, _ = _weighted(weights, self.design, y)
            mean = beta @ self.design.T
        nu = TAIL_DEGREES[:, None, None]
        inverse = np.linalg.inv(self.design.T @ (((nu + 1.0) / (nu + 3.0) / scales)[..., None] * self.design))
        logarithm = np.stack(
            [likelihood_of_sums(law, y - m, grid, self.variances) for law, m in zip(TAIL_DEGREES, mean, strict=True)]
        )
        logarithm = logarithm + 0.5 * np.linalg.slogdet(inverse)[1]
        # Jeffreys' prior of the scale, 1/σ where the fits are exact
        prior = grid * np.sqrt(np.sum(scales**-2.0, axis=1))
        share = TAIL_PRIOR[:, None] * prior * np.exp(logarithm - logarithm.max())
        law, place = np.divmod(rng.choice(share.size, PIVOT_DRAWS, p=share.ravel() / share.sum()), len(grid))
        means = beta[law, place, 0] + rng.standard_normal(PIVOT_DRAWS) * np.sqrt(inverse[law, place, 0, 0])
        # even within a step of the grid, which is even in the logarithm
        step = (TAIL_SCALES[1] / TAIL_SCALES[0]) ** rng.uniform(-0.5, 0.5, PIVOT_DRAWS)
        return TAIL_DEGREES[law], means, np.sqrt(grid[place] * step)

    @cached_property
    def tolerance(self) -> tuple[float, float]:
        """Interval that holds 95 % of all units with 95 % confidence."""
        degrees, means, scales = self.tails
        centre = float(np.median(means))
        off = np.abs(means - centre) / scales
        places = np.linspace(0.0, float(off.max()), OFF_CENTRE_PLACES)
        reach = np.empty(PIVOT_DRAWS)
        for nu in TAIL_DEGREES:
            own = degrees == nu
            reach[own] = np.interp(off[own], places, _reach(nu, places)) * scales[own]
        half = float(np.quantile(reach, CONFIDENCE_OF_TOLERANCE))
        # where units may all be alike, each may lie wherever the mean may
        low, high = self.mean_interval
        return min(centre - half, low), max(centre + half, high)

    def limits(
        self, lowest: float | Array = 0.0, highest: float | Array = 0.0, more: float = 0.0
    ) -> tuple[float, float]:
        """Return one-sided bounds: 95 % of all units are above the first, 95 % below the second, with 95 % confidence.

        Parameters
        ----------
        lowest, highest
            Draws (B,) of the least and the greatest change over the covariates that are tested.
        more
            Standard deviation between units of this change.
        """
        degrees, means, scales = self.tails
        reach = stdtrit(degrees, TOLERANCE_CONTENT) * np.hypot(scales, more)
        return (
            float(np.quantile(means - reach + lowest, 1.0 - CONFIDENCE_OF_TOLERANCE)),
            float(np.quantile(means + reach + highest, CONFIDENCE_OF_TOLERANCE)),
        )

    @property
    def scores(self) -> Array:
        """Distance of every unit from the mean in standard deviations (N,)."""
        return (self.values - self.mean) / np.sqrt(np.maximum(self.variance + self.variances, 1e-300))

    def probability(self, value: float, variance: float) -> float:
        """Return the probability that another unit lies as far from the mean, whatever the direction."""
        spread = np.sqrt(np.maximum(self.sigmas**2 + variance, 1e-300))
        return float(np.mean(2.0 * ndtr(-np.abs(value - self.means) / spread)))


def likelihood_of_sums(degrees: float, off: Array, grid: Array, variances: Array) -> Array:
    """Return the log-likelihood (G,) of values so far off a mean (G, N): Student's t of units, normal errors of fits.

    Units are normal of variance σ²/g, g of a gamma law (Andrews and Mallows 1974); over ln g a sum is taken.
    """
    if degrees > NORMAL_FROM:
        scales = grid[:, None] + variances
        return np.asarray(-0.5 * np.sum(np.log(scales) + off**2 / scales, axis=1))
    half, step = degrees / 2.0, MIXED_LOGARITHMS[1] - MIXED_LOGARITHMS[0]
    shares = step * np.exp(half * (MIXED_LOGARITHMS - np.exp(MIXED_LOGARITHMS) + math.log(half)) - gammaln(half))
    total = np.zeros(off.shape)
    for g, share in zip(np.exp(MIXED_LOGARITHMS), shares, strict=True):
        scales = grid[:, None] / g + variances
        total += share * np.exp(-0.5 * off**2 / scales) / np.sqrt(scales)
    return np.asarray(np.sum(np.log(np.maximum(total, 1e-300)), axis=1))


def _reach(degrees: float, off: Array) -> Array:
    """Return half of the intervals that hold 95 % of Student's t of unit scale, centred so far off (G,) its own."""
    low, high = off, off + float(stdtrit(degrees, (1.0 + TOLERANCE_CONTENT) / 2.0))
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        short = stdtr(degrees, middle - off) - stdtr(degrees, -middle - off) < TOLERANCE_CONTENT
        low, high = np.where(short, middle, low), np.where(short, high, middle)
    return np.asarray(high)


def population(
    values: Array, variances: Array, odd: Sequence[int] = (), beside: Array | None = None, seed: int = 0
) -> Population:
    """Return the distribution of values (N,) with known variances (N,) over at least three units.

    Parameters
    ----------
    values, variances
        Of every unit.
    odd
        Units that stand out: they take no part in mean and standard deviation.
    beside
        Covariates of every unit less their mean (N, C), whose slopes are estimated of the same values.
    seed
        What draws.
    """
    design = np.column_stack([np.ones(len(values)), *([] if beside is None else [beside])])
    sound = np.setdiff1d(np.arange(len(values)), odd)
    y, known, columns = values[sound], variances[sound], design[sound]
    grid = _grid(y, known)
    weights = 1.0 / np.maximum(grid[:, None] + known, 1e-16 * grid[-1])
    beta, inverse = _weighted(weights, columns, y)
    squares = np.sum(weights * (y - beta @ columns.T) ** 2, axis=1)
    rng = np.random.default_rng(seed)
    chi = rng.chisquare(max(len(y) - columns.shape[1], 1), PIVOT_DRAWS)
    # Q falls with ω²: where it starts below a draw, ω² is none
    drawn = np.interp(-chi, -squares, grid)
    errors = np.sqrt(np.interp(drawn, grid, inverse[:, 0, 0]))
    means = np.interp(drawn, grid, beta[:, 0]) + rng.standard_normal(PIVOT_DRAWS) * errors
    best = _restricted(y, known, columns)
    mean = float(_weighted(1.0 / np.maximum(best + known, 1e-300), columns, y)[0][0])
    return Population(values, variances, mean, best, means, np.sqrt(np.maximum(drawn, 0.0)), design)


def _weighted(weights: Array, design: Array, values: Array) -> tuple[Array, Array]:
    """Return the coefficients (…, P) of least squares with weights (…, N), and their covariance (…, P, P)."""
    inverse = np.asarray(np.linalg.inv(design.T @ (weights[..., None] * design)), dtype=np.float64)
    return np.einsum("...ab,nb,...n->...a", inverse, design, weights * values), inverse


def _grid(values: Array, variances: Array) -> Array:
    """Return variances between units (G,) that the data allow, from none on."""
    spread = float(np.var(values, ddof=1)) + float(np.mean(variances)) + 1e-300
    return np.concatenate([[0.0], np.geomspace(LEAST_SHARE, 1e4, VARIANCE_GRID) * spread])


def _restricted(values: Array, variances: Array, design: Array) -> float:
    """Return the variance between units of greatest restricted likelihood, 0 where they differ no more than c_i say."""

    def slope(omega: Array) -> Array:
        """Return the derivative of the restricted log-likelihood at variances (G,)."""
        weights = 1.0 / np.maximum(omega[:, None] + variances, 1e-300)
        beta, inverse = _weighted(weights, design, values)
        rest = values - beta @ design.T
        leverage = np.einsum("na,gab,nb->gn", design, inverse, design)
        change: Array = np.sum(weights**2 * (rest**2 + leverage) - weights, axis=1)
        return change

    grid = _grid(values, variances)
    rising = np.flatnonzero(slope(grid[1:]) > 0.0) + 1
    if not len(rising) or rising[-1] == VARIANCE_GRID:
        return 0.0
    return float(brentq(lambda omega: slope(np.array([omega]))[0], *grid[rising[-1] :][:2]))


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
    omega = _restricted(values, variances, np.ones((len(values), 1)))
    weights = 1.0 / np.maximum(omega + variances, 1e-300)
    scores: Array = (values - weights @ values / weights.sum()) * np.sqrt(weights)
    return scores


def _ends(draws: Array) -> tuple[float, float]:
    low, high = np.quantile(draws, (0.025, 0.975))
    return float(low), float(high)
