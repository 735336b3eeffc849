"""A typed tree as C99: explicit parentheses and conversions, conditions that are comparisons, one exit."""

import re
from collections.abc import Iterable, Iterator, Sequence

from mrfit.export.printer import ir
from mrfit.export.printer.functions import ONE, TWO
from mrfit.export.text import in_comment

_WIDTH = 116
INDENT = "    "
_OPERATORS = {"and": "&&", "or": "||", "//": "/"}
# Functions that C99 has not, or not as conditions without a call
_SMALL = {
    "smaller": (
        "The smaller of two numbers",
        "static @real smaller(@real a, @real b)\n{\n    return (b < a) ? b : a;\n}",
    ),
    "larger": (
        "The larger of two numbers",
        "static @real larger(@real a, @real b)\n{\n    return (b > a) ? b : a;\n}",
    ),
    "clamp": (
        "x within low and high",
        "static @real clamp(@real x, @real low, @real high)\n{\n"
        "    return (x < low) ? low : ((x > high) ? high : x);\n}",
    ),
    "sign_of": (
        "Sign of x: 0 at 0",
        "static @real sign_of(@real x)\n{\n    return (x > K(0.0)) ? K(1.0) : ((x < K(0.0)) ? -K(1.0) : K(0.0));\n}",
    ),
    "fewer": ("The smaller of two counts", "static int fewer(int a, int b)\n{\n    return (b < a) ? b : a;\n}"),
    "more": ("The larger of two counts", "static int more(int a, int b)\n{\n    return (b > a) ? b : a;\n}"),
    "square": ("Square of x", "static @real square(@real x)\n{\n    return x * x;\n}"),
}


# Numbers below this one are 0 in a float: the least of either precision stands for them
_LEAST = 1e-37
# Letters of a first word that is no variable's name, and begins its sentence with a capital
_LONG = 3


def comment(lines: Sequence[str], indent: str = "") -> str:
    """Return a comment of one or several lines."""
    written = [in_comment(line) for line in lines]
    return f"{indent}/* " + f"\n{indent} * ".join(written) + " */"


def headline(lines: Sequence[str]) -> list[str]:
    """Return a docstring as a comment: without ``Return``, and without a full stop where it is one sentence."""
    first, *others = lines
    if first.startswith("Return "):
        first = first[7:]
        first = first[:1].upper() + first[1:] if re.match(rf"[a-z]{{{_LONG},}} ", first) else first
    return [first, *others] if others else [first.removesuffix(".")]


def small_functions(program: ir.Program) -> str:
    """Return those small functions that a program calls."""
    called = _called(program)
    return "\n\n".join(f"{comment([title])}\n{code}" for name, (title, code) in _SMALL.items() if name in called)


def _called(program: ir.Program) -> set[str]:
    """Return the names of functions that a program calls and does not hold."""
    calls = (p for f in program.functions.values() for p in ir.parts(f.body) if isinstance(p, ir.Call))
    return {c.name for c in calls if not c.own}


def math_functions(program: ir.Program) -> list[str]:
    """Return the functions of math.h that a program calls."""
    return sorted(_called(program) & {*ONE.values(), *TWO.values()})


def macros(names: Iterable[str]) -> list[tuple[str, str, str]]:
    """Return functions of math.h by name, with the arguments of a macro of each and the values it passes on."""
    return [(n, *(("(x, y)", "((x), (y))") if n in TWO.values() else ("(x)", "((x))"))) for n in sorted(names)]


def constants(program: ir.Program) -> str:
    """Return the program's constants."""
    lines, last = list[str](), tuple[str, ...]()
    for constant in program.constants.values():
        if constant.remark and constant.remark != last:
            lines.append(comment(constant.remark))
        kind = "int" if constant.kind != ir.REAL else "@real"
        lines.append(f"static const {kind} {constant.name} = {CPrinter(None).value(constant.value)};")
        last = constant.remark
    return "\n".join(lines)


def function_text(function: ir.Function) -> str:
    """Return a function's definition, its comment above it."""
    return CPrinter(function).whole()


def kind_text(kind: ir.Kind) -> str:
    """Return a kind as a type."""
    if kind.name == "struct":
        return kind.tag
    return {"real": "@real", "array": "@real", "nothing": "void"}.get(kind.name, "int")


