"""Whole pieces of a signal, between two corners, as one polynomial of the lowest degree that leaves noise."""

import numpy as np

from mrfit.core.specs import Array, Index, Mask

PIECE_ORDER_MAX = 3
# Parts of a piece whose mean residuals tell a bend from noise, and standard errors by which they may do so
POLYNOMIAL_PARTS = 16
MISFIT = 3.0
# Polynomials that differ at a corner by so many times the noise, or as if it were so many samples away, meet there
MEET, MISPLACED = 4.0, 5.0
# Steps in which the place is found
NEWTON = 3


def lowest_polynomials(values: Array, starts: Index, stops: Index, noise: float, derivative: int) -> tuple[Array, Mask]:
    """Return the polynomials or their derivative per sample, (N,), and for which pieces (P,) they leave noise.

    The degree minimises the Bayesian information criterion; the polynomial stands if the means of its residual over 16
    parts of the piece are noise too. Two polynomials that cross at their corner meet there.

    Parameters
    ----------
    values
        Signal (N,).
    starts, stops
        Ranges (P,) of the pieces, which cover the signal.
    noise
        Rms of the white noise.
    derivative
        Order of the derivative.
    """
    lengths = stops - starts
    coefficients = _fitted(values, starts, lengths, noise)
    stands = _leaves_noise(values - _evaluated(coefficients, starts, lengths, starts, 0), starts, lengths, noise)
    met = _meeting(coefficients, starts, lengths, stands, noise)
    return _evaluated(coefficients, starts, lengths, met, derivative), stands


def _fitted(values: Array, starts: Index, lengths: Index, noise: float) -> Array:
    """Return the coefficients (P, 4) over [−1, 1] of each piece's polynomial, from the constant on."""
    half = np.maximum(lengths - 1, 1) / 2.0
    at = (np.arange(len(values)) - np.repeat(starts, lengths)) / np.repeat(half, lengths) - 1.0
    powers = [np.ones(len(at))]
    for _ in range(2 * PIECE_ORDER_MAX):
        powers.append(powers[-1] * at)
    level = np.repeat(np.add.reduceat(values, starts) / lengths, lengths)
    sums = np.stack([np.add.reduceat(p, starts) for p in powers], axis=1)
    moments = np.stack([np.add.reduceat(p * (values - level), starts) for p in powers[: PIECE_ORDER_MAX + 1]], axis=1)
    best = np.full(len(starts), np.inf)
    coefficients = np.zeros((len(starts), PIECE_ORDER_MAX + 1))
    order = np.arange(PIECE_ORDER_MAX + 1)
    for size in range(1, PIECE_ORDER_MAX + 2):
        hankel = sums[:, order[:size, None] + order[None, :size]]
        solution = np.linalg.solve(hankel, moments[:, :size, None])[:, :, 0]
        explained = np.sum(solution * moments[:, :size], axis=1)
        criterion = size * np.log(lengths) - explained / noise**2
        better = criterion < best
        best = np.where(better, criterion, best)
        coefficients[better] = 0.0
        coefficients[better, :size] = solution[better]
    coefficients[:, 0] += level[starts]
    return coefficients


def _evaluated(coefficients: Array, starts: Index, lengths: Index, met: Index, derivative: int) -> Array:
    """Return the polynomials or their derivatives per sample at all samples, each from ``met`` on."""
    samples = int(starts[-1] + lengths[-1])
    shared = np.diff(np.concatenate([met, [samples]]))
    half = np.repeat(np.maximum(lengths - 1, 1) / 2.0, shared)
    at = (np.arange(samples) - np.repeat(starts, shared)) / half - 1.0
    return _at(np.repeat(coefficients, shared, axis=0), at, derivative) / half**derivative


def _meeting(coefficients: Array, starts: Index, lengths: Index, stands: Mask, noise: float) -> Index:
    """Return the pieces' first samples (P,), moved to where neighbouring polynomials cross, if they meet but for noise.

    Where two lines cross is known far better than where noise parts them best.
    """
    half = np.maximum(lengths - 1, 1) / 2.0
    where = starts[1:].astype(np.float64)

    def apart(derivative: int) -> Array:
        before, after = (
            _at(coefficients[side], (where - starts[side]) / half[side] - 1.0, derivative) / half[side] ** derivative
            for side in (slice(None, -1), slice(1, None))
        )
        return after - before

    gap = np.abs(apart(0))
    near = gap <= np.maximum(MEET * noise, MISPLACED * np.abs(apart(1)))
    for _ in range(NEWTON):
        slope = apart(1)
        where = where - np.divide(apart(0), slope, out=np.zeros_like(slope), where=slope != 0.0)
    moves = near & stands[1:] & stands[:-1] & (np.abs(where - starts[1:]) < np.minimum(lengths[1:], lengths[:-1]) / 4)
    met = starts.copy()
    met[1:] = np.where(moves, np.ceil(where), starts[1:])
    return met


def _at(coefficients: Array, at: Array, derivative: int) -> Array:
    """Return polynomials (P, 4) or their derivatives at one place each, (P,)."""
    total = np.zeros(len(at))
    for k in range(PIECE_ORDER_MAX, derivative - 1, -1):
        total = total * at + float(np.prod(np.arange(k - derivative + 1, k + 1))) * coefficients[:, k]
    return total


def _leaves_noise(residual: Array, starts: Index, lengths: Index, noise: float) -> Mask:
    """Return for which pieces the residual is noise, in the small and over a 16th of the piece."""
    cuts = starts[:, None] + lengths[:, None] * np.arange(POLYNOMIAL_PARTS) // POLYNOMIAL_PARTS
    counts = np.diff(np.concatenate([cuts, (starts + lengths)[:, None]], axis=1), axis=1)
    parts = np.maximum(counts, 1)
    means = np.add.reduceat(residual, cuts.reshape(-1)).reshape(cuts.shape) / parts
    # reduceat gives a value, not a sum, for an empty part
    misfit = np.sum(np.where(counts > 0, means**2 * parts, 0.0), axis=1) / noise**2
    used = np.sum(counts > 0, axis=1)
    power = np.add.reduceat(residual**2, starts) / noise**2
    few = misfit <= 1.1 * (used + MISFIT * np.sqrt(2.0 * used))
    leaves: Mask = few & (power <= 1.1 * (lengths + MISFIT * np.sqrt(2.0 * lengths)))
    return leaves
