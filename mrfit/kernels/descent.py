"""Damped Gauss–Newton steps within the unit cube, for many points at once: their choice, and what becomes of them."""

import math

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.jit import kernel, part

Model = tuple[Array, Array, Array]
Descents = tuple[Array, Array, Array, Array, Mask]
Trial = tuple[Array, Array]
Decomposed = tuple[Array, Array, Array]

# Singular values of the scaled Jacobian below this share of the largest are noise of the differences: no step goes
# along their directions, so parameters the data do not determine stay where they started.
_RANK_TOLERANCE = 3e-5
# What exact derivatives leave of a column that depends on the others, as a share of its square
_ROUNDING = 1e-13
# Longest step along any axis of the cube.
LONGEST_STEP = 0.2
# What a failed step shortens the reach of the next to.
_SHORTENED = 0.5
# How often a damping is raised to make a step that short.
_RAISES = 40
# A step cut off at the bounds gives way to a safer one when it promises less than this share of what that one does.
_POOR = 0.1
# What a first failed step multiplies its damping by.
FIRST_RAISE, _LEAST_DAMPING = 2.0, 1e-12
# What a step that keeps its promise multiplies its damping by.
_MOST_LOWERED = 1.0 / 3.0
# A descent is stuck when a damped step failed that promised less than this share of the squared cost, or is too short.
_LEAST_FALL, _SHORTEST_STEP = 1e-10, 1e-10


@part
def _scaled(curvature: Array, held: Mask) -> tuple[Array, Array]:
    """Return JᵀJ (K, K) of columns of norm 1, and what they were divided by, inverted (K,); zeros for parameters held.

    Columns that are next to nothing stay short.
    """
    size = len(curvature)
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
    return scaled, norms


@kernel
def _factored(scaled: Array, slope: Array, damping: float) -> tuple[Array, float]:
    """Return x (K,) with (A + μ I) x = slope, and slopeᵀ x; by Cholesky's factors of A + μ I, μ no less than rounding.

    Rounding may leave A (K, K) a little short of semidefinite.
    """
    size = len(slope)
    damping = max(damping, _ROUNDING * size)
    upper, x = scaled.copy(), slope.copy()
    for k in range(size):
        pivot = math.sqrt(max(upper[k, k], 0.0) + damping)
        for j in range(k, size):
            upper[k, j] /= pivot
        upper[k, k] = pivot
        x[k] /= pivot
        for i in range(k + 1, size):
            factor = upper[k, i]
            x[i] -= factor * x[k]
            for j in range(i, size):
                upper[i, j] -= factor * upper[k, j]
    square = 0.0
    for k in range(size):
        square += x[k] * x[k]
    for k in range(size - 1, -1, -1):
        x[k] /= upper[k, k]
        for i in range(k):
            x[i] -= upper[i, k] * x[k]
    return x, square


@kernel
def _decomposed(gradient: Array, curvature: Array, held: Mask, exact: bool) -> Decomposed:
    """Return the scaled model of the parameters not held, ready to be solved at any damping.

    Where derivatives are exact no direction is noise, so none need be found: scaled JᵀJ (K, K), inverted norms of J's
    columns (K,), scaled gradient (K,). Else the model along its eigenvectors: their directions in the cube (K, K), one
    per row, the eigenvalues (K,), and the gradient along them (K,), zero for those that the data do not determine.
    """
    size = len(gradient)
    scaled, norms = _scaled(curvature, held)
    if exact:
        along = np.empty(size)
        for k in range(size):
            along[k] = gradient[k] * norms[k]
        return scaled, norms, along
    values, vectors = np.linalg.eigh(scaled)
    directions, along = np.empty((size, size)), np.zeros(size)
    for i in range(size):
        for k in range(size):
            directions[i, k] = vectors[k, i] * norms[k]
        if values[i] > _RANK_TOLERANCE**2 * values[size - 1]:
            for k in range(size):
                along[i] += directions[i, k] * gradient[k]
    return directions, values, along


@part
def _attainable(parts: Decomposed, exact: bool) -> float:
    """Return the fall of an undamped step."""
    matrix, values, along = parts
    if exact:
        _, square = _factored(matrix, along, 0.0)
        return square
    total = 0.0
    for i in range(len(along)):
        if along[i] != 0.0:
            total += along[i] * along[i] / values[i]
    return total


@kernel
def _step(parts: Decomposed, damping: float, exact: bool) -> Array:
    """Return the damped step (K,) in the cube."""
    matrix, values, along = parts
    if exact:
        step, _ = _factored(matrix, along, damping)
        for k in range(len(along)):
            step[k] *= -values[k]
        return step
    step = np.zeros(len(along))
    for i in range(len(along)):
        if along[i] != 0.0:
            for k in range(len(along)):
                step[k] -= matrix[i, k] * along[i] / (values[i] + damping)
    return step


