"""Functions of users as the batched responses that a search calls."""

from collections.abc import Callable
from functools import wraps

import numpy as np

from mrfit.core.specs import Array, Response


def quiet(simulate: Response) -> Response:
    """Return the same response without numpy's warnings: what overflows becomes inf or nan, and the search sees it."""

    @wraps(simulate)
    def response(drive: Array, theta: Array, dt: float) -> Array:
        with np.errstate(all="ignore"):
            return simulate(drive, theta, dt)

    return response


def one_by_one(simulate: Callable[[Array, Array, float], Array]) -> Response:
    """Return the batched response of a function of one parameter vector; where it fails in arithmetic, nan."""

    @wraps(simulate)
    def response(drive: Array, theta: Array, dt: float) -> Array:
        output = np.full((len(theta), drive.shape[1]), np.nan)
        with np.errstate(all="ignore"):
            for row, vector in zip(output, theta, strict=True):
                try:
                    row[:] = simulate(drive, vector, dt)
                except ArithmeticError:
                    continue
        return output

    return response
