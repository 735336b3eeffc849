"""The exported C, statement by statement, as MATLAB: pointers that a function changes become outputs of it.

It knows the C that the templates are written in and no more: structs, arrays, if, for, while, calls, ?: and casts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

KEYWORDS = frozenset(
    "break case catch classdef continue else elseif end for function global if otherwise parfor persistent return spmd "
    "switch try while".split()
)
# Functions of math.h that MATLAB calls otherwise
CALLED = {
    "fabs": "abs",
    "copysign": "copy_sign",
    "pow": "power",
    "fmin": "min",
    "fmax": "max",
    "fmod": "rem",
    "trunc": "fix",
    "exp2": "pow2",
}
OPERATORS = {"!=": "~="}


# Value of a field of a struct: a number as text, a row, rows, or a struct
Value: TypeAlias = str | list[str] | list[list[str]] | Mapping[str, "Value"]


@dataclass(frozen=True)
class Kind:
    """Type of an expression: name of a struct, ``int`` or ``real``, and extents of an array."""

    name: str
    extents: tuple[int, ...] = ()

    @property
    def element(self) -> "Kind":
        """Type of an element."""
        return Kind(self.name, self.extents[1:])


@dataclass
class Function:
    """What a call needs to know of a function: what it gives, and which arguments it changes."""

    result: str
    changes: list[bool]


@dataclass
class Structs:
    """Fields of every struct, by name, in their order."""

    fields: dict[str, dict[str, Kind]] = field(default_factory=dict)

    def zero(self, kind: Kind) -> str:
        """Return a value of a type, all zero."""
        if kind.name in self.fields:
            inside = ", ".join(f"'{n}', {self.zero(k)}" for n, k in self.fields[kind.name].items())
            return f"struct({inside})"
        if not kind.extents:
            return "0"
        rows, columns = (1, kind.extents[0]) if len(kind.extents) == 1 else kind.extents
        return f"zeros({rows}, {columns})"


def kind_of(node: Any) -> Kind:
    """Return the type a declaration gives; pointers are what they point to."""
    extents: list[int] = []
    while type(node).__name__ in ("PtrDecl", "ArrayDecl"):
        if type(node).__name__ == "ArrayDecl":
            extents.append(extent_of(node.dim))
        elif type(node.type).__name__ == "ArrayDecl":
            # a pointer to rows
            extents.append(0)
        node = node.type
    names = node.type.names if hasattr(node.type, "names") else ["struct"]
    name = names[-1]
    return Kind("real" if name.endswith("_real") or name == "double" else name, tuple(extents))


def extent_of(node: Any) -> int:
    """Return a whole number that is written as sums and products of others."""
    if type(node).__name__ == "BinaryOp":
        left, right = extent_of(node.left), extent_of(node.right)
        return left + right if node.op == "+" else left * right
    return int(node.value)


def is_changed(declaration: Any) -> bool:
    """Return whether an argument is one that the function may change: a pointer to what is not const."""
    kind = declaration.type
    if type(kind).__name__ not in ("PtrDecl", "ArrayDecl"):
        return False
    while type(kind).__name__ in ("PtrDecl", "ArrayDecl"):
        kind = kind.type
    return "const" not in kind.quals


class Translator:
    """Functions of C as those of MATLAB.

    Parameters
    ----------
    tree
        Syntax tree of the C text.
    skipped
        Names of functions that have no use in MATLAB.
    """

    def __init__(self, tree: Any, skipped: Sequence[str]) -> None:
        self.structs, self.functions = Structs(), dict[str, Function]()
        self.bodies = [n for n in tree.ext if type(n).__name__ == "FuncDef" and n.decl.name not in skipped]
        for node in tree.ext:
            if type(node).__name__ == "Typedef" and type(node.type.type).__name__ == "Struct":
                fields = {d.name: kind_of(d.type) for d in node.type.type.decls}
                self.structs.fields[node.name] = fields
        declared = [n for n in tree.ext if type(n).__name__ == "Decl" and type(n.type).__name__ == "FuncDecl"]
        for decl in declared:
            changes = [is_changed(a) for a in decl.type.args.params]
            self.functions[decl.name] = Function(decl.type.type.type.names[-1], changes)
        for node in self.bodies:
            arguments = node.decl.type.args.params
            result = node.decl.type.type.type.names[-1]
            self.functions[node.decl.name] = Function(result, [is_changed(a) for a in arguments])
        self.known: dict[str, Kind] = {}
        self.lines: list[str] = []
        self.depth, self.temporaries = 0, 0

    def text(self) -> str:
        """Return all functions."""
        return "\n".join(self.function(node) for node in self.bodies)

    def function(self, node: Any) -> str:
        """Return one function."""
        arguments = node.decl.type.args.params
        self.known = {a.name: kind_of(a.type) for a in arguments}
        self.lines, self.depth, self.temporaries = [], 1, 0
        known = self.functions[node.decl.name]
        outputs = [self.name(a.name) for a, changed in zip(arguments, known.changes, strict=True) if changed]
        outputs = ([] if known.result == "void" else ["result_"]) + outputs
        self.compound(node.body)
        called = ", ".join(self.name(a.name) for a in arguments)
        head = f"function [{', '.join(outputs)}] = {node.decl.name}({called})"
        return "\n".join([head, *self.lines, "end", ""])

    def say(self, text: str) -> None:
        """Add a line."""
        self.lines.append("    " * self.depth + text)

    @staticmethod
    def name(name: str) -> str:
        """Return a variable's name, which must be no keyword."""
        return f"{name}_" if name in KEYWORDS else name

    # statements

    def compound(self, node: Any) -> None:
        """Translate what stands between braces."""
        for item in node.block_items or []:
            self.statement(item)

    def inside(self, node: Any) -> None:
        """Translate the body of an if or a loop."""
        self.depth += 1
        self.statement(node)
        self.depth -= 1

    def statement(self, node: Any) -> None:
        """Translate one statement."""
        getattr(self, f"on_{type(node).__name__.lower()}")(node)

    def on_compound(self, node: Any) -> None:
        """A block."""
        self.compound(node)

    def on_decl(self, node: Any) -> None:
        """A declaration: zero where it is not initialised."""
        kind = kind_of(node.type)
        if type(node.type).__name__ == "PtrDecl" and node.init is not None:
            kind = self.kind(node.init)
        self.known[node.name] = kind
        name = self.name(node.name)
        if node.init is None:
            pointer = type(node.type).__name__ == "PtrDecl"
            self.say(f"{name} = {'0' if pointer else self.structs.zero(kind)};")
        elif type(node.init).__name__ == "InitList":
            values = [self.value(e) for e in node.init.exprs]
            if kind.name in self.structs.fields:
                pairs = zip(self.structs.fields[kind.name], values, strict=True)
                inside = ", ".join(f"'{n}', {v}" for n, v in pairs)
                self.say(f"{name} = struct({inside});")
            else:
                values += ["0"] * (kind.extents[0] - len(values))
                self.say(f"{name} = [{', '.join(values)}];")
        else:
            self.say(f"{name} = {self.value(node.init)};")

    def on_assignment(self, node: Any) -> None:
        """An assignment, with an operator or without."""
        target = self.target(node.lvalue)
        value = self.value(node.rvalue)
        if type(node.lvalue).__name__ == "ID" and node.lvalue.name in self.known and node.op == "=":
            found = self.kind(node.rvalue)
            # a pointer that is set later knows its type only then
            if found.extents and not self.known[node.lvalue.name].extents:
                self.known[node.lvalue.name] = found
        self.say(f"{target} = {value};" if node.op == "=" else f"{target} = {target} {node.op[0]} ({value});")

    def on_if(self, node: Any) -> None:
        """A choice."""
        self.say(f"if {self.value(node.cond)}")
        self.inside(node.iftrue)
        if node.iffalse is not None:
            self.say("else")
            self.inside(node.iffalse)
        self.say("end")

    def on_while(self, node: Any) -> None:
        """A loop; its condition must call nothing that has to be called before it."""
        before = len(self.lines)
        condition = self.value(node.cond)
        assert len(self.lines) == before
        self.say(f"while {condition}")
        self.inside(node.stmt)
        self.say("end")

    def on_for(self, node: Any) -> None:
        """A loop that counts."""
        self.statement(node.init)
        before = len(self.lines)
        condition = self.value(node.cond)
        assert len(self.lines) == before
        self.say(f"while {condition}")
        self.inside(node.stmt)
        self.depth += 1
        self.statement(node.next)
        self.depth -= 1
        self.say("end")

    def on_break(self, node: Any) -> None:
        """The end of a loop."""
        self.say("break;")

    def on_unaryop(self, node: Any) -> None:
        """A counter going on, or back."""
        name = self.target(node.expr)
        self.say(f"{name} = {name} {node.op[1]} 1;")

    def on_return(self, node: Any) -> None:
        """The end of a function."""
        self.say(f"result_ = {self.value(node.expr)};")
        self.say("return;")

    def on_cast(self, node: Any) -> None:
        """What is evaluated and not used."""
        if type(node.expr).__name__ == "FuncCall":
            self.call(node.expr)

    def on_funccall(self, node: Any) -> None:
        """A call whose result is not used."""
        self.call(node)

    # expressions

    def kind(self, node: Any) -> Kind:
        """Return an expression's type."""
        what = type(node).__name__
        if what == "ID":
            return self.known.get(node.name, Kind("real"))
        if what == "Constant":
            return Kind("int" if node.type == "int" else "real")
        if what == "StructRef":
            return self.structs.fields[self.kind(node.name).name][node.field.name]
        if what == "ArrayRef":
            return self.kind(node.name).element
        if what == "Cast":
            return kind_of(node.to_type.type)
        if what == "FuncCall":
            found = self.functions.get(node.name.name)
            return Kind("int" if found and found.result == "int" else "real")
        if what == "BinaryOp":
            both = {self.kind(node.left).name, self.kind(node.right).name}
            return Kind("int" if both == {"int"} else "real")
        return self.kind(node.expr) if what == "UnaryOp" else Kind("real")

    def target(self, node: Any) -> str:
        """Return what is assigned to."""
        return self.value(node.expr) if type(node).__name__ == "UnaryOp" else self.value(node)

    def value(self, node: Any) -> str:
        """Return an expression; what has to be done before it is said first."""
        return str(getattr(self, f"of_{type(node).__name__.lower()}")(node))

    def of_id(self, node: Any) -> str:
        """A variable."""
        return self.name(node.name)

    def of_constant(self, node: Any) -> str:
        """A number."""
        return str(node.value)

    def of_structref(self, node: Any) -> str:
        """A field."""
        return f"{self.value(node.name)}.{node.field.name}"

    def of_arrayref(self, node: Any) -> str:
        """An element, or a row of a table."""
        indices, base = [node.subscript], node.name
        while type(base).__name__ == "ArrayRef":
            indices.insert(0, base.subscript)
            base = base.name
        places = [f"{self.value(i)} + 1" for i in indices]
        if len(self.kind(base).extents) == 2 and len(places) == 1:
            places.append(":")
        return f"{self.value(base)}({', '.join(places)})"

    def of_unaryop(self, node: Any) -> str:
        """A sign, a negation, a pointer's target, an address."""
        inner = node.expr
        if node.op == "&" and type(inner).__name__ == "ArrayRef":
            return f"{self.value(inner.name)}({self.value(inner.subscript)} + 1:end)"
        if node.op in ("&", "*"):
            return self.value(inner)
        return f"{'~' if node.op == '!' else node.op}({self.value(inner)})"

    def of_binaryop(self, node: Any) -> str:
        """An operation; whole numbers are divided as C divides them."""
        left, right = self.value(node.left), self.value(node.right)
        if node.op == "%":
            return f"mod({left}, {right})"
        if node.op == "/" and self.kind(node).name == "int":
            return f"fix(({left}) / ({right}))"
        return f"({left} {OPERATORS.get(node.op, node.op)} {right})"

    def of_cast(self, node: Any) -> str:
        """A cast: to a whole number it cuts, else nothing happens."""
        text = self.value(node.expr)
        return f"fix({text})" if kind_of(node.to_type.type).name == "int" else text

    def of_ternaryop(self, node: Any) -> str:
        """A choice between two values, only one of which is evaluated."""
        self.temporaries += 1
        name = f"t_{self.temporaries}"
        self.say(f"if {self.value(node.cond)}")
        for part, branch in enumerate((node.iftrue, node.iffalse)):
            if part:
                self.say("else")
            self.depth += 1
            self.say(f"{name} = {self.value(branch)};")
            self.depth -= 1
        self.say("end")
        return name

    def of_funccall(self, node: Any) -> str:
        """A call."""
        return self.call(node)

    def call(self, node: Any) -> str:
        """Return the result of a call, which has changed what it changes."""
        name = node.name.name
        arguments = list(node.args.exprs) if node.args else []
        values = [self.value(a) for a in arguments]
        known = self.functions.get(name)
        if known is None:
            return f"{CALLED.get(name, name)}({', '.join(values)})"
        text = f"{name}({', '.join(values)})"
        changed = [v for v, c in zip(values, known.changes, strict=True) if c]
        if not changed:
            return text
        outputs = changed
        result = ""
        if known.result != "void":
            self.temporaries += 1
            result = f"t_{self.temporaries}"
            outputs = [result, *changed]
        self.say(f"[{', '.join(outputs)}] = {text};")
        return result


def struct_of(structs: Structs, kind: Kind, values: Mapping[str, Value]) -> str:
    """Return a struct with values of its fields, which are numbers as text, lists, lists of lists, or mappings."""
    pairs = [f"'{n}', {_literal(structs, k, values[n])}" for n, k in structs.fields[kind.name].items()]
    return f"struct({', '.join(pairs)})"


def _literal(structs: Structs, kind: Kind, value: Value) -> str:
    if isinstance(value, Mapping):
        return struct_of(structs, kind, value)
    if isinstance(value, list):
        rows = [", ".join(row) if isinstance(row, list) else row for row in value]
        return f"[{'; '.join(rows) if value and isinstance(value[0], list) else ', '.join(rows)}]"
    return value