@part
def _damped(parts: Decomposed, damping: float, reach: float, exact: bool) -> tuple[Array, Array, float]:
    """Return the damped step (K,) of the parameters not held, one short enough, and its damping.

    The second is the first where that is short enough, else that of the least damping μ, by fours, which makes it so.
    """
    step = _step(parts, damping, exact)
    near = step
    for _ in range(_RAISES):
        longest = 0.0
        for k in range(len(near)):
            longest = max(longest, abs(near[k]))
        if longest <= reach:
            break
        damping = max(4.0 * damping, 1e-9)
        near = _step(parts, damping, exact)
    return step, near, damping


@kernel
def _shortened(point: Array, step: Array, gradient: Array, curvature: Array, reach: float) -> tuple[Array, float]:
    """Return a point of the cube at most so far away along any axis, and the fall of the square that it promises."""
    size, longest = len(point), 0.0
    for k in range(size):
        step[k] = min(max(point[k] + step[k], 0.0), 1.0) - point[k]
        longest = max(longest, abs(step[k]))
    share = min(1.0, reach / max(longest, 1e-300))
    trial, fall = np.empty(size), 0.0
    for k in range(size):
        trial[k] = min(max(point[k] + share * step[k], 0.0), 1.0)
    for k in range(size):
        fall -= 2.0 * gradient[k] * (trial[k] - point[k])
        for j in range(size):
            fall -= (trial[k] - point[k]) * curvature[k, j] * (trial[j] - point[j])
    return trial, fall


@part
def _hold_crossing(point: Array, step: Array, held: Mask, shift: Array) -> bool:
    """Hold the parameters that a step would take out of the cube, shifted to their bound; return if there are any."""
    crossed = False
    for k in range(len(point)):
        reached = point[k] + step[k]
        if (reached < 0.0 or reached > 1.0) and not held[k]:
            held[k] = crossed = True
            shift[k] = (0.0 if reached < 0.0 else 1.0) - point[k]
    return crossed


@part
def _along_axes(gradient: Array, curvature: Array) -> Array:
    """Return a step (K,) against the gradient that is downhill however it is cut off, since JᵀJ <= K·diag(JᵀJ)."""
    size = len(gradient)
    step = np.zeros(size)
    for k in range(size):
        if curvature[k, k] > 0.0:
            step[k] = -gradient[k] / (size * curvature[k, k])
    return step


@part
def _held(point: Array, gradient: Array) -> Mask:
    """Return a mask (K,) of parameters that are held: those at a bound beyond which the cost falls."""
    held = np.empty(len(point), dtype=np.bool_)
    for k in range(len(point)):
        held[k] = (point[k] <= 0.0 and gradient[k] > 0.0) or (point[k] >= 1.0 and gradient[k] < 0.0)
    return held


@part
def _is_finite(gradient: Array, curvature: Array) -> bool:
    """Return whether there is a step at all."""
    finite = True
    for k in range(len(gradient)):
        finite = finite and math.isfinite(gradient[k]) and math.isfinite(curvature[k, k])
    return finite


