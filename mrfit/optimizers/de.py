"""Differential evolution."""

from typing import Any

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Option, Options
from mrfit.optimizers.cost.objective import Objective, Termination

# The least population scipy takes.
GENERATION_MIN = 5
DE_TOLERANCE = 1e-8

SPEC = OptimizerSpec(
    name="de",
    title="Differential evolution (best/1/bin, dithered)",
    reference="Storn and Price (1997); scipy.optimize.differential_evolution",
    kind="global",
    budget=lambda dimension, options: int(options["population"] * options["iterations"]),
    options=(
        Option("population", 40, 5, 10_000, "points that evolve, simulated side by side", whole=True),
        Option("iterations", 800, 1, 1_000_000, "generations, where --budget does not say it", whole=True),
    ),
)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> Termination:
    """Evolve points by scipy's differential evolution, each generation simulated in one batch.

    Ends when the costs of the population agree within 1e-8. One point starts at the best known, the others anywhere.
    """
    from scipy.optimize import Bounds, differential_evolution

    def costs(columns: Array, /) -> Any:
        return objective.costs(columns.T)

    count = max(GENERATION_MIN, min(int(options["population"]), objective.remaining))
    points = rng.random((count, objective.dimension))
    points[0] = objective.best_point
    result = differential_evolution(
        costs,
        Bounds(np.zeros(objective.dimension), np.ones(objective.dimension)),
        maxiter=max(1, objective.remaining),
        tol=DE_TOLERANCE,
        rng=rng,
        polish=False,
        init=points,
        updating="deferred",
        vectorized=True,
    )
    return Termination(str(result.message).rstrip("."))
