"""A function as read becomes one as C wants it: one exit, arguments that stay, variables declared where they begin."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TypeAlias

from mrfit.export.printer import ir

Pairs: TypeAlias = Sequence[tuple[ir.Place, ir.Expression]]


def shape(
    function: ir.Function,
    kinds: Sequence[ir.Kind],
    destinations: Sequence[ir.Place | None],
    after: Pairs,
    program: ir.Program,
) -> None:
    """Give a function one exit, and declarations.

    Parameters
    ----------
    function
        As it was read.
    kinds
        Kinds of the values that it returns.
    destinations
        Where each of them goes, None for that which is the function's own; empty for a tuple whose values go to
        arguments of their own.
    after
        What else is set as it ends.
    program
        The functions that it calls.
    """
    mark_changed(function, program)
    stored = {t.name for n in ir.parts(function.body) for t in _targets(n)}
    if not destinations:
        destinations = (None,) if len(kinds) == 1 else _outputs(function, kinds)
    function.result = next((k for k, d in zip(kinds, destinations, strict=True) if d is None), ir.NOTHING)
    body = _Exits(function, destinations, after).whole(function.body)
    for argument in function.arguments:
        if argument.name in stored and argument.kind.name != "array":
            given = argument.name
            argument.name = ir.unused(f"{given}_start", names_of(function))
            body = (ir.Assign(ir.Name(given, argument.kind), ir.Name(argument.name, argument.kind)), *body)
    outside = {a.name for a in (*function.arguments, *function.outputs)}
    function.body = _Declarations(body, outside, program).block(body, frozenset())


def _outputs(function: ir.Function, kinds: Sequence[ir.Kind]) -> list[ir.Place | None]:
    """Return the arguments to which a tuple's values go, named as the variables that are returned."""
    returns = [n.value for n in ir.parts(function.body) if isinstance(n, ir.Return)]
    taken = names_of(function)
    places = list[ir.Place | None]()
    for k, kind in enumerate(kinds):
        values = [v.values[k] for v in returns if isinstance(v, ir.Values)]
        names = [v.name for v in values if isinstance(v, ir.Name)]
        name = ir.unused(f"{names[0]}_out" if names else f"out_{k}", taken)
        taken.add(name)
        function.outputs.append(ir.Argument(name, kind, changed=True))
        places.append(ir.Name(name, kind))
    return places


def at_once(
    pairs: Sequence[tuple[ir.Place, ir.Expression]], temporary: Callable[[ir.Kind], ir.Name]
) -> Iterator[ir.Assign]:
    """Yield assignments that happen together one after another, so that none reads what another has changed."""
    if _may_meet(pairs):
        kept_values = [(target, temporary(value.kind), value) for target, value in pairs]
        yield from (ir.Assign(kept, value) for _, kept, value in kept_values)
        yield from (ir.Assign(target, kept) for target, kept, _ in kept_values)
        return
    left = [(t, v) for t, v in pairs if t != v]
    while left:
        free = [t for t, _ in left if not any(t in ir.parts(v) for u, v in left if u != t)]
        if free:
            yield from (ir.Assign(t, v) for t, v in left if t == free[0])
            left = [(t, v) for t, v in left if t != free[0]]
        else:
            target, value = left[0]
            kept = temporary(value.kind)
            yield ir.Assign(kept, value)
            left[0] = target, kept
            # what was to be read before it changes is now read from elsewhere
            left = left[1:] + left[:1]


def _may_meet(pairs: Pairs) -> bool:
    """Return whether it is known only as it runs which elements of an array several assignments set and read."""
    arrays = {_array_of(t) for t, _ in pairs if isinstance(t, ir.Subscript)}
    mentioned = list(ir.parts(tuple(pairs)))
    places = [p for p in mentioned if isinstance(p, ir.Subscript) and _array_of(p) in arrays]
    handed = (v for p in mentioned if isinstance(p, ir.Call) for v in p.values)
    varied = any(not isinstance(p.index, ir.Literal) for p in places)
    return len(pairs) > 1 and (varied or any(v in arrays for v in handed))


def _array_of(place: ir.Expression) -> ir.Expression:
    """Return the array of which a place is an element."""
    return _array_of(place.value) if isinstance(place, ir.Subscript) else place


