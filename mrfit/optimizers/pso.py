"""Particle swarm optimization."""

import math

import numpy as np

from mrfit.core.specs import OptimizerSpec, Option, Options
from mrfit.optimizers.cost.objective import Objective

SPEC = OptimizerSpec(
    name="pso",
    title="Particle swarm with falling inertia and shifting accelerations",
    reference="Tang et al. eqs 6-10 (8 and 9 as corrected); accelerations of Ratnaweera et al. (2004)",
    kind="global",
    budget=lambda dimension, options: int(options["population"] * options["iterations"]),
    # the paper names the constants without giving values
    options=(
        Option("population", 40, 1, 10_000, "particles, simulated side by side", whole=True),
        Option("iterations", 400, 1, 1_000_000, "times they move, where --budget does not say it", whole=True),
        Option("w_max", 0.9, 0.0, 2.0, "inertia at the start, eq. 10"),
        Option("w_min", 0.4, 0.0, 2.0, "inertia at the end"),
        Option("c1_0", 2.5, 0.0, 10.0, "acceleration towards a particle's own best at the start, eq. 8"),
        Option("c1_end", 0.5, 0.0, 10.0, "the same at the end"),
        Option("c2_0", 0.5, 0.0, 10.0, "acceleration towards the swarm's best at the start, eq. 9"),
        Option("c2_end", 2.5, 0.0, 10.0, "the same at the end"),
        Option("v_max", 0.2, 1e-6, 1.0, "largest step, as a share of the bounds"),
    ),
)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> None:
    """Move particles through the cube until the budget is spent, all of them simulated in one batch per iteration.

    v(t+1) = ω v(t) + c1 r1 (p_best - x) + c2 r2 (g_best - x);  x(t+1) = x(t) + v(t+1), with
    ω = ω_max - (ω_max - ω_min) t/T and c = c_start + (c_end - c_start) t/T, r1 and r2 uniform per component.
    Velocities are clamped to ±v_max; a particle that would leave the cube stops at its wall. One particle starts at the
    best point known, the others anywhere.

    Source: Tang et al. eqs 6-10.
    """
    dimension = objective.dimension
    count, v_max = max(1, min(int(options["population"]), objective.remaining)), options["v_max"]
    iterations = math.ceil(objective.remaining / count)
    positions = rng.random((count, dimension))
    positions[0] = objective.best_point
    velocities = rng.uniform(-v_max, v_max, (count, dimension))
    own_costs, own_points = objective.costs(positions), positions.copy()
    for iteration in range(1, iterations):
        inertia, cognitive, social = coefficients(options, iteration / iterations)
        own_pull = cognitive * rng.random((count, dimension)) * (own_points - positions)
        social_pull = social * rng.random((count, dimension)) * (objective.best_point - positions)
        velocities = np.clip(inertia * velocities + own_pull + social_pull, -v_max, v_max)
        moved = positions + velocities
        positions = np.clip(moved, 0.0, 1.0)
        velocities[positions != moved] = 0.0
        costs = objective.costs(positions)
        better = costs < own_costs
        own_costs[better], own_points[better] = costs[better], positions[better]


def coefficients(options: Options, progress: float) -> tuple[float, float, float]:
    """Return inertia ω, c1 and c2 at progress t/T from 0 to 1, each running linearly from its first to its last value.

    Source: Tang et al. eq. 10; eqs 8 and 9 with first and last value in the order their names say.
    """
    ends = (("w_max", "w_min"), ("c1_0", "c1_end"), ("c2_0", "c2_end"))
    inertia, cognitive, social = (options[a] + (options[b] - options[a]) * progress for a, b in ends)
    return inertia, cognitive, social
