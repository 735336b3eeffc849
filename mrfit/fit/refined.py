"""The last steps of a fit to very long segments: from where a search on some of their pieces ended, on all of them.

Gauss–Newton steps take sums over all samples, which are gathered piece by piece. The pieces that were searched are
hundreds of times more samples than parameters, so that one or two steps reach the optimum of all.
"""

from dataclasses import dataclass, replace

import numpy as np

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.uncertainty import sensitivities
from mrfit.fit.identify import FitGroup, weights_of
from mrfit.search.cube import Cube
from mrfit.search.problem import SegmentBlock, differences
from mrfit.search.result import SearchResult
from mrfit.simulate.assembly import Assembly

# Most steps, and share of the unit of chi square below which no fall of the sum of squares counts: estimates are then
# within a thirtieth of their standard errors of the optimum
REFINING_STEPS, FALL = 4, 1e-3
# Share of the greatest curvature below which a direction is not followed
FLAT = 1e-11


@dataclass(frozen=True)
class _Sums:
    """Sum of squared weighted errors over all samples, half its gradient (F,), and its curvature (F, F)."""

    square: float
    gradient: Array
    curvature: Array
    samples: int

    def step(self) -> Array:
        """Return the Gauss–Newton step, along the directions that the output moves along."""
        scale = np.sqrt(np.maximum(np.diag(self.curvature), 1e-300))
        values, vectors = np.linalg.eigh(self.curvature / np.outer(scale, scale))
        known = values > FLAT * values[-1]
        along = vectors[:, known]
        taken: Array = -(along @ ((along.T @ (self.gradient / scale)) / values[known])) / scale
        return taken


def refined(group: FitGroup, assembly: Assembly, cube: Cube, found: SearchResult, weight: str) -> SearchResult:
    """Return where steps on all samples that are fitted end.

    Parameters
    ----------
    group
        What is fitted.
    assembly, cube
        The model and its free parameters.
    found
        Where the search on the pieces that stand for all ended.
    weight
        Weighting of conditions.
    """
    factors = _factors(group, weight)
    best = _sums(group, factors, assembly, cube, found.point)
    point, spent = found.point, 1 + 2 * len(found.point)
    trial = np.clip(point + best.step(), 0.0, 1.0)
    for _ in range(REFINING_STEPS):
        foreseen = -float(best.gradient @ (trial - point))
        if not foreseen > FALL * best.square / best.samples:
            break
        sums = _sums(group, factors, assembly, cube, trial)
        spent += 1 + 2 * len(point)
        if sums.square < best.square:
            best, point = sums, trial
            trial = np.clip(point + best.step(), 0.0, 1.0)
        else:
            trial = (point + trial) / 2.0
    cost = float(np.sqrt(best.square / best.samples))
    return replace(found, point=point, cost=cost, nfev=found.nfev + spent)


def _factors(group: FitGroup, weight: str) -> list[float]:
    """Return the factor on the error of every block that is fitted."""
    places = group.fitted
    if weight == "none":
        return [1.0] * len(places)
    # those of one segment are alike: the pieces that were searched tell it
    found = weights_of(group.training, group.training_floors, weight)
    known: dict[str, list[float]] = {}
    for segment, factor in zip(group.training.segments, found, strict=True):
        known.setdefault(segment.id, []).append(float(factor))
    return [float(np.mean(known[group.full.parts[k].segment.id])) for k in places]


def _sums(group: FitGroup, factors: list[float], assembly: Assembly, cube: Cube, point: Array) -> _Sums:
    square, samples, free = 0.0, 0, len(point)
    gradient, curvature = np.zeros(free), np.zeros((free, free))
    for place, factor in zip(group.fitted, factors, strict=True):
        block = group.full.parts[place].folded(group.ahead)
        scale = factor * np.sqrt(block.counts)

        def errors(points: Array, block: SegmentBlock = block, scale: Array = scale) -> Array:
            return scale * differences(block, assembly, cube.to_theta(points))

        left, slopes = errors(point[None, :])[0], sensitivities(errors, point)
        square += float(left @ left) + factor**2 * block.scatter
        gradient += slopes.T @ left
        curvature += slopes.T @ slopes
        samples += block.samples
    return _Sums(square, gradient, curvature, samples)
