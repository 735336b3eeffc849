"""Linear least squares within bounds: what is left of a fit where parameters enter linearly, and of its derivatives."""

import math

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.jit import kernel, part

Projected = tuple[Array, Array, Array, Array, Mask]
Solved = tuple[Array, Array, Array, Mask]

# A pivot below this share of its column's square is rounding: the column is a combination of those before it
_RANK = 1e-12
# What elimination leaves of a row, as a share of its square, that is noise of the differences it comes from
_EXPLAINED = 1e-9
# A gradient below this share of what its terms add up to is rounding
_ROUNDING = 1e-12


@kernel
def eliminate(gram: Array, pivots: Mask) -> None:
    """Eliminate the chosen rows of symmetric matrices in place: the others' block becomes its Schur complement.

    Rows that depend on those eliminated before are passed over. Others of which next to nothing is left become zero.

    Parameters
    ----------
    gram
        Shape (P, K, K).
    pivots
        Which rows to eliminate, shape (P, K).
    """
    for p in range(len(gram)):
        a = gram[p]
        size = len(a)
        squares = np.empty(size)
        for k in range(size):
            squares[k] = a[k, k]
        for k in range(size):
            if not pivots[p, k] or not a[k, k] > _RANK * squares[k]:
                continue
            for i in range(size):
                factor = a[i, k] / a[k, k]
                if i != k and factor != 0.0:
                    for j in range(size):
                        a[i, j] -= factor * a[k, j]
        for k in range(size):
            if not pivots[p, k] and not a[k, k] > _EXPLAINED * squares[k]:
                for j in range(size):
                    a[k, j] = a[j, k] = 0.0


@part
def _step(gram: Array, slope: Array, free: Mask) -> Array:
    """Return the step (K,) of the free weights that takes the gradient ``slope`` away; dependent ones do not move."""
    size = len(slope)
    a, rest = gram.copy(), np.empty(size)
    for k in range(size):
        rest[k] = -slope[k]
    used = np.zeros(size, dtype=np.bool_)
    for k in range(size):
        if not free[k] or not a[k, k] > _RANK * gram[k, k]:
            continue
        used[k] = True
        for i in range(size):
            factor = a[i, k] / a[k, k]
            if i != k and free[i] and factor != 0.0:
                rest[i] -= factor * rest[k]
                for j in range(size):
                    a[i, j] -= factor * a[k, j]
    step = np.zeros(size)
    for k in range(size):
        if used[k]:
            step[k] = rest[k] / a[k, k]
    return step


@kernel
def _gradient(gram: Array, slope: Array, weights: Array) -> Array:
    """Return G·w + b, (K,), with zeros where it is no more than rounding of its terms."""
    size = len(slope)
    gradient = slope.copy()
    for k in range(size):
        terms = abs(slope[k])
        for j in range(size):
            term = gram[k, j] * weights[j]
            gradient[k] += term
            terms += abs(term)
        if abs(gradient[k]) <= _ROUNDING * terms:
            gradient[k] = 0.0
    return gradient


@part
def _most_inward(gradient: Array, gram: Array, weights: Array, free: Mask, low: Array) -> int:
    """Return the held weight that gains most by leaving its bound, -1 if none gains."""
    most, found = 0.0, -1
    for k in range(len(weights)):
        inward = -gradient[k] if weights[k] == low[k] else gradient[k]
        if not free[k] and inward > 0.0 and inward * inward > most * gram[k, k]:
            most, found = inward * inward / gram[k, k], k
    return found


