"""The values of parameters that depend on coil current: at the currents of a record, and at nodes from other currents.

What such a dependence is, ``current_dependence`` says.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np

from mrfit.core.specs import Array, ModelSpec
from mrfit.kernels.lagrange import combine, polynomials
from mrfit.kernels.theta import plain
from mrfit.simulate.current_dependence import (
    CurrentDependence,
    Order,
    coordinate,
    count,
    form_of,
    logarithmic,
    pieces_between,
)

# Records whose polynomials are remembered, of at most so many samples: in longer ones they cost little beside the model
_REMEMBERED, REMEMBERED_SAMPLES = 256, 10_000


def at_current(spec: ModelSpec, dependence: CurrentDependence, theta: Array, current: Array) -> Array:
    """Return the base model's parameters at a current, shape (P, K, N), or (P, K) where nothing varies.

    Parameters
    ----------
    spec
        The base model's SPEC, K parameters.
    dependence
        Orders and range.
    theta
        Parameters at the nodes, shape (P, K'), or (P, K', N) where an effect makes them vary.
    current
        Current in A, shape (N,).
    """
    constant = theta.ndim == 2 and bool(np.all(current == current[0]))
    values = current[:1] if constant else current
    nodal = theta if theta.ndim == 3 else theta[:, :, None]
    orders = dict(dependence.orders)
    # parameter by parameter in memory, as models read them
    result = np.empty((len(spec.params), len(theta), len(values)))
    bases = {order: plain(basis(dependence, order, values)) for order in orders.values() if order}
    column = 0
    for k, p in enumerate(spec.params):
        order = orders.get(p.name, 0)
        nodes = nodal[:, column : column + count(order)]
        column += count(order)
        if not order:
            result[k] = nodes[:, 0]
            continue
        is_log = logarithmic(spec, p, order)
        combine(np.ascontiguousarray(np.log(nodes) if is_log else nodes), bases[order], result[k])
        if is_log:
            np.exp(result[k], out=result[k])
        elif p.low > 0.0 and p.name not in spec.linear:
            # between its nodes a polynomial may leave the bounds, outside which a simulation may diverge
            np.clip(result[k], p.low, p.high, out=result[k])
    return result[:, :, 0].T.copy() if constant else np.swapaxes(result, 0, 1)


def basis(dependence: CurrentDependence, order: Order, current: Array) -> Array:
    """Return the Lagrange polynomials at currents (N,) in A, one row for each node; 0 outside their piece."""
    if len(current) > REMEMBERED_SAMPLES:
        return _basis(order, dependence.low, dependence.high, current)
    return _remembered_basis(order, dependence.low, dependence.high, np.asarray(current, dtype=np.float64).tobytes())


def _basis(order: Order, low: float, high: float, current: Array) -> Array:
    held = np.clip(current, low, high)
    rows = np.zeros((count(order), len(current)))
    form, ends = form_of(order), (low, high)
    for piece in pieces_between(order, low, high):
        # the first piece reaches down to the range's end, every other to above the break
        inside = (held <= piece.high) & ((held > piece.low) | (piece.low == low))
        nodes, at = (plain(coordinate(i, ends, form)) for i in (piece.nodes, held[inside]))
        rows[np.ix_(piece.columns, np.flatnonzero(inside))] = polynomials(nodes, at)
    return rows


@lru_cache(_REMEMBERED)
def _remembered_basis(order: Order, low: float, high: float, current: bytes) -> Array:
    """Return the same for currents as bytes: a search asks for those of the same few records again and again."""
    rows = _basis(order, low, high, np.frombuffer(current))
    rows.flags.writeable = False
    return rows


def through(spec: ModelSpec, dependence: CurrentDependence, currents: Array, theta: Array) -> Array:
    """Return the parameters at the nodes (K',) whose polynomials come nearest to values found current by current.

    Parameters
    ----------
    spec
        The base model's SPEC, K parameters.
    dependence
        Orders and range.
    currents
        Currents in A, shape (L,); one at which a parameter may jump counts on both sides.
    theta
        The base model's parameters at each of them, shape (L, K); a constant parameter takes their median.
    """
    orders = dict(dependence.orders)
    nodes: list[Array] = []
    for k, p in enumerate(spec.params):
        order = orders.get(p.name, 0)
        if not order:
            nodes.append(np.median(theta[:, k : k + 1], axis=0))
            continue
        log = logarithmic(spec, p, order)
        found = _nearest(dependence, order, currents, np.log(theta[:, k]) if log else theta[:, k])
        nodes.append(np.clip(np.exp(found) if log else found, p.low, p.high))
    return np.concatenate(nodes)


def _nearest(dependence: CurrentDependence, order: Order, currents: Array, values: Array) -> Array:
    """Return the values at the nodes of the polynomials nearest to values (L,) at currents (L,)."""
    rows, targets = [basis(dependence, order, currents).T], [values]
    for one, other in pairwise(dependence.pieces(order)):
        # the basis gives a level at a break to the piece below; where that may jump, it counts above as well
        at_break = np.flatnonzero((currents == other.low) & (one.columns[-1] != other.columns[0]))
        above = np.zeros((len(at_break), count(order)))
        ends, form = (dependence.low, dependence.high), form_of(order)
        nodes, at = (plain(coordinate(i, ends, form)) for i in (other.nodes, currents[at_break]))
        above[:, other.columns] = polynomials(nodes, at).T
        rows.append(above)
        targets.append(values[at_break])
    return np.linalg.lstsq(np.vstack(rows), np.concatenate(targets), rcond=None)[0]
