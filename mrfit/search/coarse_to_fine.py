"""Search on thinned data first, on all of it last: a descent far from the optimum needs no more than its direction."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from mrfit.core.specs import Array, Options
from mrfit.optimizers import multistart
from mrfit.optimizers.cost.objective import Objective, Termination
from mrfit.search import chain
from mrfit.search.limits import Limits, ProgressCallback, SearchContext, offset_progress, seconds_left
from mrfit.search.problem import PHASE_BINS, SETTLE_CYCLES, LeastSquaresProblem, SegmentBlock
from mrfit.search.result import ChainLink, SearchResult
from mrfit.search.variable_projection import Projection, SeparableObjective, projection_of

COARSE_BINS = 128
# Fewest samples that thinned blocks keep together, and each of them; and the error in a drive, as a share of the range,
# that thinning may bring: anywhere, or in a channel that jumps, at so many of the samples
THINNED_SAMPLES_MIN, FEWEST_EACH = 4096, 512
DRIVE_ERROR, JUMP, CALM = 0.02, 0.3, 0.85
THINNINGS = (16, 8, 4, 3, 2)
# Descents of the coarse search that are tried on all data
TRIED = 4
# Least cost on all data over that on thinned ones between which a minimum is taken as one of all data: where edges blur
# in thinning it is lower, where thinning overlooks what is steep it is higher
FAITHFUL = (0.5, 1.1)
# Descents on thinned data that ended no more than this share above the best, and so far apart along some axis of the
# cube, may be better on all data
WORTH_TRYING, DESCENTS_APART = 0.3, 0.02
# Shares of what comes before the first sample compared that may be enough
LEADS = (0.0, 0.0625, 0.5)
# Share of the largest residual by which leaving out the rest may change any: bit by bit, on thinned data, at an optimum
UNCHANGED, LEAD_CHANGE_ROUGH, LEAD_CHANGE_CLOSE = 1e-12, 1e-5, 1e-8
# Tolerance to which the best descent goes on on thinned data, where a step costs a fraction of one on all data
THINNED_TOLERANCE = 1e-5
# Share of the unit of chi square, the squared cost per sample, below which no fall counts on all data: estimates are
# then within a thirtieth of their standard errors of the optimum
FALL = 1e-3
# Steps on all data for which evaluations are kept back where they are limited
STEPS_KEPT_BACK = 15

# Under what name its links are told
AUTO_NAME = "auto"


class ThinnedSearch(NamedTuple):
    """Where a search on thinned data ended, the points (S, F) worth going on from, and which parameters are linear.

    There are no such points where the search was one on all data.
    """

    outcome: SearchResult
    points: Array
    projection: Projection | None


def search(posed: LeastSquaresProblem, starts: Array, run: SearchContext) -> SearchResult:
    """Return where `auto` ends: on thinned data where these are less work, then on all of them.

    Linear parameters are eliminated. The descents' points are those of the remaining parameters.

    Parameters
    ----------
    posed
        The problem on all data.
    starts
        Start points (S, F).
    run
        Source of further starts, and limits of the whole.
    """
    coarse = search_thinned(posed, starts, run)
    return refine_on_all_data(posed, coarse, run) if len(coarse.points) else coarse.outcome


def search_thinned(posed: LeastSquaresProblem, starts: Array, run: SearchContext) -> ThinnedSearch:
    """Return where `auto` ends on thinned data; on all of them where they are few, or nothing is to be searched."""
    budget, nowhere = _budget(posed, run), starts[:0]
    seen = np.vstack([posed.cube.probes(), starts])
    thin, projection = thin_problem(posed, seen, budget)
    eliminated = projection is not None and not len(projection.cube.free)
    if eliminated or 2 * thin.rows > posed.rows:
        near = shortened(posed, seen, UNCHANGED, LEADS[:1])
        objective = objective_of(near, projection, starts, run.on_progress)
        outcome = _many_starts(objective, run.rng, run.limits._replace(budget=budget))
        return ThinnedSearch(
            completed(outcome, objective, to_full_cube(objective, outcome.point[None, :])), nowhere, projection
        )
    coarse = objective_of(thin, projection, starts, run.on_progress)
    kept = min(STEPS_KEPT_BACK * coarse.model_simulations, budget // 2)
    limits = run.limits._replace(budget=max(budget - kept, 1))
    first = _polished(_many_starts(coarse, run.rng, limits, multistart.SETTLED_TOLERANCE), coarse)
    points = to_full_cube(coarse, np.array(_apart(first)))
    return ThinnedSearch(completed(first, coarse, points), points if np.isfinite(first.cost) else nowhere, projection)


def _budget(posed: LeastSquaresProblem, run: SearchContext) -> int:
    return run.limits.budget or default_budget(len(posed.cube.free))


def default_budget(dimension: int) -> int:
    """Return the evaluations of a search without a limit of its own."""
    return multistart.SPEC.budget(dimension, {})


def _many_starts(
    objective: Objective, rng: np.random.Generator, limits: Limits, tolerance: float = multistart.EXACT_CHANGE
) -> SearchResult:
    """Return where descents from many starts end on one problem, see ``optimizers.multistart``."""

    def minimise(objective: Objective, rng: np.random.Generator, options: Options) -> Termination:
        return multistart.search(objective, rng, tolerance)

    return chain.run_steps([chain.ChainStep(AUTO_NAME, multistart.SPEC, minimise, {})], objective, rng, limits)


def thin_problem(
    posed: LeastSquaresProblem, points: Array, budget: int
) -> tuple[LeastSquaresProblem, Projection | None]:
    """Return the problem on thinned data, simulated roughly where the model can, and which parameters are linear.

    It keeps of what comes before the first sample compared what is remembered at points (P, F).
    """
    assembly = replace(posed.assembly, simulate=posed.assembly.rough or posed.assembly.simulate)
    thin = replace(posed, blocks=thinned(posed.blocks), assembly=assembly)
    thin = shortened(thin, points, LEAD_CHANGE_ROUGH, LEADS)
    projection = projection_of(thin, points)
    # a small budget is not enough for a point with its best linear parameters on either data
    few = projection is not None and budget < 2 * (len(projection.moving) + 1)
    return thin, None if few else projection


def refine_on_all_data(posed: LeastSquaresProblem, coarse: ThinnedSearch, run: SearchContext) -> SearchResult:
    """Return where a search on thinned data ends when it goes on on all of them.

    Where it does not settle there, or at another cost than before, `auto` begins again on all data.
    """
    first, points, projection = coarse
    budget = _budget(posed, run)
    near = shortened(posed, points[:1], LEAD_CHANGE_CLOSE, LEADS)
    fine = objective_of(near, projection, points, offset_progress(first.nfev, run.on_progress))
    fine.allow(budget - first.nfev, deadline=run.deadline)
    tolerance = min(FALL / posed.samples, THINNED_TOLERANCE)
    ended = multistart.refine(fine, np.asarray(fine.starts), tolerance)
    points = to_full_cube(fine, fine.best_point[None, :])
    if not _unchanged(posed, near, points, 10.0 * LEAD_CHANGE_CLOSE):
        replace_problem(fine, posed)
        ended = multistart.refine(fine, fine.best_point[None, :], tolerance)
        points = to_full_cube(fine, fine.best_point[None, :])
    if ended and FAITHFUL[0] * first.cost <= fine.best_cost <= FAITHFUL[1] * first.cost:
        return completed(_joined(first, fine, None), fine, points)
    left = Limits(max(budget - first.nfev - fine.evaluations, 1), seconds_left(run.deadline), run.limits.stall)
    more = _many_starts(fine, run.rng, left, tolerance)
    return completed(_joined(first, fine, more), fine, to_full_cube(fine, fine.best_point[None, :]))


def objective_of(
    posed: LeastSquaresProblem, projection: Projection | None, starts: Array, on_progress: ProgressCallback | None
) -> Objective:
    """Return the cost over the cube, or over what a projection leaves of it, with start points (S, F) of the cube."""
    if projection is None:
        return Objective(posed.residuals, starts[0], 0, on_progress, starts)
    own = replace(projection, posed=posed)
    points = own.reduced(starts)
    return SeparableObjective(own.residuals, points[0], 0, on_progress, points, projection=own)


def completed(outcome: SearchResult, objective: Objective, points: Array) -> SearchResult:
    """Return an outcome in the whole cube, where its point is the first of some (P, F)."""
    if not isinstance(objective, SeparableObjective):
        return outcome
    projection, bad = objective.projection, outcome.first_nonfinite
    if bad is not None:
        bad = projection.posed.cube.to_points(projection.cube.to_theta(bad[None, :]))[0]
    return replace(outcome, point=points[0], first_nonfinite=bad)


def to_full_cube(objective: Objective, points: Array) -> Array:
    """Return points (P, F') of an objective of ``objective_of`` as points of the whole cube (P, F)."""
    return objective.projection.completed(points) if isinstance(objective, SeparableObjective) else points


def shortened(posed: LeastSquaresProblem, points: Array, share: float, leads: Sequence[float]) -> LeastSquaresProblem:
    """Return a problem without what comes so long before the first sample compared that the model forgets it.

    That is, at those points (P, F) that can be simulated, leaving it out changes no residual by more than a share of
    the largest one.
    """
    with np.errstate(all="ignore"):
        whole = posed.residuals(points)
        finite = np.isfinite(whole).all(axis=1)
        for lead in leads if finite.any() else ():
            short = trim_lead_in(posed, lead)
            if short.simulated < posed.simulated and _equal(whole[finite], short.residuals(points[finite]), share):
                return short
    return posed


def trim_lead_in(posed: LeastSquaresProblem, share: float) -> LeastSquaresProblem:
    """Return a problem whose blocks begin with a share of what they have before the first sample compared."""
    cuts = [int((1.0 - share) * int(b.nodes.min())) for b in posed.blocks]
    blocks = [
        replace(b, drive=np.ascontiguousarray(b.drive[:, cut:]), nodes=b.nodes - cut)
        for b, cut in zip(posed.blocks, cuts, strict=True)
    ]
    return replace(posed, blocks=blocks)


def _unchanged(posed: LeastSquaresProblem, near: LeastSquaresProblem, points: Array, share: float) -> bool:
    with np.errstate(all="ignore"):
        return near is posed or _equal(posed.residuals(points), near.residuals(points), share)


def _equal(one: Array, other: Array, share: float) -> bool:
    return bool(np.all(np.abs(one - other) <= share * np.abs(one).max(axis=1, keepdims=True)))


def replace_problem(objective: Objective, posed: LeastSquaresProblem) -> None:
    """Let an objective go on from its best point with another problem."""
    if isinstance(objective, SeparableObjective):
        objective.repose(posed)
    else:
        objective.restate(posed.residuals)


def _apart(outcome: SearchResult) -> list[Array]:
    """Return the best descents that settled little above the least cost, at points of their own."""
    chosen = [outcome.point]
    for descent in outcome.descents:
        near = descent.settled and descent.cost < outcome.cost * (1.0 + WORTH_TRYING)
        if near and len(chosen) < TRIED and min(np.abs(descent.point - p).max() for p in chosen) > DESCENTS_APART:
            chosen.append(descent.point)
    return chosen


def _polished(first: SearchResult, coarse: Objective) -> SearchResult:
    """Return the outcome of the search on thinned data after its best descent has gone on."""
    if not np.isfinite(first.cost) or first.links[-1].ending == "time":
        return first
    multistart.refine(coarse, first.point[None, :], THINNED_TOLERANCE)
    spent, cost = coarse.evaluations, coarse.best_cost
    link = replace(first.links[-1], evaluations=spent, cost=cost, history=tuple(coarse.history))
    return replace(first, point=coarse.best_point.copy(), cost=cost, nfev=spent, links=(link,))


def _joined(first: SearchResult, fine: Objective, last: SearchResult | None) -> SearchResult:
    """Return one outcome of the search on thinned data and of that on all data, the latter ended by a chain or not."""
    ended = last.links[-1] if last else None
    link = ChainLink(
        name=AUTO_NAME,
        kind="local",
        allowed=ended.allowed if ended else fine.evaluations,
        evaluations=fine.evaluations,
        cost=fine.best_cost,
        ending=ended.ending if ended else "finished",
        reason=ended.reason if ended else "settled on all data",
        history=tuple((first.nfev + e, c) for e, c in fine.history),
    )
    return replace(
        first,
        point=fine.best_point.copy(),
        cost=fine.best_cost,
        nfev=first.nfev + fine.evaluations,
        nonfinite=first.nonfinite + fine.nonfinite,
        first_nonfinite=fine.first_nonfinite if first.first_nonfinite is None else first.first_nonfinite,
        links=(*(replace(before, preliminary=True) for before in first.links), link),
        descents=last.descents if last and last.descents else first.descents,
        agreeing=last.agreeing if last and last.descents else first.agreeing,
    )


def thinned(blocks: Sequence[SegmentBlock]) -> list[SegmentBlock]:
    """Return blocks with fewer samples: a folded cycle in fewer bins, another drive at every n-th sample."""
    fewest = max(THINNED_SAMPLES_MIN // max(len(blocks), 2), FEWEST_EACH)
    return [_fewer_bins(b) if b.weights.shape[1] > 1 else _fewer_samples(_one_cycle(b), fewest) for b in blocks]


def _one_cycle(block: SegmentBlock) -> SegmentBlock:
    """Return a block with its first cycle alone where its drive repeats itself."""
    if not 0 < block.cycle < len(block.target):
        return block
    kept = slice(block.cycle)
    nodes = block.nodes[kept]
    return replace(
        block,
        drive=np.ascontiguousarray(block.drive[:, : int(nodes.max()) + 1]),
        target=block.target[kept],
        nodes=nodes,
        weights=block.weights[kept],
        counts=block.counts[kept],
    )


def _fewer_samples(block: SegmentBlock, fewest: int) -> SegmentBlock:
    for step in THINNINGS:
        if len(block.target) // step >= fewest and _error(block.drive, step) < DRIVE_ERROR:
            return _every(block, step)
    return block


def _fewer_bins(block: SegmentBlock) -> SegmentBlock:
    """Return a folded block with targets at the samples of a coarser cycle, each on the line between its neighbours.

    Means over the coarser bins would blur edges, which targets close to a sample do not.
    """
    step, lead = PHASE_BINS // COARSE_BINS, SETTLE_CYCLES * COARSE_BINS
    phase = (block.nodes[:, 1] - SETTLE_CYCLES * PHASE_BINS + block.weights @ np.arange(-1.0, 3.0)) / step
    node, kept = np.unique(np.minimum(phase.astype(np.int64), COARSE_BINS - 1), return_index=True)
    return replace(
        block,
        drive=np.ascontiguousarray(block.drive[:, ::step]),
        dt=block.dt * step,
        target=np.interp(node, phase, block.target, period=COARSE_BINS),
        nodes=lead + node[:, None],
        weights=np.ones((len(node), 1)),
        counts=np.add.reduceat(block.counts, kept),
        bins=None,
    )


def _error(drive: Array, step: int) -> float:
    """Return the largest error of straight lines between every n-th sample, as a share of each channel's range.

    Where a channel jumps, as a current that is switched does, it is the one that most samples stay below.
    """
    places, worst = np.arange((drive.shape[1] - 1) // step * step + 1), 0.0
    for row in drive:
        span = float(np.ptp(row))
        if span > 0.0:
            errors = np.abs(np.interp(places, places[::step], row[::step]) - row[: len(places)]) / span
            largest = float(np.max(errors))
            worst = max(worst, largest if largest < JUMP else float(np.quantile(errors, CALM)))
    return worst


def _every(block: SegmentBlock, step: int) -> SegmentBlock:
    """Return a full block at every n-th sample, the first target among them."""
    offset = int(block.nodes[0, 0]) % step
    return replace(
        block,
        drive=np.ascontiguousarray(block.drive[:, offset::step]),
        dt=block.dt * step,
        target=block.target[::step].copy(),
        nodes=(block.nodes[::step] - offset) // step,
        weights=np.ascontiguousarray(block.weights[::step]),
        counts=block.counts[::step] * step,
    )
