"""Bounded local minimisation of the cost."""

import numpy as np

from mrfit.core.specs import Array, OptimizerSpec, Options
from mrfit.optimizers.cost.objective import Objective, Termination

SPEC = OptimizerSpec(
    name="fmin",
    title="Sequential quadratic programming within bounds",
    reference="Tang et al. eq. 11 (fmincon's part); scipy.optimize SLSQP: Kraft (1988)",
    kind="local",
    budget=lambda dimension, options: 200 * (dimension + 1),
)

MAX_ITERATIONS = 10**6
SIMPLEX_TOLERANCE = 1e-12


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> Termination:
    """Refine the best point known by sequential quadratic programming on the mean square error.

    min f(x) with 0 <= x <= 1; each gradient 2 Jᵀr/M comes from one batched simulation of K + 1 points. f is scaled to 1
    at the start. The random generator is not used.

    Source: Tang et al. eq. 11.
    """
    from scipy.optimize import minimize

    start = objective.best_point
    scale = float(objective.costs(start[None, :])[0]) ** 2
    if not np.isfinite(scale):
        return Termination("the start cannot be simulated")
    scale = scale or 1.0

    def cost(point: Array) -> float:
        # SLSQP's line search works with differences of costs: infinity would turn them into NaN
        return float(min(objective.costs(point[None, :])[0] ** 2 / scale, 1e10))

    def gradient(point: Array) -> Array:
        residuals, jacobian = objective.linearise(point)
        slope: Array = 2.0 * (residuals @ jacobian) / (len(residuals) * scale)
        return slope if np.isfinite(slope).all() else np.zeros_like(slope)

    result = minimize(
        cost,
        start,
        jac=gradient,
        method="SLSQP",
        bounds=[(0.0, 1.0)] * objective.dimension,
        options={"ftol": SIMPLEX_TOLERANCE, "maxiter": MAX_ITERATIONS},
    )
    return Termination(str(result.message))
