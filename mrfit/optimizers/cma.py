"""Covariance matrix adaptation."""

from typing import Any

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Options
from mrfit.optimizers.cost.objective import Objective, Termination

FIRST_SPREAD = 0.25
# Costs are told relative to the first finite one, so that the tolerances mean the same for every unit.
CMA_TOLERANCE = 1e-9
# A restart that does not lower the best cost by this share is the last.
RESTART_GAIN = 1e-4

SPEC = OptimizerSpec(
    name="cma",
    title="Covariance matrix adaptation, restarted with doubled populations",
    reference="Hansen and Ostermeier (2001); Auger and Hansen (2005); library `cma`",
    kind="global",
    budget=lambda dimension, options: 2000 * (dimension + 3),
)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> Termination:
    """Run CMA-ES from the best point known, then from random points with twice the population each time.

    Ends after the first restart that brings no gain. Populations are simulated in one batch.

    Source: Auger and Hansen (2005).
    """
    start, population = objective.best_point, 4 + int(3 * np.log(objective.dimension))
    objective.costs(start[None, :])
    before = np.inf
    while objective.best_cost < before * (1.0 - RESTART_GAIN) or not np.isfinite(before):
        before = objective.best_cost
        _evolve(objective, start, population, rng)
        start, population = rng.random(objective.dimension), 2 * population
    return Termination("a restart with twice the population brought no gain")


def strategy_of(start: Array, spread: float, population: int, rng: np.random.Generator, **more: float) -> Any:
    """Return the library's strategy within the unit cube, with more of its options."""
    from cma import CMAEvolutionStrategy

    options = {
        "bounds": [0.0, 1.0],
        "popsize": population,
        # the library draws from the passed generator and leaves numpy's global state alone
        "seed": np.nan,
        "randn": lambda *shape: rng.standard_normal(shape),
        # maximally quiet, and no file in the working directory steers the run
        "verbose": -10,
        **more,
    }
    return CMAEvolutionStrategy(start, spread, options)


def _evolve(objective: Objective, start: Array, population: int, rng: np.random.Generator) -> None:
    # the library does not support one dimension: a second one that changes nothing stands in
    padded = start if objective.dimension > 1 else np.append(start, 0.5)
    strategy = strategy_of(padded, FIRST_SPREAD, population, rng, tolfun=CMA_TOLERANCE, tolx=CMA_TOLERANCE)
    scale = objective.best_cost if 0.0 < objective.best_cost < np.inf else 1.0
    while not strategy.stop():
        points = strategy.ask()
        costs = objective.costs(np.array(points)[:, : objective.dimension]) / scale
        # a finite penalty keeps the library's statistics defined
        worst = np.max(costs, where=np.isfinite(costs), initial=1.0)
        strategy.tell(points, list(np.where(np.isfinite(costs), costs, 10.0 * worst)))
