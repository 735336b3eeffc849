"""The typed tree between Python and the languages that a step is printed in: kinds, expressions, statements.

Operators on expressions of real numbers make expressions: ``a + b`` is the sum, ``a <= b`` the comparison.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from typing import TypeAlias, TypeVar, cast

from mrfit.export.text import number


@dataclass(frozen=True)
class Kind:
    """Kind of a value: ``real``, ``int``, ``bool``, ``tuple`` of ``items``, ``array`` of ``extents``, ``struct``."""

    name: str
    items: tuple["Kind", ...] = ()
    extents: tuple[int, ...] = ()
    tag: str = ""

    @property
    def element(self) -> "Kind":
        """Kind of an element of an array, a row of which is an array too."""
        return Kind("array", (), self.extents[1:]) if len(self.extents) > 1 else REAL


def struct(name: str) -> Kind:
    """Return the kind of a struct by its name behind the export's prefix."""
    return Kind("struct", tag=f"@{name}")


REAL, INT, BOOL, NOTHING = Kind("real"), Kind("int"), Kind("bool"), Kind("nothing")


class Expression:
    """A value of a kind."""

    kind: Kind

    def field(self, name: str, kind: Kind = REAL) -> "Member":
        """Return a field of a struct."""
        return Member(self, name, kind)

    def at(self, place: int) -> "Subscript":
        """Return an element of an array."""
        return Subscript(self, whole(place), self.kind.element)

    def __add__(self, other: "Expression") -> "Expression":
        return Binary("+", self, other, REAL)

    def __sub__(self, other: "Expression") -> "Expression":
        return Binary("-", self, other, REAL)

    def __mul__(self, other: "Expression") -> "Expression":
        return Binary("*", self, other, REAL)

    def __truediv__(self, other: "Expression") -> "Expression":
        return Binary("/", self, other, REAL)

    def __lt__(self, other: "Expression") -> "Expression":
        return Binary("<", self, other, BOOL)

    def __le__(self, other: "Expression") -> "Expression":
        return Binary("<=", self, other, BOOL)

    def __gt__(self, other: "Expression") -> "Expression":
        return Binary(">", self, other, BOOL)

    def __ge__(self, other: "Expression") -> "Expression":
        return Binary(">=", self, other, BOOL)

    def __and__(self, other: "Expression") -> "Expression":
        return Binary("and", self, other, BOOL)


@dataclass(frozen=True)
class Literal(Expression):
    """A constant: its text has all digits of the value."""

    text: str
    kind: Kind


@dataclass(frozen=True)
class Name(Expression):
    """A variable, an argument or a constant of the module."""

    name: str
    kind: Kind = REAL


@dataclass(frozen=True)
class Member(Expression):
    """A field of a struct."""

    value: Expression
    name: str
    kind: Kind = REAL


@dataclass(frozen=True)
class Subscript(Expression):
    """An element of an array, counted from 0."""

    value: Expression
    index: Expression
    kind: Kind = REAL


@dataclass(frozen=True)
class Unary(Expression):
    """A negative number, ``-``, or a negation, ``not``."""

    sign: str
    value: Expression
    kind: Kind


@dataclass(frozen=True)
class Binary(Expression):
    """An operation: ``+ - * / // %``, a comparison, ``and``, ``or``; those of numbers have operands of one kind."""

    sign: str
    left: Expression
    right: Expression
    kind: Kind


@dataclass(frozen=True)
class Conditional(Expression):
    """One of two values, of which only that is evaluated."""

    condition: Expression
    then: Expression
    other: Expression
    kind: Kind = REAL


@dataclass(frozen=True)
class Call(Expression):
    """A call of a function of ``math.h`` or of the tree, ``own``; ``kind`` is what it returns."""

    name: str
    values: tuple[Expression, ...]
    kind: Kind = REAL
    own: bool = False


@dataclass(frozen=True)
class Cast(Expression):
    """A number as one of another kind."""

    value: Expression
    kind: Kind


@dataclass(frozen=True)
class Values(Expression):
    """Several values: a tuple, or those of an array."""

    values: tuple[Expression, ...]
    kind: Kind


Place: TypeAlias = Name | Member | Subscript


def record(name: str, tag: str) -> Name:
    """Return a variable that is a struct."""
    return Name(name, struct(tag))


def whole(value: int) -> Literal:
    """Return a constant count."""
    return Literal(str(value), INT)


def real(value: float) -> Expression:
    """Return a constant."""
    text = Literal(number(abs(value)), REAL)
    return Unary("-", text, REAL) if value < 0.0 else text


@dataclass(frozen=True)
class Remark:
    """A comment."""

    lines: tuple[str, ...]


