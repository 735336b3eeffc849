"""Points of the unit cube: the parameters they stand for, and their neighbours for differences."""

import math

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.jit import kernel


@kernel
def spread_out(points: Array, free: Index, held: Array, ranges: Array, logarithmic: Mask) -> Array:
    """Return parameter vectors (P, K): the free ones at points (P, F) of the cube, the others as held.

    Parameters
    ----------
    points
        Shape (P, F).
    free
        Columns of the free parameters, shape (F,).
    held
        Values of all parameters, shape (K,).
    ranges
        Values or logarithms at 0 and 1 of the cube, lower and upper bounds, shape (4, F).
    logarithmic
        Which of the free parameters go by their logarithm, shape (F,).
    """
    theta = np.empty((len(points), len(held)))
    for p in range(len(points)):
        for k in range(len(held)):
            theta[p, k] = held[k]
        for f in range(len(free)):
            value = ranges[0, f] + (ranges[1, f] - ranges[0, f]) * points[p, f]
            if logarithmic[f]:
                value = math.exp(value)
            theta[p, free[f]] = min(max(value, ranges[2, f]), ranges[3, f])
    return theta


@kernel
def varied_stencils(theta: Array, columns: Index, values: Array) -> Array:
    """Return parameter vectors (Q*(1 + V), K) of some (Q, K): each as it is, then with each of some parameters moved.

    Parameters
    ----------
    theta
        Shape (Q, K).
    columns, values
        The parameters moved, and where to, shape (V,).
    """
    count = 1 + len(columns)
    out = np.empty((len(theta) * count, theta.shape[1]))
    for q in range(len(theta)):
        for v in range(count):
            for k in range(theta.shape[1]):
                out[q * count + v, k] = theta[q, k]
            if v > 0:
                out[q * count + v, columns[v - 1]] = values[v - 1]
    return out


@kernel
def stencils(points: Array, step: float) -> tuple[Array, Array]:
    """Return every point in the cube followed by its K one-sided neighbours (P, K + 1, K), and the signed steps (P, K).

    Steps lead towards the middle.
    """
    count, size = points.shape
    around, steps = np.empty((count, size + 1, size)), np.empty((count, size))
    for p in range(count):
        for k in range(size):
            value = min(max(points[p, k], 0.0), 1.0)
            steps[p, k] = -step if value > 0.5 else step
            for j in range(size + 1):
                around[p, j, k] = value
            around[p, 1 + k, k] = value + steps[p, k]
    return around, steps
