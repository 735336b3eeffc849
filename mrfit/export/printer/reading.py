"""Functions of Python as a typed tree: what is read is the subset that docs/plugins.md names, and no more."""

import ast
import inspect
import types
import typing
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from mrfit.errors import DataError
from mrfit.export.printer import ir, shaping
from mrfit.export.printer.entry_point import EntryPoint
from mrfit.export.printer.functions import MEANINGFUL_NAMES, python_of, set_by, unpacked
from mrfit.export.printer.values import Signature, ValueReader, flat_kinds, group, kind_of, real_kind
from mrfit.export.text import field as field_name


class ProgramReader:
    """Reads functions, and those that they call, into one program.

    Parameters
    ----------
    reserved
        Names that no function and no constant may have.
    prefix
        What those begin with that others see, so that no function may.

    Attributes
    ----------
    structs
        Kinds of the fields of structs whose fields are read by their names, by tag.
    """

    def __init__(self, reserved: Iterable[str] = (), prefix: str = " ") -> None:
        self.prefix, self.reserved = prefix, MEANINGFUL_NAMES.union(reserved)
        self.structs: dict[str, dict[str, ir.Kind]] = {}
        self.program = ir.Program()
        self.signatures: dict[object, Signature] = {}
        self.taken: dict[str, object] = dict.fromkeys(self.reserved)

    def entry(self, given: Any, name: str, entry: EntryPoint) -> ir.Function:
        """Return a function that the program begins with."""
        function = python_of(given)
        if function is None:
            raise DataError(f"{given!r} is no function of Python")
        found = FunctionReader(self, function, name, {}, entry).read().function
        self.program.functions[name] = found
        return found

    def function(self, function: types.FunctionType, given: Mapping[str, ir.Kind]) -> Signature:
        """Return a function that is called with values of these kinds, by the names of its arguments."""
        hints = typing.get_type_hints(function)
        known = {name: kind_of(hints.get(name)) for name in given}
        kinds = {name: given[name] if kind == ir.NOTHING else kind for name, kind in known.items()}
        key = (function, tuple(kinds.values()))
        if key not in self.signatures:
            name = self.name_for(function.__name__, function, key)
            self.signatures[key] = FunctionReader(self, function, name, kinds, None).read()
            self.program.functions[name] = self.signatures[key].function
        return self.signatures[key]

    def settled(self) -> ir.Program:
        """Return the program: each function behind those that it calls, a constant of one function inside it.

        No function has the name of a variable.
        """
        program = self.program
        functions = list(program.functions.values())
        variables = {
            n for f in functions for n in (*ir.names_in(f.body), *(a.name for a in (*f.arguments, *f.outputs)))
        }
        taken = variables | set(program.functions)
        new = {n: ir.unused(f"{n}_of", taken) for n in variables & set(program.functions)}
        for name, constant in list(program.constants.items()):
            users = [f for f in functions if name in ir.names_in(f.body) and name not in ir.declared_in(f)]
            if len(users) == 1:
                remark = (ir.Remark(constant.remark),) if constant.remark else ()
                own = ir.Declare(name, constant.kind, constant.value, True)
                users[0].body = (*remark, own, *users[0].body)
            elif users and any(name in ir.declared_in(f) for f in functions):
                other = ir.unused(f"{name}_everywhere", taken)
                taken.add(other)
                program.constants[other] = replace(constant, name=other)
                for user in users:
                    user.body = ir.renamed(user.body, {name: other}, ir.Name)
                users = []
            if len(users) < 2:
                del program.constants[name]
        for function in functions:
            function.name, function.body = (
                new.get(function.name, function.name),
                ir.renamed(function.body, new, ir.Call),
            )
        known, program.functions = {f.name: f for f in functions}, {}

        def add(function: ir.Function) -> None:
            for call in ir.parts(function.body):
                if isinstance(call, ir.Call) and call.own and call.name not in program.functions:
                    add(known[call.name])
            program.functions.setdefault(function.name, function)

        for function in functions:
            add(function)
        return program

    def name_for(self, wanted: str, what: Any, key: object = None) -> str:
        """Return a name in the program for what stands in a module, with the module's if another has the name."""
        key = what if key is None else key
        name = field_name(wanted.lstrip("_"))
        module = getattr(what, "__module__", "") or ""
        if name.startswith(self.prefix) or self.taken.setdefault(name, key) != key:
            name = f"{field_name(module.rpartition('.')[2])}_{name}"
            while name.startswith(self.prefix) or self.taken.setdefault(name, key) != key:
                name = f"own_{name}"
        return name


