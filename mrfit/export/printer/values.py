"""Expressions of Python as those of a typed tree: numbers, tuples, operations, choices and calls."""

import ast
import builtins
import inspect
import math
import types
import typing
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, Protocol

import numpy as np

from mrfit.errors import DataError
from mrfit.export.printer import ir, shaping
from mrfit.export.printer.entry_point import EntryPoint
from mrfit.export.printer.functions import (
    COMPARISON_OPERATORS,
    FOLDED,
    KNOWN,
    ONE,
    OPERATORS,
    SMALL,
    TWO,
    FunctionSource,
    constant_of,
    is_constant,
    place_of,
    python_of,
)
from mrfit.export.text import field as field_name
from mrfit.export.text import number
from mrfit.kernels import jit
from mrfit.kernels.powers import log2, power, tanh
from mrfit.kernels.theta import columns


@dataclass
class Signature:
    """A function as it is printed, the kind of what it returns in Python, and the arguments that it has there."""

    function: ir.Function
    returned: ir.Kind
    given: list[ir.Argument]


class OpenProgram(Protocol):
    """A program that is being read, as the reader of one of its functions needs it; see ``ProgramReader``."""

    reserved: frozenset[str]
    prefix: str
    structs: dict[str, dict[str, ir.Kind]]
    program: ir.Program

    def name_for(self, wanted: str, what: Any, key: object = None) -> str:
        """Return a name in the program for what stands in a module."""
        ...

    def function(self, function: types.FunctionType, given: Mapping[str, ir.Kind]) -> Signature:
        """Return a function that is called with values of these kinds."""
        ...