class _Exits:
    """Gives a function one exit: its returns leave their values where they belong, what follows them is skipped.

    Parameters
    ----------
    function
        As it was read.
    destinations, after
        As of ``shape``.
    """

    def __init__(self, function: ir.Function, destinations: Sequence[ir.Place | None], after: Pairs) -> None:
        self.destinations, self.after, self.flagged = destinations, list(after), False
        self.taken, self.count = names_of(function), 0
        self.result = ir.Name(ir.unused("result", self.taken), function.result)
        self.done = ir.Name(ir.unused("done", self.taken), ir.BOOL)

    def whole(self, body: ir.Block) -> ir.Block:
        """Return a function's body with its one return at the end."""
        if body and isinstance(body[-1], ir.Return) and not any(isinstance(p, ir.Return) for p in ir.parts(body[:-1])):
            return (*body[:-1], *self.last(body[-1].value))
        made = self.block(body, True, False)
        start: list[ir.Statement] = [ir.Assign(self.done, ir.Literal("0", ir.BOOL))] if self.flagged else []
        return (*start, *made, *([ir.Return(self.result)] if self.result.kind != ir.NOTHING else []))

    def block(self, block: ir.Block, tail: bool, loop: bool) -> ir.Block:
        """Return a block, after which the function ends if it is its ``tail``, or which stands in a ``loop``."""
        for k, statement in enumerate(block):
            before, rest = block[:k], block[k + 1 :]
            if isinstance(statement, ir.Return):
                marks: list[ir.Statement] = [] if tail else [ir.Assign(self.done, ir.Literal("1", ir.BOOL))]
                self.flagged = self.flagged or not tail
                return (*before, *self.left(statement.value), *marks, *([ir.Leave("break")] if loop else []))
            if not any(isinstance(p, ir.Return) for p in ir.parts(statement)):
                continue
            if isinstance(statement, ir.If) and rest and _always(statement.then):
                statement, rest = replace(statement, other=(*statement.other, *rest)), ()
            elif isinstance(statement, ir.If) and rest and _always(statement.other):
                statement, rest = replace(statement, then=(*statement.then, *rest)), ()
            inner = isinstance(statement, ir.For | ir.While)
            inside = [self.block(b, tail and not rest and not inner, inner or loop) for b in ir.blocks_of(statement)]
            following = self.block(rest, tail, loop)
            if inner and loop:
                # the loop around it ends too
                following = (ir.If(self.done, (ir.Leave("break"),)), *following)
            elif following and not loop:
                following = (ir.If(ir.Unary("not", self.done, ir.BOOL), following),)
            return (*before, ir.with_blocks(statement, inside), *following)
        return block

    def pairs(self, value: ir.Expression) -> list[tuple[ir.Place | None, ir.Expression]]:
        """Return the place of each value that a function returns."""
        values = flat(value) if len(self.destinations) > 1 else [value]
        return [*zip(self.destinations, values, strict=True), *self.after]

    def left(self, value: ir.Expression) -> Iterator[ir.Statement]:
        """Yield assignments of the values to their places."""
        yield from at_once([(d or self.result, v) for d, v in self.pairs(value)], self.kept)

    def last(self, value: ir.Expression) -> Iterator[ir.Statement]:
        """Yield the same with a return."""
        pairs = self.pairs(value)
        own = [v for d, v in pairs if d is None]
        others = [(d, v) for d, v in pairs if d is not None]
        read = [d for d, _ in others if own and d in ir.parts(own[0])]
        if others and own and (read or any(isinstance(p, ir.Call) for p in ir.parts(own[0]))):
            yield from self.left(value)
            yield ir.Return(self.result)
        else:
            yield from at_once(others, self.kept)
            yield from (ir.Return(v) for v in own)

    def kept(self, kind: ir.Kind) -> ir.Name:
        """Return a new variable."""
        self.count += 1
        return ir.Name(ir.unused(f"kept_{self.count}", self.taken), kind)


def names_of(function: ir.Function) -> set[str]:
    """Return the names that a function's arguments, outputs and variables have."""
    return {*(a.name for a in (*function.arguments, *function.outputs)), *ir.names_in(function.body)}


def flat(value: ir.Expression) -> list[ir.Expression]:
    """Return the values of tuples inside one another."""
    return [one for item in value.values for one in flat(item)] if isinstance(value, ir.Values) else [value]


def _always(block: ir.Block) -> bool:
    """Return whether a block ends the function whatever happens."""
    for statement in block:
        if isinstance(statement, ir.Return):
            return True
        if isinstance(statement, ir.If) and _always(statement.then) and _always(statement.other):
            return True
    return False


def changed_in(body: ir.Block, program: ir.Program) -> set[str]:
    """Return the arrays that statements change, by themselves or by what they call."""
    found = set[str]()
    for node in ir.parts(body):
        if isinstance(node, ir.Assign) and isinstance(node.target, ir.Subscript):
            place: ir.Expression = node.target
            while isinstance(place, ir.Subscript | ir.Member):
                place = place.value
            assert isinstance(place, ir.Name)
            found.add(place.name)
        if isinstance(node, ir.Call) and node.own:
            arguments = program.functions[node.name].arguments
            changed = (v for a, v in zip(arguments, node.values, strict=True) if a.changed)
            found |= {v.name for v in changed if isinstance(v, ir.Name)}
    return found


