"""The exported model around its elements, as functions of a typed tree: parameters at a current, and a step of it all.

``p`` holds all parameters, ``s`` what the past has left, ``in`` and ``u`` the inputs as given and as changed, ``b`` the
base's parameters, ``f`` factors on them, ``y`` the output; ``first`` is 1 at the step that begins at rest.
"""

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import TypeAlias

from mrfit.export.c_context import BaseField, ChannelField
from mrfit.export.printer import ir
from mrfit.export.printer.elements import CURVE, Element
from mrfit.export.printer.shaping import shape
from mrfit.simulate.current_dependence import CurrentDependence, Order, coordinate, count, form_of, knee_of

# Its functions, but those of each basis
FRAME_FUNCTIONS = (
    "values_at inner tried changed driven is_number within curve_set late_of parameters_set is_moving tracker_plan "
    "prior differences means deviations"
).split()
# Arguments of its functions, in their order
_ARGUMENTS = "p f s in u current b l x dt first".split()
_P, _B, _F = ir.record("p", "parameters"), ir.record("b", "base_values"), ir.record("f", "factors")
_U, _IN, _MEMORY, _STATE = (
    ir.record(*pair) for pair in (("u", "inputs"), ("in", "inputs"), ("s", "memory"), ("s", "state"))
)
_Y, _DT, _CURRENT, _TERM, _HALF, _BETWEEN = map(ir.Name, ("y", "dt", "current", "term", "half", "between"))
_FIRST, _ZERO, _ONE = ir.Name("first", ir.INT), ir.whole(0), ir.whole(1)
_AT_REST, _GOING = ir.Binary("!=", _FIRST, _ZERO, ir.BOOL), ir.Binary("==", _FIRST, _ZERO, ir.BOOL)
# Beyond it a value is no number
_HUGE = 1e30


Given: TypeAlias = Mapping[str, ir.Expression]