class ValueReader:
    """Reads the expressions of one function.

    Parameters
    ----------
    reader
        What reads those that it calls.
    function
        As it was written.
    name
        What it is called where it is printed.
    kinds
        Kinds of the values that it is called with, by the names of its arguments.
    entry
        How its arguments are found, of a function with which the program begins.
    """

    def __init__(
        self,
        reader: OpenProgram,
        function: types.FunctionType,
        name: str,
        kinds: Mapping[str, ir.Kind],
        entry: EntryPoint | None,
    ) -> None:
        self.reader, self.python, self.name, self.kinds, self.entry = reader, function, name, kinds, entry
        self.source = FunctionSource.of(function)
        self.hints = typing.get_type_hints(function)
        self.returned = ir.NOTHING if entry else kind_of(self.hints.get("return"))
        self.known: dict[str, ir.Kind] = {}
        self.aliases: dict[str, ir.Expression] = {}
        self.pending: list[ir.Statement] = []
        self.taken: set[str] = set()
        self.names: dict[str, str] = {}
        self.hoists = True
        self.loops = 0
        nodes = list(ast.walk(self.source.tree))
        stored = [n.id for n in nodes if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
        arguments = {*inspect.signature(function).parameters}
        # an argument has a value before it is set
        self.stored = {n: stored.count(n) + (n in arguments) for n in stored}
        inner = [n for b in nodes if isinstance(b, ast.If | ast.For | ast.While) for n in ast.walk(b)]
        inner_stored = {n.id for n in inner if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        # set in a branch or a loop, which may be passed over
        self.branched_arguments = inner_stored & arguments
        # tuples of which an item is read whose place is not constant
        self.indexed = {
            n.value.id
            for n in nodes
            if isinstance(n, ast.Subscript)
            and isinstance(n.value, ast.Name)
            and not is_constant(n.slice, self.source.tree)
        }

    def fail(self, node: ast.AST, why: str) -> NoReturn:
        """Raise the one line that says which statement has no form, and why."""
        line = self.source.first + getattr(node, "lineno", 1) - 1
        text = ast.unparse(node).splitlines()[0]
        raise DataError(
            f"{Path(self.source.file).name}:{line}: '{text}' has no form in C: {why}; docs/export.md lists what has"
        )

    def named(self, name: str) -> str:
        """Return a variable's name where it is printed: unlike all others, and unlike what has a meaning there."""
        if name not in self.names:
            others = {*self.stored, *inspect.signature(self.python).parameters} - {name}
            arguments = {a.name for a in self.entry.arguments} if self.entry else set[str]()
            wanted = f"own_{name}" if name.startswith(self.reader.prefix) else field_name(name)
            taken = others | arguments | self.reader.reserved | {*self.names.values()}
            self.names[name] = ir.unused(wanted, taken)
        return self.names[name]

    def items_of(self, value: ir.Expression) -> tuple[ir.Expression, ...]:
        """Return the values of a tuple."""
        if isinstance(value, ir.Values):
            return value.values
        if value.kind.name == "array":
            return tuple(ir.Subscript(value, ir.whole(k), value.kind.element) for k in range(value.kind.extents[0]))
        return (value,)

    def flat(self, value: ir.Expression) -> list[ir.Expression]:
        """Return the values of tuples inside one another."""
        return shaping.flat(ir.Values(self.items_of(value), value.kind)) if value.kind.name == "tuple" else [value]

    def place(self, node: ast.expr, kind: ir.Kind) -> ir.Place:
        """Return the place of an assignment."""
        if not isinstance(node, ast.Name):
            found = self.value(node)
            if not isinstance(found, ir.Subscript):
                self.fail(node, "a variable or an element of an array is assigned to")
            return found
        known = self.known.get(node.id, kind)
        if known != kind and {known, kind} == {ir.REAL, ir.INT}:
            known = ir.REAL
        elif known != kind:
            self.fail(node, "a variable keeps one kind")
        self.known[node.id] = known
        return ir.Name(self.named(node.id), known)

    def temporary(self, kind: ir.Kind, name: str = "kept") -> ir.Name:
        """Return a new variable."""
        made, count = name, 1
        while made in self.taken or made in self.reader.reserved:
            made, count = f"{name}_{count}", count + 1
        self.taken.add(made)
        self.known[made] = kind
        return ir.Name(made, kind)

    # expressions

    def condition(self, node: ast.expr) -> ir.Expression:
        """Return a condition."""
        value = self.value(node)
        if value.kind != ir.BOOL:
            self.fail(node, "a condition is a comparison")
        return value

    def in_place(self, node: ast.expr, read: Callable[[ast.expr], ir.Expression]) -> ir.Expression:
        """Return an expression before which nothing can be done: that of a while, or one that may not be evaluated."""
        hoisted, self.hoists = self.hoists, False
        try:
            return read(node)
        finally:
            self.hoists = hoisted

    def number(self, node: ast.expr) -> ir.Expression:
        """Return a number."""
        value = self.value(node)
        if value.kind not in (ir.REAL, ir.INT):
            self.fail(node, "a number is wanted")
        return value

    @staticmethod
    def real(value: ir.Expression) -> ir.Expression:
        """Return a number as a real one."""
        if value.kind != ir.INT:
            return value
        if isinstance(value, ir.Binary) and value.sign in ("+", "-", "*"):
            return ir.Binary(value.sign, ValueReader.real(value.left), ValueReader.real(value.right), ir.REAL)
        return (
            ir.Literal(number(float(value.text)), ir.REAL) if isinstance(value, ir.Literal) else ir.Cast(value, ir.REAL)
        )

    def as_kind(self, value: ir.Expression, kind: ir.Kind, node: ast.expr) -> ir.Expression:
        """Return a value as one of a kind."""
        value = self.real(value) if kind == ir.REAL else value
        if value.kind != kind:
            self.fail(node, f"it is of the kind {value.kind.name}, where {kind.name} is wanted")
        return value

    def value(self, node: ast.expr) -> ir.Expression:
        """Return an expression; what has to be done before it is pending."""
        read = getattr(self, f"of_{type(node).__name__.lower()}", None)
        if read is None:
            self.fail(node, "there is no such expression")
        return typing.cast(ir.Expression, read(node))

    def of_constant(self, node: ast.Constant) -> ir.Expression:
        """Return a constant."""
        return self.literal(node.value, node)

    def literal(self, value: object, node: ast.AST) -> ir.Expression:
        """Return a value of Python as a constant."""
        if isinstance(value, tuple):
            return group([self.literal(v, node) for v in value])
        if isinstance(value, bool):
            return ir.Literal("1" if value else "0", ir.BOOL)
        if not isinstance(value, int | float):
            self.fail(node, "a constant is a number")
        kind = ir.REAL if isinstance(value, float) else ir.INT
        text = str(abs(value)) if kind == ir.INT else "inf" if math.isinf(value) else number(abs(value))
        return ir.Unary("-", ir.Literal(text, kind), kind) if value < 0 else ir.Literal(text, kind)

    def of_name(self, node: ast.Name) -> ir.Expression:
        """Return a variable, or a constant of the module."""
        if node.id in self.aliases:
            return self.aliases[node.id]
        if node.id in self.known:
            return ir.Name(self.named(node.id), self.known[node.id])
        if node.id not in self.python.__globals__:
            self.fail(node, f"{node.id} has no value before it is used")
        given = self.python.__globals__[node.id]
        found = self.literal(given, node)
        if isinstance(found, ir.Values):
            return found
        module, written = constant_of(self.python, node.id)
        name = self.reader.name_for(node.id, module, (node.id, given))
        self.reader.program.constants[name] = ir.Constant(name, found.kind, found, written)
        return ir.Name(name, found.kind)

    def of_attribute(self, node: ast.Attribute) -> ir.Expression:
        """Return a constant of math, or a field of a struct."""
        known = isinstance(node.value, ast.Name) and node.value.id in {*self.aliases, *self.known}
        if known and (held := self.value(node.value)).kind.name == "struct":
            return ir.Member(held, node.attr, self.reader.structs[held.kind.tag][node.attr])
        owner = self.python.__globals__.get(node.value.id) if isinstance(node.value, ast.Name) else None
        if not isinstance(owner, types.ModuleType):
            self.fail(node, "only modules have attributes")
        return self.literal(getattr(owner, node.attr, None), node)

    def of_subscript(self, node: ast.Subscript) -> ir.Expression:
        """Return an item of a tuple, or an element of an array."""
        if isinstance(node.value, ast.Name) and self.entry and node.value.id in self.entry.tables:
            return self.column(node, self.entry.tables[node.value.id])
        value = self.value(node.value)
        for one in node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]:
            known = place_of(one)
            if value.kind.name == "array" and (known is None or known >= 0):
                index = self.value(one)
                if index.kind != ir.INT:
                    self.fail(node, "the place in an array is a whole number")
                value = ir.Subscript(value, index, value.kind.element)
                continue
            items = self.items_of(value)
            if known is None and isinstance(found := self.value(one), ir.Literal):
                known = int(found.text)
            if known is not None and not -len(items) <= known < len(items):
                self.fail(node, f"there are {len(items)} items")
            if known is None:
                self.fail(node, "the place in a tuple is constant, unless a variable has the tuple")
            value = items[known]
        return value

    def column(self, node: ast.Subscript, table: Mapping[str, ir.Expression] | ir.Values) -> ir.Expression:
        """Return a channel by its name, or a parameter by its column, of a function of whole arrays."""
        place = node.slice
        if not isinstance(table, ir.Values) and isinstance(place, ast.Constant) and str(place.value) in table:
            return table[str(place.value)]
        if isinstance(table, ir.Values) and isinstance(place, ast.Tuple) and ast.unparse(place.elts[0]) == ":":
            one, count = place.elts[1], len(table.values)
            if isinstance(one, ast.Slice):
                first = place_of(one.lower) if one.lower else 0
                last = place_of(one.upper) if one.upper else count
                known = (
                    first if first is not None and last is not None and first % count == (last - 1) % count else None
                )
            else:
                known = place_of(one)
            if known is not None and -count <= known < count:
                return table.values[known]
        self.fail(node, "of arrays, a channel is read by its name and a parameter by its column")

    def of_tuple(self, node: ast.Tuple) -> ir.Expression:
        """Return several values."""
        return group(self.listed_values(node.elts))

    def listed_values(self, nodes: Sequence[ast.expr]) -> list[ir.Expression]:
        """Return several expressions, tuples with a star taken apart."""
        found = list[ir.Expression]()
        for one in nodes:
            found += self.items_of(self.value(one.value)) if isinstance(one, ast.Starred) else [self.value(one)]
        return found

    def of_unaryop(self, node: ast.UnaryOp) -> ir.Expression:
        """Return a negative, or a negation."""
        if isinstance(node.op, ast.Not | ast.Invert):
            return ir.Unary("not", self.condition(node.operand), ir.BOOL)
        value = self.number(node.operand)
        return value if isinstance(node.op, ast.UAdd) else ir.Unary("-", value, value.kind)

    def of_binop(self, node: ast.BinOp) -> ir.Expression:
        """Return an operation."""
        if isinstance(node.op, ast.BitAnd | ast.BitOr):
            left, right = self.condition(node.left), self.in_place(node.right, self.condition)
            return ir.Binary("and" if isinstance(node.op, ast.BitAnd) else "or", left, right, ir.BOOL)
        left, right = self.number(node.left), self.number(node.right)
        if isinstance(node.op, ast.Pow):
            return self.raised(left, right)
        sign = OPERATORS.get(type(node.op))
        if sign is None or sign in ("//", "%") and (left.kind, right.kind) != (ir.INT, ir.INT):
            self.fail(node, "// and % are those of whole numbers" if sign else "there is no such operation")
        if (
            isinstance(left, ir.Literal)
            and isinstance(right, ir.Literal)
            and left.kind == right.kind == ir.INT
            and sign != "/"
        ):
            return self.literal(FOLDED[sign](int(left.text), int(right.text)), node)
        if sign == "/" or ir.REAL in (left.kind, right.kind):
            left, right = self.real(left), self.real(right)
        return ir.Binary(sign, left, right, left.kind)

    def raised(self, base: ir.Expression, exponent: ir.Expression) -> ir.Expression:
        """Return a power: a square is written out, by a function where its base is no plain name."""
        if isinstance(exponent, ir.Literal) and float(exponent.text) == 2.0:
            base = self.real(base)
            return base * base if isinstance(base, ir.Name | ir.Member) else ir.Call("square", (base,))
        return ir.Call("pow", (self.real(base), self.real(exponent)))

    def of_compare(self, node: ast.Compare) -> ir.Expression:
        """Return a comparison, or several in a row."""
        operands = [self.value(n) for n in (node.left, *node.comparators)]
        found: ir.Expression | None = None
        for op, left, right in zip(node.ops, operands, operands[1:], strict=False):
            sign = OPERATORS.get(type(op))
            if sign is None or not {left.kind, right.kind} <= {ir.REAL, ir.INT, ir.BOOL}:
                self.fail(node, "there is no such comparison")
            if ir.REAL in (left.kind, right.kind):
                left, right = self.real(left), self.real(right)
            one: ir.Expression = ir.Binary(sign, left, right, ir.BOOL)
            if isinstance(left, ir.Literal) and isinstance(right, ir.Literal) and left.kind == right.kind == ir.INT:
                one = self.literal(bool(COMPARISON_OPERATORS[sign](int(left.text), int(right.text))), node)
            found = one if found is None else ir.Binary("and", found, one, ir.BOOL)
        assert found is not None
        return found

    def of_boolop(self, node: ast.BoolOp) -> ir.Expression:
        """Return a conjunction or a disjunction."""
        found = self.condition(node.values[0])
        for other in node.values[1:]:
            found = ir.Binary(OPERATORS[type(node.op)], found, self.in_place(other, self.condition), ir.BOOL)
        return found

    def of_ifexp(self, node: ast.IfExp) -> ir.Expression:
        """Return a choice."""
        return self.choice(node.test, node.body, node.orelse)

    def choice(self, test: ast.expr, one: ast.expr, another: ast.expr) -> ir.Expression:
        """Return one of two numbers."""
        condition = self.condition(test)
        if isinstance(condition, ir.Literal):
            return self.value(one if condition.text == "1" else another)
        then, other = (self.in_place(n, self.value) for n in (one, another))
        if ir.REAL in (then.kind, other.kind):
            then, other = self.real(then), self.real(other)
        if then.kind.name == "tuple" and len(self.flat(then)) == len(self.flat(other)) and self.hoists:
            # variables that are set by one of two statements
            made = [self.temporary(real_kind(v.kind), "chosen") for v in self.flat(then)]
            branches = [
                tuple(ir.Assign(n, self.real(v)) for n, v in zip(made, self.flat(values), strict=True))
                for values in (then, other)
            ]
            self.pending.append(ir.If(condition, branches[0], branches[1]))
            return self.gathered(real_kind(then.kind), iter(made))
        if then.kind != other.kind or then.kind.name == "tuple":
            self.fail(test, "a choice is one between numbers")
        return ir.Conditional(condition, then, other, then.kind)

    def gathered(self, kind: ir.Kind, names: Iterator[ir.Name]) -> ir.Expression:
        """Return variables as the tuple that they are the values of."""
        if kind.name != "tuple":
            return next(names)
        return ir.Values(tuple(self.gathered(k, names) for k in kind.items), kind)

    # calls

    def target_of(self, node: ast.Call) -> Any:
        """Return the object that is called."""
        if node.keywords:
            self.fail(node, "arguments are given by their places")
        if isinstance(node.func, ast.Attribute) and isinstance(node.func.value, ast.Name):
            return getattr(self.python.__globals__.get(node.func.value.id), node.func.attr, None)
        if isinstance(node.func, ast.Name):
            return self.python.__globals__.get(node.func.id, getattr(builtins, node.func.id, None))
        self.fail(node, "what is called has a name")

    def of_call(self, node: ast.Call) -> ir.Expression:
        """Return a call's value."""
        if self.entry and isinstance(node.func, ast.Name) and node.func.id in self.entry.calls:
            return self.entry.calls[node.func.id](*self.listed_values(node.args))
        if self.target_of(node) is columns and self.entry and isinstance(node.args[0], ast.Name):
            return typing.cast(ir.Values, self.entry.tables[node.args[0].id])
        small = self.small(node, self.target_of(node))
        if small is not None:
            return small
        call, value = self.own_call(node)
        if value is None:
            return call
        if not self.hoists:
            self.fail(node, "a function of several values is not called where it may not be evaluated")
        self.pending.append(ir.CallStatement(call, tuple(typing.cast(ir.Name, v) for v in self.flat(value))))
        return value

    def several(self, node: ast.Call, place: ast.expr) -> tuple[ir.Call, ir.Expression] | None:
        """Return the call of a function of several values, with names of these; None of any other call."""
        target = self.target_of(node)
        if self.small_name(target) or python_of(target) is None or target is columns:
            return None
        pending, taken = list(self.pending), set(self.taken)
        call, value = self.own_call(node, place.id if isinstance(place, ast.Name) else "")
        if value is None:
            # it is read again, as an expression
            self.pending, self.taken = pending, taken
        return None if value is None else (call, value)

    @staticmethod
    def small_name(target: Any) -> str:
        """Return the name of a function of math or numpy, or of a built-in one; empty of another."""
        name = getattr(target, "__name__", "")
        if target in (log2, power, tanh):
            return str(target.__name__)
        own = target in (abs, min, max, len, float, int)
        known = own or name in KNOWN and any(vars(module).get(name) is target for module in (math, np, jit))
        return str(name) if known else ""

    def small(self, node: ast.Call, target: Any) -> ir.Expression | None:
        """Return a call of a function of math or numpy, or of a built-in one; None of another."""
        name = self.small_name(target)
        if not name:
            return None
        if name == "where":
            return self.choice(node.args[0], node.args[1], node.args[2])
        if name == "len":
            return ir.whole(len(self.items_of(self.value(node.args[0]))))
        if name == "row":
            first, width = self.value(node.args[1]), len(self.items_of(self.value(node.args[2])))
            assert isinstance(first, ir.Literal)
            places = [ir.whole(int(first.text) + k) for k in range(width)]
            return group([ir.Subscript(self.value(node.args[0]), place) for place in places])
        values = [self.number(n) for n in node.args]
        if name == "int":
            # of a call's value, since what is cast is no operation
            return values[0] if values[0].kind == ir.INT else ir.Cast(cut(values[0]), ir.INT)
        if all(v.kind == ir.INT for v in values) and name in ("abs", "min", "max"):
            return self.whole(name, values)
        reals = tuple(map(self.real, values))
        if name == "float":
            return reals[0]
        for known, count in ((ONE, 1), (TWO, 2), (SMALL, 1 if name == "sign" else 3 if name == "clip" else 2)):
            if name in known and len(reals) == count:
                return ir.Call(known[name], reals)
        if name in ("min", "max") and len(reals) > 2:
            return ir.Call(SMALL[name], (ir.Call(SMALL[name], reals[:2]), *reals[2:]))
        self.fail(node, "there is no such function in math.h")

    @staticmethod
    def whole(name: str, values: list[ir.Expression]) -> ir.Expression:
        """Return the size of a whole number, or the smaller or larger of several."""
        if name == "abs":
            return ir.Conditional(
                values[0] < ir.whole(0),
                ir.Unary("-", values[0], ir.INT),
                values[0],
                ir.INT,
            )
        found = values[0]
        for other in values[1:]:
            found = ir.Call("fewer" if name == "min" else "more", (found, other), ir.INT)
        return found

    def own_call(self, node: ast.Call, shown: str = "") -> tuple[ir.Call, ir.Expression | None]:
        """Return the call of a function of Python, and variables for its values if there are several."""
        target = python_of(self.target_of(node))
        if target is None:
            self.fail(node, "a function is one of math, or one of Python that is in the subset itself")
        values = self.listed_values(node.args)
        parameters = inspect.signature(target).parameters
        names = list(parameters)
        values += [
            self.literal(p.default, node) for p in list(parameters.values())[len(values) :] if p.default is not p.empty
        ]
        if len(values) != len(names):
            self.fail(node, f"{target.__name__} has {len(names)} arguments")
        signature = self.reader.function(target, {n: v.kind for n, v in zip(names, values, strict=True)})
        used = [id(a) for a in signature.function.arguments]
        wanted, passed = iter(signature.given), list[ir.Expression]()
        for value in values:
            left = self.flat(value)
            while left:
                argument = next(wanted, None)
                if argument is None:
                    self.fail(node, f"{target.__name__} wants fewer values")
                if left[0].kind.name == "array" and argument.kind.name != "array":
                    left[:1] = self.items_of(left[0])
                if argument.kind.name == "array" and left[0].kind.name != "array":
                    row, left = left[: argument.kind.extents[0]], left[argument.kind.extents[0] :]
                    if id(argument) in used:
                        name = self.temporary(argument.kind, argument.name)
                        self.pending.append(ir.Assign(name, ir.Values(tuple(map(self.real, row)), argument.kind)))
                        passed.append(name)
                elif id(argument) in used:
                    passed.append(self.as_kind(left.pop(0), argument.kind, node))
                else:
                    left.pop(0)
        call = ir.Call(signature.function.name, tuple(passed), signature.function.result, True)
        if signature.returned.name != "tuple":
            return call, None
        shown_names = (a.name.removesuffix("_out") for a in signature.function.outputs)
        own = shown or signature.function.name
        kinds = flat_kinds([signature.returned])
        made = [self.temporary(k, own if n.startswith("out_") else n) for k, n in zip(kinds, shown_names, strict=True)]
        return call, self.gathered(signature.returned, iter(made))


def kind_of(annotation: Any) -> ir.Kind:
    """Return the kind that an annotation names, NOTHING if it names none or leaves a length open."""
    simple = {float: ir.REAL, int: ir.INT, bool: ir.BOOL}
    if annotation in simple:
        return simple[annotation]
    inside = typing.get_args(annotation)
    if typing.get_origin(annotation) is tuple and Ellipsis not in inside:
        kinds = tuple(kind_of(a) for a in inside)
        return ir.NOTHING if ir.NOTHING in kinds else ir.Kind("tuple", kinds)
    return ir.NOTHING


def cut(value: ir.Expression) -> ir.Expression:
    """Return a number without its decimals."""
    return ir.Call("trunc", (value,)) if isinstance(value, ir.Binary) else value


def group(values: Sequence[ir.Expression]) -> ir.Values:
    """Return several values as a tuple."""
    return ir.Values(tuple(values), ir.Kind("tuple", tuple(v.kind for v in values)))


def real_kind(kind: ir.Kind) -> ir.Kind:
    """Return a kind with real numbers in place of whole ones."""
    if kind.name == "tuple":
        return ir.Kind("tuple", tuple(map(real_kind, kind.items)))
    return ir.REAL if kind == ir.INT else kind


def flat_kinds(kinds: Sequence[ir.Kind]) -> list[ir.Kind]:
    """Return the kinds inside tuples."""
    return [one for kind in kinds for one in (flat_kinds(kind.items) if kind.name == "tuple" else [kind])]
