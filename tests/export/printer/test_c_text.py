"""Text of C: lines of bounded width, brackets that keep the tree's order, what has to be told by address or value."""

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.export.printer import ir
from mrfit.export.printer.c_text import (
    CPrinter,
    broken,
    comment,
    constants,
    function_text,
    headline,
    kind_text,
    macros,
    math_functions,
    small_functions,
)

X, Y, Z, K = ir.Name("x"), ir.Name("y"), ir.Name("z"), ir.Name("k", ir.INT)
WIDTH = 116
TABLE = ir.Kind("array", (), (2, 3))


def negative(value: ir.Expression) -> ir.Expression:
    return ir.Unary("-", value, ir.REAL)


numbers = st.recursive(
    st.sampled_from([X, Y, Z, ir.real(2.0), ir.real(-0.5)]),
    lambda inner: st.one_of(
        st.tuples(inner, inner, st.sampled_from("+-*/")).map(lambda t: ir.Binary(t[2], t[0], t[1], ir.REAL)),
        inner.map(negative),
        inner.map(lambda v: ir.Cast(v, ir.REAL)),
    ),
    max_leaves=8,
)


def bracketed(value: ir.Expression) -> str:
    """Return an expression with a bracket round every operation."""
    if isinstance(value, ir.Binary):
        return f"({bracketed(value.left)} {value.sign} {bracketed(value.right)})"
    if isinstance(value, ir.Unary):
        return f"(-{bracketed(value.value)})"
    if isinstance(value, ir.Cast):
        return f"real({bracketed(value.value)})"
    return value.text if isinstance(value, ir.Literal) else value.name  # type: ignore[attr-defined,no-any-return]


@given(numbers)
def test_brackets_keep_the_order_of_operations(value: ir.Expression) -> None:
    text = CPrinter(None).value(value)
    assert "--" not in text and "+-" not in text
    # of numbers C and Python have the same precedence; a cast binds like a sign
    plain = text.replace("K(", "(").replace("(@real)", "+")
    names = {"x": 1.7, "y": -0.3, "z": 5.1, "real": float}
    try:
        wanted = eval(bracketed(value), names)
    except ZeroDivisionError:
        return
    if abs(wanted) < 1e12:
        assert eval(plain, names) == pytest.approx(wanted, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("condition", "text"),
    [
        ((X < Y) & (Y < Z) & (Z < X), "(x < y) && (y < z) && (z < x)"),
        (ir.Binary("or", (X < Y) & (Y < Z), Z < X, ir.BOOL), "((x < y) && (y < z)) || (z < x)"),
        ((X < Y) & ir.Binary("or", Y < Z, Z < X, ir.BOOL), "(x < y) && ((y < z) || (z < x))"),
        (ir.Unary("not", X < Y, ir.BOOL), "!(x < y)"),
        (ir.Unary("not", ir.Name("done", ir.BOOL), ir.BOOL), "done == 0"),
        (ir.Name("done", ir.BOOL), "done != 0"),
        (ir.Literal("1", ir.BOOL), "1 != 0"),
        ((X + Y) < negative(Z), "(x + y) < -z"),
    ],
)
def test_a_condition_is_a_comparison(condition: ir.Expression, text: str) -> None:
    assert CPrinter(None).condition(condition) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (ir.real(0.0), "K(0.0)"),
        (ir.real(1e-37), "K(1e-37)"),
        # less than a float has
        (ir.real(9e-38), "@TINY"),
        (ir.real(-1e-300), "-@TINY"),
        (ir.real(math.inf), "K(HUGE_VAL)"),
        (ir.whole(3), "3"),
        (ir.Binary("//", K, ir.whole(2), ir.INT), "k / 2"),
        (ir.Cast(ir.Binary("+", K, ir.whole(1), ir.INT), ir.REAL), "(@real)(k + 1)"),
        (ir.Conditional(X < Y, X + Y, Z), "(x < y) ? (x + y) : z"),
        (X < Y, "(x < y) ? 1 : 0"),
        (ir.Name("done", ir.BOOL), "done"),
        (ir.Call("exp", (X + Y,)), "EXP_(x + y)"),
        (ir.Call("square", (X,)), "square(x)"),
        (ir.Call("mine", (X,), ir.REAL, True), "mine(x)"),
        (ir.Name("t", TABLE).at(1).at(2), "t[1][2]"),
    ],
)
def test_a_value_is_one_of_c(value: ir.Expression, text: str) -> None:
    if value == ir.real(math.inf):
        value = ir.Literal("inf", ir.REAL)
    assert CPrinter(None).value(value) == text


