"""Shapes of parameters in a response: one value per vector, or one per vector and sample."""

from collections.abc import Callable

import numpy as np

from mrfit.core.specs import Array, Index

# Values per block of rows: three or four temporaries of this size stay in a core's level 2 cache.
_BLOCK = 1 << 14


def columns(theta: Array) -> tuple[Array, ...]:
    """Return every parameter in a shape that broadcasts against drive channels of shape (N,).

    Parameters
    ----------
    theta
        Parameter vectors, shape (P, K), or with values that vary along the samples, shape (P, K, N).

    Returns
    -------
    tuple
        K arrays of shape (P, 1) or (P, N).
    """
    return tuple(theta[:, k, None] if theta.ndim == 2 else theta[:, k] for k in range(theta.shape[1]))


def evaluate(formula: Callable[..., Array], drive: Array, theta: Array) -> Array:
    """Return a memoryless model's response, block of rows by block of rows.

    Parameters
    ----------
    formula
        ``formula(*channels, *parameters)`` of broadcasting arrays, channels (N,), parameters (rows, 1) or (rows, N).
    drive
        Channels, shape (C, N).
    theta
        Parameters, shape (P, K) or (P, K, N).

    Returns
    -------
    Array
        Shape (P, N).
    """
    return by_blocks(lambda block: formula(*drive, *columns(block)), drive.shape[1], theta)


def by_blocks(simulate: Callable[[Array], Array], samples: int, theta: Array) -> Array:
    """Return simulate(theta), (P, N), a few rows of theta at a time: what it allocates then stays small and warm."""
    return by_rows(lambda rows: simulate(theta[rows]), samples, len(theta))


def distinct(theta: Array) -> tuple[Index | slice, Index | slice]:
    """Return the first of equal rows of theta (P, K), and the place of each row: theta[first][places] is theta.

    Derivatives are taken from many points. Most of them change parameters of another part of the model.
    """
    if len(theta) == 1:
        return slice(None), slice(None)
    numbers: dict[bytes, int] = {}
    places = np.array([numbers.setdefault(row.tobytes(), len(numbers)) for row in theta])
    if len(numbers) == len(theta):
        return slice(None), slice(None)
    return np.unique(places, return_index=True)[1], places


def by_rows(simulate: Callable[[slice], Array], samples: int, count: int) -> Array:
    """Return the rows (P, N) that simulate(slice) makes of so many points, a few of them at a time."""
    rows = max(1, _BLOCK // max(samples, 1))
    with np.errstate(over="ignore", invalid="ignore", divide="ignore", under="ignore"):
        if count <= rows:
            return simulate(slice(count))
        out = np.empty((count, samples))
        for first in range(0, count, rows):
            block = slice(first, first + rows)
            out[block] = simulate(block)
    return out


def plain(values: Array) -> Array:
    """Return the values C-contiguous and writeable, copied if need be: kernels compile once, for that layout only."""
    return values if values.flags.c_contiguous and values.flags.writeable else values.copy()


def along_samples(theta: Array) -> Array:
    """Return theta as (K, P, M) for kernels: M = 1 where a vector's values hold for all samples, else M = N."""
    return np.ascontiguousarray(np.swapaxes(theta if theta.ndim == 3 else theta[:, :, None], 0, 1))


def once(x: Array) -> Array:
    """Return a signal (N,), or its first value (1,) where it does not change."""
    return x[:1] if np.all(x == x[0]) else x