def mark_changed(function: ir.Function, program: ir.Program) -> None:
    """Mark the arrays among a function's arguments that it changes."""
    changed = changed_in(function.body, program)
    for argument in function.arguments:
        argument.changed = argument.changed or argument.name in changed


def _targets(node: object) -> list[ir.Name]:
    """Return the variables that a statement sets."""
    if isinstance(node, ir.Assign):
        return [node.target] if isinstance(node.target, ir.Name) else []
    return [t for t in node.targets if isinstance(t, ir.Name)] if isinstance(node, ir.CallStatement) else []


class _Declarations:
    """Declares variables in the innermost block that has all of their uses.

    Parameters
    ----------
    body
        The function's body.
    outside
        Names of its arguments.
    program
        The functions that it calls.
    """

    def __init__(self, body: ir.Block, outside: set[str], program: ir.Program) -> None:
        self.kinds: dict[str, ir.Kind] = {}
        self.program = program
        for node in ir.parts(body):
            for target in _targets(node):
                if target.name not in outside:
                    self.kinds.setdefault(target.name, target.kind)

    def sets(self, name: str, block: ir.Block) -> int:
        """Return the count of a block's assignments to a variable; what a call fills in or changes is no constant."""
        changed = name in changed_in(block, self.program) or any(
            isinstance(n, ir.CallStatement) and name in [t.name for t in n.targets] for n in ir.parts(block)
        )
        return 2 * changed + sum(t.name == name for n in ir.parts(block) for t in _targets(n))

    def block(self, block: ir.Block, known: frozenset[str]) -> ir.Block:
        """Return a block with the declarations of what begins in it."""
        mentions = [set(ir.names_in(s)) for s in block]
        out = list[ir.Statement]()
        for k, statement in enumerate(block):
            for name in sorted(mentions[k] - known, key=ir.names_in(statement).index):
                if name not in self.kinds or self._inside(name, statement, mentions, k):
                    continue
                known |= {name}
                own = isinstance(statement, ir.Assign) and statement.target == ir.Name(name, self.kinds[name])
                if own and name not in ir.names_in(statement.value):  # type: ignore[union-attr]
                    constant = self.sets(name, block[k:]) == 1
                    statement = ir.Declare(name, self.kinds[name], statement.value, constant)  # type: ignore[union-attr]
                else:
                    out.append(ir.Declare(name, self.kinds[name]))
            blocks = [self.block(b, known) for b in ir.blocks_of(statement)]
            out.append(ir.with_blocks(statement, blocks))
        return tuple(out)

    @staticmethod
    def _inside(name: str, statement: ir.Statement, mentions: list[set[str]], k: int) -> bool:
        """Return whether a variable lives in the blocks of one statement alone, and begins again in each of them."""
        blocks = ir.blocks_of(statement)
        if not blocks or any(name in later for later in mentions[k + 1 :]):
            return False
        head = [getattr(statement, a) for a in ("condition", "start", "stop") if hasattr(statement, a)]
        if any(name in ir.names_in(h) for h in head):
            return False
        return all(_first(name, b) != "read" for b in blocks)


def _first(name: str, block: ir.Block) -> str:
    """Return the first use of a variable in a block: ``written``, ``read``, ``maybe`` written or ``untouched``."""
    state = "untouched"
    for statement in block:
        if name not in ir.names_in(statement):
            continue
        if state == "maybe":
            return "read"
        if isinstance(statement, ir.Assign):
            if name in ir.names_in(statement.value):
                return "read"
            state = "written" if isinstance(statement.target, ir.Name) else "read"
        elif isinstance(statement, ir.CallStatement):
            state = "read" if name in ir.names_in(statement.call) else "written"
        elif isinstance(statement, ir.If):
            if name in ir.names_in(statement.condition):
                return "read"
            ends = {_first(name, b) for b in ir.blocks_of(statement)}
            state = "read" if "read" in ends else "written" if ends == {"written"} else "maybe"
        elif isinstance(statement, ir.For | ir.While):
            heads = [getattr(statement, a) for a in ("condition", "start", "stop") if hasattr(statement, a)]
            inside = _first(name, statement.body)
            state = "read" if inside == "read" or any(name in ir.names_in(h) for h in heads) else "maybe"
        else:
            state = "read"
        if state != "maybe":
            return state
    return state
