"""Particle swarm optimization."""

import math

import numpy as np

from mrfit.objective import Objective
from mrfit.specs import OptimizerSpec

PARTICLES = 40
ITERATIONS = 400

SPEC = OptimizerSpec(
    name="pso",
    title="Particle swarm with falling inertia and shifting accelerations",
    reference="Tang et al. eqs 6-10 (8 and 9 as corrected); accelerations of Ratnaweera et al. (2004)",
    kind="global",
    budget=lambda dimension: PARTICLES * ITERATIONS,
)

# (first, last) value over the run; the paper names the quantities without giving values.
INERTIA = (0.9, 0.4)
COGNITIVE = (2.5, 0.5)
SOCIAL = (0.5, 2.5)
# Largest velocity component, as a share of the cube's edge.
SPEED_LIMIT = 0.2


def minimise(objective: Objective, rng: np.random.Generator) -> None:
    """Move 40 particles through the cube until the budget is spent, all of them simulated in one batch per iteration.

    v(t+1) = ω v(t) + c1 r1 (p_best - x) + c2 r2 (g_best - x);  x(t+1) = x(t) + v(t+1), with
    ω = ω_max - (ω_max - ω_min) t/T and c = c_start + (c_end - c_start) t/T, r1 and r2 uniform per component.
    Velocities are clamped to ±0.2; a particle that would leave the cube stops at its wall. One particle starts at the
    best point known, the others anywhere.

    Source: Tang et al. eqs 6-10.
    """
    dimension = objective.dimension
    count = max(1, min(PARTICLES, objective.remaining))
    iterations = math.ceil(objective.remaining / count)
    positions = rng.random((count, dimension))
    positions[0] = objective.best_point
    velocities = rng.uniform(-SPEED_LIMIT, SPEED_LIMIT, (count, dimension))
    own_costs, own_points = objective.costs(positions), positions.copy()
    for iteration in range(1, iterations):
        inertia, cognitive, social = coefficients(iteration / iterations)
        own_pull = cognitive * rng.random((count, dimension)) * (own_points - positions)
        social_pull = social * rng.random((count, dimension)) * (objective.best_point - positions)
        velocities = np.clip(inertia * velocities + own_pull + social_pull, -SPEED_LIMIT, SPEED_LIMIT)
        moved = positions + velocities
        positions = np.clip(moved, 0.0, 1.0)
        velocities[positions != moved] = 0.0
        costs = objective.costs(positions)
        better = costs < own_costs
        own_costs[better], own_points[better] = costs[better], positions[better]


def coefficients(progress: float) -> tuple[float, float, float]:
    """Return inertia ω, c1 and c2 at progress t/T from 0 to 1, each running linearly from its first to its last value.

    Source: Tang et al. eq. 10; eqs 8 and 9 with first and last value in the order their names say.
    """
    inertia, cognitive, social = (first + (last - first) * progress for first, last in (INERTIA, COGNITIVE, SOCIAL))
    return inertia, cognitive, social
