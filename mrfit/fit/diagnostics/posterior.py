"""Intervals by the posterior: draws from the likelihood that the HAC covariance stands for, with the bounds as priors.

Residuals r along the left singular vectors U of the Jacobian at the optimum have the long-run covariance Γ, others the
variance v. With e = Uᵀ r the cost is Q(θ) = eᵀ Γ⁻¹ e + (‖r‖² − ‖e‖²)/v, the density (1 + (Q − Q₀)/ν)^(−(ν + F)/2)
with a flat prior within the bounds of the cube. Where the model is linear this is Student's t with the HAC covariance.
Draws of a wider Student's t about the optimum, with the covariance of the fit, are weighted by the density. Where too
few of these count, about a ridge or a bound, the sampler is the affine-invariant ensemble of Goodman and Weare (2010),
which needs no gradient and follows a ridge.
"""

import math
from collections.abc import Callable, Set
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import ConfigError
from mrfit.fit.diagnostics.bootstrap import BootstrapInterval
from mrfit.fit.diagnostics.profile import residual_power, variance_factors
from mrfit.fit.diagnostics.uncertainty import RANK_TOLERANCE, Linearisation, Uncertainty, analyse, sensitivities
from mrfit.io.schemas.band import Refits
from mrfit.search.cube import Cube
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.reduced_problem import reduced_problem
from mrfit.simulate.assembly import Assembly

WALKERS_PER_PARAMETER, FEWEST_WALKERS = 4, 16
STEPS_AT_ONCE, MOST_POSTERIOR_STEPS = 500, 4000
AUTOCORRELATIONS = 30
"""Autocorrelation times after which the draws are enough."""
POSTERIOR_KEPT = 400
WIDEST_START = 0.2
"""Spread, as a share of the bounds, that draws have at most along what the data leave open."""
PROPOSAL_WIDER, PROPOSAL_DEGREES = 1.2, 8.0
"""Width of the proposal over that of the fit's covariance, and the most degrees of freedom it has."""
PROPOSALS, EFFECTIVE_DRAWS = 4000, 1000.0
"""Most draws of the proposal, and how many independent ones they have to be worth."""
FEWEST_TO_FOLLOW = 10
"""Effective draws a parameter from which a proposal can be made of them."""
OPEN_SHARE = 0.9
"""Share of the bounds from which on a 95 % interval says nothing."""


@dataclass(frozen=True)
class PosteriorDensity:
    """Logarithm of the density at points of the cube (P, F), about an optimum.

    Attributes
    ----------
    posed
        Folded blocks that were fitted.
    point
        Optimum, shape (F,).
    basis, precision
        Singular vectors U (M, R) of the Jacobian and Γ⁻¹ (R, R).
    variance
        v of the other residuals.
    degrees
        Degrees of freedom ν.
    """

    posed: LeastSquaresProblem
    point: Array
    basis: Array
    precision: Array
    variance: float
    degrees: float

    def costs(self, points: Array) -> Array:
        """Return Q at points (P, F), infinite where a simulation diverges."""
        residuals = self.posed.residuals(points)
        along = residuals @ self.basis
        rest = np.sum(residuals**2, axis=1) - np.sum(along**2, axis=1)
        costs: Array = np.einsum("pr,rs,ps->p", along, self.precision, along) + rest / self.variance
        return np.where(np.isfinite(costs), costs, np.inf)

    def logarithms(self, points: Array, least: float) -> Array:
        """Return the logarithm of the density at points (P, F), −∞ beyond the bounds."""
        inside = np.all((points >= 0.0) & (points <= 1.0), axis=1)
        found = np.full(len(points), -np.inf)
        if inside.any():
            costs = np.maximum(self.costs(points[inside]) - least, -0.9 * self.degrees)
            found[inside] = -0.5 * (self.degrees + points.shape[1]) * np.log1p(costs / self.degrees)
        return found


