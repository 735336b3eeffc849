"""Dependence of a fit's parameters on coil current: as asked for, or by their role where no levels tell."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mrfit.core import registry
from mrfit.core.recording import Recording, Segment
from mrfit.core.specs import Array, ModelSpec, Param
from mrfit.errors import ConfigError, DataError
from mrfit.io.columns import LONG_SEGMENT, chunks, is_on_disk, part_of
from mrfit.io.outdated import check_law, check_plugins
from mrfit.io.schemas.fit import Caution, Fit, FitDependence, Quantity
from mrfit.simulate.assembly import Assembly, assemble
from mrfit.simulate.at_current import at_current, basis
from mrfit.simulate.current_dependence import (
    LOG,
    PLAIN,
    CurrentDependence,
    Order,
    count,
    expanded,
    logarithmic,
    orders_of,
)

# Current levels closer than this, in A and as a share, are one
_SAME_LEVEL, SAME_SHARE = 0.02, 0.03
# Of a current that moves: share of its samples at either end that may be spikes of switching, parts of its range that
# are distinguished, and share of the samples from which on it stays in one
SPIKES = 0.002
FIFTHS = 5
STAY = 0.05
# Highest order of each role where no levels of current are held by which it could be chosen: what predicted held-out
# conditions of a real damper at five currents best. Parameters that may be negative stay constant: they couple to
# stroke or offset, and extrapolate badly.
DEFAULT_ORDERS = {"yield": 2, "knee": 2, "viscous": 1, "stiffness": 1, "hysteresis": 1}
# Roles whose laws papers print as polynomials of current; shapes and sharpnesses are exponentials of one
POLYNOMIAL_ROLES = ("yield", "viscous", "stiffness")
# Currents at which a polynomial is looked at
CURRENT_GRID = 65
# Coefficients without a role, as those of a polynomial in velocity, are forces
COEFFICIENT_ORDER = 2
OUTPUTS = ("force", "torque")


def base_of(model: str) -> Assembly:
    """Return the base model of a written name, without effects, dependence on current, and mass that it carries."""
    return assemble(registry.elements(model)[0])


def checked_order(model: str, text: str, per: str) -> None:
    """Refuse an order of dependence on current that no data could make right.

    Raises
    ------
    ConfigError
        If it is malformed, names no parameter, the model is of a coil, or parameters are fitted per condition.
    """
    if text in ("auto", "0"):
        return
    spec = base_of(model).spec
    if spec.output not in OUTPUTS:
        raise ConfigError(f"--current-order is for models of force or torque; '{spec.name}' predicts {spec.output}")
    if orders_of(spec, text) and per != "all":
        raise ConfigError("--current-order needs one set of parameters for all currents: add --per all")


def level_of(segment: Segment, levels: Sequence[float]) -> float:
    """Return the level, of those given, at which a segment was tested; nan if its current is not held or unknown."""
    if not np.isfinite(segment.current) or not levels:
        return float("nan")
    return min(levels, key=lambda level: abs(level - segment.current))


def levels_of(segments: Iterable[Segment]) -> list[float]:
    """Return the distinct current levels in A of training segments that hold one, rising."""
    held = sorted(s.current for s in segments if s.role == "train" and np.isfinite(s.current))
    levels: list[list[float]] = []
    for current in held:
        if levels and current - levels[-1][0] <= max(_SAME_LEVEL, SAME_SHARE * abs(current)):
            levels[-1].append(current)
        else:
            levels.append([current])
    return [float(np.mean(level)) for level in levels]


def default_orders(spec: ModelSpec, levels: int, fixed: Iterable[str] = ()) -> tuple[tuple[str, Order], ...]:
    """Return the order of every parameter that varies with current by default, lower where levels are few.

    Parameters
    ----------
    spec
        The base model's SPEC.
    levels
        Number of current levels tested.
    fixed
        Parameters the user holds, which stay constant.
    """
    held = set(fixed)  # of one held at a single current the others still vary
    wanted = {p: min(_most(spec, p), levels - 1) for p in spec.params if p.name not in held}
    return tuple((p.name, written(spec, p, usual_form(spec, p), order)) for p, order in wanted.items() if order > 0)


def usual_form(spec: ModelSpec, param: Param) -> str:
    """Return the form of a parameter's law by its role: forces, stiffness and damping are polynomials of current."""
    return PLAIN if param.role in POLYNOMIAL_ROLES or not logarithmic(spec, param) else LOG


def written(spec: ModelSpec, param: Param, form: str, order: int) -> Order:
    """Return a law as --current-order has it, without a form where it is the one that the order alone means."""
    return order if form == (LOG if logarithmic(spec, param) else PLAIN) or not order else f"{form}{order}"


