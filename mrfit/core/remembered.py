"""Results of pure functions of a short array, remembered: models and stages ask for those of the same records again."""

from collections.abc import Callable
from functools import lru_cache, update_wrapper
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np

from mrfit.core.specs import Array

# Results remembered of each function, and samples of the longest array: of longer ones they would take much memory
RESULTS, MOST_REMEMBERED = 128, 10_000
P = ParamSpec("P")
R = TypeVar("R")


def remembered(function: Callable[Concatenate[Array, P], R]) -> Callable[Concatenate[Array, P], R]:
    """Decorate a function of an array (N,) and hashable values to remember its last results.

    A result is shared by all who ask for it, so nobody may write into it.
    """

    @lru_cache(RESULTS)
    def of_bytes(values: bytes, *rest: P.args, **named: P.kwargs) -> R:
        return function(np.frombuffer(values), *rest, **named)

    def of_array(values: Array, /, *rest: P.args, **named: P.kwargs) -> R:
        if len(values) > MOST_REMEMBERED:
            return function(values, *rest, **named)
        content = np.asarray(values, dtype=np.float64).tobytes()
        return of_bytes(content, *rest, **named)  # type: ignore[arg-type]  # mypy asks for hashable values

    update_wrapper(of_array, function)
    return of_array
