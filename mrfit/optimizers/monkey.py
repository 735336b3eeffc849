"""Monkey algorithm."""

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Option, Options
from mrfit.optimizers.cost.objective import Objective

CLIMB_STEPS = 20
# Step length of the climb at the first and the last evaluation, as a share of the cube's edge.
CLIMB_STEP = (0.04, 5e-5)
WATCHES = 5
EYESIGHT = 0.2
SOMERSAULT = (-1.0, 1.0)

SPEC = OptimizerSpec(
    name="monkey",
    title="Monkey algorithm: climb, watch and jump, somersault",
    reference="rotary-stiffness paper §5.1 compares with it; Zhao and Tang (2008)",
    kind="global",
    budget=lambda dimension, options: int(options["population"] * options["iterations"]),
    options=(
        Option("population", 40, 1, 10_000, "monkeys, simulated side by side", whole=True),
        Option("iterations", 800, 1, 1_000_000, "evaluations of each, where --budget does not say it", whole=True),
    ),
)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> None:
    """Let the monkeys climb, watch and jump, climb, and somersault, until the budget is spent.

    All monkeys are simulated together at every step; the climb's step shrinks geometrically with the budget used.

    Source: Zhao and Tang (2008).
    """
    allowed = max(objective.remaining, 1)
    monkeys = rng.random((max(1, min(int(options["population"]), objective.remaining)), objective.dimension))
    monkeys[0] = objective.best_point
    objective.costs(monkeys)
    first, last = CLIMB_STEP
    while True:
        step = first * (last / first) ** (1.0 - objective.remaining / allowed)
        monkeys = climb(objective, monkeys, step, rng)
        monkeys = watch_and_jump(objective, monkeys, rng)
        monkeys = climb(objective, monkeys, step, rng)
        monkeys = somersault(monkeys, rng)


def climb(objective: Objective, monkeys: Array, step: float, rng: np.random.Generator) -> Array:
    """Return the monkeys (P, K) after 20 steps of ``step`` along every axis against the sign of a pseudo-gradient.

    The pseudo-gradient along axis j is [f(x + Δ) - f(x - Δ)] / (2 Δ_j), all components of Δ being ±step at random.
    """
    count = len(monkeys)
    for _ in range(CLIMB_STEPS):
        probe = step * rng.choice([-1.0, 1.0], monkeys.shape)
        costs = objective.costs(np.vstack([monkeys + probe, monkeys - probe]))
        ahead, behind = costs[:count, None], costs[count:, None]
        downhill = np.where(ahead < behind, 1.0, np.where(ahead > behind, -1.0, 0.0))
        monkeys = np.clip(monkeys + downhill * probe, 0.0, 1.0)
    return monkeys


def watch_and_jump(objective: Objective, monkeys: Array, rng: np.random.Generator) -> Array:
    """Return the monkeys (P, K), each at the best of its place and five places within its eyesight."""
    costs = objective.costs(monkeys)
    for _ in range(WATCHES):
        seen = np.clip(monkeys + rng.uniform(-EYESIGHT, EYESIGHT, monkeys.shape), 0.0, 1.0)
        seen_costs = objective.costs(seen)
        better = seen_costs < costs
        monkeys = np.where(better[:, None], seen, monkeys)
        costs = np.where(better, seen_costs, costs)
    return monkeys


def somersault(monkeys: Array, rng: np.random.Generator) -> Array:
    """Return the monkeys (P, K) thrown towards or away from their barycentre by a random share of the distance."""
    shares = rng.uniform(*SOMERSAULT, (len(monkeys), 1))
    thrown: Array = np.clip(monkeys + shares * (monkeys.mean(axis=0) - monkeys), 0.0, 1.0)
    return thrown
