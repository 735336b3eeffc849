"""Pattern search of Hooke and Jeeves: steps along the axes, then on in the direction that paid."""

from typing import Any

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Option, Options

SMALLEST = 1e-8

SPEC = OptimizerSpec(
    name="hooke",
    title="Pattern search along the axes",
    reference="Hooke and Jeeves 1961",
    kind="local",
    budget=lambda dimension, options: 1000 * (dimension + 1),
    options=(Option("step", 0.1, 1e-3, 0.5, "first step, as a share of the bounds"),),
)


def minimise(objective: Any, rng: np.random.Generator, options: Options) -> None:
    """Search from the objective's best point until the step is too small to matter."""
    base, step = objective.best_point.copy(), options["step"]
    cost = objective.costs(base[None])[0]
    while step > SMALLEST:
        point, reached = _explored(objective, base, cost, step)
        if not reached < cost:
            step /= 2.0
        while reached < cost:
            ahead = np.clip(2.0 * point - base, 0.0, 1.0)
            base, cost = point, reached
            point, reached = _explored(objective, ahead, objective.costs(ahead[None])[0], step)


def _explored(objective: Any, point: Array, cost: float, step: float) -> tuple[Array, float]:
    """Return where single steps along the axes lead, and the cost there."""
    for axis in range(len(point)):
        tried = np.repeat(point[None], 2, axis=0)
        tried[:, axis] = np.clip(tried[:, axis] + [step, -step], 0.0, 1.0)
        costs = objective.costs(tried)
        best = int(np.argmin(costs))
        if costs[best] < cost:
            point, cost = tried[best], costs[best]
    return point, cost
