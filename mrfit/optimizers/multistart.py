"""Several damped Gauss–Newton descents side by side, all their Jacobians in one batched simulation per iteration."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from mrfit.core.specs import Array, Index, Mask, OptimizerSpec, Options
from mrfit.kernels.descent import FIRST_RAISE, LONGEST_STEP, damped_steps, fanned_steps, keep_better
from mrfit.kernels.ending import AGREEMENT_RTOL, RIVAL, decided, enough, going_on
from mrfit.optimizers.cost.objective import BudgetSpent, DescentEnd, NoProgress, NormalEquations, Objective, Termination

SPEC = OptimizerSpec(
    name="multistart",
    title="Multi-start bounded Levenberg-Marquardt on all data and parameters, until several starts agree",
    reference="Levenberg (1944), Marquardt (1963); stop: Bates and Watts (1981); starts: McKay and others (1979)",
    kind="global",
    budget=lambda dimension, options: 1000 * (dimension + 1),
    ends=True,
)


# Number of descents in the first wave, and in each of those after it.
FIRST_WAVE, LATER_WAVES = 5, 4
# Points simulated per descent, from which the starts of a wave are chosen; and where a point costs far less than its
# model.
SCREENED, SCREENED_EXACTLY = 8, 32
# Starts of a wave are at least this far apart, as a share of the cube's diagonal, as long as there are such points.
STARTS_APART = 0.15

# Where no lower cost was found by so many more, the search ends without agreement.
IDLE = 21
# A cost below this share of the best screened one counts as zero when costs are compared.
ZERO = 1e-6

# A descent has settled when the linear model can explain no more than this share of the squared cost; the best one then
# goes on to a tolerance of its own, this one where nobody gives another.
SETTLED_TOLERANCE, EXACT_CHANGE = 1e-3, 1e-9
# It has also settled when so many iterations lowered the squared cost by less than a share of it: along directions
# that the data hardly determine the linear model promises again and again what the model does not keep. Of more than
# so many parameters per iteration some may lie in a curved valley: then there are more iterations.
SLOW_ITERATIONS, SLOW_SETTLED, SLOW_POLISHED = 5, 1e-3, 1e-6
SLOW_PARAMETERS = 3
# Even the last descent goes no further than to a coarse one's end where it has less than this share of what its linear
# model promised: there the valley is so narrow and curved that it would creep along it for hundreds of iterations.
KEPT = 0.05
# A descent whose steps fail is not judged so until its raise is greater than this: its damping has to fit first.
LAST_RAISE = 32.0
DESCENT_ITERATIONS, LEADER_ITERATIONS = 60, 500

FIRST_DAMPING, LAST_DAMPING = 1e-2, 1e-5
# Multiples of its damping at which a descent whose last step failed is also tried, where a point costs far less than
# its model
FANNED = np.array([0.1, 10.0, 100.0])
# A descent is given up where so many times the fall of its last iterations would not take it to the least cost.
REACH = 4.0


@dataclass
class Front:
    """The state of P descents: points (P, K), their Gauss-Newton models, dampings (P,), and which ended in what way.

    A damping that fails is multiplied by ``raises``, which doubles every time until a step succeeds; until then steps
    are no longer than ``reaches``.
    """

    points: Array
    model: NormalEquations
    dampings: Array = field(init=False)
    raises: Array = field(init=False)
    reaches: Array = field(init=False)
    settled: Mask = field(init=False)
    stuck: Mask = field(init=False)
    given_up: Mask = field(init=False)

    def __post_init__(self) -> None:
        count = len(self.points)
        self.dampings, self.raises = np.full(count, FIRST_DAMPING), np.full(count, FIRST_RAISE)
        self.reaches = np.full(count, LONGEST_STEP)
        self.settled, self.given_up = np.zeros((2, count), dtype=bool)
        self.stuck = ~np.isfinite(self.model.costs)

    @property
    def ends(self) -> tuple[Mask, Mask, Mask]:
        """Which descents take no more steps, since they settled, are stuck, are given up."""
        return self.settled, self.stuck, self.given_up

    @property
    def under_way(self) -> Mask:
        """Which descents take more steps."""
        return ~(self.settled | self.stuck | self.given_up)


def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> Termination:
    """Minimise from the given starts and well-spread ones, wave by wave, until three descents agree; see `search`."""
    return search(objective, rng, EXACT_CHANGE)


def search(objective: Objective, rng: np.random.Generator, tolerance: float) -> Termination:
    """Minimise from the given starts and well-spread ones, wave by wave, until three descents agree.

    Of many, two are enough; where the least cost stays as it is for many more, the search ends without agreement.
    Every iteration takes one step of all descents, see ``kernels.descent``. A step that lowers the cost lowers its
    damping, any other raises it. What stops it carries where descents ended up to then.

    Parameters
    ----------
    objective
        What to minimise.
    rng
        Source of the starts that are not given.
    tolerance
        Share of the squared cost that the best descent of a wave may leave.
    """
    if not objective.dimension:
        cost = float(objective.costs(objective.start[None, :])[0])
        return Termination("all parameters are linear", (DescentEnd(cost, objective.start, np.isfinite(cost)),), 1)
    given = [objective.best_point[None, :], objective.start[None, :]]
    if objective.starts is not None:
        given.append(objective.starts)
    pool = np.array(list(dict.fromkeys(map(tuple, np.clip(np.vstack(given), 0.0, 1.0)))))
    count, zero, least, idle = FIRST_WAVE, np.inf, np.inf, 0
    screened, ended = SCREENED_EXACTLY if objective.exact else SCREENED, Termination()
    try:
        while True:
            points = np.vstack([pool, _latin_hypercube(screened * count, objective.dimension, rng)])
            costs = objective.costs(points)
            zero = min(zero, ZERO * float(costs.min()))
            starts = _choose(points, costs, len(pool), count)
            front = Front(starts, objective.normal_equations(starts))
            try:
                _descend(objective, front, SETTLED_TOLERANCE, SLOW_SETTLED, DESCENT_ITERATIONS, ended.descents)
                _polish(objective, front, tolerance)
            finally:
                ended = _joined(ended, objective.best_cost, front, zero)
            if ended.agreeing >= enough(len(ended.descents)):
                return replace(ended, reason=f"{ended.agreeing} of {len(ended.descents)} starts agree")
            idle = 0 if objective.best_cost < least * (1.0 - AGREEMENT_RTOL) else idle + count
            if idle >= IDLE:
                raise NoProgress(f"none of the last {idle} starts ended lower")
            pool, count, least = pool[:0], LATER_WAVES, objective.best_cost
    except BudgetSpent as spent:
        spent.ended = ended
        raise


def refine(objective: Objective, points: Array, tolerance: float = EXACT_CHANGE, damping: float = LAST_DAMPING) -> bool:
    """Descend from the best of the points (P, K) to a tolerance, and return whether the search is over.

    All those that cost little more than the best, but not the same, descend at first. The first steps are damped the
    more, the farther the points may be from the optimum.
    """
    try:
        if not objective.dimension:
            return bool(np.isfinite(objective.costs(points[:1])).all())
        if len(points) > 1:
            points = points[_rivals(objective.costs(points))]
        front = Front(points, objective.normal_equations(points))
        front.dampings[:] = damping
        if len(points) > 1:
            _descend(objective, front, SETTLED_TOLERANCE, SLOW_SETTLED, DESCENT_ITERATIONS)
        leader = _polish(objective, front, tolerance)
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
    return (cells + rng.random((count, dimension))) / count


def _choose(points: Array, costs: Array, given: int, count: int) -> Array:
    """Return the first ``given`` points and the cheapest of the others that are apart from each other."""
    chosen = list(range(given))
    order = given + np.argsort(costs[given:], kind="stable")
    apart = STARTS_APART * np.sqrt(points.shape[1])
    for index in order.tolist():
        if len(chosen) >= max(count, given + 1):
            break
        if np.all(np.linalg.norm(points[chosen] - points[index], axis=1) >= apart):
            chosen.append(index)
    rest = [i for i in order.tolist() if i not in chosen]
    return points[chosen + rest[: max(0, count - len(chosen))]]


def _descend(
    objective: Objective,
    front: Front,
    tolerance: float,
    slow: float,
    iterations: int,
    ended: Sequence[DescentEnd] = (),
) -> None:
    """Step all descents of a front together until each has settled, is stuck, given up or has taken its iterations."""
    earlier, patience = front.model.costs**2, max(SLOW_ITERATIONS, objective.dimension // SLOW_PARAMETERS)
    hoped, several = np.zeros(len(earlier)), len(earlier) > 1
    before = len(ended), np.array([d.cost for d in ended if d.settled])
    for iteration in range(iterations):
        under_way, squares = front.under_way, front.model.costs**2
        if iteration % patience == patience - 1:
            judged = under_way & ((front.raises == FIRST_RAISE) | (front.raises > LAST_RAISE))
            creeping = np.where(earlier - squares < KEPT * hoped, max(slow, SLOW_SETTLED), slow)
            front.settled |= judged & (squares >= earlier * (1.0 - creeping))
            front.given_up |= judged & (squares - REACH * (earlier - squares) > objective.best_cost**2)
            earlier = squares
        steps = front.dampings, front.reaches, np.flatnonzero(under_way)
        trials, predicted, attainable = damped_steps(front.points, front.model, *steps, objective.exact)
        if iteration % patience == 0:
            hoped = attainable
        promises, best = (predicted, attainable), objective.best_cost
        active = going_on(front.ends, front.raises, squares, promises, best**2, tolerance)
        if not len(active) or (several and decided(front.ends, front.model.costs, attainable, best, before)):
            return
        failed = active[front.raises[active] > FIRST_RAISE]
        if objective.exact and len(failed):
            _fan(objective, front, failed, (trials, predicted))
        gained = objective.normal_equations(trials[active])
        descents = front.points, front.dampings, front.raises, front.reaches, front.stuck
        keep_better(descents, front.model, active, (trials, predicted), gained)


def _fan(objective: Objective, front: Front, active: Index, trial: tuple[Array, Array]) -> None:
    """Put the best of each descent's step and those at other dampings in place of it.

    In a narrow curved valley the damping that leads on changes from step to step.
    """
    trials, promised = trial
    dampings = front.dampings[active, None] * FANNED
    others, falls = fanned_steps(front.points, front.model, dampings, active)
    steps = np.concatenate([trials[active, None], others], axis=1)
    costs = objective.costs(steps.reshape(-1, steps.shape[2])).reshape(steps.shape[:2])
    best, row = np.argmin(costs, axis=1), np.arange(len(active))
    trials[active] = steps[row, best]
    promised[active] = np.column_stack([promised[active], falls])[row, best]
    front.dampings[active] = np.column_stack([front.dampings[active], dampings])[row, best]


def _polish(objective: Objective, front: Front, tolerance: float) -> Front:
    """Let the leader of a front go on to a tolerance, and return it."""
    leader = slice(best := int(np.argmin(front.model.costs)), best + 1)
    # slices are views: the points and costs that the leader gains are the front's
    alone = Front(front.points[leader], NormalEquations(*(part[leader] for part in front.model)))
    alone.dampings = front.dampings[leader]
    last = tolerance < SETTLED_TOLERANCE
    if last or (front.under_way[best] and front.model.costs[best] <= objective.best_cost):
        slow, iterations = (SLOW_POLISHED, LEADER_ITERATIONS) if last else (SLOW_SETTLED, DESCENT_ITERATIONS)
        _descend(objective, alone, tolerance, slow, iterations)
        front.settled[best] |= alone.settled[0]
        front.stuck[best] |= alone.stuck[0]
    return alone


def _joined(ended: Termination, least: float, front: Front, zero: float) -> Termination:
    """Return where descents ended with those of a front, best first, and how many settled at the least cost."""
    limit = least * (1.0 + AGREEMENT_RTOL) + zero
    settled, near = front.settled | front.stuck, front.model.costs <= limit
    # what came as far as one that settled agrees with it
    settled |= near & np.any(settled & near)
    rows = zip(front.model.costs, front.points, settled, strict=True)
    own = [DescentEnd(float(c), p.copy(), bool(s)) for c, p, s in rows if np.isfinite(c)]
    descents = tuple(sorted([*ended.descents, *own], key=lambda d: d.cost))
    return Termination(ended.reason, descents, sum(d.settled and d.cost <= limit for d in descents))
