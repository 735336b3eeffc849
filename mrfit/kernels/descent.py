"""One damped Gauss–Newton step within the unit cube, for many points at once."""

import math

import numpy as np
from numpy.typing import NDArray

from mrfit.kernels.jit import kernel

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Singular values of the scaled Jacobian below this share of the largest are noise of the differences: no step goes
# along their directions, so parameters the data do not determine stay where they started.
_RANK_TOLERANCE = 3e-5
# Longest step along any axis of the cube.
_LONGEST_STEP = 0.1
# A step cut off at the bounds gives way to the safe one when it promises less than this share of what that one does.
_POOR = 0.1


@kernel
def _damped(gradient: Array, curvature: Array, damping: float, held: Mask) -> tuple[Array, float]:
    """Return the damped step (K,) of the parameters not held, and what an undamped one would take off the square."""
    size = len(gradient)
    norms, largest = np.empty(size), 0.0
    for k in range(size):
        norms[k] = np.sqrt(curvature[k, k])
        largest = max(largest, norms[k])
    scaled = np.empty((size, size))
    for k in range(size):
        norms[k] = max(norms[k], 1e-4 * largest)
        norms[k] = 0.0 if held[k] or norms[k] == 0.0 else 1.0 / norms[k]
    for k in range(size):
        for j in range(size):
            scaled[k, j] = curvature[k, j] * norms[k] * norms[j]
    values, vectors = np.linalg.eigh(scaled)
    step, attainable = np.zeros(size), 0.0
    for i in range(size):
        if not values[i] > _RANK_TOLERANCE**2 * values[size - 1]:
            continue
        along = 0.0
        for k in range(size):
            along += vectors[k, i] * gradient[k] * norms[k]
        attainable += along * along / values[i]
        for k in range(size):
            step[k] -= norms[k] * vectors[k, i] * along / (values[i] + damping)
    return step, attainable


@kernel
def _shortened(point: Array, step: Array, gradient: Array, curvature: Array) -> tuple[Array, float]:
    """Return a point of the cube at most the longest step away, and the fall of the square that it promises."""
    size, longest = len(point), 0.0
    for k in range(size):
        step[k] = min(max(point[k] + step[k], 0.0), 1.0) - point[k]
        longest = max(longest, abs(step[k]))
    share = min(1.0, _LONGEST_STEP / max(longest, 1e-300))
    trial, fall = np.empty(size), 0.0
    for k in range(size):
        trial[k] = min(max(point[k] + share * step[k], 0.0), 1.0)
    for k in range(size):
        fall -= 2.0 * gradient[k] * (trial[k] - point[k])
        for j in range(size):
            fall -= (trial[k] - point[k]) * curvature[k, j] * (trial[j] - point[j])
    return trial, fall


@kernel
def _hold_crossing(point: Array, step: Array, held: Mask) -> bool:
    """Hold the parameters that a step would take out of the cube; return whether there are any."""
    crossed = False
    for k in range(len(point)):
        reached = point[k] + step[k]
        if (reached < 0.0 or reached > 1.0) and not held[k]:
            held[k] = crossed = True
    return crossed


@kernel
def _along_axes(gradient: Array, curvature: Array) -> Array:
    """Return a step (K,) against the gradient that is downhill however it is cut off, since JᵀJ <= K·diag(JᵀJ)."""
    size = len(gradient)
    step = np.zeros(size)
    for k in range(size):
        if curvature[k, k] > 0.0:
            step[k] = -gradient[k] / (size * curvature[k, k])
    return step


@kernel
def damped_steps(points: Array, gradients: Array, curvatures: Array, dampings: Array) -> tuple[Array, Array, Array]:
    """Return trial points (P, K), the fall of the squared cost they promise (P,), and that to be had (P,).

    Solves (S⁻¹ JᵀJ S⁻¹ + μ I) S d = -S⁻¹ Jᵀr, S the column norms of J, without the directions in which J is rank
    deficient, and cuts d off at the bounds. The last result is the fall that an undamped step along the free parameters
    would bring if the model were linear. Where a model is not finite, the point stays.

    Parameters
    ----------
    points
        In the cube, shape (P, K).
    gradients, curvatures
        Jᵀr (P, K) and JᵀJ (P, K, K).
    dampings
        μ, shape (P,).
    """
    count, size = points.shape
    trials, predicted, attainable = np.empty((count, size)), np.empty(count), np.empty(count)
    for p in range(count):
        point, gradient, curvature = points[p], gradients[p], curvatures[p]
        held, finite = np.empty(size, dtype=np.bool_), True
        for k in range(size):
            finite = finite and math.isfinite(gradient[k]) and math.isfinite(curvature[k, k])
            held[k] = (point[k] <= 0.0 and gradient[k] > 0.0) or (point[k] >= 1.0 and gradient[k] < 0.0)
        if not finite:
            trials[p], predicted[p], attainable[p] = point, 0.0, np.inf
            continue
        step, attainable[p] = _damped(gradient, curvature, dampings[p], held)
        safe = step.copy()
        trials[p], predicted[p] = _shortened(point, step, gradient, curvature)
        # cutting a step off at the bounds can make it an uphill one; holding what would leave the cube never does
        for _ in range(size):
            if not _hold_crossing(point, safe, held):
                break
            safe, _ = _damped(gradient, curvature, dampings[p], held)
        trial, fall = _shortened(point, safe, gradient, curvature)
        if not fall > 0.0:
            trial, fall = _shortened(point, _along_axes(gradient, curvature), gradient, curvature)
        if predicted[p] <= _POOR * fall:
            trials[p], predicted[p] = trial, fall
    return trials, predicted, attainable
