"""A model's or an effect's ``law``, or its ``rest`` and ``step``, as functions of the exported model.

In what is printed ``b`` and ``e`` hold the parameters of the base and of an effect, ``in`` the inputs, ``s`` what the
element remembers, ``f`` the factors on parameters, ``y`` the output so far, and ``dt`` is the step.
"""

import inspect
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, cast

from mrfit.core.channels import LEVEL_CHANNELS
from mrfit.core.protocols import HasCurve, MovesDrive
from mrfit.core.specs import EffectSpec, ModelSpec, Param
from mrfit.export.printer import ir
from mrfit.export.printer.entry_point import EntryPoint
from mrfit.export.printer.functions import python_of, unpacked
from mrfit.export.printer.reading import ProgramReader
from mrfit.export.printer.shaping import names_of, shape
from mrfit.export.printer.values import group
from mrfit.export.text import field as field_name
from mrfit.export.text import number
from mrfit.kernels.branch import rest_on_curve
from mrfit.kernels.past import RESERVED, begun, late, pushed, smooth_late

# Temperature in degrees Celsius where a log has none, as effects that need it take it
_ROOM = 25.0
CURVE = ir.struct("curve")
# Functions of whole arrays that are read as formulas, by slot
FORMULAS = {"base": "response", "add": "term", "output": "shape"}


@dataclass
class Element:
    """An element as it is printed.

    Attributes
    ----------
    step
        The function that is called at every step.
    rest
        The function that is called before the first; None of an element without memory.
    state
        Fields of what it remembers, numbers all.
    late
        Number of its signals that are needed late, 0 if none is.
    own
        Number of its own numbers in its past.
    centred
        Whether it has a constant ``x_middle``, the middle of the stroke.
    moved
        The function that puts what the inputs were in their place; None of an element that does not move them.
    curved
        Whether it reads a branch curve.
    """

    step: ir.Function
    rest: ir.Function | None = None
    state: list[str] = field(default_factory=list)
    late: int = 0
    own: int = 0
    centred: bool = False
    moved: ir.Function | None = None
    curved: bool = False

    @property
    def past(self) -> str:
        """Number of places of its past, empty without one."""
        if not self.late:
            return str(RESERVED + self.own) if self.own else ""
        return f"{RESERVED + self.own} + (@RING * {self.late + 1})"


@dataclass(frozen=True)
class Sight:
    """Surroundings of an element of the exported model.

    Attributes
    ----------
    ident
        Its name there, with which those of its structs begin.
    values
        Name, in what is printed, of its parameters: ``b`` or ``e``.
    channels
        The inputs that the user sets.
    varying
        Whether its parameters move.
    centred
        Inputs that it sees less their middle.
    shaping
        Whether parameters move that shape its loop.
    tried
        What stands for a call of the model inside, of an element around it.
    """

    ident: str
    values: str
    channels: tuple[str, ...]
    varying: bool = False
    centred: tuple[str, ...] = ()
    shaping: bool = False
    tried: Callable[[ir.Expression], ir.Call] | None = None

    def parameter(self, name: str) -> ir.Member:
        """Return a parameter at the step's end."""
        return ir.record(self.values, f"{self.ident}_values").field(field_name(name))

    def remembered(self, name: str) -> ir.Member:
        """Return the field of the element's memory of a name."""
        return ir.record("s", f"{self.ident}_state").field(name)

    def channel(self, name: str) -> ir.Expression:
        """Return an input now."""
        if name == "time":
            return self.remembered("time") + ir.Name("dt")
        if name not in self.channels:
            return ir.Literal(number(_ROOM), ir.REAL)
        value = ir.record("in", "inputs").field(field_name(name))
        return value - self.parameter("x_middle") if name in self.centred else value


def element(reader: ProgramReader, item: Any, spec: ModelSpec | EffectSpec, sight: Sight) -> Element | None:
    """Return an element as it is printed, None of one that has neither ``law`` nor ``step``."""
    centred = tuple(getattr(item, "CENTRED", ()))
    writer = _Writer(reader, item, spec, replace(sight, centred=centred))
    if isinstance(item, HasCurve) and not sight.shaping:
        return writer.stepped(item.step_on_curve, rest_on_curve, True)
    if callable(getattr(item, "step", None)):
        return writer.stepped(item.step, item.rest)
    if callable(getattr(item, "law", None)):
        return writer.lawful()
    formula = FORMULAS.get(writer.slot)
    return writer.vectorised(formula) if formula and callable(getattr(item, formula, None)) else None


