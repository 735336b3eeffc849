"""Whale optimization with a sigmoid coefficient and the immune operation."""

import math

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Option, Options
from mrfit.optimizers.cost.objective import InParameters
from mrfit.optimizers.woa import B_TEXT, WHALE_MOVES, WHALE_POPULATION, first_swarm, swim

# Standard deviation of a clone about its antibody, as a share of the bounds; the paper gives none.
WHALE_MUTATION = 0.05

SPEC = OptimizerSpec(
    name="mwoa",
    title="Modified whale optimization: sigmoid coefficient and immune operation",
    reference="rotary-stiffness paper eqs 7-18",
    kind="global",
    budget=lambda dimension, options: int(options["population"] * options["iterations"]),
    options=(
        Option("b", 1.2, 0.0, 10.0, B_TEXT),
        WHALE_POPULATION,
        WHALE_MOVES,
        Option("N_d", 30, 1, 1_000_000, "iterations without a gain before the immune operation", whole=True),
        Option("M", 10, 1, 10_000, "antibodies of the immune operation, at most half the whales", whole=True),
    ),
    coordinates="parameters",
)


def minimise(objective: InParameters, rng: np.random.Generator, options: Options) -> None:
    """Move the whales until the budget is spent, a = 2 exp(-10 (n/N)⁴); stir them after N_d iterations without a gain.

    Source: rotary-stiffness paper §4.2 and 4.3.
    """
    whales = first_swarm(objective, int(options["population"]), rng)
    iterations = math.ceil(objective.remaining / len(whales))
    spread = WHALE_MUTATION * (objective.high - objective.low)
    idle = 0
    for iteration in range(iterations):
        before = objective.best_cost
        costs = objective.costs(whales)
        idle = 0 if objective.best_cost < before else idle + 1
        if idle >= options["N_d"]:
            whales, idle = immune_operation(whales, costs, int(options["M"]), spread, rng), 0
        coefficient = 2.0 * math.exp(-10.0 * (iteration / iterations) ** 4)
        moved = swim(whales, objective.best_values, coefficient, options["b"], rng)
        whales = np.clip(moved, objective.low, objective.high)


def immune_operation(whales: Array, costs: Array, most: int, spread: Array, rng: np.random.Generator) -> Array:
    """Return the swarm (P, K) with its worst whales replaced by mutated clones of selected antibodies.

    Antibodies are the best whales, at most M and at most half the swarm; as many of the worst are replaced. A clone's
    antibody is drawn with the probability of `selection_probabilities`.

    Parameters
    ----------
    whales, costs
        Positions (P, K) and their costs (P,).
    most
        M.
    spread
        Standard deviation (K,) of a clone about its antibody.
    rng
        Source of randomness.

    Source: rotary-stiffness paper §4.3 step 7.
    """
    order = np.argsort(costs, kind="stable")
    count = min(most, len(whales) // 2)
    if not count:
        return whales
    antibodies = order[:count]
    chosen = rng.choice(antibodies, size=count, p=selection_probabilities(costs[antibodies]))
    stirred = whales.copy()
    stirred[order[-count:]] = whales[chosen] + spread * rng.standard_normal((count, whales.shape[1]))
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
    return proximities / total if total > 0.0 else np.full(len(costs), 1.0 / len(costs))
