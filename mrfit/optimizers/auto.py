"""Several damped Gauss–Newton descents side by side, all their Jacobians in one batched simulation per iteration."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrfit.objective import Descent, NormalEquations, Objective
from mrfit.specs import Array, OptimizerSpec

SPEC = OptimizerSpec(
    name="auto",
    title="Multi-start bounded Levenberg-Marquardt, all starts side by side, until several agree",
    reference="Levenberg (1944), Marquardt (1963); stop: Bates and Watts (1981); starts: McKay and others (1979)",
    kind="global",
    budget=lambda dimension: 1000 * (dimension + 1),
)

Mask = NDArray[np.bool_]

# Number of descents in the first wave; every later wave has twice as many as the one before, up to the last.
FIRST_WAVE = 4
LAST_WAVE = 16
# Points simulated per descent, from which the starts of a wave are chosen.
SCREENED = 8
# Starts of a wave are at least this far apart, as a share of the cube's diagonal, as long as there are such points.
APART = 0.15

# So many descents have to settle at the best cost, within this share of it.
AGREEING = 3
AGREEMENT_RTOL = 2e-3
# A cost below this share of the best screened one counts as zero when costs are compared.
ZERO = 1e-6

# A descent has settled when the linear model can explain no more than the first share of the squared cost; the best one
# then goes on to the second share.
SETTLED = 1e-3
POLISHED = 1e-9
# It has also settled when so many iterations lowered the squared cost by less than a share of it: along directions
# that the data hardly determine the linear model promises again and again what the model does not keep.
SLOW_ITERATIONS, SLOW_SETTLED, SLOW_POLISHED = 10, 1e-3, 1e-6
ITERATIONS, LEADER_ITERATIONS = 60, 500

# Singular values of the scaled Jacobian below this share of the largest are noise of the differences: no step goes
# along their directions, so parameters the data do not determine stay where they started.
RANK_TOLERANCE = 3e-5
# Longest step along any axis of the cube.
LONGEST_STEP = 0.1
FIRST_DAMPING, LEAST_DAMPING = 1e-2, 1e-12
# A step cut off at the bounds gives way to the safe one when it promises less than this share of what that one does.
POOR = 0.1
# A descent is stuck when a damped step failed that promised less than this share of the squared cost.
LEAST_FALL = 1e-10
SHORTEST_STEP = 1e-10


@dataclass
class Front:
    """The state of P descents: points (P, K), their Gauss-Newton models, dampings (P,), and which ended in what way."""

    points: Array
    model: NormalEquations
    dampings: Array = field(init=False)
    settled: Mask = field(init=False)
    stuck: Mask = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.points)
        self.dampings = np.full(count, FIRST_DAMPING)
        self.settled = np.zeros(count, dtype=bool)
        self.stuck = ~np.isfinite(self.model.costs)


def minimise(objective: Objective, rng: np.random.Generator) -> None:
    """Minimise from the given starts and well-spread ones, in growing waves, until three descents agree.

    Every iteration solves (S⁻¹ JᵀJ S⁻¹ + μ I) S d = -S⁻¹ Jᵀr for all descents at once, S the column norms of J, without
    the directions in which J is rank deficient, and cuts d off at the bounds. A step that lowers the cost lowers
    μ, any other raises it. Where descents ended is left in the objective's ``descents``, how many agree in
    ``agreeing``.
    """
    given = [objective.best_point[None, :], objective.start[None, :]]
    if objective.starts is not None:
        given.append(objective.starts)
    pool = np.array(list(dict.fromkeys(map(tuple, np.clip(np.vstack(given), 0.0, 1.0)))))
    count, zero = FIRST_WAVE, np.inf
    while True:
        screened = np.vstack([pool, _latin_hypercube(SCREENED * count, objective.dimension, rng)])
        costs = objective.costs(screened)
        zero = min(zero, ZERO * float(costs.min()))
        starts = _choose(screened, costs, len(pool), count)
        front = Front(starts, objective.normal_equations(starts))
        try:
            _descend(objective, front, SETTLED, SLOW_SETTLED, ITERATIONS)
            _polish(objective, front)
        finally:
            _record(objective, front, zero)
        if objective.agreeing >= AGREEING:
            objective.verdict = f"{objective.agreeing} of {len(objective.descents)} starts agree"
            return
        pool, count = pool[:0], min(2 * count, LAST_WAVE)


def _latin_hypercube(count: int, dimension: int, rng: np.random.Generator) -> Array:
    """Return points (P, K) of which every axis has exactly one in each P-th of the cube's edge."""
    cells = np.argsort(rng.random((count, dimension)), axis=0)
    points: Array = (cells + rng.random((count, dimension))) / count
    return points


