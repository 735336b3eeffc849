"""The exported model around its elements, as functions of a typed tree: parameters at a current, and a step of it all.

``p`` holds all parameters, ``s`` what the past has left, ``in`` and ``u`` the inputs as given and as changed, ``b`` the
base's parameters, ``f`` factors on them, ``y`` the output; ``first`` is 1 at the step that begins at rest.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

from mrfit.export.c_context import BaseField, Channel
from mrfit.export.printer.elements import CURVE, Element
from mrfit.export.printer.shaping import shape
from mrfit.export.printer.tree import (
    BOOL,
    INT,
    NOTHING,
    REAL,
    Argument,
    Assign,
    Binary,
    Call,
    Choice,
    Declare,
    Expression,
    Function,
    Group,
    If,
    Item,
    Kind,
    Member,
    Name,
    Number,
    Program,
    Return,
    Run,
    Statement,
    Unary,
    names_in,
    struct,
)
from mrfit.export.text import number
from mrfit.simulate.current_dependence import CurrentDependence, Order, coordinate, count, form_of, knee_of

# Its functions, but those of each basis
NAMES = ("values_at", "inner", "tried", "changed", "driven", "is_number", "within", "curve_set", "late_of")
_P, _U, _IN, _B, _F = (
    Name(name, struct(tag))
    for name, tag in (
        ("p", "parameters"),
        ("u", "inputs"),
        ("in", "inputs"),
        ("b", "base_values"),
        ("f", "factors"),
    )
)
_MEMORY, _STATE = Name("s", struct("memory")), Name("s", struct("state"))
_Y, _DT, _FIRST, _CURRENT = Name("y", REAL), Name("dt", REAL), Name("first", INT), Name("current", REAL)
_TERM, _HALF, _BETWEEN = Name("term", REAL), Name("half", REAL), Name("between", REAL)
_ZERO, _ONE = Number("0", INT), Number("1", INT)
_AT_REST, _GOING = Binary("!=", _FIRST, _ZERO, BOOL), Binary("==", _FIRST, _ZERO, BOOL)
# Beyond it a value is no number
_HUGE = 1e30


Given: TypeAlias = Mapping[str, Expression]


@dataclass(frozen=True)
class Part:
    """An element of the model: its name there, the slot of an effect, its functions, and the roles that it scales."""

    ident: str
    slot: str
    element: Element
    roles: tuple[str, ...] = ()


def real(value: float) -> Expression:
    """Return a constant."""
    text = Number(number(abs(value)), REAL)
    return Unary("-", text, REAL) if value < 0.0 else text


def field(value: Expression, name: str, kind: Kind = REAL) -> Member:
    """Return a field of a struct."""
    return Member(value, name, kind)


def reduced(sign: str, values: Iterable[Expression]) -> Expression:
    """Return the sum or the product of numbers."""
    first, *others = values
    for value in others:
        first = Binary(sign, first, value, REAL)
    return first


class Frame:
    """Adds the frame's functions to a program that has those of the elements.

    Parameters
    ----------
    program
        The program.
    base
        The base.
    fine
        Whether the model also runs along the middles between steps.
    """

    def __init__(self, program: Program, base: Part, fine: bool) -> None:
        self.program, self.base, self.fine = program, base, fine

    def add(
        self, name: str, title: str, arguments: Sequence[tuple[Name, bool]], body: Iterable[Statement], result: Kind
    ) -> Function:
        """Add a function with those of its arguments that it uses; with each, whether it is changed."""
        function = Function(name, [], NOTHING, tuple(body), title=(title,))
        function.arguments = [Argument(a.name, a.kind, changed) for a, changed in arguments]
        kinds = [] if result == NOTHING else [result]
        shape(function, kinds, [None] * len(kinds), [], self.program)
        used = names_in(function.body)
        function.arguments = [a for a in function.arguments if a.name in used]
        self.program.functions[name] = function
        return function

    def called(self, name: str, given: Given) -> Call:
        """Return the call of a function of the program."""
        function = self.program.functions[name]
        values = tuple(given[a.name] for a in function.arguments)
        return Call(name, values, function.result, True)

    def values(self, fields: Sequence[BaseField], dependence: CurrentDependence | None) -> None:
        """Add what gives the base's parameters at a current."""
        body = list[Statement]()
        orders = list(dict.fromkeys(q.order for q in fields if q.order))
        for k, order in enumerate(orders):
            assert dependence is not None
            table = Name(f"l{k}", Kind("array", (), (count(order),)))
            self.basis(f"basis_{k}", order, dependence)
            body.append(Declare(table.name, table.kind, Group((), table.kind)))
            body.append(Run(self.called(f"basis_{k}", {"current": _CURRENT, "l": table}), ()))
        for q in fields:
            value: Expression = field(_P, q.stored)
            if q.order:
                table = Name(f"l{orders.index(q.order)}", Kind("array", (), (q.count,)))
                stored = field(_P, q.stored, Kind("array", (), (q.count,)) if q.count > 1 else REAL)
                nodes = [Item(stored, Number(str(k), INT), REAL) if q.count > 1 else stored for k in range(q.count)]
                terms = [Binary("*", n, Item(table, Number(str(k), INT), REAL), REAL) for k, n in enumerate(nodes)]
                value = reduced("+", terms)
            value = Call("exp", (value,), REAL) if q.log else value
            value = Binary("*", value, field(_F, f"role_{q.role}"), REAL) if q.role else value
            value = Call("clamp", (value, real(q.clip[0]), real(q.clip[1])), REAL) if q.clip else value
            body.append(Assign(field(_B, q.field), value))
        scaled = ", times what effects make of them" if any(q.role for q in fields) else ""
        given = [(_P, False), (_F, False), (_CURRENT, False), (_B, True)]
        self.add("values_at", f"The model's parameters at a current{scaled}", given, body, NOTHING)

    def basis(self, name: str, order: Order, dependence: CurrentDependence) -> None:
        """Add the Lagrange polynomials of one order; beyond the range that was tested they are held."""
        ends, form, size = (dependence.low, dependence.high), form_of(order), count(order)
        table, held, at = Name("l", Kind("array", (), (size,))), Name("i", REAL), Name("i", REAL)
        body: list[Statement] = [Assign(held, Call("clamp", (_CURRENT, real(ends[0]), real(ends[1])), REAL))]
        if knee := knee_of(form, ends):
            at = Name("bent", REAL)
            bent = Call("tanh", (Binary("/", held, real(knee), REAL),), REAL)
            body.append(Assign(at, Binary("*", real(knee), bent, REAL)))
        pieces = dependence.pieces(order)
        chosen: tuple[Statement, ...] = ()
        for piece in reversed(pieces):
            nodes = coordinate(piece.nodes, ends, form).tolist()
            zeros = [k for k in range(size) if k not in piece.columns.tolist()]
            made: list[Statement] = [Assign(Item(table, Number(str(k), INT), REAL), real(0.0)) for k in zeros]
            for k, column in enumerate(piece.columns.tolist()):
                value = reduced("*", _factors(at, nodes, k)) if len(nodes) > 1 else real(1.0)
                made.append(Assign(Item(table, Number(str(column), INT), REAL), value))
            chosen = (If(Binary("<=", held, real(piece.high), BOOL), tuple(made), chosen),) if chosen else tuple(made)
        title = f"Lagrange polynomials of current through {size} nodes{', in pieces' if len(pieces) > 1 else ''}"
        self.add(name, f"{title}; held beyond them", [(_CURRENT, False), (table, True)], [*body, *chosen], NOTHING)

    def steps(
        self, part: Part, target: Name | None = None, memory: Expression = _MEMORY, **own: Expression
    ) -> Iterator[Statement]:
        """Yield a step of an element, at rest first; its output goes to ``target``."""
        given: Given = {
            "p": _P,
            "m": _MEMORY,
            "b": _B,
            "f": _F,
            "in": _U,
            "y": _Y,
            "dt": _DT,
            "curve": field(_P, "curve", CURVE),
        }
        given = {**given, **_places(part, memory), **own}
        if part.element.rest is not None:
            yield If(_AT_REST, (Run(self.called(part.element.rest.name, given), ()),))
        call = self.called(part.element.step.name, given)
        yield Assign(target, call) if target else Run(call, ())

    def outputs(self, parts: Sequence[Part], memory: Expression) -> Iterator[Statement]:
        """Yield the steps of effects of the slot ``output``."""
        for part in parts:
            if part.slot == "output" and self.fine and part.element.moved is not None:
                rest, step = self.steps(part, _Y, memory, dt=_HALF)
                *_, between = self.steps(part, None, memory, dt=_HALF, y=_BETWEEN)
                yield from (rest, If(_GOING, (between,)), step)
            elif part.slot == "output":
                yield from self.steps(part, _Y, memory)

    def inner(self, parts: Sequence[Part], scaled: Sequence[str]) -> None:
        """Add the model behind its inputs."""
        body: list[Statement] = [Declare("b", _B.kind)]
        if scaled:
            body += [Declare("f", _F.kind), *(Assign(field(_F, f"role_{role}"), real(1.0)) for role in scaled)]
        for part in parts:
            body += self.steps(part) if part.slot == "theta" else ()
        given: Given = {"p": _P, "f": _F, "current": field(_U, "current"), "b": _B}
        body += [Run(self.called("values_at", given), ()), *self.steps(self.base, _Y)]
        for part in parts:
            if part.slot == "add":
                body += [*self.steps(part, _TERM), Assign(_Y, Binary("+", _Y, _TERM, REAL))]
        body += [] if self.fine else self.outputs(parts, _MEMORY)
        title = f"The model behind its inputs: parameters, base, terms{'' if self.fine else ', output'}"
        arguments = [(_P, False), (_MEMORY, True), (_U, False), (_DT, False), (_FIRST, False)]
        self.add("inner", title, arguments, [*body, Return(_Y)], REAL)

    def tried(self, value: Expression) -> Call:
        """Return the output of the model inside at another first input, which leaves it as it is; add it if need be."""
        if "tried" not in self.program.functions:
            trial, changed = Name("trial", _MEMORY.kind), Name("w", _U.kind)
            given: Given = {"p": _P, "s": trial, "u": changed, "dt": _DT, "first": _ZERO}
            call = self.called("inner", given)
            body: list[Statement] = [Declare("trial", trial.kind, _MEMORY)] if trial in call.values else []
            body += [Declare("w", _U.kind, _IN), Assign(field(changed, "current"), _CURRENT), Return(call)]
            arguments = [(_P, False), (_MEMORY, False), (_IN, False), (_CURRENT, False), (_DT, False)]
            self.add("tried", "What it gives at another current, and stays as it was", arguments, body, REAL)
        return self.called("tried", {"p": _P, "s": Name("m", _MEMORY.kind), "in": _IN, "current": value, "dt": _DT})

    def driven(self, parts: Sequence[Part], inputs: Sequence[Channel]) -> None:
        """Add a step of the whole model, from its inputs on."""
        body = list[Statement]()
        for slot in ("input", "loop"):
            for part in parts:
                body += self.steps(part) if part.slot == slot else ()
                if part.element.moved is not None and slot == "input":
                    own = {**_places(part, _MEMORY), "in": _U, "dt": _DT, "first": _FIRST}
                    body.append(Run(self.called(part.element.moved.name, own), ()))
        now = field(_STATE, "now", _MEMORY.kind)
        given: Given = {"p": _P, "s": now, "u": _U if body else _IN, "dt": _DT, "first": _FIRST}
        whole = list[Statement]()
        if body:
            arguments = [(_P, False), (_MEMORY, True), (_U, True), (_DT, False), (_FIRST, False)]
            self.add("changed", "The inputs as the base sees them", arguments, body, NOTHING)
            whole += [Declare("u", _U.kind, _IN), Run(self.called("changed", given), ())]
        if self.fine:
            whole += self.middle(given, inputs)
        whole.append(Assign(_Y, self.called("inner", given)))
        if self.fine:
            whole += [Assign(_HALF, Binary("*", real(0.5), _DT, REAL)), *self.outputs(parts, now)]
        arguments = [(_P, False), (_STATE, True), (_IN, False), (_DT, False), (_FIRST, False)]
        self.add("driven", "A step of the whole model", arguments, [*whole, Return(_Y)], REAL)

    def middle(self, given: Given, inputs: Sequence[Channel]) -> Iterator[Statement]:
        """Yield a run of the model to the middle before a step's end, the inputs going straight there."""
        middle, apart, last = Name("halfway", _U.kind), Name("apart", REAL), field(_STATE, "dt")
        before, changed = field(_STATE, "before", _U.kind), given["u"]
        going = [
            Assign(field(middle, c.field), _middle(field(before, c.field), field(changed, c.field))) for c in inputs
        ]
        yield Declare("halfway", _U.kind, changed)
        if any(a.name == "dt" for a in self.program.functions["inner"].arguments):
            yield Assign(apart, _DT)
            known = Choice(Binary(">", last, real(0.0), BOOL), _middle(last, _DT), _DT, REAL)
            going.append(Assign(apart, known))
        yield If(_GOING, tuple(going))
        state = field(_STATE, "middle", _MEMORY.kind)
        yield Assign(_BETWEEN, self.called("inner", {**given, "s": state, "u": middle, "dt": apart}))
        yield Assign(before, changed)
        yield Assign(last, Choice(_GOING, _DT, real(0.0), REAL))

    def curve(self, loop: Call, prepared: Call, fields: Mapping[str, Kind]) -> None:
        """Add what makes the branch curve of the base's parameters, as their model says."""
        curve, kinds = Name("curve", CURVE), list(fields.items())
        body = tuple(
            Run(call, tuple(field(curve, name, kind) for name, kind in own))
            for call, own in ((loop, kinds[-4:]), (prepared, kinds[1:-4]))
        )
        title = ("Make the curve of the loop that parameters shape",)
        arguments = [Argument("b", _B.kind), Argument("curve", CURVE, changed=True)]
        self.program.functions["curve_set"] = Function("curve_set", arguments, NOTHING, body, title=title)

    def checks(self, inputs: Sequence[Channel]) -> None:
        """Add what tells numbers from others, and inputs that the fit has seen from others."""
        x, seen = Name("x", REAL), Name("seen", INT)
        is_one = _both(Binary(">", x, real(-_HUGE), BOOL), Binary("<", x, real(_HUGE), BOOL))
        body: list[Statement] = [Return(Choice(is_one, _ONE, _ZERO, INT))]
        self.add("is_number", "Whether a value is a number", [(x, False)], body, INT)
        body = [Assign(seen, _ONE)]
        for c in inputs:
            if c.ends is not None:
                value = field(_IN, c.field)
                low, high = (real(v) for v in c.ends)
                inside = _both(Binary(">=", value, low, BOOL), Binary("<=", value, high, BOOL))
                body.append(Assign(seen, Choice(inside, seen, _ZERO, INT)))
        body.append(Return(seen))
        self.add("within", "Whether all inputs lie within what the fit has seen", [(_IN, False)], body, INT)


def _places(part: Part, memory: Expression) -> dict[str, Expression]:
    """Return the places of an element's parameters, and of its memory."""
    return {
        "e": field(_P, part.ident, struct(f"{part.ident}_values")),
        "s": field(memory, part.ident, struct(f"{part.ident}_state")),
    }


def _both(one: Expression, other: Expression) -> Binary:
    return Binary("and", one, other, BOOL)


def _middle(one: Expression, other: Expression) -> Expression:
    return Binary("*", real(0.5), Binary("+", one, other, REAL), REAL)


def _factors(at: Expression, nodes: Sequence[float], k: int) -> Iterator[Expression]:
    """Yield the factors of a Lagrange polynomial that is 1 at node k."""
    for j, node in enumerate(nodes):
        if j != k:
            away = Binary("+", at, real(-node), REAL) if node < 0.0 else Binary("-", at, real(node), REAL)
            yield Binary("/", away, real(nodes[k] - node), REAL)
