"""What is read of Python, run as a typed tree, gives what Python gives: functions of the subset, and random ones."""

import inspect
import linecache
import random
import types
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.export.printer import ir
from mrfit.export.printer.functions import python_of
from mrfit.export.printer.reading import ProgramReader
from tests.export.printer import subset
from tests.export.printer.interpreter import Interpreter
from tests.export.printer.test_printer import drawn, wanted

ROWS = 40
HELPERS = """
def ordered(x: float, y: float) -> tuple[float, float]:
    if x > y:
        x, y = y, x
    elif x == y:
        return x, 0.5
    return y - x, x

def early(x: float, y: float) -> float:
    if x < 0.0:
        return y
    return x - y
"""


def answers(function: Callable[..., Any], rows: Array) -> list[list[float]]:
    """Return what the tree of a function gives at rows of its arguments."""
    plain = python_of(function)
    assert plain is not None
    names = list(inspect.signature(plain).parameters)
    reader = ProgramReader()
    read = reader.function(plain, dict.fromkeys(names, ir.REAL))
    places = {id(argument): k for k, argument in enumerate(read.given)}
    program, found = reader.settled(), list[list[float]]()
    for row in rows.tolist():
        given = [row[places[id(argument)]] for argument in read.function.arguments]
        returned, outputs = Interpreter(program).call(read.function, given)
        found.append(outputs or [returned])
    return found


@pytest.mark.parametrize("function", subset.CASES)
def test_the_tree_of_a_function_is_the_function(function: Any) -> None:
    plain = python_of(function)
    assert plain is not None
    rows = drawn(len(inspect.signature(plain).parameters), 5)[:ROWS]
    np.testing.assert_allclose(answers(function, rows), wanted(function, rows), rtol=1e-14, atol=1e-14)


class FunctionWriter:
    """Writes functions at random: assignments, choices, loops, calls and returns at any place."""

    def __init__(self, seed: int) -> None:
        self.random, self.lines, self.loops = random.Random(seed), list[str](), 0

    def text(self) -> str:
        """Return a function of two numbers that returns two."""
        self.lines = ["def main(x: float, y: float) -> tuple[float, float]:"]
        known = self.block(1, {"x", "y"}, 3, ())
        self.lines += [f"    return {self.variable(known)}, {self.variable(known)}"] if known else []
        return "\n".join([*self.lines, HELPERS])

    def variable(self, known: set[str]) -> str:
        return self.random.choice(sorted(known))

    def number(self, known: set[str], depth: int = 1) -> str:
        """Return an expression."""
        kind = self.random.random() if depth else 0.0
        if kind < 0.3:
            constant = f"{self.random.uniform(-2.0, 2.0):.1f}"
            return self.random.choice([self.variable(known), self.variable(known), constant])
        one, other = self.number(known, depth - 1), self.number(known, depth - 1)
        if kind < 0.6:
            return f"({one} {self.random.choice('+-*')} {other})"
        if kind < 0.7:
            return f"-{one}"
        if kind < 0.8:
            return f"({one} if {self.condition(known)} else {other})"
        return f"{self.random.choice(['min', 'max', 'early'])}({one}, {other})"

    def condition(self, known: set[str]) -> str:
        """Return a condition."""
        one = f"{self.number(known)} {self.random.choice(['<', '<=', '>', '>='])} {self.number(known)}"
        forms = [one, one, f"not {one}", f"({one} and {self.variable(known)} < {self.number(known)})"]
        return self.random.choice([*forms, f"({one} or {self.variable(known)} < {self.number(known)})"])

    def block(self, depth: int, known: set[str], room: int, counts: tuple[str, ...]) -> set[str]:
        """Write statements; return the variables that have a value behind them, none where there is no way there."""
        known, indent = {*known}, "    " * depth
        self.lines.append(f"{indent}pass")
        for _ in range(self.random.randint(1, 4)):
            kind = self.random.random()
            first, second = self.random.sample(["x", "y", "a", "b", "c"], 2)
            pairs = [f"{self.number(known)}, {self.number(known)}" for _ in range(2)]
            if kind < 0.3:
                self.lines.append(f"{indent}{first} = {self.number(known, 2)}")
                known.add(first)
            elif kind < 0.4:
                self.lines.append(f"{indent}{self.variable(known)} -= {self.number(known)}")
            elif kind < 0.6:
                both = (pairs[0], f"ordered({pairs[0]})", f"({pairs[0]}) if {self.condition(known)} else ({pairs[1]})")
                self.lines.append(f"{indent}{first}, {second} = {self.random.choice(both)}")
                known |= {first, second}
            elif kind < 0.8 and room:
                self.lines.append(f"{indent}if {self.condition(known)}:")
                then = self.block(depth + 1, known, room - 1, counts)
                self.lines.append(f"{indent}else:")
                other = self.block(depth + 1, known, room - 1, counts)
                if not then and not other:
                    return set()
                known = then & other if then and other else then or other
            elif kind < 0.9 and room:
                self.loops += 1
                count = f"k{self.loops}"
                span = self.random.choice(["range(3)", "range(2, -1, -1)", "range(1, 3)"])
                self.lines.append(f"{indent}for {count} in {span}:")
                self.lines.append(f"{indent}    x += 0.1 * {count}")
                self.block(depth + 1, known, room - 1, (*counts, count))
            elif kind < 0.95:
                self.lines.append(f"{indent}return {pairs[0]}")
                return set()
            elif counts:
                self.lines.append(f"{indent}{self.random.choice(['break', 'continue'])}")
                return set()
        return known


@pytest.fixture
def written(request: pytest.FixtureRequest) -> Iterator[tuple[Callable[..., Any], str]]:
    """Return a function written at random, and its text."""
    text = FunctionWriter(request.param).text()
    name = f"<written {request.param}>"
    linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
    module = types.ModuleType("written")
    exec(compile(text, name, "exec"), module.__dict__)
    yield module.main, text
    del linecache.cache[name]


@pytest.mark.parametrize("written", range(60), indirect=True)
def test_the_tree_of_a_random_function_is_the_function(written: tuple[Callable[..., Any], str]) -> None:
    function, text = written
    rows = np.array([[0.3, -1.2], [1.0, 1.0], [-0.7, 0.4], [2.1, 0.1], [0.0, -0.0]])
    np.testing.assert_allclose(answers(function, rows), wanted(function, rows), rtol=1e-12, atol=1e-12, err_msg=text)
