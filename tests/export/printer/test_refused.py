"""What has no form in C is refused in one line that names its place and the reason; what is near to it is read."""

import inspect
import linecache
import types
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from mrfit.errors import DataError
from mrfit.export.printer import ir
from mrfit.export.printer.reading import ProgramReader

HEAD = """
import math
import numpy as np

NAMED, SHORT = "a name", 2

def two(x: float, y: float) -> tuple[float, float]:
    return y, x

def one(x: float, y: float = 2.0) -> float:
    return x - y

def many(*x: float) -> float:
    return 1.0

def chosen(s: tuple[float, float], c: float) -> float:
    p, q = s
    if c > 0.0:
        s = (c, p)
    return s[0] - 2.0 * s[1] + q

def main(x: float, y: float) -> float:
"""
FILE = "<refused>"


@pytest.fixture
def made() -> Iterator[Callable[[str], Any]]:
    """Return what makes a function of lines of its body, behind other functions."""

    def of_text(body: str) -> Any:
        text = HEAD + "".join(f"    {line}\n" for line in body.split("\n"))
        linecache.cache[FILE] = (len(text), None, text.splitlines(keepends=True), FILE)
        module = types.ModuleType("refused")
        exec(compile(text, FILE, "exec"), module.__dict__)
        return module.main

    yield of_text
    linecache.cache.pop(FILE, None)


def read(function: Any) -> ir.Program:
    reader = ProgramReader(("main",))
    reader.function(function, dict.fromkeys(inspect.signature(function).parameters, ir.REAL))
    return reader.settled()


@pytest.mark.parametrize(
    ("body", "fault", "why"),
    [
        ("w = (x, y)\nw[0] = 1.0\nreturn w[0]", "w[0]", "a variable or an element of an array is assigned to"),
        ("if x:\n    return y\nreturn x", "x", "a condition is a comparison"),
        ("return x if y > 0.0 and x else y", "x", "a condition is a comparison"),
        ("return -(x > y)", "x > y", "a number is wanted"),
        ("return (x, y) + x", "(x, y)", "a number is wanted"),
        ("return NAMED", "NAMED", "a constant is a number"),
        ("return x.real", "x.real", "only modules have attributes"),
        ("return (x, y)[2]", "(x, y)[2]", "there are 2 items"),
        ("return (x, y)[-3]", "(x, y)[-3]", "there are 2 items"),
        ("v = np.zeros(3)\nreturn v[x]", "v[x]", "the place in an array is a whole number"),
        ("t = 0.0\nfor k in range(2):\n    t += (x, y)[k]\nreturn t", "(x, y)[k]", "the place in a tuple is constant"),
        ("return x // 2.0", "x // 2.0", "// and % are those of whole numbers"),
        ("return x % 2", "x % 2", "// and % are those of whole numbers"),
        ("return x @ y", "x @ y", "there is no such operation"),
        ("return x if x is y else y", "x is y", "there is no such comparison"),
        ("return x if (x, y) == (y, x) else y", "(x, y) == (y, x)", "there is no such comparison"),
        ("return one(x if x > y else (x, y))", "x > y", "a choice is one between numbers"),
        ("return one(x)(y)", "one(x)(y)", "what is called has a name"),
        ("return math.exp(x, y)", "math.exp(x, y)", "there is no such function in math.h"),
        ("return math.hypot(x, y, x)", "math.hypot(x, y, x)", "there is no such function in math.h"),
        ("return np.cumsum(x)", "np.cumsum(x)", "a function is one of math, or one of Python"),
        ("return one(x, y, x)", "one(x, y, x)", "one has 2 arguments"),
        ("return one()", "one()", "one has 2 arguments"),
        ("return one(x > y)", "one(x > y)", "it is of the kind bool, where real is wanted"),
        ("return x if y > 0.0 else two(x, y)[0]", "two(x, y)", "is not called where it may not be evaluated"),
        ("if x > y and two(x, y)[0] > 0.0:\n    return x\nreturn y", "two(x, y)", "where it may not be evaluated"),
        ("while two(x, y)[0] > 0.0:\n    x -= 1.0\nreturn x", "two(x, y)", "where it may not be evaluated"),
        ("return many(x)", "def many(*x: float) -> float:", "a function has a fixed number of arguments"),
        ("return x, y", "(x, y)", "1 values are returned elsewhere"),
        ("a, b = (x, y, x)\nreturn a", "a, b = (x, y, x)", "there are 3 values"),
        ("for k in range(0, 4, 2):\n    x += k\nreturn x", "for k in range(0, 4, 2):", "which counts by 1 or -1"),
        (
            "for k in range(3):\n    k += 1\n    x += k\nreturn x",
            "k",
            "in a loop its count and its end stay as they are",
        ),
        ("n = int(x)\nfor k in range(n):\n    n -= 1\nreturn y + n", "n", "its count and its end stay as they are"),
        ("for k in range(4):\n    for k in range(2):\n        x += k\nreturn x", "k", "its count and its end stay"),
        (
            "n = 4\nfor k in range(n):\n    for n in range(2):\n        x += k\nreturn x",
            "n",
            "its count and its end stay",
        ),
        ("k = 3\nfor k in range(k):\n    x += k\nreturn x", "for k in range(k):", "does not know its count"),
        ("for k in range(0, k + 1):\n    x += k\nreturn x", "for k in range(0, k + 1):", "does not know its count"),
        (
            "v = np.zeros(2)\nv[0] = 3.0\nfor k in range(int(v[0])):\n    v[0] -= 1.0\nreturn v[0]",
            "v[0]",
            "its count and its end stay",
        ),
        ("while x > y:\n    x -= 1.0\nelse:\n    x = y\nreturn x", "while x > y:", "there is no such statement"),
        ("for k in range(2):\n    x += k\nelse:\n    x = y\nreturn x", "for k in range(2):", "no such statement"),
        ("a = b = x\nreturn a", "a = b = x", "there is no such statement"),
        ("del x\nreturn y", "del x", "there is no such statement"),
        ("return", "return", "there is no such statement"),
        ("n = int(x)\nv = np.zeros(n)\nreturn v[0]", "np.zeros(n)", "an array has constant extents"),
        ("return [x, y][0]", "[x, y]", "there is no such expression"),
    ],
)
def test_what_has_no_form_is_named_by_its_place_and_the_reason(
    body: str, fault: str, why: str, made: Callable[[str], Any]
) -> None:
    function = made(body)
    with pytest.raises(DataError) as raised:
        read(function)
    text = str(raised.value)
    assert f"'{fault}' has no form in C: " in text and why in text and "\n" not in text
    lines = (HEAD + "".join(f"    {line}\n" for line in body.split("\n"))).splitlines()
    line = int(text.removeprefix(f"{FILE}:").partition(":")[0])
    # that of a statement around it, where Python writes it otherwise
    assert any(word in lines[line - 1] for word in (fault, fault.strip("()")))


