"""Ends of several descents side by side, and whether together they found the least cost."""

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.jit import kernel

Ends = tuple[Mask, Mask, Mask]

# So many descents have to settle at the best cost, within this share of it; after so many descents, two are enough.
AGREEING, MANY = 3, 12
AGREEMENT_RTOL = 2e-3
# A descent has settled where its step promises less than this share of the squared cost.
_FLAT = 1e-9
# It is given up where steps failed until its raise was this, and its linear model does not promise the least cost.
_FAILING = 8.0
# Descents under way that cost no more than this share above the best may end below it.
RIVAL = 0.1
# They are waited for where so many times what their linear models promise would take them there.
_RELIED = 2.0


@kernel
def going_on(
    ends: Ends, raises: Array, squares: Array, promises: tuple[Array, Array], least: float, tolerance: float
) -> Index:
    """Mark the descents that have settled or are hopeless, in place, and return those that go on (A,).

    Parameters
    ----------
    ends
        Which have settled, are stuck, are given up, each (P,).
    raises
        What a failed step multiplies their damping by, (P,).
    squares
        Their squared costs (P,).
    promises
        Falls of these that the next step promises, and that a linear model would have, each (P,).
    least
        The least squared cost of all descents.
    tolerance
        Share of the squared cost that is still possible, up to which a descent has settled (Bates and Watts 1981).
    """
    settled, stuck, given_up = ends
    predicted, attainable = promises
    count, going = len(squares), 0
    active = np.empty(count, dtype=np.int64)
    for p in range(count):
        if settled[p] or stuck[p] or given_up[p]:
            continue
        settled[p] = attainable[p] <= tolerance * squares[p] or predicted[p] <= _FLAT * squares[p]
        # what fails again and again does not fall further than promised; one alone has nothing to be compared with
        hopeless = count > 1 and raises[p] >= _FAILING and squares[p] - _RELIED * attainable[p] > least
        given_up[p] = hopeless
        if not settled[p] and not hopeless:
            active[going] = p
            going += 1
    return active[:going]


@kernel
def enough(descents: int) -> int:
    """Return the number of so many descents that have to agree."""
    return AGREEING if descents < MANY else AGREEING - 1


@kernel
def decided(ends: Ends, costs: Array, attainable: Array, best: float, before: tuple[int, Array]) -> bool:
    """Return whether enough descents came to the least cost, of which one at least has settled, and none promises less.

    Parameters
    ----------
    ends, attainable
        As ``going_on`` takes them.
    costs
        Costs of the descents (P,).
    best
        The least cost.
    before
        How many descents there were before these, and the costs of those of them that settled.
    """
    settled, stuck, given_up = ends
    ended, earlier = before
    limit, less, near = best * (1.0 + AGREEMENT_RTOL), best * (1.0 - AGREEMENT_RTOL), 0
    for cost in earlier:
        if cost <= limit:
            near += 1
    found = near > 0
    for p in range(len(costs)):
        if settled[p] or stuck[p] or given_up[p]:
            ended += 1
        if costs[p] <= limit:
            near += 1
            found = found or settled[p] or stuck[p]
    if not found or near < enough(ended):
        return False
    for p in range(len(costs)):
        under_way = not (settled[p] or stuck[p] or given_up[p])
        hoped = costs[p] * costs[p] - _RELIED * attainable[p]
        if under_way and costs[p] <= best * (1.0 + RIVAL) and hoped < less * less:
            return False
    return True
