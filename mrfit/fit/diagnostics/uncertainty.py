"""How far the data determine the parameters: intervals that allow for correlated noise, and what stays open.

The residuals of a simulated model are correlated from sample to sample, so the covariance is the sandwich J⁺ Γ J⁺ᵀ with
Γ the long-run covariance of the scores J_t·e_t (quadratic spectral kernel, bandwidth of Andrews 1991), not σ²(JᵀJ)⁻¹.
The residual is whitened first by its correlation at a lag of one sample (Andrews and Monahan 1992).
Where the drive is periodic, part of the residual repeats from cycle to cycle, as the error of a converter's steps or of
a wrong model does: cycles do not average it out. Γ is that of what differs between cycles, plus whatever the long-run
covariance over one folded cycle, all cycles of a phase summed, has in excess of it and of chance.

A direction of the parameter space along which the 95 % interval is wider than the bounds is not determined by the data:
every parameter that leans on it is reported as unbounded.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.memory import decayed

# Central differences in cube coordinates: truncation ~1e-8, table noise 1e-9 / 1e-4 = 1e-5 of a column
SENSITIVITY_STEP = 1e-4
# A singular value below this share of the largest is rounding, whatever the noise
RANK_TOLERANCE = 3e-6
# Share of it below which an open direction counts as one along which the output does not move
REDUNDANT = 3e-5
# Squared weight on undetermined directions above which a parameter counts as undetermined itself
LEAN = 1e-5
# Score series are summed in blocks to at most this length: the long-run covariance stays, the transform gets shorter
SERIES = 4096
# Most phases of a folded cycle: noise that differs between cycles must not hide how slowly it changes
FOLDED_BINS = 256
# Lag-one correlation beyond which a series holds too few independent samples for its bandwidth to be estimated
LARGEST_RHO, LARGEST_WHITENED = 0.97, 0.999
# Probability that a folded cycle of noise resembles its mirror image so far that its halves count as one
MIRROR_LEVEL = 0.01


@dataclass(frozen=True)
class Linearisation:
    """A fit about its optimum, record by record.

    Attributes
    ----------
    jacobians
        For each record the sensitivities (N_s, F) of weighted residuals in cube coordinates.
    residuals
        For each record the weighted residuals (N_s,).
    periods
        For each record the samples per cycle of its drive, 0 where it is not periodic.
    share
        Share of the samples fitted that these stand for.
    """

    jacobians: list[Array]
    residuals: list[Array]
    periods: list[float]
    share: float = 1.0


@dataclass(frozen=True)
class Uncertainty:
    """Covariance of the free parameters in cube coordinates, split into what the data determine and what they do not.

    Attributes
    ----------
    covariance
        Over the determined directions only, shape (F, F).
    directions
        Orthonormal right singular vectors of the Jacobian as columns, best determined first, shape (F, F).
    open
        Which of them the data leave open, shape (F,).
    spreads
        Standard deviation along each direction in cube coordinates, infinite without any sensitivity, shape (F,).
    singular_values
        Of the Jacobian in cube coordinates, scaled to RMS per sample, shape (F,).
    degrees
        Degrees of freedom: effective number of independent samples less the rank.
    """

    covariance: Array
    directions: Array
    open: Mask
    spreads: Array
    singular_values: Array
    degrees: float

    @property
    def rank(self) -> int:
        """Number of determined directions."""
        return int(np.sum(~self.open))

    @property
    def quantile(self) -> float:
        """Half-width of a 95 % interval in standard deviations."""
        return quantile_95(self.degrees)

    @property
    def redundant(self) -> Mask:
        """Which of the open directions do not move the output at all, whatever the noise, shape (F,)."""
        largest = max(float(self.singular_values.max()), 1e-300)
        return self.open & (self.singular_values <= REDUNDANT * largest)

    @property
    def null(self) -> Array:
        """The directions the data leave open, shape (F, U)."""
        return self.directions[:, self.open]

    def half_width(self, gradient: Array) -> float:
        """Return the 95 % half-width of a quantity with gradient (F,), infinite where the data leave it open."""
        norm = float(gradient @ gradient)
        if norm == 0.0:
            return 0.0
        if self.null.size and float(np.sum((gradient @ self.null) ** 2)) > LEAN * norm:
            return np.inf
        variance = float(np.dot(gradient, self.covariance @ gradient))
        return self.quantile * math.sqrt(max(variance, 0.0))

    def bounded_half_width(self, gradient: Array) -> float:
        """Return the 95 % half-width of a quantity with gradient (F,), its open directions no wider than the cube.

        A direction hardly determined takes a quantity that leans on it a little no further than its bounds allow.
        """
        leaning = (gradient @ self.null) * np.minimum(self.spreads[self.open], 1.0)
        variance = max(float(np.dot(gradient, self.covariance @ gradient)), 0.0) + float(leaning @ leaning)
        return self.quantile * math.sqrt(variance)


def quantile_95(degrees: float) -> float:
    """Return the half-width of a 95 % interval in standard deviations, of Student's t."""
    return float(stdtrit(max(degrees, 1.0), 0.975))


