"""One descent from the best of a few starts near the optimum: on thinned data first, then on all of them."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from mrfit.core.specs import Array
from mrfit.optimizers import multistart
from mrfit.optimizers.cost.objective import Objective
from mrfit.search import coarse_to_fine
from mrfit.search.limits import SearchContext, offset_progress
from mrfit.search.problem import LeastSquaresProblem, Problem, measured
from mrfit.search.result import ChainLink, SearchResult
from mrfit.search.strategy import Strategy
from mrfit.search.variable_projection import projection_of

DESCENT_NAME = "descent"


@dataclass(frozen=True)
class Descent(Strategy):
    """Strategy: a damped Gauss-Newton descent, linear parameters eliminated.

    Attributes
    ----------
    evaluations
        On thinned data, and on all of them again, for each remaining parameter and one more.
    tolerance
        Share of the squared cost that it may leave.
    exact_below
        Cost below which it goes on to the tolerance of ``multistart``.
    far_above
        Cost on thinned data above which it ends where that is, measured on all of them.
    shortens
        Whether it leaves out what comes so long before the first sample compared that the model forgets it.
    thinned_tolerance
        The share that it may leave on thinned data; None for the same.
    """

    evaluations: int
    tolerance: float
    exact_below: float
    far_above: float = np.inf
    shortens: bool = False
    thinned_tolerance: float | None = None
    # starts that cost little more than the best descend, too; characteristic points say nothing of an optimum nearby
    many_starts: ClassVar[bool] = True
    from_points: ClassVar[bool] = False

    def budget(self, dimension: int) -> int:
        """Return the evaluations that it asks for where nobody limits them."""
        return 2 * self.evaluations * (dimension + 1)

    def search(self, problem: Problem, starts: Array, how: SearchContext) -> SearchResult:
        """Return where it ends from the best of start points (S, F)."""
        posed, links = measured(problem), list[ChainLink]()
        if self.shortens:
            posed = without_forgotten(posed, starts, coarse_to_fine.LEAD_CHANGE_ROUGH)
        at = self.thinned(posed, starts)
        projection = projection_of(at, starts)
        for damping in (multistart.FIRST_DAMPING, multistart.LAST_DAMPING):
            before = links[0].evaluations if links else 0
            if links:
                at = self.closely(posed, starts)
            objective = coarse_to_fine.objective_of(at, projection, starts, offset_progress(before, how.on_progress))
            objective.allow(self._allowed(objective, how, links), deadline=how.deadline)
            links.append(self._link(objective, damping, how, before))
            starts = coarse_to_fine.to_full_cube(objective, objective.best_point[None, :])
        result = SearchResult(
            point=starts[0],
            cost=objective.best_cost,
            nfev=sum(link.evaluations for link in links),
            nonfinite=objective.nonfinite,
            first_nonfinite=objective.first_nonfinite,
            links=(replace(links[0], preliminary=True), links[1]),
        )
        return coarse_to_fine.completed(result, objective, starts)

    def thinned(self, posed: LeastSquaresProblem, starts: Array) -> LeastSquaresProblem:
        """Return the problem with which it begins from start points (S, F)."""
        return replace(posed, blocks=coarse_to_fine.thinned(posed.blocks))

    def closely(self, posed: LeastSquaresProblem, points: Array) -> LeastSquaresProblem:
        """Return the problem with which it goes on from points (1, F)."""
        return posed

    def _allowed(self, objective: Objective, how: SearchContext, links: Sequence[ChainLink]) -> int:
        """Return the evaluations of a descent, those of a single model where the one before ended too far."""
        if links and links[0].cost > self.far_above:
            return objective.model_simulations
        allowed = self.evaluations * (objective.dimension + 1)
        return allowed if how.limits.budget is None else min(allowed, max(how.limits.budget // 2, 1))

    def _link(self, objective: Objective, damping: float, how: SearchContext, before: int) -> ChainLink:
        """Return what a descent did on thinned data or, after so many evaluations, on all, where it may end exactly."""
        allowed = objective.allowance.budget - objective.evaluations
        tolerance = self.tolerance if before else self.thinned_tolerance or self.tolerance
        over = multistart.refine(objective, np.asarray(objective.starts), tolerance, damping)
        if before and objective.best_cost < self.exact_below:
            over = multistart.refine(objective, objective.best_point[None, :])
        late = how.deadline is not None and time.monotonic() >= how.deadline
        return ChainLink(
            name=DESCENT_NAME,
            kind="local",
            allowed=allowed,
            evaluations=objective.evaluations,
            cost=objective.best_cost,
            ending="finished" if over else "time" if late else "budget",
            reason="settled" if over else "time limit reached" if late else f"budget of {allowed} evaluations spent",
            history=tuple((before + e, cost) for e, cost in objective.history),
        )


def without_forgotten(posed: LeastSquaresProblem, points: Array, share: float) -> LeastSquaresProblem:
    """Return a problem without what changes no residual at points (P, F) by more than a share of the largest one.

    That is what comes long before the first sample compared.
    """
    return coarse_to_fine.shortened(posed, points, share, coarse_to_fine.LEADS)
