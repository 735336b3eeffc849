"""What an optimizer sees: a cost over the unit cube that counts, remembers the best point, survives bad ones."""

import time
from collections.abc import Callable
from dataclasses import InitVar, dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from mrfit.core.specs import Array
from mrfit.core.workers import give_up
from mrfit.kernels.cube import stencils

# Relative step of one-sided differences: the square root of float64's resolution, widened since simulations carry
# table and interpolation errors of about 1e-9.
DIFFERENCE_STEP = 1e-5

# A gain in cost smaller than this share does not count as progress.
STALL_RTOL = 1e-6

# Most numbers of residuals held at once for normal equations; larger batches are simulated in blocks.
BLOCK_NUMBERS = 1 << 22


class DescentEnd(NamedTuple):
    """Where one of several starts ended: its cost, its point (K,) and whether it settled in a local minimum."""

    cost: float
    point: Array
    settled: bool


@dataclass(frozen=True)
class Termination:
    """What an optimizer says about its end.

    Attributes
    ----------
    reason
        Why it stopped by itself, in a few words; empty where it used all evaluations that it had.
    descents
        Where each of several starts ended, best first.
    agreeing
        How many of these settled at the best cost.
    """

    reason: str = ""
    descents: tuple[DescentEnd, ...] = ()
    agreeing: int = 0


class BudgetSpent(Exception):
    """Raised by an Objective when the allowed evaluations are used up; the best point so far stays in the Objective.

    Attributes
    ----------
    ended
        What the optimizer that was stopped adds to it, if anything.
    """

    ended = Termination()


class TimeSpent(BudgetSpent):
    """Raised by an Objective when its deadline has passed."""


class NoProgress(BudgetSpent):
    """Raised by an Objective when the best cost has not improved for ``patience`` evaluations, or by an optimizer."""


class Allowance(NamedTuple):
    """When an objective ends a search.

    Attributes
    ----------
    budget
        Evaluations (simulated points, those of Jacobians included) up to which it counts.
    patience
        Evaluations without progress after which it ends, or None.
    deadline
        Reading of ``time.monotonic()`` at which it ends, or None; the first batch is always evaluated.
    """

    budget: int
    patience: int | None = None
    deadline: float | None = None


class NormalEquations(NamedTuple):
    """Gauss–Newton model of P points: cost (P,), Jᵀr (P, K) and JᵀJ (P, K, K), both divided by the residuals' number.

    A point that cannot be simulated has infinite cost and zeros for the rest; a parameter whose step cannot be
    simulated has zeros in its row and column.
    """

    costs: Array
    gradients: Array
    curvatures: Array


class Coordinates(Protocol):
    """The free parameters in physical units, as optimizers see them that work in the parameters themselves."""

    @property
    def low(self) -> Array:
        """Lower bounds, shape (K,)."""

    @property
    def high(self) -> Array:
        """Upper bounds, shape (K,)."""

    def to_values(self, points: Array) -> Array:
        """Map points (P, K) of the cube to values (P, K)."""

    def to_points(self, values: Array) -> Array:
        """Map values (P, K) to points (P, K) of the cube."""


@dataclass(frozen=True)
class CubeCoordinates:
    """The unit cube itself, of K parameters."""

    dimension: int

    @property
    def low(self) -> Array:
        """Zeros, shape (K,)."""
        return np.zeros(self.dimension)

    @property
    def high(self) -> Array:
        """Ones, shape (K,)."""
        return np.ones(self.dimension)

    def to_values(self, points: Array) -> Array:
        """Return the points as they are."""
        return points

    def to_points(self, values: Array) -> Array:
        """Return the values as they are."""
        return values


