"""What a search may use, and how it tells what it has found so far."""

import time
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from mrfit.settings.fit import PATIENCE

ProgressCallback = Callable[[int, float], None]
"""Called as ``told(evaluations, best_cost)`` after every batch."""


class Limits(NamedTuple):
    """Evaluations and seconds of a whole search, None for no limit of its own, and when it stalls."""

    budget: int | None = None
    seconds: float | None = None
    stall: float = PATIENCE


UNLIMITED = Limits()


class SearchContext(NamedTuple):
    """What a whole search has: randomness, limits, ``time.monotonic`` when it began, whom to tell."""

    rng: np.random.Generator
    limits: Limits
    begin: float
    on_progress: ProgressCallback

    @property
    def deadline(self) -> float | None:
        """Reading of ``time.monotonic`` at which the search ends; None for none."""
        return None if self.limits.seconds is None else self.begin + self.limits.seconds


def seconds_left(deadline: float | None) -> float | None:
    """Return the seconds to a deadline of ``time.monotonic``, as limits have them: more than none; None for none."""
    return None if deadline is None else max(deadline - time.monotonic(), 1e-3)


def offset_progress(before: int, told: ProgressCallback) -> ProgressCallback:
    """Return how a part of a search tells of itself that began after so many evaluations."""
    return lambda evaluations, cost: told(before + evaluations, cost)


def no_progress(evaluations: int, cost: float) -> None:
    """Tell nobody."""


def own_generator(rng: np.random.Generator, purpose: str) -> np.random.Generator:
    """Return the generator of a part of a search: it depends on the search's seed, not on what was drawn from it."""
    seed: Any = rng.bit_generator.seed_seq
    return np.random.default_rng([*np.atleast_1d(seed.entropy).tolist(), *seed.spawn_key, *f" {purpose}".encode()])