class CPrinter:
    """Prints one function, or an expression outside of any."""

    def __init__(self, function: ir.Function | None) -> None:
        self.function = function
        self.outputs = {a.name for a in function.outputs} if function else set()
        self.pointers = {a.name for a in function.arguments if a.kind.name == "struct"} if function else set()

    def whole(self) -> str:
        """Return the definition."""
        assert self.function is not None
        f = self.function
        arguments = ", ".join(map(self.argument, (*f.arguments, *f.outputs))) or "void"
        head = broken(f"static {kind_text(f.result)} {f.name}({arguments})")
        body = "\n".join(self.block(f.body, INDENT))
        title = f"{comment(headline(f.title))}\n" if any(f.title) else ""
        return f"{title}{head}\n{{\n{body}\n}}"

    def argument(self, given: ir.Argument) -> str:
        """Return an argument's declaration."""
        if given.kind.name == "array" and len(given.kind.extents) > 1:
            return f"@real (*{given.name})[{given.kind.extents[1]}]"
        if given.kind.name in ("array", "struct") or given.name in self.outputs:
            return f"{'' if given.changed else 'const '}{kind_text(given.kind)} *{given.name}"
        return f"{kind_text(given.kind)} {given.name}"

    # statements

    def block(self, block: ir.Block, indent: str) -> Iterator[str]:
        """Yield the lines of a block."""
        for statement in block:
            yield from self.statement(statement, indent)

    def statement(self, statement: ir.Statement, indent: str) -> Iterator[str]:
        """Yield the lines of a statement."""
        if isinstance(statement, ir.Remark):
            yield comment(statement.lines, indent)
        elif isinstance(statement, ir.Declare):
            yield broken(f"{indent}{self.declared(statement)};")
        elif isinstance(statement, ir.Assign):
            yield broken(f"{indent}{self.assigned(statement)};")
        elif isinstance(statement, ir.CallStatement):
            targets = [t.name if t.name in self.outputs else f"&{self.place(t)}" for t in statement.targets]
            call = ", ".join([*map(self.passed, statement.call.values), *targets])
            void = "(void)" if statement.call.kind != ir.NOTHING else ""
            yield broken(f"{indent}{void}{statement.call.name}({call});")
        elif isinstance(statement, ir.If):
            yield from self.chosen(statement, indent, False)
        elif isinstance(statement, ir.For):
            yield from self.loop(statement, indent)
        elif isinstance(statement, ir.While):
            yield broken(f"{indent}while ({self.condition(statement.condition)}) {{")
            yield from (*self.block(statement.body, indent + INDENT), f"{indent}}}")
        elif isinstance(statement, ir.Leave):
            yield f"{indent}{statement.word};"
        else:
            yield broken(f"{indent}return {self.value(statement.value)};")

    def declared(self, statement: ir.Declare) -> str:
        """Return a declaration."""
        extents = "".join(f"[{n}]" for n in statement.kind.extents)
        head = f"{'const ' if statement.constant else ''}{kind_text(statement.kind)} {statement.name}{extents}"
        if statement.value is None:
            return head
        if statement.kind.name == "array":
            assert isinstance(statement.value, ir.Values)
            return f"{head} = {self.listed(statement.value, statement.kind)}"
        return f"{head} = {self.value(statement.value)}"

    def listed(self, value: ir.Values, kind: ir.Kind) -> str:
        """Return an array's values; those of one without are 0."""
        count, element = kind.extents[0], kind.element
        if element != ir.REAL:
            return f"{{ {', '.join([self.listed(value, element)] * count)} }}"
        return f"{{ {', '.join(list(map(self.value, value.values)) or ['K(0.0)'] * count)} }}"

    def assigned(self, statement: ir.Assign) -> str:
        """Return an assignment, with an operator where one can do it."""
        target, value = self.value(statement.target), statement.value
        if isinstance(value, ir.Binary) and value.left == statement.target and value.sign in ("+", "-", "*", "/"):
            return f"{target} {value.sign}= {self.value(value.right)}"
        return f"{target} = {self.value(value)}"

    def chosen(self, statement: ir.If, indent: str, inside: bool) -> Iterator[str]:
        """Yield a choice; one that goes on with ``else if`` ends with ``else``, as MISRA wants it."""
        head = f"{'} else ' if inside else ''}if ({self.condition(statement.condition)}) {{"
        yield broken(indent + head)
        yield from self.block(statement.then, indent + INDENT)
        if len(statement.other) == 1 and isinstance(statement.other[0], ir.If):
            yield from self.chosen(statement.other[0], indent, True)
            return
        if statement.other or inside:
            yield f"{indent}}} else {{"
            yield from self.block(statement.other, indent + INDENT)
            if not any(not isinstance(s, ir.Remark) for s in statement.other):
                yield f"{indent}{INDENT}/* as it is */"
        yield f"{indent}}}"

    def loop(self, statement: ir.For, indent: str) -> Iterator[str]:
        """Yield a loop that counts."""
        name, start, stop = statement.name, self.value(statement.start), self.operand(statement.stop)
        sign, step = (">", "--") if statement.down else ("<", "++")
        yield broken(f"{indent}for (int {name} = {start}; {name} {sign} {stop}; {name}{step}) {{")
        yield from (*self.block(statement.body, indent + INDENT), f"{indent}}}")

    # expressions

    def condition(self, value: ir.Expression) -> str:
        """Return an expression that is true or false."""
        if isinstance(value, ir.Literal):
            return f"{value.text} != 0"
        if isinstance(value, ir.Unary):
            return (
                f"{self.place(value.value)} == 0" if self.is_flag(value.value) else f"!({self.condition(value.value)})"
            )
        if isinstance(value, ir.Binary):
            if value.sign in ("and", "or"):
                left = self.joined(value.left, value.sign)
                return f"{left} {_OPERATORS[value.sign]} {self.joined(value.right, '')}"
            return f"{self.operand(value.left)} {value.sign} {self.operand(value.right)}"
        return f"{self.place(value)} != 0"

    @staticmethod
    def is_flag(value: ir.Expression) -> bool:
        """Return whether something that is true or false is stored as a number."""
        return isinstance(value, ir.Name | ir.Member | ir.Subscript | ir.Call)

    def joined(self, value: ir.Expression, sign: str) -> str:
        """Return a condition among others."""
        text = self.condition(value)
        return text if isinstance(value, ir.Binary) and value.sign == sign else f"({text})"

    def place(self, value: ir.Expression) -> str:
        """Return a place or a call."""
        if isinstance(value, ir.Name):
            return f"*{value.name}" if value.name in self.outputs else value.name
        if isinstance(value, ir.Member):
            arrow = "->" if self.is_pointer(value.value) else "."
            return f"{self.place(value.value)}{arrow}{value.name}"
        if isinstance(value, ir.Subscript):
            return f"{self.place(value.value)}[{self.value(value.index)}]"
        assert isinstance(value, ir.Call)
        # functions of math.h have the precision of the model's numbers
        name = value.name if value.own or value.name in _SMALL else f"{value.name.upper()}_"
        return f"{name}({', '.join(map(self.passed, value.values))})"

    def is_pointer(self, value: ir.Expression) -> bool:
        """Return whether something is a struct that the caller has."""
        return isinstance(value, ir.Name) and value.name in self.pointers

    def passed(self, value: ir.Expression) -> str:
        """Return an argument of a call; a struct by its address."""
        if value.kind.name == "struct":
            return f"{'' if self.is_pointer(value) else '&'}{self.place(value)}"
        return self.value(value)

    def value(self, value: ir.Expression) -> str:
        """Return an expression."""
        if isinstance(value, ir.Literal):
            if value.kind == ir.REAL and 0.0 < float(value.text) < _LEAST:
                return "@TINY"
            text = "HUGE_VAL" if value.text == "inf" else value.text
            return f"K({text})" if value.kind == ir.REAL else text
        if isinstance(value, ir.Conditional):
            return f"({self.condition(value.condition)}) ? {self.operand(value.then)} : {self.operand(value.other)}"
        if value.kind == ir.BOOL and not self.is_flag(value):
            return f"({self.condition(value)}) ? 1 : 0"
        if isinstance(value, ir.Unary):
            # two signs in a row are a decrement
            return f"-{self.operand(value.value, right=isinstance(value.value, ir.Unary))}"
        if isinstance(value, ir.Cast):
            return f"({kind_text(value.kind)}){self.operand(value.value)}"
        if isinstance(value, ir.Binary):
            left = self.operand(value.left, value.sign)
            return f"{left} {_OPERATORS.get(value.sign, value.sign)} {self.operand(value.right, right=True)}"
        assert not isinstance(value, ir.Values)
        return f"{'*' if self.is_pointer(value) else ''}{self.place(value)}"

    def operand(self, value: ir.Expression, sign: str = "", right: bool = False) -> str:
        """Return an expression inside another: in parentheses, but for sums in sums and products in products."""
        text = self.value(value)
        if isinstance(value, ir.Unary) and isinstance(
            value.value, ir.Literal | ir.Name | ir.Member | ir.Subscript | ir.Call
        ):
            return f"({text})" if right else text
        if isinstance(value, ir.Binary) and value.sign == sign and sign in ("+", "*"):
            return text
        if isinstance(value, ir.Unary) and not right:
            return text
        return f"({text})" if isinstance(value, ir.Binary | ir.Conditional | ir.Unary) else text


def broken(line: str, column: int | None = None) -> str:
    """Return a line of code, cut before operators and behind commas where it is too long."""
    if len(line) <= _WIDTH:
        return line
    indent = len(line) - len(line.lstrip())
    opened, places, columns = list[int](), list[tuple[int, int]](), dict[int, int | None]()
    for k, sign in enumerate(line[:_WIDTH]):
        if sign in "([{":
            opened.append(k + 1)
        elif sign in ")]}":
            opened = opened[:-1]
        elif sign == " " and k > indent + 8 and (line[k - 1] == "," or line[k + 1 : k + 3].strip() in _SIGNS):
            # what goes on stands behind the bracket that is still open
            places.append((len(opened), -k))
            columns[k] = opened[-1] if opened else None
    if not places:
        return line
    at = -min(places)[1]
    following = columns[at] or column or indent + 4
    return f"{line[:at]}\n{broken(' ' * following + line[at + 1 :], following)}"


_SIGNS = ("+", "-", "*", "/", "&&", "||", "?", ":")
