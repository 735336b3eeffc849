"""A problem in the fewest parameters that give all responses of its model, and their inverse to the model's own."""

from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array, ReducedModel
from mrfit.search.cube import Cube, cube_of
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.result import SearchResult

# Share of a parameter by which it may lie beyond its bound: rounding
BOUND_ROUNDING = 1e-9


def reduced_problem(posed: LeastSquaresProblem) -> "tuple[LeastSquaresProblem, ReducedWay] | None":
    """Return a problem in its model's reduced parameters with their inverse; None without, or with a user's bounds."""
    reduced, own = posed.assembly.reduced, posed.cube
    as_given = [(p.low, p.high) for p in own.params] == [(p.low, p.high) for p in posed.assembly.spec.params]
    if reduced is None or not as_given or len(own.free) < len(own.params):
        return None
    way = ReducedWay(reduced, cube_of(reduced.spec, {}, {}, {}), own)
    assembly = replace(
        posed.assembly,
        spec=reduced.spec,
        simulate=reduced.response,
        rough=reduced.rough,
        reduced=None,
        sensitivities=reduced.sensitivities,
    )
    return replace(posed, assembly=assembly, cube=way.cube), way


@dataclass(frozen=True)
class ReducedWay:
    """The way from reduced parameters back to a model's own, each in its cube."""

    reduced: ReducedModel
    cube: Cube
    own: Cube

    def theta(self, point: Array) -> Array:
        """Return the model's parameters (1, K) at a point (R,) of the reduced cube."""
        return self.reduced.restore(self.cube.to_theta(point[None, :]))

    def inside(self, point: Array) -> bool:
        """Return whether these are within their bounds, and the point at no bound that is none of theirs."""
        low, high = np.array([(p.low, p.high) for p in self.own.params]).T
        slack = BOUND_ROUNDING * np.maximum(np.abs(low), np.abs(high))
        theta, (below, above) = self.theta(point), (point <= BOUND_ROUNDING, point >= 1.0 - BOUND_ROUNDING)
        bound = np.count_nonzero((theta <= low + slack) | (theta >= high - slack))
        within = np.all((theta >= low - slack) & (theta <= high + slack))
        return bool(within and np.count_nonzero(below | above) <= bound)

    def restored(self, outcome: SearchResult) -> SearchResult:
        """Return an outcome with its points as the nearest ones of the model's own cube."""
        bad = outcome.first_nonfinite
        first_nonfinite = None if bad is None else self.own.to_points(self.theta(bad))[0]
        return replace(outcome, point=self.own.to_points(self.theta(outcome.point))[0], first_nonfinite=first_nonfinite)