def _most(spec: ModelSpec, param: Param) -> int:
    if not param.role:
        return COEFFICIENT_ORDER if param.name in spec.linear else 0
    return DEFAULT_ORDERS.get(param.role, 0) if param.low >= 0 else 0


@dataclass(frozen=True)
class TestedCurrents:
    """Currents of training segments.

    Attributes
    ----------
    levels
        Currents held, in A, rising.
    varying
        Currents in A over each segment (N,) during which they move.
    low, high
        Ends in A of the range tested.
    """

    levels: list[float]
    varying: list[Array]
    low: float
    high: float

    @property
    def steps(self) -> int:
        """Return how many values of current there are to tell: levels, or parts of its range where it moves."""
        # a current that is switched on and off stays in two parts
        return max(len(self.levels), len(_visited(self.varying, self.low, self.high)))


def tested_currents(segments: Sequence[Segment], recordings: Mapping[str, Recording]) -> TestedCurrents:
    """Return the currents of training segments."""
    levels = levels_of(segments)
    varying = [
        _spread(recordings[s.recording].channels["current"], s)
        for s in segments
        if s.role == "train" and "current" in recordings[s.recording].channels and not np.isfinite(s.current)
    ]
    ends = [*levels, *(float(end) for values in varying for end in np.quantile(values, (SPIKES, 1.0 - SPIKES)))]
    return TestedCurrents(levels, varying, min(ends, default=0.0), max(ends, default=0.0))


