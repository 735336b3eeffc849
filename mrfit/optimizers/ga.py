"""Real-coded genetic algorithm."""

import math

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Option, Options
from mrfit.optimizers.cost.objective import Objective

ELITE = 2
CROSSOVER_SHARE = 0.8
BLEND = 0.5
# Standard deviation of a mutated component at the first and the last generation, as a share of the cube's edge.
GENE_MUTATION = (0.2, 2e-4)

SPEC = OptimizerSpec(
    name="ga",
    title="Real-coded genetic algorithm: tournaments, blend crossover, shrinking mutation, elite",
    reference="rotary-stiffness paper §5.1 compares with it; blend crossover of Eshelman and Schaffer (1993)",
    kind="global",
    budget=lambda dimension, options: int(options["population"] * options["iterations"]),
    options=(
        Option("population", 40, 1, 10_000, "points that are bred, simulated side by side", whole=True),
        Option("iterations", 800, 1, 1_000_000, "generations, where --budget does not say it", whole=True),
    ),
)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> None:
    """Breed points until the budget is spent, each generation simulated in one batch.

    Parents win tournaments of two; 80 % of the children blend two parents (BLX-0.5), the others copy one; every
    component mutates with probability 1/K by a normal step that shrinks over the run; the best two survive.
    """
    count = max(1, min(int(options["population"]), objective.remaining))
    generations = math.ceil(objective.remaining / count)
    points = rng.random((count, objective.dimension))
    points[0] = objective.best_point
    costs = objective.costs(points)
    first, last = GENE_MUTATION
    for generation in range(1, generations):
        elite = np.argsort(costs, kind="stable")[: min(ELITE, count - 1)]
        children = breed(points, costs, rng, first * (last / first) ** (generation / generations))
        child_costs = objective.costs(children)
        worst = np.argsort(-child_costs, kind="stable")[: len(elite)]
        children[worst], child_costs[worst] = points[elite], costs[elite]
        points, costs = children, child_costs


def breed(points: Array, costs: Array, rng: np.random.Generator, mutation: float) -> Array:
    """Return as many children as there are parents, (P, K) -> (P, K), inside the cube.

    Parameters
    ----------
    points, costs
        Parents (P, K) and their costs (P,).
    rng
        Source of randomness.
    mutation
        Standard deviation of a mutated component.
    """
    count, dimension = points.shape
    entrants = rng.integers(count, size=(2, count, 2))
    winners = np.where(costs[entrants[..., 0]] <= costs[entrants[..., 1]], entrants[..., 0], entrants[..., 1])
    mother, father = points[winners[0]], points[winners[1]]
    shares = rng.uniform(-BLEND, 1.0 + BLEND, (count, dimension))
    blended = rng.random((count, 1)) < CROSSOVER_SHARE
    children = np.where(blended, mother + shares * (father - mother), mother)
    mutated = rng.random((count, dimension)) < 1.0 / dimension
    steps = mutation * rng.standard_normal((count, dimension))
    inside: Array = np.clip(children + np.where(mutated, steps, 0.0), 0.0, 1.0)
    return inside
