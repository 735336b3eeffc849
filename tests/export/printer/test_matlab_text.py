"""Printed MATLAB gives what Python gives, also where there is no Octave to run it."""

import inspect
import re
from typing import Any

import numpy as np
import pytest

from mrfit.export.printer import ir
from mrfit.export.printer.functions import python_of
from mrfit.export.printer.matlab_text import MatlabPrinter, matlab_text
from mrfit.export.printer.reading import ProgramReader
from tests.export.printer import subset
from tests.export.printer.matlab import functions
from tests.export.printer.test_printer import drawn, wanted


@pytest.mark.parametrize("function", subset.CASES)
def test_the_matlab_of_a_function_is_the_function(function: Any) -> None:
    plain = python_of(function)
    assert plain is not None
    names = list(inspect.signature(plain).parameters)
    reader = ProgramReader(("main",))
    read = reader.function(plain, dict.fromkeys(names, ir.REAL))
    places = {id(argument): k for k, argument in enumerate(read.given)}
    called = functions(matlab_text(reader.settled()))[read.function.name]
    rows = drawn(len(names), 7)[:40]
    given = rows[:, [places[id(a)] for a in read.function.arguments]]
    found = np.array([np.atleast_1d(called(*row)) for row in given.tolist()])
    np.testing.assert_allclose(found, wanted(function, rows), rtol=1e-14, atol=1e-14)


def printer(**constants: ir.Expression) -> MatlabPrinter:
    own = {n: ir.Constant(n, v.kind, v) for n, v in constants.items()}
    return MatlabPrinter(ir.Program(own), ir.Function("f", [], ir.NOTHING, ()))


X, Y, K = ir.Name("x"), ir.Name("y"), ir.Name("k", ir.INT)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (X - (Y - X), "x - (y - x)"),
        (X / (Y * X), "x / (y * x)"),
        (ir.Unary("-", ir.Unary("-", X, ir.REAL), ir.REAL), "-(-x)"),
        (ir.Call("square", (X - Y,)), "power(x - y, 2)"),
        (ir.Call("cbrt", (X,)), "nthroot(x, 3)"),
        (ir.Call("clamp", (X, ir.real(-1.0), ir.real(2.0))), "min(max(x, -1.0), 2.0)"),
        (ir.Call("fmod", (X, Y)), "rem(x, y)"),
        (ir.Call("trunc", (X,)), "fix(x)"),
        (ir.Cast(X, ir.INT), "fix(x)"),
        (ir.Binary("//", K, ir.whole(2), ir.INT), "floor((k) / (2))"),
        (ir.Binary("%", K, ir.whole(2), ir.INT), "mod(k, 2)"),
        (ir.Binary("!=", X, Y, ir.BOOL), "double(x ~= y)"),
        (ir.Literal("inf", ir.REAL), "Inf"),
    ],
)
def test_an_expression_has_matlab_s_functions_signs_and_brackets(value: ir.Expression, text: str) -> None:
    assert printer().value(value) == text


def test_a_constant_of_the_program_stands_in_brackets_where_it_is_negative() -> None:
    held = printer(LOW=ir.real(-2.0), HIGH=ir.real(3.0))
    assert held.value(X - ir.Name("LOW")) == "x - (-2.0)" and held.value(X * ir.Name("HIGH")) == "x * 3.0"


def test_elements_count_from_one_and_a_row_is_a_colon() -> None:
    table = ir.Name("t", ir.Kind("array", (), (2, 3)))
    assert printer().value(table.at(1)) == "t(1 + 1, :)" and printer().value(table.at(0).at(2)) == "t(0 + 1, 2 + 1)"


def test_a_choice_inside_an_expression_is_made_before_it_in_a_variable_of_its_own() -> None:
    body: ir.Block = (ir.Assign(ir.Name("chosen_1"), X), ir.Return(ir.Conditional(X < Y, X, Y) + ir.Name("chosen_1")))
    function = ir.Function("f", [ir.Argument("x", ir.REAL), ir.Argument("y", ir.REAL)], ir.REAL, body)
    text = MatlabPrinter(ir.Program(), function).whole()
    assert text.index("chosen_2 = x;") < text.index("value_ = chosen_2 + chosen_1;")
    called = functions(text)["f"]
    assert called(1.0, 2.0) == 2.0 and called(3.0, 2.0) == 5.0


def test_what_a_function_changes_of_its_arguments_comes_back_behind_its_value() -> None:
    reader = ProgramReader(("main",))
    reader.function(subset.listed, {"x": ir.REAL, "y": ir.REAL})
    text = matlab_text(reader.settled())
    assert re.search(r"^function \[rows\] = fill\(rows, x\)$", text, re.MULTILINE)
    assert re.search(r"^ +\[rows\] = fill\(rows, x\);$", text, re.MULTILINE)