@kernel
def bounded_weights(gram: Array, slope: Array, low: Array, high: Array) -> tuple[Array, Mask]:
    """Return w (P, K) with the least wᵀ·G·w/2 + bᵀ·w and low <= w <= high, and which of them are free of bounds (P, K).

    From w = 0, moved into the bounds, towards the optimum of the weights not held; one that meets a bound is held there
    until the gradient at the optimum of the others points inwards (Stark and Parker 1995). Weights that G does not
    determine stay at 0. Where G or b is not finite, so do all.

    Parameters
    ----------
    gram
        G, shape (P, K, K).
    slope
        b, shape (P, K).
    low, high
        Bounds, shape (K,).
    """
    count, size = slope.shape
    weights, freedom = np.zeros((count, size)), np.ones((count, size), dtype=np.bool_)
    for p in range(count):
        w, free, finite = weights[p], freedom[p], True
        for k in range(size):
            w[k] = min(max(0.0, low[k]), high[k])
            finite = finite and math.isfinite(gram[p, k, k]) and math.isfinite(slope[p, k])
        if not finite:
            continue
        for _ in range(4 * size + 8):
            step = _step(gram[p], _gradient(gram[p], slope[p], w), free)
            share, hit = 1.0, -1
            for k in range(size):
                if w[k] + step[k] < low[k] or w[k] + step[k] > high[k]:
                    reached = ((low[k] if step[k] < 0.0 else high[k]) - w[k]) / step[k]
                    if hit < 0 or reached < share:
                        share, hit = reached, k
            for k in range(size):
                w[k] = min(max(w[k] + share * step[k], low[k]), high[k])
            if hit >= 0:
                w[hit], free[hit] = (low[hit] if step[hit] < 0.0 else high[hit]), False
                continue
            hit = _most_inward(_gradient(gram[p], slope[p], w), gram[p], w, free, low)
            if hit < 0:
                break
            free[hit] = True
    return weights, freedom


@kernel
def projected(rows: Array, still: Array, moving: Index, low: Array, high: Array) -> Projected:
    """Return responses with their best linear parameters: weights, residuals, their root mean square, basis, free ones.

    Parameters
    ----------
    rows
        Residuals at the linear parameters' start, and one step along each of those that move, shape (P, 1 + V, M); more
        rows than these are not read.
    still
        Shares (L, M) of the response one step along each linear parameter; those that move are not read.
    moving
        Places of those that move among the linear ones, shape (V,).
    low, high
        Bounds of the weights in steps, shape (L,), see ``bounded_weights``.
    """
    count, size, samples = len(rows), len(low), rows.shape[2]
    basis, gram = np.empty((count, size, samples)), np.empty((count, size, size))
    slope, residuals, costs = np.empty((count, size)), np.empty((count, samples)), np.empty(count)
    for p in range(count):
        for k in range(len(still)):
            for m in range(samples):
                basis[p, k, m] = still[k, m]
        for v in range(len(moving)):
            for m in range(samples):
                basis[p, moving[v], m] = rows[p, 1 + v, m] - rows[p, 0, m]
        np.dot(basis[p], basis[p].T, gram[p])
        np.dot(basis[p], rows[p, 0], slope[p])
    weights, free = bounded_weights(gram, slope, low, high)
    for p in range(count):
        np.dot(weights[p], basis[p], residuals[p])
        for m in range(samples):
            residuals[p, m] += rows[p, 0, m]
        costs[p] = math.sqrt(np.dot(residuals[p], residuals[p]) / samples)
    return weights, residuals, costs, basis, free


