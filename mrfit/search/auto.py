"""Multistart least squares: linear parameters eliminated, in the fewest parameters, on thinned data first."""

from dataclasses import dataclass
from typing import ClassVar

from mrfit.core.specs import Array, OptimizerSpec
from mrfit.optimizers import multistart
from mrfit.search import coarse_to_fine, reparametrised
from mrfit.search.limits import SearchContext
from mrfit.search.problem import Problem, measured
from mrfit.search.result import SearchResult
from mrfit.search.strategy import Strategy

SPEC = OptimizerSpec(
    name=coarse_to_fine.AUTO_NAME,
    title="Multi-start bounded Levenberg-Marquardt, linear parameters solved for, on thinned data first",
    reference=f"{multistart.SPEC.reference}; variable projection: Golub and Pereyra (1973), Kaufman (1975)",
    kind="global",
    budget=multistart.SPEC.budget,
    ends=True,
)


@dataclass(frozen=True)
class Auto(Strategy):
    """Strategy: descents from many starts, see ``reparametrised``, ``coarse_to_fine`` and ``variable_projection``.

    Attributes
    ----------
    own_parameters
        Whether to search in the model's own parameters where it has fewer that give its responses, too.
    """

    own_parameters: bool = False
    # every start has a descent of its own; characteristic points are one start of many
    many_starts: ClassVar[bool] = True
    from_points: ClassVar[bool] = False

    def budget(self, dimension: int) -> int:
        """Return the evaluations that it asks for where nobody limits them."""
        return coarse_to_fine.default_budget(dimension)

    def search(self, problem: Problem, starts: Array, how: SearchContext) -> SearchResult:
        """Return where it ends from start points (S, F) and further ones."""
        way = coarse_to_fine.search if self.own_parameters else reparametrised.search
        return way(measured(problem), starts, how)
