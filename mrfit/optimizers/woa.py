"""Whale optimization algorithm."""

import math

import numpy as np

from mrfit.objective import Objective
from mrfit.specs import Array, OptimizerSpec

WHALES = 40
ITERATIONS = 800
SPIRAL_SHAPE = 1.0

SPEC = OptimizerSpec(
    name="woa",
    title="Whale optimization with linearly falling coefficient",
    reference="rotary-stiffness paper eqs 7-14; Mirjalili and Lewis (2016)",
    kind="global",
    budget=lambda dimension: WHALES * ITERATIONS,
)


def minimise(objective: Objective, rng: np.random.Generator) -> None:
    """Move 40 whales until the budget is spent, a = 2 (1 - n/N) in eq. 9; see `swim`.

    Source: rotary-stiffness paper §4.1.
    """
    whales = first_swarm(objective, rng)
    iterations = math.ceil(objective.remaining / len(whales))
    for iteration in range(iterations):
        objective.costs(whales)
        whales = swim(whales, objective.best_point, 2.0 * (1.0 - iteration / iterations), SPIRAL_SHAPE, rng)


def first_swarm(objective: Objective, rng: np.random.Generator) -> Array:
    """Return the first positions (P, K): one whale at the best point known, the others anywhere in the cube."""
    whales = rng.random((max(1, min(WHALES, objective.remaining)), objective.dimension))
    whales[0] = objective.best_point
    return whales


def swim(whales: Array, prey: Array, coefficient: float, spiral_shape: float, rng: np.random.Generator) -> Array:
    """Return the next positions of a swarm, (P, K) -> (P, K), clipped into the cube.

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
    moved: Array = np.clip(np.where(rng.random((count, 1)) < 0.5, encircling, spiral), 0.0, 1.0)
    return moved
