"""What a formula says: its value at samples, and the shape of each variable in it, read from its numbers alone.

A formula is a sum of products of factors of one variable each, in SI units: ``120*sgn(v)*exp(-((x-0.002)/0.004)^2)``.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from .forms import SHAPES, VARIABLES, Array, Name, name_of

FUNCTIONS: dict[str, Callable[..., Array]] = {
    "abs": np.abs,
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "tanh": np.tanh,
    "sgn": np.sign,
    "sign": np.sign,
    "max": np.maximum,
    "min": np.minimum,
    "clip": np.clip,
    "step": lambda y: np.heaviside(y, 0.5),
}
OPERATORS: dict[type, Callable[..., Array]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
SIGNS = {"^": "**", "·": "*", "×": "*", "−": "-", "²": "**2", "³": "**3", "\u202f": "", "\u00a0": ""}  # noqa: RUF001
# misfits of a shape, over its root mean square: it is that shape, and it is none of them
EXACT, FAR = 0.003, 0.15
ORIGIN = 0.3  # greatest shift of an origin over the range


class FormulaError(ValueError):
    """A formula that cannot be read."""


@dataclass(frozen=True)
class Product:
    """A summand of a formula, as text and parsed; names other than the variables have values of their own."""

    text: str
    tree: ast.expr
    numbers: Mapping[str, float]

    @property
    def variables(self) -> tuple[str, ...]:
        """Names of the variables in it."""
        found = {node.id for node in ast.walk(self.tree) if isinstance(node, ast.Name)}
        return tuple(name for name in VARIABLES if name in found)

    def at(self, values: Mapping[str, Array]) -> Array:
        """Return its value where the variables have these values."""
        with np.errstate(all="ignore"):
            return np.nan_to_num(self._value(self.tree, values)) * np.ones_like(values["t"])

    def _value(self, node: ast.expr, values: Mapping[str, Array]) -> Array:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return np.asarray(float(node.value))
        if isinstance(node, ast.Name) and (node.id in values or node.id in self.numbers):
            return values[node.id] if node.id in values else np.asarray(self.numbers[node.id])
        if isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](self._value(node.left, values), self._value(node.right, values))
        if isinstance(node, ast.UnaryOp) and type(node.op) in OPERATORS:
            return OPERATORS[type(node.op)](self._value(node.operand, values))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS:
            return FUNCTIONS[node.func.id](*(self._value(a, values) for a in node.args))
        raise FormulaError(f"{self.text!r}: {ast.unparse(node)} is not understood")

    def name(self, low: Mapping[str, float], high: Mapping[str, float]) -> Name:
        """Return the variables and their shapes between the least and greatest values that tests had."""
        found = []
        for variable in self.variables:
            y = np.linspace(low[variable], high[variable], 201)
            best = np.zeros(y.size)
            for share in (0.13, 0.37, 0.61, 0.89):  # of the others; a factor may be zero at some of these places
                values = {k: np.full(y.size, low[k] + share * (high[k] - low[k])) for k in VARIABLES}
                slice_ = self.at({**values, variable: y})
                best = slice_ if np.max(np.abs(slice_)) > np.max(np.abs(best)) else best
            found.append(recognise(variable, y, best))
        return name_of(found)


def read_formula(text: str, numbers: Mapping[str, float] | None = None) -> list[Product]:
    """Return the products that a formula is the sum of, constants left out; |x| is a magnitude, ^ a power.

    Raises
    ------
    FormulaError
        If it cannot be parsed.
    """
    plain = text
    for sign, python in SIGNS.items():
        plain = plain.replace(sign, python)
    plain = re.sub(r"\|([^|]+)\|", r"abs(\1)", plain)
    try:
        whole = ast.parse(plain.strip(), mode="eval").body
    except SyntaxError as error:
        raise FormulaError(f"{text!r}: {error.msg}") from error
    products = [Product(text, tree, numbers or {}) for tree in _summands(whole)]
    return [p for p in products if p.variables]


def _summands(tree: ast.expr) -> list[ast.expr]:
    if isinstance(tree, ast.BinOp) and isinstance(tree.op, ast.Add | ast.Sub):
        right = _summands(tree.right)
        if isinstance(tree.op, ast.Sub):
            right = [ast.UnaryOp(ast.USub(), term) for term in right]
        return [*_summands(tree.left), *right]
    return [tree]


# shapes from the simplest on, with fixed constants and starts of free ones over the range of the variable
POWERS = [("odd", {"n": n}, {}) for n in (1.0, 3.0, 2.0, 0.5, 1.5)] + [
    ("even", {"n": n}, {}) for n in (1.0, 2.0, 4.0, 0.5)
]
SIDES = [
    ("side", {"side": s, "n": n}, {"place": p})
    for n in (1.0, 2.0, 0.5, 1.5, 0.0)
    for s in (1.0, -1.0)
    for p in (0.0, 0.3, -0.3)
]
CURVES = [
    *(("dead-zone", {}, {"place": p}) for p in (0.2, 0.5)),
    *(("decay", {}, {"tau": p}) for p in (0.2, 0.6, -0.6)),
    *(("bump", {}, {"place": p, "width": 0.4}) for p in (-0.6, -0.3, 0.0, 0.3, 0.6)),
    *((name, {"n": 1.3}, {"length": p}) for name in ("column", "pressure") for p in (1.5, 3.0, -1.5, -3.0)),
]
CANDIDATES = [*POWERS, ("sign", {}, {"width": 0.02}), *SIDES, *CURVES]


def recognise(variable: str, y: Array, values: Array) -> tuple[str, str, float, float]:
    """Return the simplest shape, exponent and side that has these values; constants and a shared origin are free."""
    if variable == "L":
        return ("L", "odd", 1.0, 1.0)
    scale = float(np.max(np.abs(y)))
    origin = 25.0 / scale if variable == "T" else 0.0
    size = float(np.sqrt(np.mean(values**2))) or 1.0
    found = []
    for shape, fixed, free in CANDIDATES:
        moved = {"origin": origin} if shape in ("odd", "even") else {}
        misfit, constants = _fit(shape, fixed, {**moved, **free}, y / scale, values / size)
        found.append((misfit, shape, {**fixed, **constants}))
        if misfit < EXACT:
            break
    least = min(misfit for misfit, *_ in found)
    if least > FAR:
        return (variable, "other", 1.0, 1.0)
    _, shape, constants = next(f for f in found if f[0] <= max(1.5 * least, EXACT))
    if shape == "pressure":  # a column with its force at rest
        shape = "column"
    if variable == "T" and shape == "decay":  # over these temperatures it is Arrhenius' law within 1 %
        shape = "arrhenius"
    return (variable, shape, constants.get("n", 1.0), constants.get("side", 1.0))


def _fit(
    shape: str, fixed: dict[str, float], free: dict[str, float], y: Array, values: Array
) -> tuple[float, dict[str, float]]:
    names = list(free)

    def left(point: Array) -> Array:
        constants = dict(zip(names, point, strict=True))
        moved = y - constants.pop("origin", 0.0)
        with np.errstate(all="ignore"):
            return _left(SHAPES[shape](moved, **fixed, **constants), values)

    if not names:
        return _rms(left(np.zeros(0))), {}
    shift = np.array([ORIGIN if name == "origin" else np.inf for name in names])
    start = np.array(list(free.values()))
    solved = least_squares(left, start, bounds=(start - shift, start + shift), diff_step=1e-4, max_nfev=60)
    return _rms(solved.fun), dict(zip(names, solved.x, strict=True))


def _left(column: Array, values: Array) -> Array:
    column = np.nan_to_num(column, posinf=0.0, neginf=0.0)
    return values - column * (column @ values) / max(float(column @ column), 1e-300)


def _rms(y: Array) -> float:
    return float(np.sqrt(np.mean(y**2)))
