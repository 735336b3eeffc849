"""Search on thinned data first, on all of it last: a descent far from the optimum needs no more than its direction."""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from mrfit import optimize
from mrfit.fit.problem import PHASE_BINS, SETTLE_CYCLES, Block, Posed, cubic_weights
from mrfit.objective import BudgetSpent, Objective
from mrfit.specs import Array

COARSE_BINS = 128
# Fewest samples a thinned block keeps, and the error in its drive, as a share of the range, that thinning may bring
FEWEST = 2048
DRIVE_ERROR = 0.02
THINNINGS = (16, 8, 4, 2)
# Descents of the coarse search that are tried on all data
TRIED = 4
# Gauss-Newton steps on all data, the share of the squared cost that a last one would still take away, and the singular
# values, as shares of the largest, below which the Jacobian is noise of differences
STEPS = 8
SETTLED = 1e-9
RANK_TOLERANCE = 3e-5
# Thinning is faithful where the least cost on all data is that on thinned ones within this share; edges blur in it
FAITHFUL = 0.1
# Evaluations for each free parameter kept back for the search on all data
KEPT_BACK = 15


def search(
    posed: Posed,
    starts: Array,
    rng: np.random.Generator,
    limits: tuple[int | None, float | None],
    on_progress: Callable[[int, float], None],
) -> optimize.Outcome | None:
    """Return where `auto` on thinned data and least squares on all of them end, None where thinning gains nothing.

    Parameters
    ----------
    posed
        The problem on all data.
    starts
        Start points (S, F).
    rng
        Source of further starts.
    limits
        Evaluations and seconds for the whole, each None for no limit of its own.
    on_progress
        Called as ``on_progress(evaluations, best_cost)``.
    """
    thin = [thinned(b) for b in posed.blocks]
    if 2 * sum(b.drive.shape[1] for b in thin) > sum(b.drive.shape[1] for b in posed.blocks):
        return None
    budget, seconds = limits
    begin = time.monotonic()
    kept = KEPT_BACK * (starts.shape[1] + 1)
    coarse = Objective(
        replace(posed, blocks=thin).residuals, starts[0], budget=0, on_progress=on_progress, starts=starts
    )
    first = optimize.run("auto", coarse, rng, None if budget is None else max(budget - kept, budget // 2, 1), seconds)
    if not np.isfinite(first.cost):
        return None

    def told(evaluations: int, cost: float) -> None:
        on_progress(first.evaluations + evaluations, cost)

    tried = np.vstack([first.point, *_apart(first)])
    allowed = kept if budget is None else max(min(kept, budget - first.evaluations), len(tried))
    fine = Objective(posed.residuals, first.point, budget=allowed, on_progress=told)
    fine.costs(tried)
    ended = settled(fine)
    faithful = abs(fine.best_cost / first.cost - 1.0) < FAITHFUL if first.cost > 0.0 else False
    if ended and faithful:
        return _joined(first, fine, None)
    left = None if budget is None else max(budget - first.evaluations - fine.evaluations, 1)
    rest = None if seconds is None else max(seconds - (time.monotonic() - begin), 1e-3)
    fine.starts = tried
    return _joined(first, fine, optimize.run("lsq" if faithful else "auto", fine, rng, left, rest))


def settled(objective: Objective) -> bool:
    """Take Gauss-Newton steps from the best point, within the cube and where the Jacobian has rank; tell if they end.

    They do so near a minimum on thinned data; where one does not lower the cost, a trust region is needed.
    """
    try:
        return any(_step_was_last(objective) for _ in range(STEPS))
    except BudgetSpent:
        return False


def _step_was_last(objective: Objective) -> bool:
    """Take one step, and tell whether there was nothing left to gain.

    Raises
    ------
    BudgetSpent
        If there is no evaluation left, or the step does not lower the cost.
    """
    point, cost = objective.best_point, objective.best_cost
    residuals, jacobian = objective.linearise(point)
    slope = jacobian.T @ residuals
    held = ((point <= 0.0) & (slope > 0.0)) | ((point >= 1.0) & (slope < 0.0))
    norms = np.linalg.norm(jacobian, axis=0)
    scale = np.where(held | (norms == 0.0), 0.0, 1.0 / np.where(norms > 0.0, norms, 1.0))
    left, singular, right = np.linalg.svd(jacobian * scale, full_matrices=False)
    known = singular > RANK_TOLERANCE * max(float(singular[0]), 1e-300)
    along = left.T @ residuals
    if float(np.sum(along[known] ** 2)) <= SETTLED * float(residuals @ residuals):
        return True
    step = scale * (right.T @ np.where(known, along / np.where(known, singular, 1.0), 0.0))
    if not objective.costs((point - step)[None, :])[0] < cost:
        raise BudgetSpent
    return False


def _apart(outcome: optimize.Outcome) -> list[Array]:
    """Return the best descents that ended at costs of their own."""
    chosen: list[Array] = []
    cost = outcome.cost
    for descent in outcome.descents:
        if descent.cost > cost * 1.002 and len(chosen) < TRIED - 1:
            chosen.append(descent.point)
            cost = descent.cost
    return chosen


def _joined(first: optimize.Outcome, fine: Objective, last: optimize.Outcome | None) -> optimize.Outcome:
    """Return one outcome of the search on thinned data and of that on all data, the latter ended by a chain or not."""
    ended = last.links[-1] if last else None
    link = optimize.Link(
        name="auto",
        kind="local",
        allowed=ended.allowed if ended else fine.evaluations,
        evaluations=fine.evaluations,
        cost=fine.best_cost,
        ending=ended.ending if ended else "finished",
        reason=ended.reason if ended else "settled on all data",
        history=tuple((first.evaluations + e, c) for e, c in fine.history),
    )
    return replace(
        first,
        point=fine.best_point.copy(),
        cost=fine.best_cost,
        evaluations=first.evaluations + fine.evaluations,
        nonfinite=first.nonfinite + fine.nonfinite,
        first_nonfinite=fine.first_nonfinite if first.first_nonfinite is None else first.first_nonfinite,
        links=(*first.links, link),
        descents=last.descents if last and last.descents else first.descents,
        agreeing=last.agreeing if last and last.descents else first.agreeing,
    )


def thinned(block: Block) -> Block:
    """Return a block with fewer samples: a folded cycle in fewer bins, another drive at every n-th sample."""
    if block.bins is not None:
        return _fewer_bins(block)
    for step in THINNINGS:
        if len(block.target) // step >= FEWEST and _error(block.drive, step) < DRIVE_ERROR:
            return _every(block, step)
    return block


def _fewer_bins(block: Block) -> Block:
    """Return a folded block with one target in eight, those beside the samples of the coarser cycle.

    Means over the coarser bins would blur edges, which a target close to a sample does not.
    """
    step, lead = PHASE_BINS // COARSE_BINS, SETTLE_CYCLES * COARSE_BINS
    phase = (block.nodes[:, 1] - SETTLE_CYCLES * PHASE_BINS + block.weights @ np.arange(-1.0, 3.0)) / step
    node, kept = np.unique(np.minimum(phase.astype(np.int64), COARSE_BINS - 1), return_index=True)
    return replace(
        block,
        drive=np.ascontiguousarray(block.drive[:, ::step]),
        dt=block.dt * step,
        target=block.target[kept],
        nodes=lead + (node[:, None] + np.arange(-1, 3)) % COARSE_BINS,
        weights=cubic_weights(phase[kept] - node),
        counts=np.add.reduceat(block.counts, kept),
        bins=None,
    )


def _error(drive: Array, step: int) -> float:
    """Return the largest error of straight lines between every n-th sample, as a share of each channel's range."""
    places = np.arange((drive.shape[1] - 1) // step * step + 1)
    errors = [
        np.max(np.abs(np.interp(places, places[::step], row[::step]) - row[: len(places)]))
        / max(float(np.ptp(row)), 1e-300)
        for row in drive
        if np.ptp(row) > 0.0
    ]
    return float(max(errors, default=0.0))


def _every(block: Block, step: int) -> Block:
    """Return a full block at every n-th sample, the first target among them."""
    offset = int(block.nodes[0, 0]) % step
    return replace(
        block,
        drive=np.ascontiguousarray(block.drive[:, offset::step]),
        dt=block.dt * step,
        target=block.target[::step].copy(),
        nodes=(block.nodes[::step] - offset) // step,
        weights=np.ascontiguousarray(block.weights[::step]),
        counts=np.full(len(block.target[::step]), float(step)),
    )