def posterior_density(
    posed: LeastSquaresProblem, point: Array, uncertainty: Uncertainty, linearised: Linearisation
) -> PosteriorDensity:
    """Return the density about an optimum whose covariance is that of ``uncertainty`` where the model is linear."""
    jacobian = sensitivities(posed.residuals, point)
    left, singular, right = np.linalg.svd(jacobian, full_matrices=False)
    kept = singular > RANK_TOLERANCE * max(float(singular[0]), 1e-300)
    turned = right[kept] * singular[kept, None]
    null, spreads = uncertainty.null, uncertainty.spreads[uncertainty.open]
    # along what the data hardly determine the covariance is that of the scores there
    covariance = uncertainty.covariance + (null * np.minimum(spreads, 1e6) ** 2) @ null.T
    gamma = turned @ covariance @ turned.T
    white = residual_power(uncertainty, linearised) * len(left) / posed.samples
    variance = white * float(np.median(variance_factors(uncertainty, linearised)))
    gamma += 1e-9 * float(np.trace(gamma)) / len(gamma) * np.eye(len(gamma))
    return PosteriorDensity(posed, point, left[:, kept], np.linalg.inv(gamma), variance, max(uncertainty.degrees, 3.0))


def draws_of_fit(
    posed: LeastSquaresProblem,
    point: Array,
    uncertainty: Uncertainty,
    linearised: Linearisation,
    linearised_at: Callable[[Assembly, Cube, Array], Linearisation],
    rng: np.random.Generator,
) -> Array:
    """Return draws (D, F) in the cube of a fit, made in the model's reduced parameters where these are fewer.

    Parameters
    ----------
    posed, point
        Folded blocks that were fitted, and the optimum.
    uncertainty, linearised
        Of the fit there.
    linearised_at
        Linearises the fit in other parameters.
    rng
        What draws.
    """
    found = reduced_problem(posed)
    if found is None or len(found[1].cube.free) == len(point):
        return posterior_draws(posterior_density(posed, point, uncertainty, linearised), uncertainty, rng)
    less, way = found
    reduced_point = way.cube.to_points(way.reduced.reduce(posed.cube.to_theta(point[None, :])))[0]
    linearised = linearised_at(less.assembly, less.cube, reduced_point)
    uncertainty = analyse(linearised.jacobians, linearised.residuals, linearised.periods, linearised.share)
    draws = posterior_draws(posterior_density(less, reduced_point, uncertainty, linearised), uncertainty, rng)
    theta = way.reduced.restore(way.cube.to_theta(draws))
    low, high = np.array([(p.low, p.high) for p in posed.cube.params]).T
    within = np.all((theta >= low) & (theta <= high), axis=1)
    # an optimum at a bound has none beyond it; where the inverse leaves the bounds for all, these say nothing
    return posed.cube.to_points(theta[within] if within.any() else theta)


def posterior_draws(density: PosteriorDensity, uncertainty: Uncertainty, rng: np.random.Generator) -> Array:
    """Return draws (D, F) of the posterior in the cube.

    Raises
    ------
    ConfigError
        If the walkers are needed and their sampler is not installed.
    """
    least = float(density.costs(density.point[None, :])[0])
    open_ways = uncertainty.null * np.minimum(uncertainty.spreads[uncertainty.open], WIDEST_START)
    widths = _root(uncertainty.covariance + open_ways @ open_ways.T)
    found = _weighted_draws(density, density.point, widths, least, rng)
    return _ensemble_draws(density, widths, least, rng) if found is None else found


