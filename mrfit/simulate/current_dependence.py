"""Parameters that depend on coil current: polynomials through their values at a few currents, in one piece or more.

A parameter p of order m is given by its values p_0 … p_m at m + 1 currents I_0 … I_m spread over the tested range, and

    p(i) = Σ_k p_k·ℓ_k(i),   ℓ_k the Lagrange polynomials of the nodes,

on a logarithmic scale where the parameter has one and does not enter linearly, so that a sharpness or an exponent
stays positive. Forces and stiffnesses, which enter linearly, are polynomials of i as papers print them, and stay
linear. Either form can be asked for: ``log2`` is the exponential of a polynomial of order 2, ``plain2`` the polynomial
itself, held within the parameter's bounds where it does not enter linearly. ``sat1`` is a straight line of a current
that saturates as an iron core does, s = i_k·tanh(i/i_k) with i_k half the greatest current tested: monotone and
bounded; ``sat2`` a parabola of s. Values at nodes have the unit, the bounds
and the start value of the parameter itself, which coefficients of powers of i have not. Outside the tested range the
current is held at its end: a polynomial says nothing there.

Where the fluid's yield stress turns abruptly, pieces of the range have polynomials of their own (inverse-tanh paper
Table 3). Each has its nodes spread over its piece; neighbours written with ``:`` share the one at the break and so meet
there, those written with ``/`` may jump. The break itself belongs to the piece below it.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np

from mrfit.core.specs import Array, DerivedQuantity, Index, ModelSpec, Param
from mrfit.errors import ConfigError, DataError

HIGHEST_ORDER = 4
# Parameters that do not depend on the coil's field unless the user says so
FIXED_ROLES = ("offset", "shape")
MEETING, JUMPING = ":", "/"
PLAIN, LOG, SAT = "plain", "log", "sat"
FORMS = (PLAIN, LOG, SAT)
# Current of the knee of a law that saturates, as a share of the greatest current tested
KNEE = 0.5

COEFFICIENT = re.compile(r"([^(.]+)(?:\(.*\))?\.i\d+")
"""Name of a derived quantity that is a coefficient: of which parameter, on which piece, of which power."""
Order = int | str
"""Order 0 to 4, or those of pieces with the breaks in A between them: ``1:0.2:2`` meet, ``1/0.2/2`` may jump.

