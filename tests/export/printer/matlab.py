"""Printed MATLAB, run without MATLAB: a translation of the little of it that is printed, line by line, to Python."""

import copy
import math
import re
from collections.abc import Callable, Mapping
from typing import Any


class Matrix:
    """A matrix of numbers, counted from 1; one index of a row counts its columns."""

    def __init__(self, rows: list[list[float]]) -> None:
        self.rows = rows

    def __call__(self, *places: Any) -> Any:
        row, column = places if len(places) == 2 else (1, *places)
        own = self.rows[whole(row)]
        return Matrix([own]) if column == ":" else own[whole(column)]

    def put(self, value: float, *places: float) -> None:
        """Set an element."""
        row, column = places if len(places) == 2 else (1, *places)
        self.rows[whole(row)][whole(column)] = value


def whole(place: float) -> int:
    """Return a place counted from 0 of one counted from 1."""
    assert place == int(place) >= 1
    return int(place) - 1


def span(first: float, step: float, last: float) -> list[float]:
    """Return ``first:step:last``."""
    return [first + k * step for k in range(max(0, math.floor((last - first) / step) + 1))]


KNOWN: Mapping[str, Any] = {
    **{n: getattr(math, n) for n in "exp expm1 log log1p sqrt sin cos tan atan tanh erf hypot floor ceil".split()},
    **{"Inf": math.inf, "abs": abs, "min": min, "max": max, "fix": math.trunc, "power": math.pow, "rem": math.fmod},
    **{"double": float, "mod": lambda a, b: a % b, "sign": lambda x: (x > 0) - (x < 0), "pow2": lambda x: 2.0**x},
    **{"nthroot": lambda x, n: math.copysign(abs(x) ** (1.0 / n), x), "copy_sign": math.copysign, "span": span},
    **{"zeros": lambda rows, columns: Matrix([[0.0] * columns for _ in range(rows)]), "Matrix": Matrix},
    **{"copied": copy.deepcopy, "several_of": lambda found: found if isinstance(found, tuple) else (found,)},
}


def expression(text: str) -> str:
    """Return an expression in Python."""
    assert not re.search(r"\+\+|--|!|(?<!\w)not\b", text), text
    for old, new in (("~=", "!="), ("&&", " and "), ("||", " or "), ("~", " not "), (":)", "':')")):
        text = text.replace(old, new)
    return f"Matrix([{text}])" if text.startswith("[") else text


def statement(line: str, outputs: list[str]) -> str:
    """Return a line in Python, without its indent; ``outputs`` becomes what the function gives."""
    if head := re.fullmatch(r"function \[(.*)\] = (\w+)\((.*)\)", line):
        outputs[:] = [head[1]]
        return f"def {head[2]}({head[3]}):"
    if head := re.fullmatch(r"for (\w+) = (.*)", line):
        ends = [expression(part) for part in head[2].split(":")]
        return f"for {head[1]} in span({', '.join(ends if len(ends) == 3 else [ends[0], '1', ends[1]])}):"
    if line.startswith("if "):
        return f"if {expression(line[3:])}:"
    if line in ("else", "while true"):
        return {"else": "else:", "while true": "while True:"}[line]
    assert line.endswith(";"), line
    if head := re.fullmatch(r"\[(.*)\] = (.*);", line):
        return f"{head[1].replace('~', '_')}, = several_of({expression(head[2])})"
    if head := re.fullmatch(r"(\w+)\((.*?)\) = (.*);", line):
        return f"{head[1]}.put({expression(head[3])}, {head[2]})"
    if head := re.fullmatch(r"(\w+) = (.*);", line):
        return f"{head[1]} = {expression(head[2])}"
    return line.removesuffix(";")


def functions(text: str) -> Mapping[str, Callable[..., Any]]:
    """Return the functions of a text, which give the value of their one output or a tuple of several."""
    lines, open_blocks, outputs = list[str](), list[str](), [""]
    for line in filter(None, (one.strip() for one in text.split("\n"))):
        if line.startswith("%"):
            continue
        if line == "end":
            if open_blocks.pop() == "function":
                lines.append(f"    return {outputs[0]}")
            else:
                lines.append("    " * (len(open_blocks) + 1) + "pass")
            continue
        made, opens = statement(line, outputs), line.split()[0]
        lines.append("    " * (len(open_blocks) - (line == "else")) + made)
        if opens in ("function", "if", "for", "while"):
            open_blocks.append(opens)
        if opens == "function" and "()" not in made:
            names = made.partition("(")[2].removesuffix("):")
            # what is given is a copy
            lines.append(f"    {names}, = copied(({names},))")
        elif made.endswith(":"):
            lines.append("    " * len(open_blocks) + "pass")
    space = dict(KNOWN)
    exec("\n".join(lines), space)
    return space
