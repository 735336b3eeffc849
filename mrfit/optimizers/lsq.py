"""Bounded non-linear least squares by a trust region."""

import numpy as np

from mrfit.core.specs import OptimizerSpec, Options
from mrfit.optimizers.cost.objective import Objective, Termination

SPEC = OptimizerSpec(
    name="lsq",
    title="Trust-region reflective least squares within bounds",
    reference="preyield paper §3; scipy.optimize.least_squares: Branch, Coleman and Li (1999)",
    kind="local",
    budget=lambda dimension, options: 200 * (dimension + 1),
)

# scipy keeps its iterates inside the bounds; a start nearer to one than 1e-10 it would move to a point not tried.
MARGIN = 1e-9
LSQ_TOLERANCE = 1e-10


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> Termination:
    """Refine the best point known by scipy's trust-region reflective method; each Jacobian is one batched simulation.

    The random generator is not used.
    """
    from scipy.optimize import least_squares

    start = np.clip(objective.best_point, MARGIN, 1.0 - MARGIN)
    if not np.isfinite(objective.costs(start[None, :])[0]):
        return Termination("the start cannot be simulated")
    result = least_squares(
        objective.residuals,
        start,
        objective.jacobian,
        bounds=(0.0, 1.0),
        xtol=LSQ_TOLERANCE,
        ftol=LSQ_TOLERANCE,
        gtol=LSQ_TOLERANCE,
    )
    return Termination(str(result.message).rstrip("."))