@dataclass(frozen=True)
class ModelPart:
    """An element of the model: its name there, the slot of an effect, its functions, and the roles that it scales."""

    ident: str
    slot: str
    element: Element
    roles: tuple[str, ...] = ()


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

    def __init__(self, program: ir.Program, base: ModelPart, fine: bool) -> None:
        self.program, self.base, self.fine = program, base, fine

    def add(
        self, name: str, title: str, body: Sequence[ir.Statement], result: ir.Kind = ir.NOTHING, changed: str = ""
    ) -> None:
        """Add a function, its arguments the names that its body does not declare; those that are changed, named."""
        nodes = list(ir.parts(tuple(body)))
        declared = {n.name for n in nodes if isinstance(n, ir.Declare)}
        used = {n.name: n.kind for n in nodes if isinstance(n, ir.Name) and n.name not in declared}
        arguments = [ir.Argument(n, used[n], n in changed.split()) for n in _ARGUMENTS if n in used]
        function = ir.Function(name, arguments, ir.NOTHING, tuple(body), title=(title,))
        kinds = [] if result == ir.NOTHING else [result]
        shape(function, kinds, [None] * len(kinds), [], self.program)
        self.program.functions[name] = function

    def called(self, name: str, given: Given) -> ir.Call:
        """Return the call of a function of the program."""
        function = self.program.functions[name]
        values = tuple(given[a.name] for a in function.arguments)
        return ir.Call(name, values, function.result, True)

    def values(self, fields: Sequence[BaseField], dependence: CurrentDependence | None) -> None:
        """Add what gives the base's parameters at a current."""
        body = list[ir.Statement]()
        orders = list(dict.fromkeys(q.order for q in fields if q.order))
        for k, order in enumerate(orders):
            assert dependence is not None
            table = ir.Name(f"l{k}", ir.Kind("array", (), (count(order),)))
            self.basis(f"basis_{k}", order, dependence)
            body.append(ir.Declare(table.name, table.kind, ir.Values((), table.kind)))
            body.append(ir.CallStatement(self.called(f"basis_{k}", {"current": _CURRENT, "l": table}), ()))
        for q in fields:
            value: ir.Expression = _P.field(q.stored)
            if q.order:
                table = ir.Name(f"l{orders.index(q.order)}", ir.Kind("array", (), (q.count,)))
                stored = _P.field(q.stored, ir.Kind("array", (), (q.count,)) if q.count > 1 else ir.REAL)
                nodes = [stored.at(k) if q.count > 1 else stored for k in range(q.count)]
                terms = [n * table.at(k) for k, n in enumerate(nodes)]
                value = reduce(operator.add, terms)
            value = ir.Call("exp", (value,)) if q.log else value
            value = value * _F.field(f"role_{q.role}") if q.role else value
            value = ir.Call("clamp", (value, ir.real(q.clip[0]), ir.real(q.clip[1]))) if q.clip else value
            body.append(ir.Assign(_B.field(q.field), value))
        scaled = ", times what effects make of them" if any(q.role for q in fields) else ""
        self.add("values_at", f"The model's parameters at a current{scaled}", body, changed="b")

    def basis(self, name: str, order: Order, dependence: CurrentDependence) -> None:
        """Add the Lagrange polynomials of one order; beyond the range that was tested they are held."""
        ends, form, size = (dependence.low, dependence.high), form_of(order), count(order)
        table, held, at = ir.Name("l", ir.Kind("array", (), (size,))), ir.Name("i"), ir.Name("i")
        body: list[ir.Statement] = [ir.Assign(held, ir.Call("clamp", (_CURRENT, ir.real(ends[0]), ir.real(ends[1]))))]
        if knee := knee_of(form, ends):
            at = ir.Name("bent")
            bent = ir.Call("tanh", (held / ir.real(knee),))
            body.append(ir.Assign(at, ir.real(knee) * bent))
        pieces = dependence.pieces(order)
        chosen: tuple[ir.Statement, ...] = ()
        for piece in reversed(pieces):
            nodes = coordinate(piece.nodes, ends, form).tolist()
            zeros = [k for k in range(size) if k not in piece.columns.tolist()]
            made: list[ir.Statement] = [ir.Assign(table.at(k), ir.real(0.0)) for k in zeros]
            for k, column in enumerate(piece.columns.tolist()):
                value = reduce(operator.mul, _factors(at, nodes, k)) if len(nodes) > 1 else ir.real(1.0)
                made.append(ir.Assign(table.at(column), value))
            chosen = (ir.If(held <= ir.real(piece.high), tuple(made), chosen),) if chosen else tuple(made)
        title = f"Lagrange polynomials of current through {size} nodes{', in pieces' if len(pieces) > 1 else ''}"
        self.add(name, f"{title}; held beyond them", [*body, *chosen], changed="l")

    def steps(
        self, part: ModelPart, target: ir.Name | None = None, memory: ir.Expression = _MEMORY, **own: ir.Expression
    ) -> Iterator[ir.Statement]:
        """Yield a step of an element, at rest first; its output goes to ``target``."""
        fixed: Given = {"p": _P, "m": _MEMORY, "b": _B, "f": _F, "in": _U, "y": _Y, "dt": _DT}
        given = {**fixed, "curve": _P.field("curve", CURVE), **_places(part, memory), **own}
        if part.element.rest is not None:
            yield ir.If(_AT_REST, (ir.CallStatement(self.called(part.element.rest.name, given), ()),))
        call = self.called(part.element.step.name, given)
        yield ir.Assign(target, call) if target else ir.CallStatement(call, ())

    def outputs(self, parts: Sequence[ModelPart], memory: ir.Expression) -> Iterator[ir.Statement]:
        """Yield the steps of effects of the slot ``output``."""
        for part in parts:
            if part.slot == "output" and self.fine and part.element.moved is not None:
                rest, step = self.steps(part, _Y, memory, dt=_HALF)
                *_, between = self.steps(part, None, memory, dt=_HALF, y=_BETWEEN)
                yield from (rest, ir.If(_GOING, (between,)), step)
            elif part.slot == "output":
                yield from self.steps(part, _Y, memory)

    def inner(self, parts: Sequence[ModelPart], scaled: Sequence[str]) -> None:
        """Add the model behind its inputs."""
        body: list[ir.Statement] = [ir.Declare("b", _B.kind)]
        if scaled:
            body += [ir.Declare("f", _F.kind), *(ir.Assign(_F.field(f"role_{role}"), ir.real(1.0)) for role in scaled)]
        for part in parts:
            body += self.steps(part) if part.slot == "theta" else ()
        given: Given = {"p": _P, "f": _F, "current": _U.field("current"), "b": _B}
        body += [ir.CallStatement(self.called("values_at", given), ()), *self.steps(self.base, _Y)]
        for part in parts:
            if part.slot == "add":
                body += [*self.steps(part, _TERM), ir.Assign(_Y, _Y + _TERM)]
        body += [] if self.fine else self.outputs(parts, _MEMORY)
        title = f"The model behind its inputs: parameters, base, terms{'' if self.fine else ', output'}"
        self.add("inner", title, [*body, ir.Return(_Y)], ir.REAL, "s")

    def tried(self, value: ir.Expression) -> ir.Call:
        """Return the output of the model inside at another first input, which leaves it as it is; add it if need be."""
        if "tried" not in self.program.functions:
            trial, changed = ir.Name("trial", _MEMORY.kind), ir.Name("w", _U.kind)
            given: Given = {"p": _P, "s": trial, "u": changed, "dt": _DT, "first": _ZERO}
            call = self.called("inner", given)
            body: list[ir.Statement] = [ir.Declare("trial", trial.kind, _MEMORY)] if trial in call.values else []
            body += [ir.Declare("w", _U.kind, _IN), ir.Assign(changed.field("current"), _CURRENT), ir.Return(call)]
            self.add("tried", "What it gives at another current, and stays as it was", body, ir.REAL)
        return self.called("tried", {"p": _P, "s": ir.Name("m", _MEMORY.kind), "in": _IN, "current": value, "dt": _DT})

    def driven(self, parts: Sequence[ModelPart], inputs: Sequence[ChannelField]) -> None:
        """Add a step of the whole model, from its inputs on."""
        body = list[ir.Statement]()
        for slot in ("input", "loop"):
            for part in parts:
                body += self.steps(part) if part.slot == slot else ()
                if part.element.moved is not None and slot == "input":
                    own = {**_places(part, _MEMORY), "in": _U, "dt": _DT, "first": _FIRST}
                    body.append(ir.CallStatement(self.called(part.element.moved.name, own), ()))
        now = _STATE.field("now", _MEMORY.kind)
        given: Given = {"p": _P, "s": now, "u": _U if body else _IN, "dt": _DT, "first": _FIRST}
        whole = list[ir.Statement]()
        if body:
            self.add("changed", "The inputs as the base sees them", body, changed="s u")
            whole += [ir.Declare("u", _U.kind, _IN), ir.CallStatement(self.called("changed", given), ())]
        if self.fine:
            whole += self.middle(given, inputs)
        whole.append(ir.Assign(_Y, self.called("inner", given)))
        if self.fine:
            whole += [ir.Assign(_HALF, ir.real(0.5) * _DT), *self.outputs(parts, now)]
        self.add("driven", "A step of the whole model", [*whole, ir.Return(_Y)], ir.REAL, "s")

    def middle(self, given: Given, inputs: Sequence[ChannelField]) -> Iterator[ir.Statement]:
        """Yield a run of the model to the middle before a step's end, the inputs going straight there."""
        middle, apart, last = ir.Name("halfway", _U.kind), ir.Name("apart"), _STATE.field("dt")
        before, changed = _STATE.field("before", _U.kind), given["u"]
        going = [
            ir.Assign(middle.field(c.field), _middle(before.field(c.field), changed.field(c.field))) for c in inputs
        ]
        yield ir.Declare("halfway", _U.kind, changed)
        if any(a.name == "dt" for a in self.program.functions["inner"].arguments):
            yield ir.Assign(apart, _DT)
            known = ir.Conditional(last > ir.real(0.0), _middle(last, _DT), _DT)
            going.append(ir.Assign(apart, known))
        yield ir.If(_GOING, tuple(going))
        state = _STATE.field("middle", _MEMORY.kind)
        yield ir.Assign(_BETWEEN, self.called("inner", {**given, "s": state, "u": middle, "dt": apart}))
        yield ir.Assign(before, changed)
        yield ir.Assign(last, ir.Conditional(_GOING, _DT, ir.real(0.0)))

    def curve(self, loop: ir.Call, prepared: ir.Call, fields: Mapping[str, ir.Kind]) -> None:
        """Add what makes the branch curve of the base's parameters, as their model says."""
        curve, kinds = ir.Name("curve", CURVE), list(fields.items())
        body = tuple(
            ir.CallStatement(call, tuple(curve.field(name, kind) for name, kind in own))
            for call, own in ((loop, kinds[-4:]), (prepared, kinds[1:-4]))
        )
        title = ("Make the curve of the loop that parameters shape",)
        arguments = [ir.Argument("b", _B.kind), ir.Argument("curve", CURVE, changed=True)]
        self.program.functions["curve_set"] = ir.Function("curve_set", arguments, ir.NOTHING, body, title=title)

    def checks(self, inputs: Sequence[ChannelField]) -> None:
        """Add what tells numbers from others, and inputs that the fit has seen from others."""
        x, seen = ir.Name("x"), ir.Name("seen", ir.INT)
        is_one = (x > ir.real(-_HUGE)) & (x < ir.real(_HUGE))
        body: list[ir.Statement] = [ir.Return(ir.Conditional(is_one, _ONE, _ZERO, ir.INT))]
        self.add("is_number", "Whether a value is a number", body, ir.INT)
        body = [ir.Assign(seen, _ONE)]
        for c in inputs:
            if c.ends is not None:
                value = _IN.field(c.field)
                low, high = (ir.real(v) for v in c.ends)
                inside = (value >= low) & (value <= high)
                body.append(ir.Assign(seen, ir.Conditional(inside, seen, _ZERO, ir.INT)))
        body.append(ir.Return(seen))
        self.add("within", "Whether all inputs lie within their ranges in the fit's logs", body, ir.INT)


def _places(part: ModelPart, memory: ir.Expression) -> dict[str, ir.Expression]:
    """Return the places of an element's parameters, and of its memory."""
    return {
        "e": _P.field(part.ident, ir.struct(f"{part.ident}_values")),
        "s": memory.field(part.ident, ir.struct(f"{part.ident}_state")),
    }


def _middle(one: ir.Expression, other: ir.Expression) -> ir.Expression:
    return ir.real(0.5) * (one + other)


def _factors(at: ir.Expression, nodes: Sequence[float], k: int) -> Iterator[ir.Expression]:
    """Yield the factors of a Lagrange polynomial that is 1 at node k."""
    for j, node in enumerate(nodes):
        if j != k:
            away = at + ir.real(-node) if node < 0.0 else at - ir.real(node)
            yield away / ir.real(nodes[k] - node)