@dataclass
class Objective:
    """Root-mean-square cost over the unit cube: counts evaluations, remembers the best point, ends with its allowance.

    Nobody but itself writes what it counts; ``allow`` and ``restate`` are all that is done to it from outside.

    Parameters
    ----------
    residuals_of
        Maps points (P, K) of the cube to weighted residuals (P, M), all of them simulated in one batch. Rows may hold
        non-finite values.
    start
        Start point, shape (K,), in the cube.
    budget
        Evaluations allowed, see ``allow``.
    on_progress
        Called as ``on_progress(evaluations, best_cost)`` after every batch.
    starts
        Further start points worth trying, shape (S, K).
    coordinates
        The parameters in physical units, for optimizers that ask for them; None where the cube is all there is.

    Attributes
    ----------
    evaluations, nonfinite
        Points simulated so far, and how many of them gave non-finite residuals.
    first_nonfinite
        The first of these points.
    best_cost, best_point
        The least cost so far and where; infinity and ``start`` as long as nothing finite was met.
    history
        (evaluations, best cost) after every batch.
    allowance
        When it ends the search.
    """

    residuals_of: Callable[[Array], Array]
    start: Array
    budget: InitVar[int]
    on_progress: Callable[[int, float], None] | None = None
    starts: Array | None = None
    coordinates: Coordinates | None = None
    evaluations: int = field(init=False, default=0)
    nonfinite: int = field(init=False, default=0)
    first_nonfinite: Array | None = field(init=False, default=None)
    best_cost: float = field(init=False, default=np.inf)
    best_point: Array = field(init=False)
    history: list[tuple[int, float]] = field(init=False, default_factory=list)
    allowance: Allowance = field(init=False)
    _gained: tuple[int, float] = field(init=False, default=(0, np.inf))
    _width: int = field(init=False, default=0)

    def __post_init__(self, budget: int) -> None:
        self.start = np.clip(np.asarray(self.start, dtype=np.float64), 0.0, 1.0)
        self.best_point, self.allowance = self.start.copy(), Allowance(budget)

    def allow(self, evaluations: int, patience: int | None = None, deadline: float | None = None) -> None:
        """Allow so many evaluations from here on, some of them without progress, until a time; see ``Allowance``."""
        self.allowance = Allowance(self.evaluations + evaluations, patience, deadline)
        self._gained = (self.evaluations, self.best_cost)

    def restate(self, residuals_of: Callable[[Array], Array]) -> None:
        """Go on with another problem over the same cube: the best point stays, what it costs is not known any more."""
        self.residuals_of, self.best_cost = residuals_of, np.inf

    @property
    def dimension(self) -> int:
        """Number of free parameters K."""
        return len(self.start)

    @property
    def simulations(self) -> int:
        """Evaluations that the cost of one point takes."""
        return 1

    @property
    def exact(self) -> bool:
        """Whether the Gauss–Newton models are free of the noise of differences."""
        return False

    @property
    def model_simulations(self) -> int:
        """Evaluations that the Gauss–Newton model of one point takes."""
        return self.dimension + 1

    @property
    def remaining(self) -> int:
        """Points whose cost the evaluations left allow."""
        return max(self.allowance.budget - self.evaluations, 0) // self.simulations

    def costs(self, points: Array) -> Array:
        """Return the RMS residual of every point, (P, K) -> (P,); points are clipped into the cube.

        A non-finite simulation costs infinity and is counted.

        Raises
        ------
        BudgetSpent
            If the budget does not cover all points; those it covers are evaluated first.
        """
        costs = self._evaluate(points[: self.remaining])[1]
        if len(costs) < len(points):
            raise BudgetSpent
        return costs

    def residuals(self, point: Array) -> Array:
        """Return the residuals (M,) at one point (K,), clipped into the cube; non-finite values are passed on.

        Raises
        ------
        BudgetSpent
            If no evaluation is left.
        """
        self._require(1)
        residuals: Array = self._evaluate(point[None, :])[0][0]
        return residuals

    def jacobian(self, point: Array) -> Array:
        """Return the Jacobian (M, K) of the residuals at one point, one batch of K + 1 points; see `linearise`."""
        return self.linearise(point)[1]

    def linearise(self, point: Array) -> tuple[Array, Array]:
        """Return residuals (M,) and Jacobian (M, K) at one point by one-sided differences, one batch of K + 1 points.

        Steps point into the cube, so that no bound is crossed. Columns with non-finite values are zero.

        Raises
        ------
        BudgetSpent
            If fewer than K + 1 evaluations are left.
        """
        self._require(self.dimension + 1)
        stencil, steps = stencils(point[None, :], DIFFERENCE_STEP)
        rows, costs = self._evaluate(stencil[0])
        with np.errstate(all="ignore"):
            jacobian = ((rows[1:] - rows[0]) / steps[0][:, None]).T
        jacobian[:, ~np.isfinite(costs[1:] + costs[0])] = 0.0
        return rows[0], jacobian

    def normal_equations(self, points: Array) -> NormalEquations:
        """Return the Gauss–Newton models of all points (P, K), simulated together as P·(K + 1) points.

        Only as many points as the budget covers are evaluated; the others have infinite cost.

        Raises
        ------
        BudgetSpent
            If the budget covers none of them.
        """
        count, dimension = points.shape
        each = self.model_simulations
        affordable = min(count, (self.allowance.budget - self.evaluations) // each)
        if affordable < 1:
            raise BudgetSpent
        block = max(1, BLOCK_NUMBERS // (each * max(self._width, 1)))
        if block >= count == affordable:
            return NormalEquations(*self._models(points))
        costs, gradients = np.full(count, np.inf), np.zeros((count, dimension))
        curvatures = np.zeros((count, dimension, dimension))
        for first in range(0, affordable, block):
            part = slice(first, min(first + block, affordable))
            costs[part], gradients[part], curvatures[part] = self._models(points[part])
        return NormalEquations(costs, gradients, curvatures)

    def _models(self, points: Array) -> tuple[Array, Array, Array]:
        around, steps = stencils(points, DIFFERENCE_STEP)
        rows, flat = self._evaluate(around.reshape(-1, self.dimension))
        costs = flat.reshape(around.shape[:2])
        # contiguous, as those of one point are: kernels are compiled for each layout
        return costs[:, 0].copy(), *_products(rows.reshape(*costs.shape, self._width), costs, steps)

    def _require(self, evaluations: int) -> None:
        if self.remaining < evaluations:
            raise BudgetSpent

    def _evaluate(self, points: Array) -> tuple[Array, Array]:
        if not len(points):
            return np.empty((0, 0)), np.empty(0)
        self._watch()
        inside = np.clip(points, 0.0, 1.0)
        with np.errstate(all="ignore"):
            residuals = self.residuals_of(inside)
            costs = np.sqrt(np.einsum("pm,pm->p", residuals, residuals) / residuals.shape[1])
        self._width = residuals.shape[1]
        return residuals, self._noted(inside, costs, len(points) * self.simulations)

    def _noted(self, points: Array, costs: Array, evaluations: int) -> Array:
        """Return the costs of points just simulated, infinite where they are not finite, and keep account of them."""
        bad = ~np.isfinite(costs)
        if bad.any():
            self.nonfinite += int(bad.sum())
            if self.first_nonfinite is None:
                self.first_nonfinite = points[int(np.argmax(bad))].copy()
            costs[bad] = np.inf
        self.evaluations += evaluations
        best = int(np.argmin(costs))
        if costs[best] < self.best_cost:
            self.best_cost, self.best_point = float(costs[best]), points[best].copy()
        self.history.append((self.evaluations, self.best_cost))
        if self.on_progress:
            self.on_progress(self.evaluations, self.best_cost)
        return costs

    def _watch(self) -> None:
        """End the search where the clock or the lack of progress says so; never before the first evaluation."""
        give_up()
        if not self.evaluations:
            return
        _, patience, deadline = self.allowance
        if deadline is not None and time.monotonic() >= deadline:
            raise TimeSpent
        since, reference = self._gained
        if self.best_cost < reference * (1.0 - STALL_RTOL):
            self._gained = (self.evaluations, self.best_cost)
        elif patience is not None and self.evaluations - since >= patience:
            raise NoProgress


class InParameters:
    """An objective as an optimizer sees it that works in the parameters themselves.

    Costs, budget and best point are the objective's; only the coordinates differ.

    Attributes
    ----------
    low, high
        Bounds (K,) of the parameters, in physical units.
    """

    def __init__(self, objective: Objective) -> None:
        self._objective = objective
        self._coordinates = objective.coordinates or CubeCoordinates(objective.dimension)
        self.low, self.high = self._coordinates.low, self._coordinates.high

    @property
    def dimension(self) -> int:
        """Number of free parameters K."""
        return self._objective.dimension

    @property
    def remaining(self) -> int:
        """Parameter vectors whose cost the evaluations left allow."""
        return self._objective.remaining

    @property
    def best_cost(self) -> float:
        """The least cost so far."""
        return self._objective.best_cost

    @property
    def best_values(self) -> Array:
        """Where it is, shape (K,)."""
        values: Array = self._coordinates.to_values(self._objective.best_point[None, :])[0]
        return values

    def anywhere(self, count: int, rng: np.random.Generator) -> Array:
        """Return parameter vectors (P, K) drawn evenly from the cube, over decades where bounds span some."""
        return self._coordinates.to_values(rng.random((count, self.dimension)))

    def costs(self, values: Array) -> Array:
        """Return the RMS residual of every parameter vector, (P, K) -> (P,), see ``Objective.costs``."""
        return self._objective.costs(self._coordinates.to_points(values))


def _products(rows: Array, costs: Array, steps: Array) -> tuple[Array, Array]:
    """Return Jᵀr (P, K) and JᵀJ (P, K, K) per residual from stencil rows (P, K + 1, M)."""
    sound = np.isfinite(costs[:, 1:]) & np.isfinite(costs[:, :1])
    with np.errstate(all="ignore"):
        differences = rows[:, 1:] - rows[:, :1]
        differences[~sound] = 0.0
        centres = np.where(np.isfinite(costs[:, :1]), rows[:, 0], 0.0)
        gradients = np.matmul(differences, centres[:, :, None])[:, :, 0] / steps
        curvatures = np.matmul(differences, differences.transpose(0, 2, 1)) / (steps[:, :, None] * steps[:, None, :])
    samples = rows.shape[2]
    return gradients / samples, curvatures / samples
