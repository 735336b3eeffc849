"""A typed tree as MATLAB: what a function changes of its arguments, or fills in, becomes an output of it."""

from collections.abc import Sequence
from itertools import count

from mrfit.export.printer import ir, shaping
from mrfit.export.text import ascii_line

INDENT = "    "
# Functions that are called otherwise than in C
CALLED = {
    **{"fabs": "abs", "copysign": "copy_sign", "pow": "power", "fmod": "rem", "trunc": "fix", "exp2": "pow2"},
    **{"smaller": "min", "larger": "max", "fewer": "min", "more": "max", "sign_of": "sign"},
}
_SIGNS = {"and": "&&", "or": "||", "!=": "~="}


def matlab_text(program: ir.Program) -> str:
    """Return all functions of a program."""
    return "\n".join(MatlabPrinter(program, function).whole() for function in program.functions.values())


def results(function: ir.Function) -> list[str]:
    """Return the names of a function's outputs behind what it returns."""
    return [a.name for a in (*function.arguments, *function.outputs) if a.changed]


class MatlabPrinter:
    """Prints one function."""

    def __init__(self, program: ir.Program, function: ir.Function) -> None:
        self.program, self.function = program, function
        self.lines: list[str] = []
        self.depth, self.taken = 0, shaping.names_of(function)

    def whole(self) -> str:
        """Return the definition."""
        f = self.function
        outputs = [*(["value_"] if f.result != ir.NOTHING else []), *results(f)]
        arguments = ", ".join(a.name for a in f.arguments)
        self.lines = [f"function [{', '.join(outputs)}] = {f.name}({arguments})"]
        self.remark(f.title)
        self.depth = 1
        self.block(f.body)
        return "\n".join([*self.lines, "end", ""])

    def say(self, text: str) -> None:
        """Add a line."""
        self.lines.append(INDENT * self.depth + text)

    def remark(self, lines: Sequence[str]) -> None:
        """Add a comment."""
        for line in lines:
            self.say(f"% {ascii_line(line)}".rstrip())

    # statements

    def block(self, block: ir.Block, deeper: int = 0) -> None:
        """Add the lines of a block."""
        self.depth += deeper
        for statement in block:
            self.statement(statement)
        self.depth -= deeper

    def statement(self, statement: ir.Statement) -> None:
        """Add the lines of a statement."""
        if isinstance(statement, ir.Remark):
            self.remark(statement.lines)
        elif isinstance(statement, ir.Declare):
            self.declared(statement)
        elif isinstance(statement, ir.Assign):
            self.set(self.value(statement.target), statement.value)
        elif isinstance(statement, ir.CallStatement):
            self.run(statement.call, [t.name for t in statement.targets], "")
        elif isinstance(statement, ir.If):
            self.say(f"if {self.condition(statement.condition)}")
            self.block(statement.then, 1)
            if statement.other:
                self.say("else")
                self.block(statement.other, 1)
            self.say("end")
        elif isinstance(statement, ir.For):
            first, last = self.value(statement.start), self.value(statement.stop)
            ends = f"{first}:-1:{last} + 1" if statement.down else f"{first}:{last} - 1"
            self.say(f"for {statement.name} = {ends}")
            self.block(statement.body, 1)
            self.say("end")
        elif isinstance(statement, ir.While):
            self.say("while true")
            self.depth += 1
            self.say(f"if ~({self.condition(statement.condition)})")
            self.say(f"{INDENT}break;")
            self.say("end")
            self.block(statement.body)
            self.depth -= 1
            self.say("end")
        elif isinstance(statement, ir.Leave):
            self.say(f"{statement.word};")
        else:
            self.set("value_", statement.value)

    def declared(self, statement: ir.Declare) -> None:
        """Add a declaration, which is an assignment where there is a value."""
        name, kind = statement.name, statement.kind
        if kind.name == "array":
            assert isinstance(statement.value, ir.Values)
            rows, columns = (1, *kind.extents) if len(kind.extents) == 1 else kind.extents
            inside = ", ".join(map(self.value, statement.value.values))
            self.say(f"{name} = {f'[{inside}]' if inside else f'zeros({rows}, {columns})'};")
        elif kind.name == "struct" and statement.value is None:
            self.say(f"{name} = struct();")
        elif statement.value is not None:
            self.set(name, statement.value)

    def set(self, target: str, value: ir.Expression) -> None:
        """Add an assignment; a choice is one between two of them."""
        if isinstance(value, ir.Conditional):
            self.say(f"if {self.condition(value.condition)}")
            self.depth += 1
            self.set(target, value.then)
            self.depth -= 1
            self.say("else")
            self.depth += 1
            self.set(target, value.other)
            self.depth -= 1
            self.say("end")
        elif isinstance(value, ir.Call) and value.own and results(self.program.functions[value.name]):
            self.run(value, [], target)
        else:
            self.say(f"{target} = {self.value(value)};")

    def run(self, call: ir.Call, targets: Sequence[str], target: str) -> None:
        """Add a call that changes arguments, or fills in variables."""
        function = self.program.functions[call.name]
        values = [self.value(v) for v in call.values]
        changed = [v for a, v in zip(function.arguments, values, strict=True) if a.changed]
        outputs = [*([target or "~"] if function.result != ir.NOTHING else []), *changed, *targets]
        self.say(f"[{', '.join(outputs)}] = {call.name}({', '.join(values)});")

    # expressions

    def condition(self, value: ir.Expression) -> str:
        """Return an expression that is true or false."""
        if isinstance(value, ir.Unary):
            return f"~({self.condition(value.value)})"
        if isinstance(value, ir.Binary) and value.sign in ("and", "or"):
            return f"({self.condition(value.left)}) {_SIGNS[value.sign]} ({self.condition(value.right)})"
        if isinstance(value, ir.Binary):
            return f"{self.operand(value.left)} {_SIGNS.get(value.sign, value.sign)} {self.operand(value.right)}"
        return f"{self.value(value)} ~= 0"

    def value(self, value: ir.Expression) -> str:
        """Return an expression; what has to be done before it is said first."""
        if isinstance(value, ir.Literal):
            return "Inf" if value.text == "inf" else value.text
        if isinstance(value, ir.Name):
            constant = self.program.constants.get(value.name)
            return self.operand(constant.value) if constant else value.name
        if isinstance(value, ir.Member):
            return f"{self.value(value.value)}.{value.name}"
        if isinstance(value, ir.Subscript):
            return self.item(value)
        if isinstance(value, ir.Conditional):
            name = next(n for k in count(1) if (n := f"chosen_{k}") not in self.taken)
            self.taken.add(name)
            self.set(name, value)
            return name
        if isinstance(value, ir.Call):
            return self.called(value)
        if isinstance(value, ir.Cast):
            return f"fix({self.value(value.value)})" if value.kind == ir.INT else self.operand(value.value)
        if value.kind == ir.BOOL:
            return f"double({self.condition(value)})"
        if isinstance(value, ir.Unary):
            return f"-{self.operand(value.value)}"
        assert isinstance(value, ir.Binary)
        if value.sign in ("//", "%"):
            left, right = self.value(value.left), self.value(value.right)
            return f"mod({left}, {right})" if value.sign == "%" else f"floor(({left}) / ({right}))"
        return f"{self.operand(value.left)} {value.sign} {self.operand(value.right)}"

    def item(self, value: ir.Subscript) -> str:
        """Return an element of an array."""
        indices, array = [value.index], value.value
        while isinstance(array, ir.Subscript):
            indices.insert(0, array.index)
            array = array.value
        places = [*(f"{self.value(i)} + 1" for i in indices), *([":"] if value.kind.name == "array" else [])]
        return f"{self.value(array)}({', '.join(places)})"

    def called(self, value: ir.Call) -> str:
        """Return a call."""
        values = [self.value(v) for v in value.values]
        if value.name == "square" and not value.own:
            return f"power({values[0]}, 2)"
        if value.name == "clamp" and not value.own:
            return f"min(max({values[0]}, {values[1]}), {values[2]})"
        if value.name == "cbrt" and not value.own:
            return f"nthroot({values[0]}, 3)"
        assert not value.own or not results(self.program.functions[value.name])
        name = value.name if value.own else CALLED.get(value.name, value.name)
        return f"{name}({', '.join(values)})"

    def operand(self, value: ir.Expression) -> str:
        """Return an expression inside another."""
        text = self.value(value)
        return f"({text})" if isinstance(value, ir.Binary | ir.Unary) and value.kind != ir.BOOL else text