@kernel
def damped_steps(
    points: Array, model: Model, dampings: Array, reaches: Array, active: Index, exact: bool
) -> tuple[Array, Array, Array]:
    """Return trial points (P, K), the fall of the squared cost they promise (P,), and that possible (P,).

    Solves (S⁻¹ JᵀJ S⁻¹ + μ I) S d = -S⁻¹ Jᵀr, S the column norms of J, without the directions in which J is rank
    deficient, shortens d to a fifth of the cube's edge and cuts it off at the bounds. That goes far along what the data
    hardly determine. Where it promises too little, the better of two others is taken: the μ raised until d is short,
    and d with those parameters at their bound that would leave the cube. The last result is the fall that an undamped
    step along the free parameters would bring if the model were linear. Where a model is not finite, the point stays,
    as do those of descents that are not active.

    Parameters
    ----------
    points
        In the cube, shape (P, K).
    model
        Costs (P,), Jᵀr (P, K) and JᵀJ (P, K, K).
    dampings
        μ, shape (P,).
    reaches
        Longest step along any axis, shape (P,). Where it is shorter than usual, since a longer one failed, only the
        second and third step are tried, and μ is set to what makes them short.
    active
        Descents that are to take a step, shape (A,).
    """
    count, size = points.shape
    trials, predicted, attainable = points.copy(), np.zeros(count), np.zeros(count)
    for p in active:
        point, gradient, curvature = points[p], model[1][p], model[2][p]
        held, reach = _held(point, gradient), reaches[p]
        if not _is_finite(gradient, curvature):
            attainable[p] = np.inf
            continue
        parts = _decomposed(gradient, curvature, held, exact)
        attainable[p] = _attainable(parts, exact)
        step, near, damping = _damped(parts, dampings[p], reach, exact)
        safe, shift = step.copy(), np.zeros(size)
        longest, predicted[p] = _shortened(point, step, gradient, curvature, reach)
        trial, fall = _shortened(point, near, gradient, curvature, reach)
        # cutting a step off at the bounds can make it an uphill one; holding what would leave the cube never does
        crossed = False
        for _ in range(size):
            if not _hold_crossing(point, safe, held, shift):
                break
            moved, crossed = np.dot(curvature, shift), True
            for k in range(size):
                moved[k] += gradient[k]
            safe = _step(_decomposed(moved, curvature, held, exact), dampings[p], exact)
            for k in range(size):
                safe[k] += shift[k]
        other, promised = _shortened(point, safe, gradient, curvature, reach)
        if crossed and promised > fall:
            trial, fall = other, promised
        if not fall > 0.0:
            trial, fall = _shortened(point, _along_axes(gradient, curvature), gradient, curvature, reach)
        if reach < LONGEST_STEP:
            dampings[p] = damping
        if predicted[p] <= _POOR * fall or reach < LONGEST_STEP:
            longest, predicted[p] = trial, fall
        for k in range(size):
            trials[p, k] = longest[k]
    return trials, predicted, attainable


@kernel
def fanned_steps(points: Array, model: Model, dampings: Array, active: Index) -> tuple[Array, Array]:
    """Return trial points (A, D, K) of some descents (A,) at several dampings (A, D), and the falls promised (A, D).

    They are steps of ``damped_steps`` where derivatives are exact, shortened and cut off at the bounds.
    """
    count, members = dampings.shape
    trials, promised = np.empty((count, members, points.shape[1])), np.zeros((count, members))
    for a in range(count):
        point, gradient, curvature = points[active[a]], model[1][active[a]], model[2][active[a]]
        parts = _decomposed(gradient, curvature, _held(point, gradient), True)
        for d in range(members):
            step = _step(parts, dampings[a, d], True)
            trials[a, d], promised[a, d] = _shortened(point, step, gradient, curvature, LONGEST_STEP)
    return trials, promised


@kernel
def keep_better(descents: Descents, model: Model, active: Index, trial: Trial, gained: Model) -> None:
    """Take the trial steps that lower the cost and adapt the dampings, in place.

    A step that brings the share s of the promised fall multiplies its damping by max(1/3, 1 - (2s - 1)^3), between a
    third and two. One that fails multiplies it by its raise, which doubles every time until a step succeeds; the next
    step then reaches less far.

    Source: H. B. Nielsen, Damping parameter in Marquardt's method, IMM-REP-1999-05, Technical University of Denmark.

    Parameters
    ----------
    descents
        Points (P, K), dampings (P,), raises (P,), reaches (P,), which are stuck (P,).
    model
        Costs (P,), Jᵀr (P, K) and JᵀJ (P, K, K) at the points.
    active
        Descents that took a step, shape (A,).
    trial
        Trial points (P, K) and the fall of the squared cost that they promise (P,).
    gained
        As ``model``, at the trial points of the active descents.
    """
    points, dampings, raises, reaches, stuck = descents
    trials, promised = trial
    for a in range(len(active)):
        p = active[a]
        square = model[0][p] ** 2
        fall, longest = square - gained[0][a] ** 2, 0.0
        for k in range(points.shape[1]):
            longest = max(longest, abs(trials[p, k] - points[p, k]))
        better = fall > 0.0
        met = fall / max(promised[p], 1e-300)
        if better:
            factor = max(_MOST_LOWERED, 1.0 - (2.0 * min(met, 1.0) - 1.0) ** 3)
            model[0][p] = gained[0][a]
            reaches[p] = LONGEST_STEP
            for k in range(points.shape[1]):
                points[p, k], model[1][p, k] = trials[p, k], gained[1][a, k]
                for j in range(points.shape[1]):
                    model[2][p, k, j] = gained[2][a, k, j]
        else:
            factor = raises[p]
            # a greater damping alone may leave the step as it is
            reaches[p] = max(_SHORTENED * longest, 1e-12)
        raises[p] = FIRST_RAISE if better else 2.0 * raises[p]
        dampings[p] = max(dampings[p] * factor, _LEAST_DAMPING)
        lost = not better and promised[p] <= _LEAST_FALL * square and dampings[p] > 1.0
        stuck[p] = longest < _SHORTEST_STEP or lost