``plain``, ``log`` or ``sat`` before it says what is a polynomial: the parameter, its logarithm, or the parameter of a
current that saturates.
"""


@dataclass(frozen=True, slots=True)
class CurrentPiece:
    """One polynomial: its range and its nodes (m + 1,) in A, and their places among all nodes of the parameter."""

    low: float
    high: float
    nodes: Array
    columns: Index

    @property
    def order(self) -> int:
        """Order of the polynomial."""
        return len(self.nodes) - 1


@dataclass(frozen=True, slots=True)
class CurrentDependence:
    """Dependence of parameters on current: their orders, and the range of current.

    Attributes
    ----------
    orders
        (parameter name, order) pairs; parameters not named are constant.
    low, high
        Ends in A of the range of current tested.

    Raises
    ------
    DataError
        If a parameter is to vary over a range without extent, or a break lies outside the range.
    """

    orders: tuple[tuple[str, Order], ...]
    low: float
    high: float

    def __post_init__(self) -> None:
        if self.varies and not self.low < self.high:
            raise DataError(
                f"a dependence on current needs tests at two currents or more, these are all at {self.low:.4g} A: "
                "add tests at other currents, or leave --current-order out"
            )
        for name, order in self.orders:
            outside = [b for b in _read(order)[1] if not self.low < b < self.high]
            if outside:
                raise DataError(
                    f"--current-order {name}={order}: {outside[0]:.4g} A is not inside the tested range, "
                    f"{self.low:.4g} to {self.high:.4g} A"
                )

    @property
    def varies(self) -> bool:
        """Whether any parameter depends on current."""
        return any(order for _, order in self.orders)

    @property
    def has_breaks(self) -> bool:
        """Whether any parameter has several pieces."""
        return any(_read(order)[1] for _, order in self.orders)

    def pieces(self, order: Order) -> tuple[CurrentPiece, ...]:
        """Return the polynomials of a parameter of this order, by rising current."""
        return pieces_between(order, self.low, self.high)

    def nodes(self, order: Order) -> Array:
        """Return the currents in A at which a parameter of this order is given, one for each of its values."""
        nodes = np.empty(count(order))
        for piece in reversed(self.pieces(order)):
            nodes[piece.columns] = piece.nodes
        return nodes

    def labels(self, order: Order, exact: bool = False) -> list[str]:
        """Return the nodes as parameters' names have them: ``0.2A``, at a jump ``0.2A-`` below and ``0.2A+`` above.

        They have four digits, or as many as tell them apart; all of them where they are to be ``exact``. An end of the
        range that is less than the last digit of the other is 0: a current that is off has digits of its noise alone.
        """
        below, above = set[int](), set[int]()
        for one, other in pairwise(self.pieces(order)):
            if one.columns[-1] != other.columns[0]:
                below |= {int(one.columns[-1])} if one.order else set()
                above |= {int(other.columns[0])} if other.order else set()
        ends = ["-" * (k in below) + "+" * (k in above) for k in range(count(order))]
        nodes = self.nodes(order).tolist()
        if exact:
            return [f"{i!r}A{end}" for i, end in zip(nodes, ends, strict=True)]
        place = math.floor(math.log10(max(map(abs, nodes)) or 1.0)) + 1
        written = []
        for digits in range(4, 18):
            least = 0.5 * 10.0 ** (place - digits)
            off = [i in (self.low, self.high) and abs(i) < least for i in nodes]
            texts = [f"{0.0 if zero else i:.{digits}g}A" for i, zero in zip(nodes, off, strict=True)]
            written.append([text + end for text, end in zip(texts, ends, strict=True)])
        return next((found for found in written if len(set(found)) == len(found)), written[-1])

    @property
    def exact_names(self) -> dict[str, str]:
        """Names of parameters at nodes, by their names in short, with every digit of the current."""
        pairs = [(n, zip(self.labels(o), self.labels(o, True), strict=True)) for n, o in self.orders if o]
        return {f"{name}@{short}": f"{name}@{exact}" for name, labels in pairs for short, exact in labels}


def coordinate(current: Array, ends: Sequence[float] | Array, form: str) -> Array:
    """Return the variable in A of a form's polynomial at currents (N,): the current, or ``i_k tanh(i/i_k)``."""
    knee = knee_of(form, ends)
    return knee * np.tanh(current / knee) if knee else current


def knee_of(form: str, ends: Sequence[float] | Array) -> float:
    """Return the current i_k in A at which a form bends, for ends of the range tested; 0 where it does not."""
    return KNEE * max(abs(ends[0]), abs(ends[1])) if form == SAT else 0.0


def base_name(name: str) -> str:
    """Return a parameter's name without the current at which its value is given."""
    return name.partition("@")[0]


@dataclass(frozen=True, slots=True, order=True)
class CurrentNode:
    """A current in A at which a parameter is given; ``side`` is -1 below a jump there, 1 above it, else 0."""

    current: float
    side: int = 0


_NODE = re.compile(r"(-?[\d.]+(?:e[-+]?\d+)?)A([-+]?)")


def node_of(name: str) -> CurrentNode | None:
    """Return the node of a parameter's value by a name of ``labels``; None where the value is the same at all."""
    match = _NODE.fullmatch(name.partition("@")[2])
    return CurrentNode(float(match[1]), {"-": -1, "": 0, "+": 1}[match[2]]) if match else None


def form_of(order: Order) -> str:
    """Return the form a written order asks for, of ``FORMS``; empty for the parameter's own."""
    return next((form for form in FORMS if str(order).strip().startswith(form)), "")


