"""Results of pure functions of an array, remembered: models and stages ask for those of the same records again."""

from collections.abc import Callable
from functools import lru_cache, update_wrapper
from hashlib import blake2b
from typing import Concatenate, ParamSpec, TypeVar

import numpy as np

from mrfit.core.specs import Array

# Results remembered of each function, and samples of the longest array: results of longer ones would take much memory
RESULTS, MOST_REMEMBERED = 128, 10_000
P = ParamSpec("P")
R = TypeVar("R")


class _ArrayDigest:
    """An array that is known by the digest of its content; it is held until a function's result of it is known."""

    def __init__(self, values: Array) -> None:
        self.values = np.ascontiguousarray(values, dtype=np.float64)
        self.digest = blake2b(self.values.data).digest()

    def __hash__(self) -> int:
        return hash(self.digest)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _ArrayDigest) and self.digest == other.digest


def remembered(
    function: Callable[Concatenate[Array, P], R], longest: int = MOST_REMEMBERED
) -> Callable[Concatenate[Array, P], R]:
    """Decorate a function of an array (N,) and hashable values to remember its last results.

    A result is shared by all who ask for it, so nobody may write into it. Those of more than ``longest`` samples are
    not remembered.
    """

    @lru_cache(RESULTS)
    def of_content(content: _ArrayDigest, *rest: P.args, **named: P.kwargs) -> R:
        # a result may hold its array, which the caller may write into
        own = content.values.copy()
        own.flags.writeable = False
        return function(own, *rest, **named)

    def of_array(values: Array, /, *rest: P.args, **named: P.kwargs) -> R:
        if len(values) > longest:
            return function(values, *rest, **named)
        content = _ArrayDigest(values)
        try:
            return of_content(content, *rest, **named)  # type: ignore[arg-type]  # mypy asks for hashable values
        finally:
            content.values = np.empty(0)

    update_wrapper(of_array, function)
    return of_array
