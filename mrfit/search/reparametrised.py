"""Search in the fewest parameters that give all responses of a model, and return to its own."""

from dataclasses import replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.search import coarse_to_fine
from mrfit.search.limits import SearchContext
from mrfit.search.problem import LeastSquaresProblem
from mrfit.search.reduced_problem import reduced_problem
from mrfit.search.result import SearchResult
from mrfit.search.variable_projection import projection_of


def search(posed: LeastSquaresProblem, starts: Array, run: SearchContext) -> SearchResult:
    """Return where `auto` ends, as ``coarse_to_fine.search``; in the model's reduced parameters where it has such.

    Where what they reach lies outside the bounds of the model's own parameters, or at a bound that these do not have,
    the search goes on in these. Where the user changed those bounds, or fixed a parameter, they are not used.
    """
    found = reduced_problem(posed)
    if found is None:
        return coarse_to_fine.search(posed, starts, run)
    less, way = found
    starts = way.cube.to_points(way.reduced.reduce(way.own.to_theta(starts)))
    coarse = coarse_to_fine.search_thinned(less, starts, run)
    outcome = coarse.outcome
    if len(coarse.points) and way.inside(outcome.point):
        outcome = coarse_to_fine.refine_on_all_data(less, coarse, run)
    ended = way.restored(outcome)
    if not np.isfinite(outcome.cost) or way.inside(outcome.point):
        return ended
    projection = projection_of(replace(posed, blocks=coarse_to_fine.thinned(posed.blocks)), ended.point[None, :])
    return coarse_to_fine.refine_on_all_data(
        posed, coarse_to_fine.ThinnedSearch(ended, ended.point[None, :], projection), run
    )