def test_structs_go_by_address_and_arguments_that_are_such_by_their_pointer() -> None:
    held, own = ir.record("s", "state"), ir.record("w", "inputs")
    call = ir.Call("step", (held, own, held.field("now", ir.struct("memory")), X), ir.REAL, True)
    arguments = [ir.Argument("s", ir.struct("state"), True), ir.Argument("x", ir.REAL)]
    body = (ir.Declare("w", own.kind), ir.Assign(own.field("v"), held.field("v")), ir.Return(call))
    text = function_text(ir.Function("f", arguments, ir.REAL, body))
    assert "static @real f(@state *s, @real x)" in text and "    @inputs w;\n    w.v = s->v;" in text
    assert "return step(s, &w, &s->now, x);" in text


def test_arguments_that_are_not_changed_are_constant_and_outputs_are_pointers() -> None:
    arguments = [
        ir.Argument("p", ir.struct("parameters")),
        ir.Argument("a", ir.Kind("array", (), (4,))),
        ir.Argument("b", ir.Kind("array", (), (4,)), True),
        ir.Argument("t", TABLE, True),
        ir.Argument("k", ir.INT),
    ]
    body = (ir.Assign(ir.Name("y_out"), ir.Name("a", arguments[1].kind).at(0)),)
    function = ir.Function("f", arguments, ir.NOTHING, body, [ir.Argument("y_out", ir.REAL, True)])
    line = function_text(function).replace("\n", " ")
    assert (
        "static void f(const @parameters *p, const @real *a, @real *b, @real (*t)[3], int k, @real *y_out)"
        in re.sub(" +", " ", line)
    )
    assert "    *y_out = a[0];" in function_text(function)
    assert "static void g(void)" in function_text(ir.Function("g", [], ir.NOTHING, ()))


def test_what_a_call_returns_and_nobody_takes_is_cast_away_and_what_it_fills_in_goes_by_address() -> None:
    with_value = ir.CallStatement(ir.Call("f", (X,), ir.REAL, True), ())
    filling = ir.CallStatement(ir.Call("g", (X,), ir.NOTHING, True), (Y, ir.Name("z_out")))
    function = ir.Function("h", [], ir.NOTHING, (with_value, filling), [ir.Argument("z_out", ir.REAL, True)])
    text = function_text(function)
    assert "    (void)f(x);\n    g(x, &y, z_out);\n" in text


def test_arrays_begin_with_their_values_or_zeros_of_all_extents() -> None:
    row = ir.Kind("array", (), (2,))
    body: ir.Block = (
        ir.Declare("a", row, ir.Values((X, Y), row), True),
        ir.Declare("t", TABLE, ir.Values((), TABLE)),
        ir.Declare("later", ir.INT),
    )
    text = function_text(ir.Function("f", [], ir.NOTHING, body))
    zeros = "{ K(0.0), K(0.0), K(0.0) }"
    assert "const @real a[2] = { x, y };" in text and f"@real t[2][3] = {{ {zeros}, {zeros} }};" in text
    assert "    int later;" in text


def test_an_assignment_to_what_it_reads_first_is_shortened_and_no_other() -> None:
    def line(value: ir.Expression) -> str:
        return CPrinter(None).assigned(ir.Assign(X, value))

    assert [line(X + Y), line(X - Y), line(X * (Y + Z)), line(X / Y)] == ["x += y", "x -= y", "x *= y + z", "x /= y"]
    assert line(Y - X) == "x = y - x" and line((X + Y) * Z) == "x = (x + y) * z"


