"""A typed tree, run as its statements say: with the scopes of C, where nothing is read before it has a value."""

import copy
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from mrfit.export.printer import ir

UNSET = None
ARITHMETIC: Mapping[str, Callable[[Any, Any], Any]] = {
    **{"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "%": operator.mod},
    **{"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne},
    "//": operator.floordiv,
}
SMALL: Mapping[str, Callable[..., float]] = {
    **{"smaller": min, "larger": max, "fewer": min, "more": max, "square": lambda x: x * x},
    **{"clamp": lambda x, low, high: min(max(x, low), high), "sign_of": lambda x: float((x > 0.0) - (x < 0.0))},
}


class LoopEnd(Exception):
    """The end of a loop or of a round of it."""


class Scope(dict[str, Any]):
    """Variables of a block, and those among them that keep their value."""

    def __init__(self, values: Mapping[str, Any] | None = None, fixed: Sequence[str] = ()) -> None:
        super().__init__(values or {})
        self.fixed = set(fixed)


class Interpreter:
    """Runs the functions of a program."""

    def __init__(self, program: ir.Program) -> None:
        self.program = program

    def call(self, function: ir.Function, given: Sequence[Any]) -> tuple[Any, list[Any]]:
        """Return what a function returns, and the values of its outputs."""
        constants = {n: self.value(c.value, []) for n, c in self.program.constants.items()}
        own = {a.name: v for a, v in zip(function.arguments, given, strict=True)}
        scope = [
            Scope(constants, [*constants]),
            Scope({**own, **{a.name: UNSET for a in function.outputs}}, [*own]),
        ]
        returned = self.block(function.body, scope)
        assert (returned is None) == (function.result == ir.NOTHING)
        outputs = [scope[1][a.name] for a in function.outputs]
        assert UNSET not in outputs
        return returned, outputs

    def block(self, block: ir.Block, scope: list[Scope]) -> Any:
        """Run a block in a scope of its own; what it returns stands last, in the outermost one alone."""
        inner = [*scope, Scope()]
        for k, statement in enumerate(block):
            if isinstance(statement, ir.Return):
                assert len(inner) == 3 and k == len(block) - 1, "there is one return, which is the last statement"
                return self.value(statement.value, inner)
            self.run(statement, inner)
        return None

    def run(self, statement: ir.Statement, scope: list[Scope]) -> None:
        """Run a statement."""
        if isinstance(statement, ir.Declare):
            assert statement.name not in scope[-1], f"{statement.name} is declared twice"
            assert not statement.constant or statement.value is not None
            empty: Any = {} if statement.kind.name == "struct" else UNSET
            found = empty if statement.value is None else copy.deepcopy(self.value(statement.value, scope))
            scope[-1][statement.name] = found
            scope[-1].fixed |= {statement.name} if statement.constant else set()
        elif isinstance(statement, ir.Assign):
            self.put(statement.target, copy.deepcopy(self.value(statement.value, scope)), scope)
        elif isinstance(statement, ir.CallStatement):
            self.filled(statement, scope)
        elif isinstance(statement, ir.If):
            self.block(statement.then if self.value(statement.condition, scope) else statement.other, scope)
        elif isinstance(statement, ir.For):
            first, stop = self.value(statement.start, scope), self.value(statement.stop, scope)
            for k in range(first, stop, -1 if statement.down else 1):
                if not self.round(statement.body, [*scope, Scope({statement.name: k}, [statement.name])]):
                    break
        elif isinstance(statement, ir.While):
            while self.value(statement.condition, scope) and self.round(statement.body, scope):
                pass
        elif isinstance(statement, ir.Leave):
            raise LoopEnd(statement.word)

    def round(self, body: ir.Block, scope: list[Scope]) -> bool:
        """Run a loop once; return whether it goes on."""
        try:
            self.block(body, scope)
        except LoopEnd as end:
            return str(end) == "continue"
        return True

    def filled(self, statement: ir.CallStatement, scope: list[Scope]) -> None:
        """Run a call that leaves values in variables."""
        function = self.program.functions[statement.call.name]
        values = [self.value(v, scope) for v in statement.call.values]
        _, outputs = Interpreter(self.program).call(function, values)
        for target, value in zip(statement.targets, outputs, strict=True):
            self.put(target, value, scope)

    def put(self, target: ir.Place, value: Any, scope: list[Scope]) -> None:
        """Give a place a value."""
        if isinstance(target, ir.Name):
            home = next(s for s in reversed(scope) if target.name in s)
            assert target.name not in home.fixed, f"{target.name} keeps its value"
            home[target.name] = value
        elif isinstance(target, ir.Subscript):
            self.value(target.value, scope)[self.value(target.index, scope)] = value
        else:
            self.value(target.value, scope)[target.name] = value

    def value(self, node: ir.Expression, scope: list[Scope]) -> Any:
        """Return the value of an expression."""
        if isinstance(node, ir.Literal):
            return float(node.text) if node.kind == ir.REAL else int(node.text)
        if isinstance(node, ir.Name):
            found = next((s[node.name] for s in reversed(scope) if node.name in s), UNSET)
            assert found is not UNSET, f"{node.name} is read before it has a value"
            return found
        if isinstance(node, ir.Member):
            return self.value(node.value, scope)[node.name]
        if isinstance(node, ir.Subscript):
            place = self.value(node.index, scope)
            assert place >= 0
            return self.value(node.value, scope)[place]
        if isinstance(node, ir.Unary):
            value = self.value(node.value, scope)
            return not value if node.sign == "not" else -value
        if isinstance(node, ir.Binary) and node.sign in ("and", "or"):
            left = self.value(node.left, scope)
            return self.value(node.right, scope) if bool(left) == (node.sign == "and") else left
        if isinstance(node, ir.Binary):
            assert (node.left.kind == ir.REAL) == (node.right.kind == ir.REAL)
            return ARITHMETIC[node.sign](self.value(node.left, scope), self.value(node.right, scope))
        if isinstance(node, ir.Conditional):
            return self.value(node.then if self.value(node.condition, scope) else node.other, scope)
        if isinstance(node, ir.Cast):
            return float(self.value(node.value, scope)) if node.kind == ir.REAL else int(self.value(node.value, scope))
        if isinstance(node, ir.Values):
            return [self.value(v, scope) for v in node.values] or made(node.kind)
        assert isinstance(node, ir.Call)
        values = [self.value(v, scope) for v in node.values]
        if node.own:
            return Interpreter(self.program).call(self.program.functions[node.name], values)[0]
        return SMALL[node.name](*values) if node.name in SMALL else getattr(math, node.name)(*values)


def made(kind: ir.Kind) -> list[Any]:
    """Return an array of zeros."""
    return [made(kind.element) if kind.element != ir.REAL else 0.0 for _ in range(kind.extents[0])]