def _choose(points: Array, costs: Array, given: int, count: int) -> Array:
    """Return the first ``given`` points and the cheapest of the others that are apart from each other."""
    chosen = list(range(given))
    order = given + np.argsort(costs[given:], kind="stable")
    apart = APART * np.sqrt(points.shape[1])
    spread = [int(i) for i in order]
    for index in spread:
        if len(chosen) >= max(count, given + 1):
            break
        if all(np.linalg.norm(points[index] - points[other]) >= apart for other in chosen):
            chosen.append(index)
    rest = [i for i in spread if i not in chosen]
    return points[chosen + rest[: max(0, count - len(chosen))]]


def _descend(objective: Objective, front: Front, tolerance: float, slow: float, iterations: int) -> None:
    """Step all descents of a front together until each has settled, is stuck or has taken its iterations."""
    earlier = front.model.costs.copy()
    for iteration in range(iterations):
        if iteration % SLOW_ITERATIONS == SLOW_ITERATIONS - 1:
            front.settled |= ~front.stuck & (front.model.costs**2 >= earlier**2 * (1.0 - slow))
            earlier = front.model.costs.copy()
        trials, predicted, explained = _proposals(front)
        front.settled |= ~front.stuck & (explained <= tolerance)
        active = np.flatnonzero(~front.settled & ~front.stuck)
        if not len(active) or _agreeing(front) >= AGREEING:
            return
        _advance(front, active, trials[active], predicted[active], objective.normal_equations(trials[active]))


def _agreeing(front: Front) -> int:
    """Return how many descents of a front have settled at its least cost."""
    costs = front.model.costs
    return int(np.sum(front.settled & (costs <= costs.min() * (1.0 + AGREEMENT_RTOL))))


def _advance(front: Front, active: NDArray[np.int64], trials: Array, predicted: Array, model: NormalEquations) -> None:
    """Take the trial steps that lower the cost, and adapt the dampings."""
    gain = front.model.costs[active] ** 2 - model.costs**2
    better = gain > 0.0
    factor = np.select([~better, gain < 0.25 * predicted, gain > 0.75 * predicted], [3.0, 2.0, 0.5], 1.0)
    front.dampings[active] = np.maximum(front.dampings[active] * factor, LEAST_DAMPING)
    hopeless = predicted <= LEAST_FALL * front.model.costs[active] ** 2
    short = np.abs(trials - front.points[active]).max(axis=1) < SHORTEST_STEP
    front.stuck[active] = short | (~better & hopeless & (front.dampings[active] > 1.0))
    taken = active[better]
    front.points[taken] = trials[better]
    for kept, new in zip(front.model, model, strict=True):
        kept[taken] = new[better]