def test_a_tuple_that_is_an_argument_is_set_in_no_branch(made: Callable[[str], Any]) -> None:
    with pytest.raises(
        DataError, match="a tuple that is an argument is set in a branch; give the new one another name"
    ):
        read(made("return chosen((x, y), x)"))


@pytest.mark.parametrize(
    "body",
    [
        "v = np.zeros(SHORT)\nv[-1] = x\nreturn v[1]",
        "return (x, y)[-2]",
        "return one(x)",
        "a, _ = two(x, y)\nreturn a",
        "for k in range(3, 0, -1):\n    x += k\nreturn x",
        "for _ in range(2):\n    for _ in range(3):\n        x -= y\nreturn x",
        "for _ in range(3):\n    x, _ = two(x, y)\nreturn x",
        "n = int(x)\nfor k in range(n):\n    y += k * n\nn = 2\nreturn y * n",
        "return x if (x > y) == (y > 0.0) else y",
        "k = 7 // 2 + 7 % 4\nreturn x * k",
        "pass\n'a sentence'\nb: float = x\nreturn b",
        "return min(x, y, 1.0) + max(1, 2)",
    ],
)
def test_what_is_near_to_it_is_read(body: str, made: Callable[[str], Any]) -> None:
    assert any(f.result == ir.REAL and "main" in f.name for f in read(made(body)).functions.values())


@pytest.mark.parametrize(
    ("test", "left"),
    [("1 < 2", "x"), ("len((x, y)) >= 3", "y"), ("len((x, y)) >= 2", "x"), ("2 != 2", "y"), ("3 <= 2", "y")],
)
def test_a_choice_that_is_known_as_it_is_read_is_no_choice(test: str, left: str, made: Callable[[str], Any]) -> None:
    (function,) = read(made(f"return x if {test} else y")).functions.values()
    assert [a.name for a in function.arguments] == [left] and function.body == (ir.Return(ir.Name(left)),)