@cache
def _read(order: Order) -> tuple[tuple[int, ...], tuple[float, ...], tuple[bool, ...]]:
    """Return the pieces' orders, the breaks between them in A, and whether the pieces meet there.

    Raises
    ------
    ConfigError
        If the text is not of this form, breaks do not rise, or two constants are to meet.
    """
    tokens = re.split(f"([{MEETING}{JUMPING}])", "".join(str(order).split()).removeprefix(form_of(order)))
    written, signs = tokens[::4], tokens[1::4]
    if len(tokens) % 4 != 1 or signs != tokens[3::4] or not set(written) <= {str(k) for k in range(HIGHEST_ORDER + 1)}:
        raise ConfigError(
            f"--current-order takes 0 to {HIGHEST_ORDER}, or in pieces 1:0.2:2 (order 1 to 0.2 A, 2 from there, "
            f"meeting) or 1/0.2/2 (they may jump), with 'plain', 'log' or 'sat' before it for a polynomial, the "
            f"exponential of one or a polynomial of a current that saturates, for all or as NAME=ORDER pairs, "
            f"not '{order}'"
        )
    try:
        breaks = tuple(float(token) for token in tokens[2::4])
    except ValueError as error:
        raise ConfigError(f"--current-order '{order}': a break is a current in A") from error
    if not all(np.isfinite(breaks)) or any(not a < b for a, b in pairwise(breaks)):
        raise ConfigError(f"--current-order '{order}': breaks are currents in A that rise")
    meeting = tuple(sign == MEETING for sign in signs)
    if any(m and a == b == "0" for m, (a, b) in zip(meeting, pairwise(written), strict=True)):
        raise ConfigError(f"--current-order '{order}': constants that meet are one; write 0/{breaks[0]:g}/0")
    return tuple(map(int, written)), breaks, meeting


@cache
def count(order: Order) -> int:
    """Return the number of values that give a parameter of this order: a node for each, shared where pieces meet."""
    orders, _, meeting = _read(order)
    return sum(orders) + len(orders) - sum(meeting)


@cache
def pieces_between(order: Order, low: float, high: float) -> tuple[CurrentPiece, ...]:
    """Return the pieces of an order over a range of current in A."""
    orders, breaks, meeting = _read(order)
    edges, pieces, following = (low, *breaks, high), list[CurrentPiece](), 0
    for k, m in enumerate(orders):
        first = following - 1 if k and meeting[k - 1] else following
        following = first + m + 1
        nodes = np.linspace(edges[k], edges[k + 1], m + 1)
        if not m:
            # a constant stands where it meets a neighbour, else in the middle of its piece
            ends = [edges[j] for j in (k, k + 1) if 0 < j < len(orders) and meeting[j - 1]]
            nodes = np.array([ends[0] if ends else (edges[k] + edges[k + 1]) / 2])
        pieces.append(CurrentPiece(edges[k], edges[k + 1], nodes, np.arange(first, following)))
    return tuple(pieces)


def orders_of(spec: ModelSpec, text: str) -> tuple[tuple[str, Order], ...]:
    """Return the (parameter, order) pairs of a written current dependence: ``2``, or ``fy=1:0.2:2,c=1``.

    A single order goes to every parameter but offsets and shapes, as a polynomial to those that may be negative.

    Raises
    ------
    ConfigError
        If an order is not 0 to 4, a name is not a parameter, one that may be negative is to have a logarithm, or all
        parameters are to depend on a current that is an input of the model.
    """
    if "=" not in text:
        order = _order(text)
        if order and "current" in spec.inputs:
            raise ConfigError(
                f"--current-order {text}: '{spec.name}' has the current as an input and no parameter needs to follow "
                f"it: leave --current-order out, or name those that do, as --current-order {spec.names[0]}={text}"
            )
        varying = [p for p in spec.params if p.role not in FIXED_ROLES and order and not p.fixed]
        without = _order(str(order).removeprefix(LOG))
        return tuple((p.name, order if p.low > 0.0 else without) for p in varying)
    named = {name.strip(): order for name, _, order in (item.partition("=") for item in text.split(","))}
    for name in named:
        if name not in spec.names:
            raise ConfigError(
                f"--current-order: '{spec.name}' has no parameter '{name}'; it has {', '.join(spec.names)}"
            )
        if form_of(named[name]) == LOG and spec.params[spec.names.index(name)].low <= 0.0:
            raise ConfigError(f"--current-order {name}={named[name]}: {name} may be negative, so it has no logarithm")
    return tuple((n, _order(v)) for n, v in named.items() if _order(v))


