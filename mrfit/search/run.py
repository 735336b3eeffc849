"""The one way into a search: a problem, start points, limits and randomness in, where the search ended out."""

import time

import numpy as np

from mrfit.core.specs import Array
from mrfit.search import chain, strategies
from mrfit.search.limits import Limits, ProgressCallback, SearchContext, no_progress
from mrfit.search.problem import Problem
from mrfit.search.result import SearchResult


def run(
    problem: Problem,
    starts: Array,
    limits: Limits,
    rng: np.random.Generator,
    strategy: str | strategies.Strategy = "auto",
    on_progress: ProgressCallback = no_progress,
) -> SearchResult:
    """Return where a strategy ends that looks for the least cost of a problem over the unit cube.

    Parameters
    ----------
    problem
        Residuals over the cube; ``auto`` and ``staged`` need to know what they are made of, see
        ``problem.LeastSquaresProblem``.
    starts
        Start points (S, F) of the cube.
    limits
        Evaluations and seconds of the whole search, and when it stalls.
    rng
        Source of all randomness. Without a limit in seconds the result depends on nothing else.
    strategy
        As written by the user (``auto``, ``staged``, ``pso-fmin``), or a strategy itself.
    on_progress
        Called as ``on_progress(evaluations, best_cost)`` after every batch.

    Raises
    ------
    ConfigError
        If there is no such strategy, or a limit is not positive.
    """
    chain.check(limits)
    chosen = strategies.find(strategy) if isinstance(strategy, str) else strategy
    return chosen.search(problem, starts, SearchContext(rng, limits, time.monotonic(), on_progress))