def _weighted_draws(
    density: PosteriorDensity,
    centre: Array,
    widths: Array,
    least: float,
    rng: np.random.Generator,
    *,
    again: bool = True,
) -> Array | None:
    """Return draws (D, F) by importance, of a proposal that follows the first draws where those were too uneven.

    None where its weights are too uneven as well.
    """
    free, degrees = len(centre), min(density.degrees, PROPOSAL_DEGREES)
    points, logarithms, effective = np.empty((0, free)), np.empty(0), 0.0
    while len(points) < PROPOSALS and effective < EFFECTIVE_DRAWS:
        shape = STEPS_AT_ONCE, free
        along = rng.standard_normal(shape) / np.sqrt(rng.chisquare(degrees, (STEPS_AT_ONCE, 1)) / degrees)
        part = centre + PROPOSAL_WIDER * along @ widths.T
        proposed = -0.5 * (degrees + free) * np.log1p(np.sum(along**2, axis=1) / degrees)
        points = np.concatenate([points, part])
        logarithms = np.concatenate([logarithms, density.logarithms(part, least) - proposed])
        weights = np.exp(logarithms - logarithms.max())
        weights /= weights.sum()
        effective = 1.0 / float(np.sum(weights**2))
    if effective >= EFFECTIVE_DRAWS:
        return points[rng.choice(len(points), PROPOSALS, p=weights)]
    if not again or effective < FEWEST_TO_FOLLOW * free:
        return None
    centre = weights @ points
    spread = (points - centre).T * weights @ (points - centre)
    return _weighted_draws(density, centre, _root(spread), least, rng, again=False)


def _root(covariance: Array) -> Array:
    """Return a triangle L with L·Lᵀ = covariance (F, F), which may be singular."""
    return np.linalg.cholesky(covariance + 1e-12 * np.trace(covariance) * np.eye(len(covariance)))


def _ensemble_draws(density: PosteriorDensity, widths: Array, least: float, rng: np.random.Generator) -> Array:
    """Return draws (D, F) by walkers."""
    try:
        from emcee import EnsembleSampler
    except ImportError:
        raise ConfigError("--intervals posterior needs emcee: python -m pip install 'mrfit[posterior]'") from None
    free = len(density.point)
    walkers = max(FEWEST_WALKERS, WALKERS_PER_PARAMETER * free)
    start = density.point + 0.5 * rng.standard_normal((walkers, free)) @ widths.T
    # reflected at the bounds, so that no two walkers lie on one
    start = np.abs(start)
    start = np.clip(np.where(start > 1.0, 2.0 - start, start), 1e-6, 1.0 - 1e-6)
    sampler = EnsembleSampler(walkers, free, lambda points: density.logarithms(points, least), vectorize=True)
    sampler.random_state = np.random.RandomState(int(rng.integers(2**31))).get_state()
    state = start
    for _ in range(MOST_POSTERIOR_STEPS // STEPS_AT_ONCE):
        state = sampler.run_mcmc(state, STEPS_AT_ONCE, skip_initial_state_check=True)
        time = float(np.max(sampler.get_autocorr_time(tol=0)))
        if math.isfinite(time) and sampler.iteration > AUTOCORRELATIONS * time:
            break
    draws: Array = sampler.get_chain(discard=sampler.iteration // 4, flat=True)
    return draws


def posterior_intervals(posed: LeastSquaresProblem, draws: Array) -> dict[str, BootstrapInterval]:
    """Return 95 % intervals of parameters and derived quantities over draws (D, F), open where they fill the bounds."""
    values = posed.cube.to_theta(draws)
    spec = posed.assembly.spec
    ends = np.quantile(np.hstack([values, posed.assembly.derived(values)]), (0.025, 0.975), axis=0)
    names = [*spec.names, *(d.name for d in spec.derived)]
    low, high = np.quantile(draws, (0.025, 0.975), axis=0)
    wide = np.zeros(len(names), dtype=bool)
    wide[posed.cube.free] = high - low > OPEN_SHARE * 0.95
    return {
        name: BootstrapInterval(*((None, None) if w else (float(a), float(b))))
        for name, w, a, b in zip(names, wide, *ends, strict=True)
    }


def posterior_rows(cube: Cube, draws: Array, known: Set[str]) -> Refits:
    """Return some of the draws (D, F) as parameters that the data determine, for figures."""
    chosen = draws[np.linspace(0, len(draws) - 1, min(POSTERIOR_KEPT, len(draws))).astype(np.int64)]
    kept = [k for k in cube.free if cube.params[k].name in known]
    names = [cube.params[k].name for k in kept]
    return Refits(names=names, rows=cube.to_theta(chosen)[:, kept].tolist(), factor=1.0, degrees=float(len(chosen)))