def test_a_choice_in_a_row_ends_with_else_and_a_single_one_needs_none() -> None:
    one = ir.If(X < Y, (ir.Assign(Z, X),))
    text = "\n".join(CPrinter(None).statement(ir.If(Z < X, (ir.Assign(Z, Y),), (one,)), ""))
    assert (
        text.count("if (") == 2 and "} else if (x < y) {" in text and text.endswith("} else {\n    /* as it is */\n}")
    )
    assert "else" not in "\n".join(CPrinter(None).statement(one, ""))


@pytest.mark.parametrize(
    ("down", "head"), [(False, "for (int k = 3; k < n; k++) {"), (True, "for (int k = 3; k > n; k--) {")]
)
def test_a_loop_counts_up_or_down_to_before_its_stop(down: bool, head: str) -> None:
    loop = ir.For("k", ir.whole(3), ir.Name("n", ir.INT), down, (ir.Leave("break"),))
    assert [*CPrinter(None).statement(loop, "")] == [head, "    break;", "}"]


@given(st.lists(st.sampled_from(["alpha", "f(x, y)", "(a + b)", "g(h(c), 2)", "t[3]"]), min_size=12, max_size=40))
def test_long_lines_are_cut_before_operators_and_stay_the_same_code(terms: list[str]) -> None:
    line = f"    const @real value = {' * '.join(terms)};"
    cut = broken(line)
    assert " ".join(cut.split()) == " ".join(line.split())
    assert all(len(one) <= WIDTH for one in cut.split("\n"))
    assert (cut == line) == (len(line) <= WIDTH)
    assert all(one.startswith("        * ") for one in cut.split("\n")[1:])


def test_a_long_call_is_cut_behind_its_commas_below_its_bracket() -> None:
    line = f"    y = function_of_many({', '.join(f'argument_{k}' for k in range(14))});"
    first, *others = broken(line).split("\n")
    column = line.index("(") + 1
    assert first.endswith(",") and others and all(o.startswith(" " * column + "argument") for o in others)
    assert broken("x" * 300) == "x" * 300


@pytest.mark.parametrize(
    ("docstring", "said"),
    [
        (["Return the smaller of two."], ["The smaller of two"]),
        (["Return k of a loop."], ["k of a loop"]),
        (["It stays.", "", "As it is."], ["It stays.", "", "As it is."]),
    ],
)
def test_a_docstring_becomes_a_headline(docstring: list[str], said: list[str]) -> None:
    assert headline(docstring) == said


def test_comments_have_one_end() -> None:
    assert comment(["a */ b", "c"], "  ") == "  /* a * / b\n   * c */"


def test_only_what_a_program_calls_and_does_not_hold_is_added() -> None:
    calls = ir.Call("clamp", (ir.Call("tanh", (X,)), ir.Call("pow", (X, Y)), ir.Call("tanh", (X,), ir.REAL, True)))
    program = ir.Program({}, {"f": ir.Function("f", [], ir.REAL, (ir.Return(calls),))})
    assert math_functions(program) == ["pow", "tanh"] and small_functions(program).count("static") == 1
    assert macros(["tanh", "pow"]) == [("pow", "(x, y)", "((x), (y))"), ("tanh", "(x)", "((x))")]


def test_constants_have_their_kind_and_a_remark_once() -> None:
    own = [
        ir.Constant("FEW", ir.INT, ir.whole(3), ("Of both",)),
        ir.Constant("RATE", ir.REAL, ir.real(-0.5), ("Of both",)),
        ir.Constant("ON", ir.BOOL, ir.Literal("1", ir.BOOL)),
    ]
    text = constants(ir.Program({c.name: c for c in own}))
    assert text.split("\n") == [
        "/* Of both */",
        "static const int FEW = 3;",
        "static const @real RATE = -K(0.5);",
        "static const int ON = 1;",
    ]
    assert (kind_text(ir.BOOL), kind_text(ir.NOTHING), kind_text(ir.struct("inputs"))) == ("int", "void", "@inputs")
