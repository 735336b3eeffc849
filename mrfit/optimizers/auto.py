"""Several damped Gauss–Newton descents side by side, all their Jacobians in one batched simulation per iteration."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrfit.kernels.descent import damped_steps
from mrfit.objective import BudgetSpent, Descent, NormalEquations, Objective
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
FIRST_WAVE = 5
LAST_WAVE = 10
# Points simulated per descent, from which the starts of a wave are chosen.
SCREENED = 8
# Starts of a wave are at least this far apart, as a share of the cube's diagonal, as long as there are such points.
APART = 0.15

# So many descents have to settle at the best cost, within this share of it; after so many descents, two are enough.
AGREEING = 3
MANY = 12
AGREEMENT_RTOL = 2e-3
# A cost below this share of the best screened one counts as zero when costs are compared.
ZERO = 1e-6

# A descent has settled when the linear model can explain no more than this share of the squared cost; the best one then
# goes on to the objective's tolerance.
SETTLED = 1e-3
# It has also settled when so many iterations lowered the squared cost by less than a share of it: along directions
# that the data hardly determine the linear model promises again and again what the model does not keep.
SLOW_ITERATIONS, SLOW_SETTLED, SLOW_POLISHED = 5, 1e-3, 1e-6
ITERATIONS, LEADER_ITERATIONS = 60, 500

FIRST_DAMPING, LEAST_DAMPING, FIRST_RAISE = 1e-2, 1e-12, 2.0
LAST_DAMPING = 1e-5
# Descents under way that cost no more than this share above the best may end below it.
RIVAL = 0.1
# A descent is stuck when a damped step failed that promised less than this share of the squared cost.
LEAST_FALL = 1e-10
SHORTEST_STEP = 1e-10


@dataclass
class Front:
    """The state of P descents: points (P, K), their Gauss-Newton models, dampings (P,), and which ended in what way.

    A damping that fails is multiplied by ``raises``, which doubles every time until a step succeeds.
    """

    points: Array
    model: NormalEquations
    dampings: Array = field(init=False)
    raises: Array = field(init=False)
    settled: Mask = field(init=False)
    stuck: Mask = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.points)
        self.dampings, self.raises = np.full(count, FIRST_DAMPING), np.full(count, FIRST_RAISE)
        self.settled = np.zeros(count, dtype=bool)
        self.stuck = ~np.isfinite(self.model.costs)


def minimise(objective: Objective, rng: np.random.Generator) -> None:
    """Minimise from the given starts and well-spread ones, in growing waves, until three descents agree.

    Every iteration takes one step of all descents, see ``kernels.descent``. A step that lowers the cost lowers its
    damping, any other raises it. Where descents ended is left in the objective's ``descents``, how many agree in
    ``agreeing``.
    """
    if not objective.dimension:
        cost = float(objective.costs(objective.start[None, :])[0])
        objective.descents, objective.agreeing = [Descent(cost, objective.start, np.isfinite(cost))], 1
        objective.verdict = "all parameters are linear"
        return
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
        if objective.agreeing >= (AGREEING if len(objective.descents) < MANY else AGREEING - 1):
            objective.verdict = f"{objective.agreeing} of {len(objective.descents)} starts agree"
            return
        pool, count = pool[:0], min(2 * count, LAST_WAVE)


def refine(objective: Objective, points: Array) -> bool:
    """Descend from the best of the points (P, K) to the objective's tolerance, and return whether the search is over.

    All those that cost little more than the best, but not the same, descend at first.
    """
    try:
        if len(points) > 1:
            points = points[_rivals(objective.costs(points))]
        front = Front(points, objective.normal_equations(points))
        front.dampings[:] = LAST_DAMPING
        if len(points) > 1:
            _descend(objective, front, SETTLED, SLOW_SETTLED, ITERATIONS)
        leader = _polish(objective, front)
    except BudgetSpent:
        return False
    return bool(leader.settled[0] or leader.stuck[0])


def _rivals(costs: Array) -> list[int]:
    """Return the place of the least cost and those of costs of their own little above it."""
    chosen: list[int] = []
    for k in map(int, np.argsort(costs, kind="stable")):
        if not chosen or costs[chosen[-1]] * (1.0 + AGREEMENT_RTOL) < costs[k] <= costs[chosen[0]] * (1.0 + RIVAL):
            chosen.append(k)
    return chosen


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
    near = np.linalg.norm(points[:, None] - points, axis=2) < apart
    taken = near[chosen].any(axis=0)
    for index in order.tolist():
        if len(chosen) >= max(count, given + 1):
            break
        if not taken[index]:
            chosen.append(index)
            taken |= near[index]
    rest = [i for i in order.tolist() if i not in chosen]
    return points[chosen + rest[: max(0, count - len(chosen))]]


def _descend(objective: Objective, front: Front, tolerance: float, slow: float, iterations: int) -> None:
    """Step all descents of a front together until each has settled, is stuck or has taken its iterations."""
    earlier = front.model.costs.copy()
    for iteration in range(iterations):
        if iteration % SLOW_ITERATIONS == SLOW_ITERATIONS - 1:
            front.settled |= ~front.stuck & (front.model.costs**2 >= earlier**2 * (1.0 - slow))
            earlier = front.model.costs.copy()
        costs, gradients, curvatures = front.model
        trials, predicted, attainable = damped_steps(front.points, gradients, curvatures, front.dampings)
        # the relative offset of Bates and Watts (1981)
        front.settled |= ~front.stuck & (attainable <= tolerance * costs**2)
        active = np.flatnonzero(~front.settled & ~front.stuck)
        if not len(active) or (len(costs) > 1 and _decided(objective, front)):
            return
        _advance(front, active, trials[active], predicted[active], objective.normal_equations(trials[active]))


def _decided(objective: Objective, front: Front) -> bool:
    """Return whether enough descents, of this front and before it, settled at the least cost, and none is near it."""
    costs = front.model.costs
    before = [d.cost for d in objective.descents if d.settled]
    ended = np.append(costs[front.settled], before)
    least = min([*costs, *before])
    under_way = costs[~front.settled & ~front.stuck]
    agreeing = np.count_nonzero(ended <= least * (1.0 + AGREEMENT_RTOL))
    return bool(agreeing >= AGREEING and np.all(under_way > least * (1.0 + RIVAL)))


def _advance(front: Front, active: NDArray[np.int64], trials: Array, predicted: Array, model: NormalEquations) -> None:
    """Take the trial steps that lower the cost, and adapt the dampings."""
    gain = front.model.costs[active] ** 2 - model.costs**2
    better = gain > 0.0
    met = gain / np.maximum(predicted, 1e-300)
    factor = np.where(better, np.where(met < 0.25, 2.0, np.where(met > 0.75, 0.5, 1.0)), front.raises[active])
    front.dampings[active] = np.maximum(front.dampings[active] * factor, LEAST_DAMPING)
    front.raises[active] = np.where(better, FIRST_RAISE, 2.0 * front.raises[active])
    hopeless = predicted <= LEAST_FALL * front.model.costs[active] ** 2
    short = np.abs(trials - front.points[active]).max(axis=1) < SHORTEST_STEP
    front.stuck[active] = short | (~better & hopeless & (front.dampings[active] > 1.0))
    taken = active[better]
    front.points[taken] = trials[better]
    for kept, new in zip(front.model, model, strict=True):
        kept[taken] = new[better]


def _polish(objective: Objective, front: Front) -> Front:
    """Let the leader of a front go on to the objective's tolerance, and return it."""
    leader = slice(best := int(np.argmin(front.model.costs)), best + 1)
    # slices are views: what the leader gains is the front's
    alone = Front(front.points[leader], NormalEquations(*(part[leader] for part in front.model)))
    alone.dampings = front.dampings[leader]
    if objective.tolerance < SETTLED:
        _descend(objective, alone, objective.tolerance, SLOW_POLISHED, LEADER_ITERATIONS)
    return alone


def _record(objective: Objective, front: Front, zero: float) -> None:
    """Add a front's descents to the objective's record, best first, and count how many settled at the best cost."""
    ended = zip(front.model.costs, front.points, front.settled, strict=True)
    descents = [Descent(float(c), p.copy(), bool(s or c <= zero)) for c, p, s in ended if np.isfinite(c)]
    objective.descents = sorted([*objective.descents, *descents], key=lambda d: d.cost)
    limit = objective.best_cost * (1.0 + AGREEMENT_RTOL) + zero
    objective.agreeing = sum(d.settled and d.cost <= limit for d in objective.descents)
