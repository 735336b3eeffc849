"""Whale optimization with a sigmoid coefficient and the immune operation."""

import math

import numpy as np

from mrfit.objective import Objective
from mrfit.optimizers.woa import ITERATIONS, WHALES, first_swarm, swim
from mrfit.specs import Array, OptimizerSpec

SPIRAL_SHAPE = 1.2
IDLE_ITERATIONS = 30
ANTIBODIES = 10
# Standard deviation of a clone about its antibody, as a share of the cube's edge; the paper gives none.
MUTATION = 0.05

SPEC = OptimizerSpec(
    name="mwoa",
    title="Modified whale optimization: sigmoid coefficient and immune operation",
    reference="rotary-stiffness paper eqs 7-18",
    kind="global",
    budget=lambda dimension: WHALES * ITERATIONS,
)


def minimise(objective: Objective, rng: np.random.Generator) -> None:
    """Move 40 whales until the budget is spent, a = 2 exp(-10 (n/N)⁴); stir them after 30 iterations without a gain.

    Source: rotary-stiffness paper §4.2 and 4.3.
    """
    whales = first_swarm(objective, rng)
    iterations = math.ceil(objective.remaining / len(whales))
    idle = 0
    for iteration in range(iterations):
        before = objective.best_cost
        costs = objective.costs(whales)
        idle = 0 if objective.best_cost < before else idle + 1
        if idle >= IDLE_ITERATIONS:
            whales, idle = immune_operation(whales, costs, rng), 0
        coefficient = 2.0 * math.exp(-10.0 * (iteration / iterations) ** 4)
        whales = swim(whales, objective.best_point, coefficient, SPIRAL_SHAPE, rng)


def immune_operation(whales: Array, costs: Array, rng: np.random.Generator) -> Array:
    """Return the swarm (P, K) with its worst whales replaced by mutated clones of selected antibodies.

    Antibodies are the best whales, at most 10 and at most half the swarm; as many of the worst are replaced. A clone's
    antibody is drawn with the probability of `selection_probabilities`.

    Source: rotary-stiffness paper §4.3 step 7.
    """
    order = np.argsort(costs, kind="stable")
    count = min(ANTIBODIES, len(whales) // 2)
    if not count:
        return whales
    antibodies = order[:count]
    chosen = rng.choice(antibodies, size=count, p=selection_probabilities(costs[antibodies]))
    stirred = whales.copy()
    mutation = MUTATION * rng.standard_normal((count, whales.shape[1]))
    stirred[order[-count:]] = np.clip(whales[chosen] + mutation, 0.0, 1.0)
    return stirred


def selection_probabilities(costs: Array) -> Array:
    """Return the probability of each antibody to be cloned, costs (M,) -> (M,): rare costs are preferred.

    sp_i = p_i / Σ p_i with the proximity p_i = Σ_j |f_i - f_j|; the same for all where all costs are equal. Infinite
    costs count as the largest finite one.

    Source: rotary-stiffness paper eqs 16 and 18.
    """
    finite = np.where(np.isfinite(costs), costs, np.max(costs, where=np.isfinite(costs), initial=0.0))
    scaled = finite / max(float(finite.max()), 1e-300)
    proximities = np.abs(scaled[:, None] - scaled).sum(axis=1)
    total = proximities.sum()
    probabilities: Array = proximities / total if total > 0.0 else np.full(len(costs), 1.0 / len(costs))
    return probabilities