@dataclass(frozen=True)
class Declare:
    """A variable from here on: with its only value where ``constant``, with a first one, or with none yet."""

    name: str
    kind: Kind
    value: Expression | None = None
    constant: bool = False


@dataclass(frozen=True)
class Assign:
    """A value of a variable, a field or an element."""

    target: Place
    value: Expression


@dataclass(frozen=True)
class CallStatement:
    """A call that leaves several values in variables."""

    call: Call
    targets: tuple[Name | Member, ...]


@dataclass(frozen=True)
class If:
    """A choice between statements."""

    condition: Expression
    then: tuple["Statement", ...]
    other: tuple["Statement", ...] = ()


@dataclass(frozen=True)
class For:
    """A loop over whole numbers from ``start`` up, or down, to before ``stop``."""

    name: str
    start: Expression
    stop: Expression
    down: bool
    body: tuple["Statement", ...]


@dataclass(frozen=True)
class While:
    """A loop while a condition holds."""

    condition: Expression
    body: tuple["Statement", ...]


@dataclass(frozen=True)
class Leave:
    """The end of a loop, ``break``, or of one of its rounds, ``continue``."""

    word: str


@dataclass(frozen=True)
class Return:
    """The end of a function, with its value."""

    value: Expression


Statement: TypeAlias = Remark | Declare | Assign | CallStatement | If | For | While | Leave | Return
Block: TypeAlias = tuple[Statement, ...]


@dataclass
class Argument:
    """An argument of a function; ``changed`` where the function changes what the caller has there."""

    name: str
    kind: Kind
    changed: bool = False


@dataclass
class Function:
    """A function: its arguments, what it returns, and its statements.

    Attributes
    ----------
    result
        Kind of what it returns; ``NOTHING`` where all goes to ``outputs``.
    outputs
        Further arguments, by which a tuple's values are returned.
    kept
        Places in which it remembers what the next call wants.
    title
        Lines of comment above it.
    """

    name: str
    arguments: list[Argument]
    result: Kind
    body: Block
    outputs: list[Argument] = field(default_factory=list)
    kept: list[Place] = field(default_factory=list)
    title: tuple[str, ...] = ()


@dataclass(frozen=True)
class Constant:
    """A constant of a module."""

    name: str
    kind: Kind
    value: Expression
    remark: tuple[str, ...] = ()


@dataclass
class Program:
    """A program: constants and functions, each behind those that it needs."""

    constants: dict[str, Constant] = field(default_factory=dict)
    functions: dict[str, Function] = field(default_factory=dict)


def parts(node: object) -> Iterator[object]:
    """Yield a node of the tree and all below it, those that are evaluated first before the others."""
    if isinstance(node, tuple):
        for item in node:
            yield from parts(item)
    elif not isinstance(node, Kind) and is_dataclass(node):
        for one in fields(node):
            yield from parts(getattr(node, one.name))
        yield node


def names_in(node: object) -> list[str]:
    """Return the variables that a node mentions, those it sets too."""
    found = []
    for part in parts(node):
        if isinstance(part, Name | Declare | For):
            found.append(part.name)
    return found


def unused(name: str, taken: Collection[str]) -> str:
    """Return a name, with underscores behind it where another variable has it."""
    while name in taken:
        name += "_"
    return name


def blocks_of(statement: Statement) -> Sequence[Block]:
    """Return the blocks inside a statement."""
    if isinstance(statement, If):
        return (statement.then, statement.other)
    return (statement.body,) if isinstance(statement, For | While) else ()


def with_blocks(statement: Statement, blocks: Sequence[Block]) -> Statement:
    """Return a statement with other blocks inside."""
    if isinstance(statement, If):
        return replace(statement, then=blocks[0], other=blocks[1])
    return replace(statement, body=blocks[0]) if isinstance(statement, For | While) else statement


Part = TypeVar("Part")


def declared_in(function: Function) -> set[str]:
    """Return the names of a function's arguments, outputs and variables, not those of constants that it reads."""
    own = {p.name for p in parts(function.body) if isinstance(p, Declare | For)}
    return own.union(a.name for a in (*function.arguments, *function.outputs))


def renamed(node: Part, names: Mapping[str, str], kind: type[Call] | type[Name]) -> Part:
    """Return a node in which functions, or variables, have other names."""
    if isinstance(node, tuple):
        return cast(Part, tuple(renamed(item, names, kind) for item in node))
    if isinstance(node, Kind) or not is_dataclass(node):
        return node
    changed = {one.name: renamed(getattr(node, one.name), names, kind) for one in fields(node)}
    if isinstance(node, kind) and (isinstance(node, Name) or node.own):
        changed["name"] = names.get(node.name, node.name)
    return replace(node, **changed)  # type: ignore[type-var]
