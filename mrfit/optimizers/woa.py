"""Whale optimization algorithm."""

import math

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Option, Options
from mrfit.optimizers.cost.objective import InParameters

WHALE_POPULATION = Option("population", 40, 1, 10_000, "whales, simulated side by side", whole=True)
WHALE_MOVES = Option("iterations", 800, 1, 1_000_000, "times they move, where --budget does not say it", whole=True)
B_TEXT = "shape of the logarithmic spiral, eq. 11"

SPEC = OptimizerSpec(
    name="woa",
    title="Whale optimization with linearly falling coefficient",
    reference="rotary-stiffness paper eqs 7-14; Mirjalili and Lewis (2016)",
    kind="global",
    budget=lambda dimension, options: int(options["population"] * options["iterations"]),
    options=(Option("b", 1.0, 0.0, 10.0, B_TEXT), WHALE_POPULATION, WHALE_MOVES),
    # C X pulls towards the origin: in the cube that would be every lower bound
    coordinates="parameters",
)


def minimise(objective: InParameters, rng: np.random.Generator, options: Options) -> None:
    """Move the whales until the budget is spent, a = 2 (1 - n/N) in eq. 9; see `swim`.

    Source: rotary-stiffness paper §4.1.
    """
    whales = first_swarm(objective, int(options["population"]), rng)
    iterations = math.ceil(objective.remaining / len(whales))
    for iteration in range(iterations):
        objective.costs(whales)
        coefficient = 2.0 * (1.0 - iteration / iterations)
        moved = swim(whales, objective.best_values, coefficient, options["b"], rng)
        whales = np.clip(moved, objective.low, objective.high)


def first_swarm(objective: InParameters, population: int, rng: np.random.Generator) -> Array:
    """Return the first parameter vectors (P, K): one whale at the best known, the others anywhere."""
    count = max(1, min(population, objective.remaining))
    whales = objective.anywhere(count, rng)
    whales[0] = objective.best_values
    return whales


def swim(whales: Array, prey: Array, coefficient: float, spiral_shape: float, rng: np.random.Generator) -> Array:
    """Return the next positions of a swarm, (P, K) -> (P, K), not held within bounds.

    With A = 2 a r - a and C = 2 r: half of the whales follow the spiral X' = |X_opt - X| e^(b l) cos(2π l) + X_opt, l
    uniform in (-1, 1); the others X' = X_ref - A |C X_ref - X|, where X_ref is the prey if |A| < 1 and another whale
    if not. A is one number per whale, since the choice of the branch needs one; C is drawn per component.

    Parameters
    ----------
    whales
        Positions (P, K).
    prey
        Best position so far (K,).
    coefficient
        a, falling from 2 to 0.
    spiral_shape
        b.
    rng
        Source of randomness.

    Source: rotary-stiffness paper eqs 7-14.
    """
    count, dimension = whales.shape
    reach = coefficient * (2.0 * rng.random((count, 1)) - 1.0)
    weights = 2.0 * rng.random((count, dimension))
    companions = whales[rng.integers(count, size=count)]
    reference = np.where(np.abs(reach) < 1.0, prey, companions)
    encircling = reference - reach * np.abs(weights * reference - whales)
    turns = rng.uniform(-1.0, 1.0, (count, 1))
    spiral = np.abs(prey - whales) * np.exp(spiral_shape * turns) * np.cos(2.0 * np.pi * turns) + prey
    return np.where(rng.random((count, 1)) < 0.5, encircling, spiral)