@kernel
def reduced_model(varied: Array, steps: Array, solved: Solved) -> tuple[Array, Array]:
    """Return Jᵀr (P, F) and JᵀJ (P, F, F) per residual of projected residuals r, by Kaufman's approximation.

    Parameters
    ----------
    varied
        Residuals one step along each parameter at the same linear ones, the last F of the rows, shape (P, ≥ F, M).
    steps
        The steps, shape (P, F).
    solved
        What they are compared with and differ from (P, M); basis (P, L, M) and free ones (P, L) of the linear ones.
    """
    base, residuals, basis, free = solved
    count, dimension = steps.shape
    size, samples, first = basis.shape[1], varied.shape[2], varied.shape[1] - dimension
    gram, gradients = np.empty((count, size + dimension, size + dimension)), np.empty((count, dimension))
    pivots = np.zeros((count, size + dimension), dtype=np.bool_)
    whole = np.empty((size + dimension, samples))
    for p in range(count):
        for k in range(size):
            pivots[p, k] = True
            for m in range(samples):
                whole[k, m] = basis[p, k, m] if free[p, k] else 0.0
        for f in range(dimension):
            total = 0.0
            for m in range(samples):
                whole[size + f, m] = (varied[p, first + f, m] - base[p, m]) / steps[p, f]
                total += whole[size + f, m]
            if not math.isfinite(total):
                for m in range(samples):
                    whole[size + f, m] = 0.0
        np.dot(whole, whole.T, gram[p])
        slope = np.dot(whole[size:], residuals[p])
        for f in range(dimension):
            gradients[p, f] = slope[f] / samples
    eliminate(gram, pivots)
    curvatures = np.empty((count, dimension, dimension))
    for p in range(count):
        for f in range(dimension):
            for j in range(dimension):
                curvatures[p, f, j] = gram[p, size + f, size + j] / samples
    return gradients, curvatures


@kernel
def with_last_share(rows: Array, rest: Array, ratios: Array) -> Array:
    """Return residuals (Q, 1 + V, M) of which the last row, one step along the last of V linear parameters, is missing.

    A response without a constant part is the sum of the parameters' values times their shares, so the residuals at the
    start, less ``rest``, are those values times the shares of the parameters that move.

    Parameters
    ----------
    rows
        Residuals at the linear parameters' start, and one step along each of those that move but the last, (Q, V, M).
    rest
        Residuals with the parameters that move at zero, and the others at their start, shape (M,).
    ratios
        Start values of those that move in their steps, shape (V,).
    """
    count, places, samples = rows.shape
    out = np.empty((count, places + 1, samples))
    for q in range(count):
        for v in range(places):
            for m in range(samples):
                out[q, v, m] = rows[q, v, m]
        last = out[q, places]
        for m in range(samples):
            last[m] = rows[q, 0, m] - rest[m]
        for v in range(1, places):
            for m in range(samples):
                last[m] -= ratios[v - 1] * (rows[q, v, m] - rows[q, 0, m])
        for m in range(samples):
            last[m] = rows[q, 0, m] + last[m] / ratios[places - 1]
    return out


@kernel
def affine_model(
    rows: Array, still: Array, moving: Index, bounds: tuple[Array, Array], steps: Array
) -> tuple[Array, Array, Array]:
    """Return costs (P,), Jᵀr (P, F) and JᵀJ (P, F, F) per residual of projected residuals, as ``reduced_model``.

    Parameters
    ----------
    rows
        Residuals at each point and one step along each of its F parameters, there at the linear parameters' start and
        one step along each of those that move, shape (P, 1 + F, 1 + V, M).
    still, moving, bounds
        As ``projected`` takes them.
    steps
        The steps, shape (P, F).
    """
    count, stencil, places, samples = rows.shape
    weights, residuals, costs, basis, free = projected(rows[:, 0].copy(), still, moving, bounds[0], bounds[1])
    varied = np.empty((count, stencil - 1, samples))
    for p in range(count):
        rest = np.zeros(samples)
        share = 1.0
        for v in range(places - 1):
            share -= weights[p, moving[v]]
        for k in range(len(still)):
            moves = False
            for v in range(places - 1):
                moves = moves or moving[v] == k
            if not moves:
                for m in range(samples):
                    rest[m] += weights[p, k] * still[k, m]
        for f in range(stencil - 1):
            for m in range(samples):
                varied[p, f, m] = rest[m] + share * rows[p, 1 + f, 0, m]
            for v in range(places - 1):
                for m in range(samples):
                    varied[p, f, m] += weights[p, moving[v]] * rows[p, 1 + f, 1 + v, m]
    gradients, curvatures = reduced_model(varied, steps, (residuals, residuals, basis, free))
    return costs, gradients, curvatures
