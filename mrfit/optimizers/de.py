"""Differential evolution."""

from typing import Any

import numpy as np

from mrfit.objective import Objective
from mrfit.specs import Array, OptimizerSpec

POPULATION = 40
GENERATIONS = 800
# The least population scipy takes.
SMALLEST = 5
TOLERANCE = 1e-8

SPEC = OptimizerSpec(
    name="de",
    title="Differential evolution (best/1/bin, dithered)",
    reference="Storn and Price (1997); scipy.optimize.differential_evolution",
    kind="global",
    budget=lambda dimension: POPULATION * GENERATIONS,
)


def minimise(objective: Objective, rng: np.random.Generator) -> None:
    """Evolve 40 points by scipy's differential evolution, each generation simulated in one batch.

    Ends when the costs of the population agree within 1e-8. One point starts at the best known, the others anywhere.
    """
    from scipy.optimize import Bounds, differential_evolution

    def costs(columns: Array, /) -> Any:
        return objective.costs(columns.T)

    count = max(SMALLEST, min(POPULATION, objective.remaining))
    points = rng.random((count, objective.dimension))
    points[0] = objective.best_point
    result = differential_evolution(
        costs,
        Bounds(np.zeros(objective.dimension), np.ones(objective.dimension)),
        maxiter=max(1, objective.remaining),
        tol=TOLERANCE,
        rng=rng,
        polish=False,
        init=points,
        updating="deferred",
        vectorized=True,
    )
    objective.verdict = str(result.message).rstrip(".")
