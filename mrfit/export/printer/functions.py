"""Functions of Python as they are written: syntax trees, comments, constants, and which operations have a form in C."""

import ast
import inspect
import io
import operator
import re
import textwrap
import tokenize
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

OPERATORS: Mapping[type, str] = {
    **{ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.FloorDiv: "//", ast.Mod: "%"},
    **{ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="},
    **{ast.And: "and", ast.Or: "or"},
}
# Operations of whole numbers, which constants are put through as they are read
FOLDED = {"+": operator.add, "-": operator.sub, "*": operator.mul, "//": operator.floordiv, "%": operator.mod}
COMPARISON_OPERATORS = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
}
# Functions of math and numpy of one number by their names in math.h; those of two
_SAME = (
    "exp exp2 expm1 log log2 log10 log1p sqrt cbrt fabs floor ceil trunc erf sin cos tan asin acos atan sinh cosh tanh"
)
ONE = {
    **{name: name for name in _SAME.split()},
    **{"arcsin": "asin", "arccos": "acos", "arctan": "atan", "abs": "fabs", "absolute": "fabs"},
}
TWO = {
    **{name: name for name in ("pow", "hypot", "copysign", "atan2", "fmod")},
    **{"power": "pow", "arctan2": "atan2"},
}
# Small functions that every language writes out for itself
SMALL = {
    **{"min": "smaller", "minimum": "smaller", "max": "larger", "maximum": "larger"},
    **{"sign": "sign_of", "clip": "clamp"},
}


# Names that no variable has: what C and MATLAB call or define, their own words, and what the printer calls its own
MEANINGFUL_NAMES = frozenset(
    (
        *(name for own in (ONE, TWO, SMALL) for name in own.values()),
        *(f"{name.upper()}_" for own in (ONE, TWO) for name in own.values()),
        *"square fewer more HUGE_VAL INFINITY NAN M_PI M_PI_2 M_PI_4 M_E M_LN2 M_LN10 M_SQRT2 value_".split(),
        *"break case catch classdef continue else elseif end for function global if otherwise parfor".split(),
        *"persistent return spmd switch try while abs max min power sign fix mod rem pow2 zeros".split(),
    )
)
KNOWN = frozenset((*ONE, *TWO, *SMALL, "where", "row"))


def python_of(function: Any) -> types.FunctionType | None:
    """Return a function as it was written, that a compiler has wrapped; None of what is no function of Python."""
    found = getattr(function, "py_func", function)
    return found if isinstance(found, types.FunctionType) else None


@dataclass
class FunctionSource:
    """The text of a function, and its comments: by line, those that have it for themselves and those behind code."""

    file: str
    first: int
    tree: ast.FunctionDef
    alone: dict[int, str] = field(default_factory=dict)
    behind: dict[int, str] = field(default_factory=dict)

    @classmethod
    def of(cls, function: types.FunctionType) -> "FunctionSource":
        """Return that of a function."""
        lines, first = inspect.getsourcelines(function)
        text = textwrap.dedent("".join(lines))
        (tree,) = ast.parse(text).body
        assert isinstance(tree, ast.FunctionDef)
        source = cls(inspect.getsourcefile(function) or "?", first, tree)
        for token in tokenize.generate_tokens(io.StringIO(text).readline):
            if token.type == tokenize.COMMENT and not token.string.startswith(("# noqa", "# type:")):
                lines_of = source.behind if token.line[: token.start[1]].strip() else source.alone
                lines_of[token.start[0]] = token.string.lstrip("# ").rstrip()
        return source


def unpacked(function: types.FunctionType, name: str) -> list[str]:
    """Return the names into which a function, or one that it calls, takes a tuple apart; none if none does."""
    tree = FunctionSource.of(function).tree
    for node in tree.body:
        pairs = list[tuple[ast.expr, ast.expr]]()
        if isinstance(node, ast.Assign):
            pairs = [(node.targets[0], node.value)]
            if isinstance(node.value, ast.Tuple) and isinstance(node.targets[0], ast.Tuple):
                pairs = list(zip(node.targets[0].elts, node.value.elts, strict=False))
        for target, value in pairs:
            own = isinstance(value, ast.Name) and value.id == name and isinstance(target, ast.Tuple)
            if own and all(isinstance(e, ast.Name) for e in typing.cast(ast.Tuple, target).elts):
                names = [typing.cast(ast.Name, e).id for e in typing.cast(ast.Tuple, target).elts]
                return [f"{name}_{k}" if n.strip("_") == "" else n for k, n in enumerate(names)]
    taken = {n.id for n in ast.walk(tree) if isinstance(n, ast.Name)} | {a.arg for a in tree.args.args}
    for call in (n for n in ast.walk(tree) if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)):
        called = python_of(function.__globals__.get(typing.cast(ast.Name, call.func).id))
        for one, argument in zip(call.args, inspect.signature(called).parameters if called else (), strict=False):
            if isinstance(one, ast.Name) and one.id == name and called:
                found = unpacked(called, argument)
                if found and not taken & set(found):
                    return found
    return []


def set_by(target: ast.expr) -> list[ast.Name | None]:
    """Return the variables that an assignment sets, None for one without a use; none if they are no variables."""
    if isinstance(target, ast.Tuple):
        found = [set_by(e) for e in target.elts]
        return [n for one in found for n in one] if all(found) else []
    if not isinstance(target, ast.Name):
        return []
    return [None if target.id.strip("_") == "" else target]


def is_constant(node: ast.expr, tree: ast.FunctionDef) -> bool:
    """Return whether a place is known as a function is read: made of constants, lengths and variables set once."""
    if isinstance(node, ast.Name):
        values = [n.value for n in tree.body if isinstance(n, ast.Assign) and ast.unparse(n.targets[0]) == node.id]
        stored = [
            n for n in ast.walk(tree) if isinstance(n, ast.Name) and n.id == node.id and isinstance(n.ctx, ast.Store)
        ]
        return len(values) == len(stored) == 1 and is_constant(values[0], tree)
    if isinstance(node, ast.BinOp):
        return is_constant(node.left, tree) and is_constant(node.right, tree)
    length = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "len"
    return length or place_of(node) is not None


def place_of(node: ast.expr) -> int | None:
    """Return the place in a tuple that is a constant, None of any other."""
    sign = -1 if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub) else 1
    node = node.operand if isinstance(node, ast.UnaryOp) else node
    return sign * node.value if isinstance(node, ast.Constant) and isinstance(node.value, int) else None


def constant_of(function: types.FunctionType, name: str) -> tuple[Any, tuple[str, ...]]:
    """Return the module of a constant that a function sees, and the comment above it."""
    module = inspect.getmodule(function)
    lines = inspect.getsource(module).split("\n") if module else []
    for k, line in enumerate(lines):
        if re.match(rf"([\w, ]+, )?{name}\b[\w, ]*(:.*)?=", line):
            found = list[str]()
            while k and lines[k - 1].startswith("# "):
                k -= 1
                found.insert(0, lines[k][2:])
            return module, tuple(found)
    return module, ()