def _order(text: str) -> Order:
    written = "".join(text.split())
    orders, breaks, _ = _read(written)
    return written if breaks or (orders[0] and form_of(written)) else orders[0]


def expanded(spec: ModelSpec, dependence: CurrentDependence) -> ModelSpec:
    """Return the SPEC of a model with its parameters given at nodes of current."""
    orders = dict(dependence.orders)
    params: list[Param] = []
    for p in spec.params:
        order = orders.get(p.name, 0)
        labels = dependence.labels(order) if order else []
        params += [
            replace(p, name=f"{p.name}@{label}", text=f"{p.text} at {label.replace('A', ' A')}") for label in labels
        ] or [p]
    bent = {p.name for p in spec.params if logarithmic(spec, p, orders.get(p.name, 0)) and orders.get(p.name, 0)}
    linear = [q.name for q in params if base_name(q.name) in spec.linear and base_name(q.name) not in bent]
    coefficients = [
        _coefficient(p, piece, power, pieces, LOG if logarithmic(spec, p, orders[p.name]) else form_of(orders[p.name]))
        for p in spec.params
        if orders.get(p.name, 0)
        for pieces in [dependence.pieces(orders[p.name])]
        for piece in pieces
        for power in range(piece.order + 1)
    ]
    return replace(
        spec,
        inputs=(*spec.inputs, *(() if "current" in spec.inputs else ("current",))),
        params=tuple(params),
        linear=tuple(linear),
        derived=tuple(coefficients),
    )


def logarithmic(spec: ModelSpec, param: Param, order: Order = 0) -> bool:
    """Return whether it is the logarithm of a parameter that is a polynomial: as its order says, or by its kind."""
    form = form_of(order)
    return form == LOG if form else param.scale == "log" and param.name not in spec.linear


def _coefficient(
    param: Param, piece: CurrentPiece, power: int, pieces: Sequence[CurrentPiece], form: str
) -> DerivedQuantity:
    is_log = form == LOG and piece.order > 0
    name, unit = (f"ln({param.name})", "1") if is_log else (param.name, param.unit)
    place = "" if len(pieces) == 1 else f"({piece.low:.4g}..{piece.high:.4g}A)"
    knee = knee_of(form, (pieces[0].low, pieces[-1].high))
    of = f"({knee:.4g} A*tanh(i/{knee:.4g} A))^{power}" if knee else f"i^{power}"
    text = f"coefficient of {of} of {name}" + (f" from {piece.low:.4g} to {piece.high:.4g} A" if place else "")
    # of a slope the unit of the quantity is no matter
    role = "logarithm" if is_log and not power else ""
    return DerivedQuantity(f"{param.name}{place}.i{power}", f"{unit}/A^{power}" if power else unit, text, role)


def parameter_of(derived: str) -> str:
    """Return the parameter of which a derived quantity is a coefficient, an empty text for any other quantity."""
    found = COEFFICIENT.fullmatch(derived)
    return found[1] if found else ""


def coefficients(spec: ModelSpec, dependence: CurrentDependence, theta: Array) -> Array:
    """Return the coefficients of powers of current, as papers print them, shape (P, D) for ``expanded``'s derived.

    Those of a law that saturates are of powers of ``coordinate``.
    """
    orders = dict(dependence.orders)
    columns: list[Array] = []
    column = 0
    for p in spec.params:
        order = orders.get(p.name, 0)
        for piece in dependence.pieces(order) if order else ():
            nodes = theta[:, column + piece.columns]
            nodes = np.log(nodes) if logarithmic(spec, p, order) and piece.order else nodes
            at = coordinate(piece.nodes, (dependence.low, dependence.high), form_of(order))
            powers = np.linalg.inv(np.vander(at, increasing=True))
            columns += list((nodes @ powers.T).T)
        column += count(order)
    return np.stack(columns, axis=1)