class _Writer:
    """Prepares the functions of one element."""

    def __init__(self, reader: ProgramReader, item: Any, spec: ModelSpec | EffectSpec, sight: Sight) -> None:
        self.reader, self.item, self.spec, self.sight = reader, item, spec, sight
        self.slot = spec.slot if isinstance(spec, EffectSpec) else "base"
        needed = [p.needs for p in spec.params if p.needs and p.needs not in spec.inputs]
        self.inputs = [*spec.inputs, *dict.fromkeys(needed)]
        self.here = group([sight.parameter(p.name) for p in spec.params])

    def now(self) -> list[ir.Expression]:
        """Return the inputs at the step's end, behind the output where the element changes that."""
        own: list[ir.Expression] = [ir.Name("y")] if self.slot == "output" else []
        return [*own, *map(self.sight.channel, self.inputs)]

    def before(self) -> list[ir.Place]:
        """Return the places of the inputs at the step's beginning."""
        names = [*(["output"] if self.slot == "output" else []), *map(field_name, self.inputs)]
        return [self.sight.remembered("time" if n == "time" else f"before_{n}") for n in names]

    def then(self, parameter: Param) -> ir.Member:
        """Return the place of a parameter at the step's beginning."""
        return self.sight.remembered(f"then_{field_name(parameter.name)}")

    def arguments(self) -> list[ir.Argument]:
        """Return all that an element may be given."""
        sight = self.sight
        return [
            ir.Argument("p", ir.struct("parameters")),
            ir.Argument("m", ir.struct("memory")),
            ir.Argument("curve", CURVE),
            ir.Argument(sight.values, ir.struct(f"{sight.ident}_values")),
            ir.Argument("s", ir.struct(f"{sight.ident}_state"), changed=True),
            ir.Argument("f", ir.struct("factors"), changed=True),
            ir.Argument("in", ir.struct("inputs"), changed=self.slot in ("input", "loop")),
            ir.Argument("y", ir.REAL),
            ir.Argument("dt", ir.REAL),
            ir.Argument("first", ir.INT),
        ]

    def destinations(self) -> list[ir.Place | None]:
        """Return the places of the element's outputs, None for one that the function returns."""
        if self.slot in ("input", "loop"):
            return [self.sight.channel(self.inputs[-1])]  # type: ignore[list-item]
        if self.slot == "theta":
            factors = ir.Name("f", ir.struct("factors"))
            return [ir.Member(factors, f"role_{role}") for role in self.item.ROLES]
        return [None]

    def lawful(self) -> Element:
        """Return an element without memory, but for the time."""
        given: list[ir.Expression] = [*self.now(), *self.here.values]
        bound = dict[str, ir.Expression]()
        for name, parameter in inspect.signature(self.item.law).parameters.items():
            others = parameter.kind == inspect.Parameter.VAR_POSITIONAL
            bound[name] = group(given[len(bound) :]) if others else given[len(bound)]
        entry = EntryPoint(self.arguments(), bound, self.destinations(), self.title(), factors=self.slot == "theta")
        timed = "time" in self.inputs
        if timed:
            entry.after, entry.always = [(self.sight.remembered("time"), self.sight.channel("time"))], True
        step = self.reader.entry(self.item.law, f"{self.sight.ident}_step", entry)
        if not timed:
            return Element(step)
        place = self.sight.remembered("time")
        body: ir.Block = (ir.Assign(place, ir.Literal("0.0", ir.REAL)),)
        rest = ir.Function(
            f"{self.sight.ident}_rest",
            [a for a in self.arguments() if a.name == "s"],
            ir.NOTHING,
            body,
            title=self.rest_title(),
        )
        self.reader.program.functions[rest.name] = rest
        return Element(step, rest, ["time"])

    def vectorised(self, formula: str) -> Element:
        """Return an element that is a formula of whole arrays, in which no sample knows of another."""
        function = inspect.unwrap(getattr(self.item, formula))
        names = list(inspect.signature(function).parameters)
        channels = dict(zip(self.spec.inputs, map(self.sight.channel, self.spec.inputs), strict=True))
        tables: dict[str, Mapping[str, ir.Expression] | ir.Values] = {names[-2]: self.here}
        bound: dict[str, ir.Expression] = {}
        if self.slot == "base":
            bound[names[0]] = group(list(channels.values()))
        else:
            tables[names[-3]] = channels
        if self.slot == "output":
            bound[names[0]] = ir.Name("y")
        entry = EntryPoint(self.arguments(), bound, [None], self.title(), tables=tables)
        return Element(self.reader.entry(function, f"{self.sight.ident}_step", entry))

    def stepped(self, step_of: Callable[..., Any], rest_of: Callable[..., Any], curved: bool = False) -> Element:
        """Return an element with memory."""
        sight, item = self.sight, self.item
        signals, own_numbers = int(getattr(item, "LATE", 0)), int(getattr(item, "OWN", 0))
        names = self.state_names(step_of, rest_of)
        state = group([sight.remembered(n) for n in names])
        now, before = group(self.now()), group(list(self.before()))
        then = group([*map(self.then, self.spec.params)])
        then = then if sight.varying else self.here
        kept: list[tuple[ir.Place, ir.Expression]] = [*zip(self.before(), self.now(), strict=True)]
        if sight.varying:
            kept += [(p, v) for p, v in zip(then.values, self.here.values, strict=True)]  # type: ignore[misc]
        given = {"state": state, "before": before, "now": now, "theta": group([then, self.here])}
        extra = ir.Name("curve", CURVE) if curved else self.past
        bound = self.bound(step_of, [*given.values(), ir.Name("dt"), extra])
        own = self.destinations()
        entry = EntryPoint(self.arguments(), bound, [*own, *state.values], self.title(), kept)  # type: ignore[list-item]
        if sight.tried:
            name, tried = list(bound)[-1], sight.tried
            entry.calls = {name: tried}
        step = self.reader.entry(step_of, f"{sight.ident}_step", entry)
        wanted = [(p, v) for p, v in kept if p in step.kept]
        bound = self.bound(rest_of, [now, self.here])
        arguments = [a for a in self.arguments() if a.name not in ("dt", "f")]
        for argument in arguments:
            argument.changed = argument.name == "s"
        entry = EntryPoint(arguments, bound, [*state.values], self.rest_title(), wanted, True)  # type: ignore[list-item]
        rest = self.reader.entry(rest_of, f"{sight.ident}_rest", entry)
        moved = None
        if signals or own_numbers:
            rest.body = (*rest.body, self.begin(signals, own_numbers))
        if signals:
            self.remember(step, rest, state.values[:signals])
        elif isinstance(item, MovesDrive) and sight.channels:
            signals, moved = len(sight.channels), self.moving()
        fields = list(dict.fromkeys([*names, *(p.name for p, _ in wanted)]))  # type: ignore[union-attr]
        return Element(step, rest, fields, signals, own_numbers, bool(sight.centred), moved, curved)

    def begin(self, signals: int, own: int) -> ir.CallStatement:
        """Return the beginning of its past."""
        values = (
            ir.Literal("@RING" if signals else "0", ir.INT),
            ir.whole(signals),
            ir.whole(own),
        )
        return ir.CallStatement(self.called(begun, self.past, *values), ())

    @property
    def past(self) -> ir.Member:
        """Its past."""
        return ir.Member(self.sight.remembered("past").value, "past", ir.Kind("array", (), (0,)))

    def called(self, function: Callable[..., Any], *values: ir.Expression) -> ir.Call:
        """Return the call of a function of Python with values."""
        plain = python_of(function)
        assert plain is not None
        kinds = dict(zip(inspect.signature(plain).parameters, (v.kind for v in values), strict=True))
        made = self.reader.function(plain, kinds).function
        return ir.Call(made.name, values, made.result, True)

    def longest(self) -> ir.Expression:
        """Return the greatest age in s of a signal that a step reads."""
        entry = EntryPoint(
            self.arguments(),
            self.bound(self.item.longest, [self.here]),
            [None],
            ("How far back signals are needed, s",),
        )
        longest = self.reader.entry(self.item.longest, f"{self.sight.ident}_longest", entry)
        return ir.Call(longest.name, tuple(ir.Name(a.name, a.kind) for a in longest.arguments), ir.REAL, True)

    def pushing(self, signals: Sequence[ir.Expression], taken: Collection[str] = ()) -> tuple[ir.Block, ir.If]:
        """Return the first sample of signals of a past, and the one behind every step, beside names that are taken."""
        name = ir.unused("signals", taken)
        kind = ir.Kind("array", (), (len(signals),))
        # nearer samples share a place, so that there are enough of them at any rate
        places = ir.Cast(ir.Literal("@RING", ir.INT), ir.REAL) - ir.Literal("4.0", ir.REAL)
        least = self.longest() / places

        def push(dt: ir.Expression, least: ir.Expression) -> tuple[ir.Statement, ...]:
            call = self.called(pushed, self.past, ir.Name(name, kind), dt, least)
            return (ir.Declare(name, kind, ir.Values(tuple(signals), kind), True), ir.CallStatement(call, ()))

        begin = push(ir.Literal("0.0", ir.REAL), ir.Literal("0.0", ir.REAL))
        more = (*push(ir.Name("dt"), least), ir.CallStatement(self.called(rebased, self.past), ()))
        return begin, ir.If(ir.Name("dt") > ir.Literal("0.0", ir.REAL), more)

    def moving(self) -> ir.Function:
        """Return the function that puts what the inputs were a dead time ago in their place, as in apply."""
        age, dt = ir.Name("age"), ir.Name("dt")
        places = [cast(ir.Place, self.sight.channel(n)) for n in self.sight.channels]
        now = [ir.Name(f"now_{place.name}") for place in places]  # type: ignore[union-attr]
        body: list[ir.Statement] = [
            ir.Assign(age, self.longest()),
            *(ir.Assign(n, place) for n, place in zip(now, places, strict=True)),
        ]
        for k, (name, place, value) in enumerate(zip(self.sight.channels, places, now, strict=True)):
            read = late if name in LEVEL_CHANNELS else smooth_late
            body.append(ir.Assign(place, self.called(read, self.past, ir.whole(k), age, dt, value)))
        begin, more = self.pushing(now)
        begin = (self.begin(len(now), 0), *begin)
        body[1 + len(now) : 1 + len(now)] = [
            ir.If(ir.Binary("!=", ir.Name("first", ir.INT), ir.whole(0), ir.BOOL), begin)
        ]
        body.append(more)
        function = ir.Function(f"{self.sight.ident}_moved", [], ir.NOTHING, tuple(body), title=self.title())
        shape(function, [], [], [], self.reader.program)
        function.arguments = [a for a in self.arguments() if a.name in ir.names_in(function.body)]
        for argument in function.arguments:
            argument.changed = argument.name in ("s", "in")
        self.reader.program.functions[function.name] = function
        return function

    def remember(self, step: ir.Function, rest: ir.Function, signals: Sequence[ir.Expression]) -> None:
        """Let an element push what it needs late: at rest its first sample, and one behind every step."""
        taken = names_of(step) | names_of(rest)
        begin, moved = self.pushing(signals, taken)
        rest.body = (*rest.body, *begin)
        body, last = list(step.body), list[ir.Statement]()
        if isinstance(body[-1], ir.Return):
            # the output may be read from the past, which moves on now
            value = body.pop().value  # type: ignore[union-attr]
            output = ir.Name(ir.unused("output", taken))
            body.append(ir.Declare(output.name, ir.REAL, value, True))
            last = [ir.Return(output)]
        step.body = (*body, moved, *last)

    def state_names(self, step: Callable[..., Any], rest: Callable[..., Any]) -> list[str]:
        """Return the names of what is remembered: those into which ``step`` takes its state apart."""
        function = python_of(step)
        assert function is not None
        names = unpacked(function, next(iter(inspect.signature(function).parameters)))
        if names:
            # its own fields beside those that every element may have
            places = [*self.before(), *map(self.then, self.spec.params)]
            taken = {"past", "time", *(p.name for p in places if isinstance(p, ir.Member))}
            return [ir.unused(field_name(n), taken) for n in names]
        at_rest = rest((1.0,) * len(self.now()), tuple(p.start for p in self.spec.params))
        return [f"state_{k}" for k in range(len(at_rest))]

    @staticmethod
    def bound(function: Callable[..., Any], values: Sequence[ir.Expression]) -> dict[str, ir.Expression]:
        """Return the values of a function's arguments, by name."""
        names = list(inspect.signature(function).parameters)
        return dict(zip(names, values, strict=False))

    def title(self) -> tuple[str, ...]:
        """Return the element's title and equation."""
        return (self.spec.title, *([f"    {self.spec.equation}"] if self.spec.equation else []))

    def rest_title(self) -> tuple[str, ...]:
        """Return the title of the function of the rest."""
        return (f"{self.spec.title}: what it remembers at rest",)


def rebased(past: Any) -> None:
    """Count samples and time from here on, once in a while, so that neither grows beyond the digits of a float."""
    places, width = int(past[1]), int(past[2]) + 1
    if past[0] >= 2.0 * past[1]:
        past[0] -= past[1]
        first = RESERVED + int(past[3])
        newest = past[first + (int(past[0]) - 1) % places * width]
        for k in range(places):
            past[first + k * width] -= newest
