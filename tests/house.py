"""Figures of the code itself: its size, its names and its sentences.

``python -m tests.house`` prints them; ``python -m tests.house NAME`` lists the places behind one of them.
``test_house.py`` holds each at or below its ceiling.
"""

import ast
import io
import re
import sys
import tokenize
from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import mrfit
from tests.test_layers import imported, layer_of, modules, nodes

PACKAGE = Path(mrfit.__path__[0])
TESTS = PACKAGE.parent / "tests"
SILENT = {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
CLAUSE = re.compile(
    r"(?:(?:Return|Yield|Say|Tell|Show|Print|Write|Give|Read|Find|Make|Take|Note|Keep|Measure|Compute|Set) )?"
    r"(?:what|where|how|why|when|who|whose|which|whatever|wherever)\b(?!-)",
    re.IGNORECASE,
)
PARTICIPLE = re.compile(r"[A-Z][a-z]*(?:ed|ing)")
# participles of irregular verbs
IRREGULAR = set(
    "Been Begun Bent Bound Bought Broken Brought Built Chosen Cut Done Drawn Driven Fallen Fed Felt Found "
    "Given Gone Grown Heard Held Hidden Kept Known Laid Led Left Lent Lost Made Meant Met Paid Put Read "
    "Run Said Seen Sent Set Shown Shut Sought Spent Split Stood Sunk Swept Taken Taught Thought Told Torn "
    "Understood Won Worn Written".split()
)
# words of the same form that name a thing
NOUNS = set("Bed Bearing Drawing Finding Heading Recording Ring Seed Setting Speed Spring String Timing".split())
Place = tuple[str, int, str]
Function = ast.FunctionDef | ast.AsyncFunctionDef


def trees() -> list[tuple[str, ast.Module]]:
    """Return the path of every module from the folder above the package, and its syntax tree."""
    return [(f"{PACKAGE.name}/{name}", tree) for name, tree in modules()]


def documented(tree: ast.AST) -> Iterator[tuple[ast.AST, ast.Expr, str]]:
    """Yield every node with a docstring, the statement that holds it, and its text."""
    for node in nodes(tree):
        if isinstance(node, ast.Module | ast.ClassDef | Function) and node.body:
            first = node.body[0]
            if isinstance(first, ast.Expr) and isinstance(first.value, ast.Constant):
                if isinstance(first.value.value, str):
                    yield node, first, first.value.value


def code_lines(text: str) -> int:
    """Count the lines of a module that are no blank line, comment or docstring."""
    lines = {
        line
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in SILENT
        for line in range(token.start[0], token.end[0] + 1)
    }
    for _, statement, _ in documented(ast.parse(text)):
        lines -= set(range(statement.lineno, (statement.end_lineno or 0) + 1))
    return len(lines)


@cache
def size_of(root: Path) -> int:
    return sum(code_lines(p.read_text(encoding="utf-8")) for p in sorted(root.rglob("*.py")))


def relative_clauses(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Yield the docstrings that begin with a relative clause, or with a verb and one."""
    for _, statement, text in documented(tree):
        if CLAUSE.match(text.lstrip()):
            yield statement.lineno, text.strip().splitlines()[0]


def is_participle(name: str) -> bool:
    """Return whether the name of a class is a participle and nothing else."""
    word = name.lstrip("_")
    return word not in NOUNS and (word in IRREGULAR or PARTICIPLE.fullmatch(word) is not None)


def class_definitions() -> list[Place]:
    """Return every class of the package outside the schemas of files."""
    return [
        (name, node.lineno, node.name)
        for name, tree in trees()
        if "/io/schemas/" not in name
        for node in nodes(tree)
        if isinstance(node, ast.ClassDef)
    ]


def repeated_classes() -> list[Place]:
    """Return the class names that have more than one definition, each where it is first defined."""
    found = defaultdict(list)
    for name, line, title in class_definitions():
        found[title].append((name, line, title))
    return [
        (*places[0][:2], f"{title}: also {', '.join(p for p, _, _ in places[1:])}")
        for title, places in sorted(found.items())
        if len(places) > 1
    ]


def constants(tree: ast.Module) -> Iterator[tuple[int, str, str]]:
    """Yield line, name and value of every public constant of a module."""
    for node in tree.body:
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        if not isinstance(node, ast.Assign | ast.AnnAssign) or node.value is None:
            continue
        for target in targets:
            names = target.elts if isinstance(target, ast.Tuple) else [target]
            several = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
            values = node.value.elts if several and isinstance(node.value, ast.Tuple) else [node.value] * len(names)
            for one, value in zip(names, values, strict=False):
                if isinstance(one, ast.Name) and re.fullmatch(r"[A-Z][A-Z0-9_]*", one.id):
                    yield node.lineno, one.id, ast.unparse(value)


# What every module of a kind declares, as docs/plugins.md says
DECLARED = {"LATE", "OWN", "REDUCED", "ROLES", "SPEC"}


def ambiguous_constants() -> list[Place]:
    """Return the names of public constants that have another value elsewhere, each where it is first defined."""
    found = defaultdict(list)
    for name, tree in trees():
        for line, title, value in constants(tree):
            found[title].append((name, line, value))
    return [
        (*places[0][:2], f"{title}: " + "; ".join(f"{value[:40]} in {name}" for name, _, value in places))
        for title, places in sorted(found.items())
        if title not in DECLARED and len({value for *_, value in places}) > 1
    ]


def module_imports() -> dict[str, set[str]]:
    """Return for every module the modules of the package it imports, in functions and for types as well."""
    known = {n.removesuffix(".py").replace("/", ".").removesuffix(".__init__"): tree for n, tree in trees()}
    found: dict[str, set[str]] = {}
    for name, tree in known.items():
        found[name] = set()
        for node in nodes(tree):
            if isinstance(node, ast.ImportFrom) and node.module in known:
                inside = {f"{node.module}.{a.name}" for a in node.names}
                found[name] |= {m for m in inside if m in known} or {node.module}
            elif isinstance(node, ast.Import):
                found[name] |= {a.name for a in node.names if a.name in known}
        # `import mrfit` gives what users call: it imports when asked
        found[name] -= {name, "mrfit"}
    return found


def climbing_imports() -> list[Place]:
    """Return the imports from a room above, in functions and for types as well."""
    return [
        (name, 1, f"imports mrfit.{other}")
        for name, tree in trees()
        if (own := name.split("/")[1].removesuffix(".py")) != "__init__"
        for other in sorted(imported(tree))
        if layer_of(other) > layer_of(own)
    ]


def import_cycles() -> list[Place]:
    """Return a module of every set of modules that import each other, with the others of it (Tarjan 1972)."""
    graph = module_imports()
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    cycles: list[Place] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in sorted(graph[node]):
            if other not in index:
                visit(other)
            if other in stack:
                low[node] = min(low[node], low[other])
        if low[node] == index[node]:
            members = stack[stack.index(node) :]
            del stack[stack.index(node) :]
            if len(members) > 1:
                cycles.append((members[0], 1, " -> ".join(members[1:])))

    for name in sorted(graph):
        if name not in index:
            visit(name)
    return cycles


def functions_with_many_arguments(most: int = 6) -> list[Place]:
    """Return the functions with more arguments than ``most``.

    ``self`` does not count, nor do the options of commands and the symbols that a model's ``law`` takes by protocol.
    """
    found = []
    for name, tree in trees():
        if "/cli/" in name:
            continue
        for node in nodes(tree):
            if isinstance(node, Function) and not ("/models/" in name and node.name == "law"):
                named = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
                count = len([a for k, a in enumerate(named) if k or a not in ("self", "cls")])
                if count > most:
                    found.append((name, node.lineno, f"{node.name} has {count}"))
    return found


def opening_clauses() -> list[Place]:
    return [(name, line, text) for name, tree in trees() for line, text in relative_clauses(tree)]


def participles() -> list[Place]:
    return [place for place in class_definitions() if is_participle(place[2])]


LISTS: dict[str, Callable[[], list[Place]]] = {
    "repeated classes": repeated_classes,
    "participles": participles,
    "ambiguous constants": ambiguous_constants,
    "relative clauses": opening_clauses,
    "climbing imports": climbing_imports,
    "cycles": import_cycles,
    "many arguments": functions_with_many_arguments,
}


def figures() -> dict[str, float]:
    """Return every figure under its name; those of ``LISTS`` are counts of places."""
    docstrings = sum(1 for _, tree in trees() for _ in documented(tree))
    counts = {name: float(len(places())) for name, places in LISTS.items()}
    return {
        "code lines": float(size_of(PACKAGE)),
        **counts,
        "relative clauses, share": counts["relative clauses"] / docstrings,
        "test code : code": size_of(TESTS) / size_of(PACKAGE),
    }


def main(arguments: list[str]) -> None:
    if not arguments:
        for name, value in figures().items():
            print(f"{name:26}{value:10.3f}" if "share" in name or ":" in name else f"{name:26}{value:10.0f}")
    for path, line, text in LISTS[" ".join(arguments)]() if arguments else ():
        print(f"{path}:{line}: {text}")


if __name__ == "__main__":
    main(sys.argv[1:])
