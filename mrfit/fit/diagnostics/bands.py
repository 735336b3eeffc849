"""95 % bands of parameters that depend on current, by the delta method from the covariance of the fit.

At a current i the parameter p(i), or its logarithm where it is searched over decades, has the gradient g(i) in the
cube. The pointwise half-width is t·(gᵀ Σ g)^½. The simultaneous band replaces t by c, at which a curve of unit vectors
u(i) = L g/|L g|, L Lᵀ = Σ, leaves it anywhere in 5 of 100 cases at most (Naiman 1986):

    0.05 = κ/π·(1 + c²/ν)^(−ν/2) + m·P(|t_ν| > c),

κ the length of u over the range of currents, ν the degrees of freedom, m the number of pieces between jumps.
"""

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from scipy.special import stdtr

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.uncertainty import Uncertainty, sensitivities
from mrfit.io.schemas.fit import Band
from mrfit.search.cube import Cube
from mrfit.simulate.assembly import Assembly
from mrfit.simulate.at_current import at_current
from mrfit.simulate.current_dependence import CurrentDependence, expanded
from mrfit.simulate.current_levels import base_of

Response = Callable[[Array], Array]

BAND_CURRENTS = 41
"""Currents at which a piece of a curve is given."""
LEVEL = 0.05
BAND_SPREAD_MIN = 1e-9
"""Share of the largest standard deviation along a curve below which it has none at a current."""


def bands(assembly: Assembly, cube: Cube, point: Array, uncertainty: Uncertainty) -> list[Band]:
    """Return the bands of all parameters of a base model that depend on current; none where nothing does.

    Parameters
    ----------
    assembly, cube
        The model and its free parameters.
    point
        Optimum in the cube, shape (F,).
    uncertainty
        At this optimum.
    """
    name, dependence = assembly.recipe or ("", None)
    if dependence is None or not dependence.varies:
        return []
    spec = base_of(name).spec
    nodal, orders, found = len(expanded(spec, dependence).params), dict(dependence.orders), []
    for k, param in enumerate(spec.params):
        order = orders.get(param.name, 0)
        if not order:
            continue
        pieces = currents_of(dependence, order)
        current = np.concatenate(pieces)

        def plain(points: Array, k: int = k, current: Array = current) -> Array:
            return at_current(spec, dependence, cube.to_theta(points)[:, :nodal], current)[:, k]

        # as the interval of its value at a node, whose cube may be logarithmic
        log = param.scale == "log" and bool(np.all(plain(point[None, :]) > 0.0))

        def curve(points: Array, plain: Response = plain, log: bool = log) -> Array:
            return np.log(plain(points)) if log else plain(points)

        middle, gradients = curve(point[None, :])[0], sensitivities(curve, point)
        half = np.array([uncertainty.half_width(g) for g in gradients])
        edges = np.cumsum([0, *map(len, pieces)])
        wider = simultaneous(gradients, uncertainty, [slice(a, b) for a, b in pairwise(edges)]) / uncertainty.quantile
        ends = [middle - half, middle + half, middle - wider * half, middle + wider * half]
        low, high, low_everywhere, high_everywhere = (_shown(np.exp(e) if log else e, half) for e in ends)
        found.append(
            Band(
                name=param.name,
                current=current.tolist(),
                value=(np.exp(middle) if log else middle).tolist(),
                low=low,
                high=high,
                low_everywhere=low_everywhere,
                high_everywhere=high_everywhere,
            )
        )
    return found


def currents_of(dependence: CurrentDependence, order: int | str) -> list[Array]:
    """Return currents in A over the range, one array for every stretch in which a parameter cannot jump."""
    stretches: list[list[Array]] = []
    last = None
    for piece in dependence.pieces(order):
        grid = np.linspace(piece.low, piece.high, BAND_CURRENTS)
        if last is not None and last.columns[-1] == piece.columns[0]:
            stretches[-1].append(grid[1:])
        else:
            # the break itself belongs to the piece below it
            stretches.append([np.concatenate([[np.nextafter(grid[0], grid[1])], grid[1:]]) if stretches else grid])
        last = piece
    return [np.concatenate(parts) for parts in stretches]


def simultaneous(gradients: Array, uncertainty: Uncertainty, pieces: Sequence[slice]) -> float:
    """Return the half-width of a simultaneous 95 % band in standard deviations, for gradients (N, F) along a curve."""
    from scipy.optimize import brentq

    values, vectors = np.linalg.eigh(uncertainty.covariance)
    along = gradients @ (vectors * np.sqrt(np.maximum(values, 0.0)))
    lengths = np.linalg.norm(along, axis=1)
    length, count = 0.0, 0
    for piece in pieces:
        own = along[piece][lengths[piece] > BAND_SPREAD_MIN * max(float(lengths.max()), 1e-300)]
        if not len(own):
            continue
        unit = own / np.linalg.norm(own, axis=1)[:, None]
        # the chord, since the cosine of a small angle has no digits left
        chords = np.linalg.norm(np.diff(unit, axis=0), axis=1)
        length += float(np.sum(2.0 * np.arcsin(np.minimum(chords / 2.0, 1.0))))
        count += 1
    degrees = max(uncertainty.degrees, 1.0)

    def beyond(c: float) -> float:
        tube = length / math.pi * math.exp(-0.5 * degrees * math.log1p(c * c / degrees))
        return tube + 2.0 * max(count, 1) * float(stdtr(degrees, -c)) - LEVEL

    highest = 2.0 * uncertainty.quantile
    while beyond(highest) > 0.0:
        highest *= 2.0
    return float(brentq(beyond, uncertainty.quantile * (1.0 - 1e-9), highest))


def _shown(ends: Array, half: Array) -> list[float | None]:
    return [float(e) if math.isfinite(h) and math.isfinite(e) else None for e, h in zip(ends, half, strict=True)]