class FunctionReader(ValueReader):
    """Reads one function, statement by statement."""

    def read(self) -> Signature:
        """Return the function."""
        arguments, start = self.entered() if self.entry else self.given()
        known, aliases = dict(self.known), dict(self.aliases)
        body: ir.Block = ()
        for _ in range(8):
            # a variable that is whole at first and a real number later is the latter: read again
            before, self.pending, self.aliases = dict(self.known), [], dict(aliases)
            self.taken = {*map(self.named, self.stored), *(a.name for a in arguments), *map(self.named, known)}
            body = (*start, *self.block(self.source.tree.body))
            if self.known == before:
                break
            self.known = {**self.known, **known}
        function = ir.Function(
            self.name, arguments, ir.NOTHING, body, title=self.entry.title if self.entry else self.title()
        )
        after = list[tuple[ir.Place, ir.Expression]]()
        if self.entry:
            mentioned = list(ir.parts(body))
            after = [(place, v) for place, v in self.entry.after if self.entry.always or place in mentioned]
        function.kept = [place for place, _ in after]
        kinds = self.returned.items if self.returned.name == "tuple" else (self.returned,)
        destinations = self.entry.destinations if self.entry else ()
        shaping.shape(function, flat_kinds(kinds), destinations, after, self.reader.program)
        used = set(ir.names_in(function.body))
        function.arguments = [a for a in arguments if a.name in used]
        return Signature(function, self.returned, arguments)

    def entered(self) -> tuple[list[ir.Argument], list[ir.Statement]]:
        """Return an entry's arguments, and what it begins with."""
        assert self.entry is not None
        self.aliases = dict(self.entry.bound)
        start = list[ir.Statement]()
        for name, value in self.entry.bound.items():
            if isinstance(value, ir.Values) and name in self.indexed:
                start += self.listed(name, value)
            elif not isinstance(value, ir.Values) and name in self.stored:
                del self.aliases[name]
                start.append(ir.Assign(self.place(ast.Name(name), value.kind), value))
        return list(self.entry.arguments), start

    def given(self) -> tuple[list[ir.Argument], list[ir.Statement]]:
        """Return the arguments of any other function."""
        tree, found = self.source.tree, list[ir.Argument]()
        if tree.args.vararg or tree.args.kwarg or tree.args.kwonlyargs:
            self.fail(tree, "a function has a fixed number of arguments")
        for one in tree.args.args:
            found += self.argument(one.arg, self.kinds[one.arg])
        return found, []

    def argument(self, name: str, kind: ir.Kind) -> list[ir.Argument]:
        """Return an argument, or those that a tuple's values become."""
        if kind.name == "tuple" and name in self.indexed:
            kind = ir.Kind("array", (), (len(kind.items),))
        self.known[name] = kind
        if kind.name != "tuple":
            return [ir.Argument(self.named(name), kind)]
        names = unpacked(self.python, name) or [f"{name}_{k}" for k in range(len(kind.items))]
        inside = [self.argument(n, k) for n, k in zip(names, kind.items, strict=True)]
        values = tuple(self.aliases.get(n, ir.Name(self.named(n), k)) for n, k in zip(names, kind.items, strict=True))
        self.aliases[name] = ir.Values(values, kind)
        return [a for made in inside for a in made]

    def title(self) -> tuple[str, ...]:
        """Return the docstring to where its sections begin."""
        lines = inspect.cleandoc(self.python.__doc__ or "").split("\n")
        ends = [k for k in range(len(lines) - 1) if lines[k + 1] and set(lines[k + 1]) == {"-"}]
        return tuple("\n".join(lines[: ends[0]] if ends else lines).rstrip().split("\n"))

    # statements

    def block(self, body: Sequence[ast.stmt]) -> ir.Block:
        """Return statements, with the comments that stand above and behind them."""
        found = list[ir.Statement]()
        for node in body:
            remarks = tuple(self.remarks(node))
            made = list(self.statement(node))
            before, self.pending = self.pending, []
            found += [*([ir.Remark(remarks)] if remarks and (made or before) else []), *before, *made]
        return tuple(found)

    def looped(self, body: Sequence[ast.stmt]) -> ir.Block:
        """Return the statements of a loop."""
        self.loops += 1
        found = self.block(body)
        self.loops -= 1
        return found

    def flushed(self, made: Iterator[ir.Statement]) -> ir.Block:
        """Return statements behind what has to be done before them."""
        found = tuple(made)
        before, self.pending = self.pending, []
        return (*before, *found)

    def remarks(self, node: ast.stmt) -> Iterator[str]:
        """Yield the comment lines that belong to a statement: those above it, and those behind its code."""
        first = line = node.lineno - 1
        while line in self.source.alone:
            line -= 1
        last = node.lineno if hasattr(node, "body") else node.end_lineno or node.lineno
        for one in (*range(line + 1, first + 1), *range(node.lineno, last + 1)):
            if text := self.source.alone.get(one) or self.source.behind.get(one):
                yield text

    def statement(self, node: ast.stmt) -> Iterator[ir.Statement]:
        """Yield the statements that one of Python becomes."""
        if isinstance(node, ast.Pass) or isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            return
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            yield from self.assigned(node, node.targets[0], node.value)
        elif isinstance(node, ast.AnnAssign) and node.value is not None:
            yield from self.assigned(node, node.target, node.value)
        elif isinstance(node, ast.AugAssign):
            read = ast.copy_location(ast.parse(ast.unparse(node.target), mode="eval").body, node)
            sum_ = ast.copy_location(ast.BinOp(read, node.op, node.value), node)
            yield from self.assigned(node, node.target, ast.fix_missing_locations(sum_))
        elif isinstance(node, ast.If):
            condition = self.condition(node.test)
            before, self.pending = self.pending, []
            yield from (*before, ir.If(condition, self.block(node.body), self.block(node.orelse)))
        elif isinstance(node, ast.While) and not node.orelse:
            yield ir.While(self.in_place(node.test, self.condition), self.looped(node.body))
        elif isinstance(node, ast.For) and not node.orelse:
            yield from self.counted(node)
        elif isinstance(node, ast.Break | ast.Continue):
            yield ir.Leave("break" if isinstance(node, ast.Break) else "continue")
        elif isinstance(node, ast.Return) and node.value is not None:
            yield from self.ended(node.value)
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            value = self.value(node.value)
            if not isinstance(value, ir.Call):
                self.fail(node, "its value is not used")
            yield ir.CallStatement(value, ())
        else:
            self.fail(node, "there is no such statement")

    def ended(self, node: ast.expr) -> Iterator[ir.Statement]:
        """Yield the end of the function; a choice between tuples is one between statements."""
        if isinstance(node, ast.IfExp) and any(isinstance(n, ast.Tuple) for n in (node.body, node.orelse)):
            condition = self.condition(node.test)
            before, self.pending = self.pending, []
            yield from before
            yield ir.If(condition, self.flushed(self.ended(node.body)), self.flushed(self.ended(node.orelse)))
            return
        value = self.value(node)
        values = self.flat(value)
        if self.returned == ir.NOTHING:
            self.returned = real_kind(value.kind)
        wanted = flat_kinds(self.returned.items if self.returned.name == "tuple" else (self.returned,))
        if len(values) != len(wanted):
            self.fail(node, f"{len(wanted)} values are returned elsewhere")
        made = tuple(self.as_kind(v, k, node) for v, k in zip(values, wanted, strict=True))
        if self.entry and self.entry.factors:
            places = zip(typing.cast(list[ir.Place], self.entry.destinations), made, strict=True)
            made = tuple(place * value for place, value in places)
        yield ir.Return(ir.Values(made, self.returned) if len(made) > 1 else made[0])

    def counted(self, node: ast.For) -> Iterator[ir.Statement]:
        """Yield a loop over a range."""
        call = node.iter
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "range"):
            self.fail(node, "a loop runs over range(...)")
        step = ast.unparse(call.args[2]) if len(call.args) == 3 else "1"
        if not isinstance(node.target, ast.Name) or step not in ("1", "-1"):
            self.fail(node, "a loop has one variable, which counts by 1 or -1")
        start = self.value(call.args[0]) if len(call.args) > 1 else ir.whole(0)
        end, name = call.args[1 if len(call.args) > 1 else 0], node.target.id
        self.check_range(node, name, end)
        stop = self.value(end)
        if self.outlives(name):
            count = self.temporary(ir.INT, f"{self.named(name)}_count")
            last = self.place(node.target, ir.INT)
            own = ir.Assign(last, self.real(count) if last.kind == ir.REAL else count)
            yield ir.For(count.name, start, stop, step == "-1", (own, *self.looped(node.body)))
            return
        if name.strip("_") == "":
            name = next(n for n in ("k", "j", "round_") if n not in self.stored and n not in self.known)
            self.aliases[node.target.id] = ir.Name(self.named(name), ir.INT)
        self.known[node.target.id] = ir.INT
        yield ir.For(self.named(name), start, stop, step == "-1", self.looped(node.body))

    def check_range(self, node: ast.For, name: str, end: ast.expr) -> None:
        """Refuse a loop whose range would change: Python has counted before it begins, C asks again in every round."""
        if any(isinstance(n, ast.Name) and n.id == name for n in ast.walk(node.iter)):
            self.fail(node, "the range of a loop does not know its count")
        fixed = {n.id for n in ast.walk(end) if isinstance(n, ast.Name)} | ({name} if name.strip("_") else set())
        for one in (n for statement in node.body for n in ast.walk(statement)):
            place = one.value if isinstance(one, ast.Subscript) else one
            if isinstance(getattr(one, "ctx", None), ast.Store) and isinstance(place, ast.Name) and place.id in fixed:
                self.fail(one, "in a loop its count and its end stay as they are")

    def outlives(self, name: str) -> bool:
        """Return whether the count of a loop is a variable outside of it, too, which has the last count in Python."""
        nodes = list(ast.walk(self.source.tree))
        loops = [n for n in nodes if isinstance(n, ast.For) and isinstance(n.target, ast.Name) and n.target.id == name]
        inside = [n for loop in loops for n in ast.walk(loop)]
        # what is set to a name of underscores alone is left out
        kinds = ast.Load | ast.Store if name.strip("_") else ast.Load
        own = (n for n in nodes if isinstance(n, ast.Name) and n.id == name and isinstance(n.ctx, kinds))
        return any(n not in inside for n in own)

    def assigned(self, node: ast.stmt, target: ast.expr, given: ast.expr) -> Iterator[ir.Statement]:
        """Yield an assignment of one or several values."""
        if isinstance(given, ast.IfExp) and any(isinstance(n, ast.Tuple) for n in (target, given.body, given.orelse)):
            condition = self.condition(given.test)
            before, self.pending = self.pending, []
            yield from before
            # what either branch sets has no name for what does not change
            self.stored.update({n.id: 2 for n in ast.walk(target) if isinstance(n, ast.Name) and n.id in self.stored})
            branches = [self.flushed(self.assigned(node, target, n)) for n in (given.body, given.orelse)]
            yield ir.If(condition, branches[0], branches[1])
        elif isinstance(target, ast.Tuple) and isinstance(given, ast.Tuple) and any(map(self.is_zeros, given.elts)):
            for one, made in zip(target.elts, given.elts, strict=True):
                yield from self.assigned(node, one, made)
        elif isinstance(target, ast.Name) and isinstance(given, ast.Call) and (kind := self.zeros(given)):
            self.known[target.id] = kind
            yield ir.Assign(ir.Name(self.named(target.id), kind), ir.Values((), kind))
        elif isinstance(target, ast.Name) and isinstance(given, ast.Call) and self.target_of(given) is np.array:
            yield from self.listed(target.id, group(self.items_of(self.value(given.args[0]))))
        elif isinstance(given, ast.Call) and (call := self.several(given, target)):
            # what a call fills in is what its values are assigned to, where those are variables
            names, wanted = self.flat(call[1]), set_by(target)
            if wanted and len(wanted) == len(names):
                filled = [
                    typing.cast(ir.Name, self.place(t, n.kind) if t else n) for t, n in zip(wanted, names, strict=True)
                ]
                yield ir.CallStatement(call[0], tuple(filled))
            else:
                yield ir.CallStatement(call[0], tuple(typing.cast(ir.Name, n) for n in names))
                yield from shaping.at_once(list(self.matched(node, target, call[1])), self.temporary)
        else:
            value = self.value(given)
            if isinstance(target, ast.Name) and target.id in self.indexed and isinstance(value, ir.Values):
                yield from self.listed(target.id, value)
            else:
                yield from shaping.at_once(list(self.matched(node, target, value)), self.temporary)

    def matched(
        self, node: ast.stmt, target: ast.expr, value: ir.Expression
    ) -> Iterator[tuple[ir.Place, ir.Expression]]:
        """Yield the places and the values of an assignment; a name for what does not change is that itself."""
        if isinstance(target, ast.Name) and target.id.strip("_") == "":
            return
        if isinstance(target, ast.Tuple):
            values = self.items_of(value)
            if len(values) != len(target.elts):
                self.fail(node, f"there are {len(values)} values")
            for one, item in zip(target.elts, values, strict=True):
                yield from self.matched(node, one, item)
        elif isinstance(target, ast.Name) and value.kind.name == "tuple":
            if target.id in self.branched_arguments:
                self.fail(node, "a tuple that is an argument is set in a branch; give the new one another name")
            if self.stored[target.id] == 1 and all(self.fixed(v) or self.single(v) for v in self.flat(value)):
                self.aliases[target.id], self.known[target.id] = value, value.kind
                return
            name, others = field_name(target.id), self.reader.reserved.union(map(self.named, self.stored))
            names = tuple(ir.Name(ir.unused(f"{name}_{k}", others), v.kind) for k, v in enumerate(self.items_of(value)))
            self.known.update({n.name: n.kind for n in names})
            self.taken |= {n.name for n in names}
            self.known[target.id], self.aliases[target.id] = value.kind, ir.Values(names, value.kind)
            yield from zip(names, self.items_of(value), strict=True)
        elif isinstance(target, ast.Name) and self.stored[target.id] == 1 and self.fixed(value):
            self.aliases[target.id], self.known[target.id] = value, value.kind
        else:
            place = self.place(target, value.kind)
            yield place, self.real(value) if place.kind == ir.REAL else value

    def fixed(self, value: ir.Expression) -> bool:
        """Return whether a value is a field or an argument that stays as it is until the function ends, or a count."""
        if isinstance(value, ir.Member) or isinstance(value, ir.Literal) and value.kind == ir.INT:
            return True
        return (
            isinstance(value, ir.Name) and value.name not in map(self.named, self.stored) and value.name in self.known
        )

    def single(self, value: ir.Expression) -> bool:
        """Return whether a value is a variable that is set once, outside of loops."""
        once = {self.named(n) for n, count in self.stored.items() if count == 1}
        return not self.loops and isinstance(value, ir.Name) and value.name in once

    def listed(self, name: str, value: ir.Values) -> Iterator[ir.Statement]:
        """Yield a tuple as an array, of which items are read whose places are not constant."""
        kind = ir.Kind("array", (), (len(value.values),))
        self.known[name] = kind
        self.aliases.pop(name, None)
        yield ir.Assign(ir.Name(self.named(name), kind), ir.Values(tuple(map(self.real, value.values)), kind))

    def is_zeros(self, node: ast.expr) -> bool:
        """Return whether an expression makes an array."""
        return isinstance(node, ast.Call) and self.target_of(node) in (np.zeros, np.empty)

    def zeros(self, node: ast.Call) -> ir.Kind | None:
        """Return the kind of a new array, None of any other call."""
        if not self.is_zeros(node):
            return None
        sizes = node.args[0].elts if isinstance(node.args[0], ast.Tuple) else [node.args[0]]
        found = [
            self.reader.program.constants[v.name].value
            if isinstance(v, ir.Name) and v.name in self.reader.program.constants
            else v
            for v in map(self.value, sizes)
        ]
        if not all(isinstance(v, ir.Literal) and v.kind == ir.INT for v in found):
            self.fail(node, "an array has constant extents")
        return ir.Kind("array", (), tuple(int(typing.cast(ir.Literal, v).text) for v in found))