def _proposals(front: Front) -> tuple[Array, Array, Array]:
    """Return trial points (P, K), the fall of the squared cost they promise (P,), and the share of it to be had (P,).

    The last is the fall that an undamped step along the free parameters would bring if the model were linear: the
    relative offset of Bates and Watts (1981).
    """
    points, (costs, gradients, curvatures) = front.points, front.model
    held = ((points <= 0.0) & (gradients > 0.0)) | ((points >= 1.0) & (gradients < 0.0))
    steps, attainable = _damped_steps(gradients, curvatures, front.dampings, held)
    trials, predicted = _shortened(front, np.clip(points + steps, 0.0, 1.0) - points)
    # cutting a step off at the bounds can make it an uphill one; holding what would leave the cube never does
    safe_trials, safe_predicted = _shortened(front, _held_within_bounds(front, steps, held))
    poor = predicted <= POOR * safe_predicted
    trials = np.where(poor[:, None], safe_trials, trials)
    explained = attainable / np.maximum(np.where(np.isfinite(costs), costs, 0.0) ** 2, 1e-300)
    return trials, np.where(poor, safe_predicted, predicted), explained


def _held_within_bounds(front: Front, steps: Array, held: Mask) -> Array:
    """Return steps (P, K) that stay in the cube: parameters that would leave it do not move, the others solved anew."""
    points, (_, gradients, curvatures) = front.points, front.model
    for _ in range(points.shape[1]):
        reached = points + steps
        crossing = ((reached < 0.0) | (reached > 1.0)) & ~held
        if not crossing.any():
            break
        held = held | crossing
        steps = _damped_steps(gradients, curvatures, front.dampings, held)[0]
    return steps


def _shortened(front: Front, steps: Array) -> tuple[Array, Array]:
    """Return trial points (P, K) at most the longest step away, and the fall of the squared cost they promise (P,)."""
    longest = np.abs(steps).max(axis=1, keepdims=True)
    trials = np.clip(front.points + steps * np.minimum(1.0, LONGEST_STEP / np.maximum(longest, 1e-300)), 0.0, 1.0)
    moved = trials - front.points
    bend = np.einsum("pk,pkl,pl->p", moved, front.model.curvatures, moved)
    return trials, -2.0 * np.einsum("pk,pk->p", front.model.gradients, moved) - bend


def _damped_steps(gradients: Array, curvatures: Array, dampings: Array, held: Mask) -> tuple[Array, Array]:
    """Return damped steps (P, K) of the parameters not held, and the undamped fall of the squared cost (P,)."""
    norms = np.sqrt(np.einsum("pkk->pk", curvatures))
    scales = np.maximum(norms, 1e-4 * norms.max(axis=1, keepdims=True))
    scales[scales == 0.0] = 1.0
    free = np.where(held, 0.0, 1.0 / scales)
    values, vectors = np.linalg.eigh(curvatures * free[:, :, None] * free[:, None, :])
    along = np.einsum("pkl,pk->pl", vectors, gradients * free)
    determined = values > RANK_TOLERANCE**2 * values[:, -1:]
    damped = np.where(determined, along / np.where(determined, values + dampings[:, None], 1.0), 0.0)
    attainable = np.where(determined, along**2 / np.where(determined, values, 1.0), 0.0).sum(axis=1)
    return -free * np.einsum("pkl,pl->pk", vectors, damped), attainable


def _polish(objective: Objective, front: Front) -> None:
    """Let the leader of a front go on to the tighter tolerance."""
    leader = slice(best := int(np.argmin(front.model.costs)), best + 1)
    # slices are views: what the leader gains is the front's
    alone = Front(front.points[leader], NormalEquations(*(part[leader] for part in front.model)))
    alone.dampings = front.dampings[leader]
    _descend(objective, alone, POLISHED, SLOW_POLISHED, LEADER_ITERATIONS)


def _record(objective: Objective, front: Front, zero: float) -> None:
    """Add a front's descents to the objective's record, best first, and count how many settled at the best cost."""
    ended = zip(front.model.costs, front.points, front.settled, strict=True)
    descents = [Descent(float(c), p.copy(), bool(s or c <= zero)) for c, p, s in ended if np.isfinite(c)]
    objective.descents = sorted([*objective.descents, *descents], key=lambda d: d.cost)
    limit = objective.best_cost * (1.0 + AGREEMENT_RTOL) + zero
    objective.agreeing = sum(d.settled and d.cost <= limit for d in objective.descents)