def _spread(current: Array, segment: Segment) -> Array:
    """Return a current over a segment, of one that stays on disk some of the samples, spread over it."""
    within = part_of(current, segment.start, segment.stop)
    if not is_on_disk(within):
        return within
    return np.concatenate([part[:: -(-len(within) // LONG_SEGMENT)] for part in chunks(within)])


def takes_current(spec: ModelSpec) -> bool:
    """Return whether the current is an input of a model itself, so that no parameter of it depends on current."""
    return "current" in spec.inputs


def recorded_range(recordings: Mapping[str, Recording]) -> tuple[float, float]:
    """Return the least and the greatest current of recordings, NaN where none has a current."""
    values = [r.channels["current"] for r in recordings.values() if "current" in r.channels]
    if not values:
        return np.nan, np.nan
    return min(float(v.min()) for v in values), max(float(v.max()) for v in values)


def to_choose(model: str, text: str, currents: TestedCurrents) -> bool:
    """Return whether orders are chosen by what predicts held-out levels: none are asked for, two levels were held."""
    spec = base_of(model).spec
    return text == "auto" and spec.output in OUTPUTS and "current" not in spec.inputs and len(currents.levels) > 1


def dependence_on_current(
    model: str, text: str, segments: Sequence[Segment], recordings: Mapping[str, Recording], fixed: Iterable[str]
) -> CurrentDependence | None:
    """Return the dependence of a joint fit's parameters on current, None if there is none.

    Parameters
    ----------
    model
        Model as written.
    text
        ``auto``, an order, or ``NAME=ORDER,…``, in pieces as ``1:0.2:2``. ``auto`` applies to models of force or torque
        without a current of their own, where the current was held at two levels or more, or moved between them; it
        gives each parameter the order of its role.
    segments, recordings
        What is fitted; training segments give the range of current.
    fixed
        Parameters the user holds.

    Raises
    ------
    DataError
        If an order asked for needs more levels of current than were tested.
    """
    spec, currents = base_of(model).spec, tested_currents(segments, recordings)
    levels, varying = currents.levels, currents.varying
    if text == "auto":
        if spec.output not in OUTPUTS or "current" in spec.inputs or currents.steps < 2:
            return None
        orders = default_orders(spec, currents.steps, fixed)
    else:
        orders = () if text == "0" else orders_of(spec, text)
        most = max((count(order) for _, order in orders), default=0)
        if most and not varying and most > len(levels):
            raise DataError(
                f"--current-order {text} needs training tests at {most} currents, there are "
                f"{_listed(levels) or 'none stated'}{_held_out(segments)}; lower the order, or name "
                "each log's current in the channel map ([condition] current, or a pattern on file names)"
            )
    if not orders:
        return None
    dependence = CurrentDependence(orders, currents.low, currents.high)
    if not varying:
        _check_pieces(dependence, levels, _held_out(segments))
    return dependence


def _visited(varying: Sequence[Array], low: float, high: float, held: Sequence[float] = ()) -> Array:
    """Return the middles of the fifths of a range in which a moving current stays, or a level was held."""
    if not varying or not low < high:
        return np.array([])
    edges = np.linspace(low, high, FIFTHS + 1)
    moving, levels = np.histogram(np.concatenate(varying), edges)[0], np.histogram(held, edges)[0]
    middles = (edges[:-1] + edges[1:]) / 2
    visited: Array = middles[(moving > STAY * moving.sum()) | (levels > 0)]
    return visited


def _listed(levels: Sequence[float]) -> str:
    return f"{len(levels)} ({', '.join(f'{i:.4g} A' for i in levels)})" if levels else ""


def _held_out(segments: Sequence[Segment]) -> str:
    """Return the conditions that are held out, with the option that trains on them; nothing where none is."""
    trained = {s.condition for s in segments if s.role == "train"}
    named = dict.fromkeys(s.condition for s in segments if s.condition not in trained)
    return f"; held out: {', '.join(named)} (mrfit segment --holdout none trains on them)" if named else ""


def _check_pieces(dependence: CurrentDependence, levels: Sequence[float], held_out: str) -> None:
    """Refuse pieces with more values than the levels inside them can give, and say what is held out.

    Raises
    ------
    DataError
        If a parameter has such a piece.
    """
    for name, order in dependence.orders:
        if np.linalg.matrix_rank(basis(dependence, order, np.array(levels))) < count(order):
            raise DataError(
                f"--current-order {name}={order}: a piece of order m needs training tests at m + 1 currents in it (a "
                "break belongs to the piece below it, and to both where they meet); there are "
                f"{_listed(levels)}{held_out}: move the break or lower an order"
            )


def sign_warnings(model: str, dependence: CurrentDependence | None, theta: Array) -> list[Caution]:
    """Return a warning on positive parameters whose polynomial turns negative between the currents tested, if any does.

    Parameters
    ----------
    model
        Model as written.
    dependence
        How its parameters depend on current.
    theta
        Parameters of a fit (K,), the base model's first.
    """
    spec, found = base_of(model).spec, list[str]()
    if dependence is not None:
        grid = np.linspace(dependence.low, dependence.high, CURRENT_GRID)
        least = at_current(spec, dependence, theta[None, : len(expanded(spec, dependence).params)], grid)[0].min(axis=1)
        found = [p.name for p, value in zip(spec.params, least, strict=True) if p.low > 0.0 and value < 0.0]
    text = (
        f"{', '.join(found)} turns negative at some current between those tested: ask for a lower order, or for the "
        "exponential of a polynomial (--current-order NAME=log2)"
    )
    return [Caution(kind="negative-between", text=text)] if found else []


def piece_warnings(dependence: CurrentDependence, currents: TestedCurrents) -> list[Caution]:
    """Return a warning on pieces in which a moving current stays at too few places to tell their values."""
    found = list[str]()
    for name, order in dependence.orders if currents.varying else ():
        pieces = dependence.pieces(order)
        places = np.concatenate([_visited(currents.varying, p.low, p.high, currents.levels) for p in pieces])
        if len(pieces) > 1 and np.linalg.matrix_rank(basis(dependence, order, places)) < count(order):
            found.append(f"{name}={order}")
    text = (
        f"--current-order {','.join(found)}: in a piece of it the current stays at too few places, so that moments in "
        "passing tell its values: move the break or lower the order"
    )
    return [Caution(kind="piece-untested", text=text)] if found else []


def kept(dependence: CurrentDependence | None) -> FitDependence | None:
    """Return a dependence as fit.json keeps it."""
    if dependence is None:
        return None
    return FitDependence(orders=dict(dependence.orders), low=dependence.low, high=dependence.high)


def assembly_of(fit: Fit) -> Assembly:
    """Return the assembly a fit was made with: the one way from a fit to what its parameters give.

    Raises
    ------
    DataError
        If the code of its law has changed since.
    """
    check_law(fit)
    return as_written(fit)


def as_written(fit: Fit) -> Assembly:
    """Return the assembly of a fit's written model, its dependence on current included, whether its law is the same.

    Raises
    ------
    DataError
        If a plug-in that it was made with is not here.
    """
    check_plugins(fit)
    return assemble(fit.model, dependence_of(fit))


def dependence_of(fit: Fit) -> CurrentDependence | None:
    """Return the dependence of a fit's parameters on current, None if there is none."""
    stored = fit.current_dependence
    return CurrentDependence(tuple(stored.orders.items()), stored.low, stored.high) if stored else None


def exact_parameters(fit: Fit) -> list[tuple[str, Quantity]]:
    """Return condition and value of each parameter and derived quantity, names of nodes with every digit."""
    dependence = dependence_of(fit)
    names = dependence.exact_names if dependence else {}
    found = [(r.condition, p) for r in fit.results for p in [*r.parameters, *r.derived]]
    return [(condition, replace(p, name=names.get(p.name, p.name))) for condition, p in found]
