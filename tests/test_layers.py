"""Imports point one way, so that any file can be understood with what lies below it alone."""

import ast
from functools import cache
from pathlib import Path

import mrfit

PACKAGE = Path(mrfit.__path__[0])
# Rooms from the ground up: a room imports its own and those below
LAYERS = [
    {"errors"},
    {"core"},
    {"settings"},
    {"kernels"},
    {"io"},
    {"signal"},
    {"ingest", "flux", "segment", "models", "effects"},
    {"simulate", "driven", "measure"},
    {"optimizers"},
    {"search"},
    {"fit"},
    {"discover"},
    {"report", "export"},
    {"compare", "advise", "sheet"},
    {"batch"},
    {"api"},
    {"apply", "drift", "track"},
    {"cli", "contracts"},
]
STAGES = {"ingest", "flux", "segment", "fit", "report"}


@cache
def modules() -> list[tuple[str, ast.Module]]:
    return [
        (p.relative_to(PACKAGE).as_posix(), ast.parse(p.read_text(encoding="utf-8")))
        for p in sorted(PACKAGE.rglob("*.py"))
    ]


@cache
def nodes(tree: ast.AST) -> list[ast.AST]:
    """Return the nodes of a syntax tree; the tests go through them many times."""
    return list(ast.walk(tree))


def layer_of(name: str) -> int:
    return next(k for k, layer in enumerate(LAYERS) if name in layer)


@cache
def imported(tree: ast.Module) -> set[str]:
    found = set()
    for node in nodes(tree):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("mrfit"):
            parts = node.module.split(".")
            found |= {parts[1]} if len(parts) > 1 else {a.name for a in node.names}
        elif isinstance(node, ast.Import):
            found |= {a.name.split(".")[1] for a in node.names if a.name.startswith("mrfit.")}
    return found


def test_imports_point_down_the_layers_only() -> None:
    for name, tree in modules():
        own = name.split("/")[0].removesuffix(".py")
        if own == "__init__":
            continue
        for other in imported(tree):
            assert layer_of(other) <= layer_of(own), f"{name} imports mrfit.{other} from a layer above"


def test_stages_do_not_import_each_other() -> None:
    for name, tree in modules():
        own = name.split("/")[0]
        if own in STAGES:
            assert not imported(tree) & (STAGES - {own}), f"{name} imports another stage"


def test_packages_re_export_nothing() -> None:
    for name, tree in modules():
        # what `import mrfit` gives is named in the package's own
        if name.endswith("/__init__.py"):
            assert not tree.body, f"{name} must stay empty"


def test_numba_is_imported_in_one_place() -> None:
    for name, tree in modules():
        names = {
            a.name.split(".")[0] if isinstance(node, ast.Import) else (node.module or "").split(".")[0]
            for node in nodes(tree)
            if isinstance(node, (ast.Import, ast.ImportFrom))
            for a in node.names
        }
        assert "numba" not in names or name == "kernels/jit.py"


def test_functions_and_files_stay_small() -> None:
    for name, tree in modules():
        source = (PACKAGE / name).read_text()
        assert source.count("\n") <= 600, f"{name} has more than 600 lines"
        for node in nodes(tree):
            if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
                size = (node.end_lineno or 0) - node.lineno + 1
                assert size <= 90, f"{name}: {node.name} has {size} lines"