def sensitivities(simulate: Callable[[Array], Array], point: Array) -> Array:
    """Return d(simulate)/d(point) by central differences pointing into the cube: (P, F) -> (P, N) gives (N, F).

    Where a neighbour cannot be simulated, a column is zero: nothing is known along that parameter.
    """
    upper = np.minimum(point + SENSITIVITY_STEP, 1.0)
    lower = np.maximum(point - SENSITIVITY_STEP, 0.0)
    free = len(point)
    points = np.tile(point, (2 * free, 1))
    points[np.arange(free), np.arange(free)] = upper
    points[free + np.arange(free), np.arange(free)] = lower
    rows = simulate(points)
    with np.errstate(invalid="ignore"):
        columns = (rows[:free] - rows[free:]) / (upper - lower)[:, None]
    columns[~np.isfinite(columns).all(axis=1)] = 0.0
    jacobian: Array = columns.T
    return jacobian


def condensed(rows: Array, length: int) -> Array:
    """Return sums over ``length`` neighbouring samples, divided by √length: (P, N) -> (P, N // length).

    Sums of squares and products of slowly varying rows stay, and so does the variance of white noise.
    """
    if length == 1:
        return rows
    whole = rows[:, : rows.shape[1] // length * length]
    sums: Array = whole.reshape(len(rows), -1, length).sum(axis=2)
    return sums / math.sqrt(length)


def analyse(
    jacobians: Sequence[Array], residuals: Sequence[Array], periods: Sequence[float] = (), share: float = 1.0
) -> Uncertainty:
    """Return the uncertainty of a least-squares optimum.

    Parameters
    ----------
    jacobians
        For each independent record the sensitivities (N_s, F) of weighted residuals in cube coordinates.
    residuals
        For each record the weighted residuals (N_s,).
    periods
        For each record the samples per cycle of its drive, 0 where it is not periodic; none at all means the latter.
    share
        Share of the samples fitted that the records stand for.
    """
    samples = sum(len(r) for r in residuals)
    _, found, vt = np.linalg.svd(np.linalg.qr(np.vstack(jacobians), mode="r"))
    directions = vt.T
    # fewer samples than parameters leave directions without a singular value
    singular = np.concatenate([found, np.zeros(len(vt) - len(found))])
    scale = np.where(singular > 0.0, singular, 1.0)
    gamma, degrees = _score_covariance([j @ directions / scale for j in jacobians], residuals, periods)
    usable = singular > RANK_TOLERANCE * max(float(singular[0]), 1e-300)
    inverse = np.where(usable, 1.0 / scale, 0.0)
    covariance = share * (inverse[:, None] * gamma * inverse[None, :])
    spreads = np.where(usable, np.sqrt(np.maximum(np.diag(covariance), 0.0)), np.inf)
    wide = 2 * quantile_95(degrees) * spreads > 1.0
    covariance[wide, :] = 0.0
    covariance[:, wide] = 0.0
    return Uncertainty(
        covariance=directions @ covariance @ directions.T,
        directions=directions,
        open=wide,
        spreads=spreads,
        singular_values=singular / np.sqrt(samples),
        degrees=degrees,
    )


def _score_covariance(
    bases: Sequence[Array], residuals: Sequence[Array], periods: Sequence[float]
) -> tuple[Array, float]:
    """Return the covariance of Σ_t u_t·e_t (F, F) for directions u (N_s, F) orthonormal over all records, and degrees.

    Both parts are widened by n/(n − F), n their effective number of independent samples, for what the fit has taken
    out of the residuals; the degrees are those of Satterthwaite's sum.
    """
    rank = bases[0].shape[1]
    once, within, folded = np.zeros((3, rank, rank))
    worth, phases, uncertain = 0.0, 0.0, 0.0
    for number, (basis, series) in enumerate(zip(bases, residuals, strict=True)):
        period = periods[number] if len(periods) else 0.0
        noise = differing(series, period)
        worth += effective_samples(noise)
        own = innovation_covariance(basis, noise)
        if noise is series:
            once += own
            continue
        within += own
        bins = phase_bins(len(series), period, FOLDED_BINS)
        repeated = np.bincount(bins, series) / np.bincount(bins)
        sums, powers = _by_phase(bins, basis * series[:, None]), _by_phase(bins, basis**2)
        recurring = mirror_factor(repeated) * long_run_covariance(sums, circular=True)
        folded += recurring
        phases += effective_samples(repeated)
        shares = powers / np.maximum(powers.sum(axis=0), 1e-300)
        uncertain += np.trace(recurring) ** 2 * max(bandwidth(sums), 1.0) * float(np.max(np.sum(shares**2, axis=0)))
    wider = worth / max(worth - rank, 1.0)
    noisy = wider * (once + within)
    if phases == 0.0:
        return noisy, worth - rank
    share = rank * uncertain / max(float(np.trace(folded)) ** 2, 1e-300)
    # greatest eigenvalue, less 1, of a unit covariance estimated with a relative variance (Marchenko and Pastur 1967)
    chance = 2.0 * math.sqrt(share) + share
    larger = excess(folded * phases / max(phases - rank, 1.0), wider * within, chance)
    total = float(np.trace(noisy + larger))
    share = float(np.trace(larger)) / total if total > 0.0 else 0.0
    inverse_degrees = share**2 / max(phases - rank, 1.0) + (1.0 - share) ** 2 / max(worth - rank, 1.0)
    return noisy + larger, 1.0 / inverse_degrees


def _by_phase(bins: Index, columns: Array) -> Array:
    """Return the sums over each phase (M, F) of columns (N, F)."""
    return np.stack([np.bincount(bins, c).astype(np.float64) for c in columns.T], axis=1)


def innovation_covariance(basis: Array, series: Array) -> Array:
    """Return the covariance of Σ_t u_t·e_t (F, F) for directions u (N, F) and noise e (N,), whitened as AR(1).

    With e_t = ρ·e_(t−1) + w_t the sum is Σ_t ũ_t·w_t, ũ_t = u_t + ρ·ũ_(t+1), whatever ρ.
    """
    power = float(series @ series)
    rho = float(np.clip(series[1:] @ series[:-1] / power, 0.0, LARGEST_WHITENED)) if power > 0.0 else 0.0
    innovations = series - rho * np.concatenate([[0.0], series[:-1]])
    return long_run_covariance(decayed(np.ascontiguousarray(basis[::-1]), rho)[::-1] * innovations[:, None])


def differing(series: Array, period: float) -> Array:
    """Return what of a series (N,) differs between cycles, scaled to its full variance; all of it below 2 cycles."""
    cycles = len(series) / period if period >= 1.0 else 0.0
    if cycles < 2.0:
        return series
    bins = phase_bins(len(series), period)
    repeated = np.bincount(bins, series) / np.bincount(bins)
    return (series - repeated[bins]) * math.sqrt(cycles / (cycles - 1.0))


def phase_bins(samples: int, period: float, most: int | None = None) -> Index:
    """Return the phase bin of every sample of a series with ``period`` samples per cycle, every bin in use."""
    count = min(int(period), most or samples)
    # slightly later, so that rounding does not move the first sample of a bin to the one before
    bins = np.floor(np.arange(samples) * (count / period) + 1e-6).astype(np.int64) % count
    return np.unique(bins, return_inverse=True)[1].reshape(-1)


def mirror_factor(repeated: Array) -> float:
    """Return 1 + the correlation of a folded residual with its mirror image about the best phase, where significant.

    The steps of a converter err alike on the way up and on the way down, so that two halves of a cycle are worth one.
    """
    power = float(repeated @ repeated)
    if power == 0.0:
        return 1.0
    mirrored = float(np.fft.irfft(np.fft.rfft(repeated) ** 2, len(repeated)).max()) / power
    independent = max(effective_samples(repeated), 2.0)
    # of as many places as there are independent phases, pairs of which count twice
    chance = math.sqrt(2.0 / independent) * float(ndtri(1.0 - MIRROR_LEVEL / independent))
    return 1.0 + mirrored if mirrored > chance else 1.0


def excess(larger: Array, smaller: Array, chance: float = 0.0) -> Array:
    """Return the part of larger − smaller, both (F, F), above chance, in the units of the smaller one's diagonal."""
    unit = np.sqrt(np.maximum(np.diag(smaller), 1e-12 * max(float(np.trace(larger + smaller)), 1e-300)))
    values, vectors = np.linalg.eigh((larger - smaller) / np.outer(unit, unit))
    positive: Array = (vectors * np.where(values > chance, values, 0.0)) @ vectors.T * np.outer(unit, unit)
    return positive


def long_run_covariance(scores: Array, circular: bool = False) -> Array:
    """Return the sum over all lags of the autocovariance of (N, F) scores, times N, shape (F, F), not negative.

    The kernel is the quadratic spectral one, Σ_l k(l/S)·C_l with C_l = Σ_t s_t s_{t+l}ᵀ.

    Parameters
    ----------
    scores
        Series (N, F).
    circular
        Whether the last sample is followed by the first, as in a folded cycle.
    """
    if len(scores) > SERIES:
        # sums of one length: others would be noise of their own
        scores = np.add.reduceat(scores, np.arange(0, len(scores), -(-len(scores) // SERIES)), axis=0)
    samples = len(scores)
    length = samples if circular else 2 * samples
    spectrum = np.fft.rfft(scores, length, axis=0)
    lags = np.minimum(np.arange(length), length - np.arange(length))
    weights = np.maximum(np.fft.rfft(_quadratic_spectral(lags / bandwidth(scores))).real, 0.0)
    weights[1:] *= 2.0
    if length % 2 == 0:
        weights[-1] /= 2.0
    return np.real((spectrum.conj() * weights[:, None]).T @ spectrum) / length


def bandwidth(scores: Array) -> float:
    """Return Andrews' AR(1) plug-in bandwidth of the quadratic spectral kernel for scores (N, F), at most N / 8."""
    lead, lag = scores[1:], scores[:-1]
    power = np.sum(lag**2, axis=0)
    rho = np.clip(np.sum(lead * lag, axis=0) / np.where(power > 0, power, 1.0), -LARGEST_RHO, LARGEST_RHO)
    variance = np.sum((lead - rho * lag) ** 2, axis=0) ** 2
    numerator = float(np.sum(4 * rho**2 * variance / (1 - rho) ** 8))
    denominator = float(np.sum(variance / (1 - rho) ** 4))
    if denominator <= 0.0:
        return 1e-3
    return float(np.clip(1.3221 * (numerator / denominator * len(scores)) ** 0.2, 1e-3, max(len(scores) / 8, 1e-3)))


def _quadratic_spectral(x: Array) -> Array:
    """Return 25/(12π²x²)·(sin y/y − cos y) with y = 6πx/5, 1 at x = 0 (Andrews 1991, eq. 2.7)."""
    far = np.maximum(x, 1e-3)
    y = 1.2 * np.pi * far
    return np.where(x < 1e-3, 1.0, 25.0 / (12.0 * np.pi**2 * far**2) * (np.sin(y) / y - np.cos(y)))


def effective_samples(series: Array) -> float:
    """Return the number of independent samples a residual series is worth, from its lag-one correlation."""
    power = float(series @ series)
    rho = float(series[1:] @ series[:-1]) / power if power > 0 else 0.0
    rho = min(max(rho, 0.0), 0.9999)
    return len(series) * (1 - rho) / (1 + rho)
