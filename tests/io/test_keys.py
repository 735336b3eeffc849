"""A stage is done again where what it reads, its settings or the code it uses has changed, and not otherwise."""

import ast
from functools import cache
from pathlib import Path

import pytest

import mrfit.io.keys
from mrfit.io.keys import STARTS, code_version, fit_key, key_of, sources

PACKAGE = Path(mrfit.io.keys.__file__).parents[1]


@cache
def imported(path: Path) -> set[Path]:
    """Modules of the package that a file imports, at any depth of it."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mrfit"):
            names |= {node.module or "", *(f"{node.module}.{a.name}" for a in node.names)}
        elif isinstance(node, ast.Import):
            names |= {a.name for a in node.names if a.name.startswith("mrfit.")}
    found = (PACKAGE.joinpath(*name.split(".")[1:]).with_suffix(".py") for name in names if "." in name)
    return {p for p in found if p.is_file()}


def needed(start: Path) -> set[Path]:
    """All modules that a file imports, directly or through others."""
    seen, left = set[Path](), [start]
    while left:
        one = left.pop()
        if one not in seen:
            seen.add(one)
            left += imported(one)
    return seen


@pytest.mark.parametrize("stage", STARTS)
def test_the_code_in_a_stages_keys_is_what_it_imports_and_no_more(stage: str) -> None:
    starts = [p for start in STARTS[stage] for p in PACKAGE.glob(start)]
    used = set().union(*(needed(p) for p in starts))
    rooms = {p for p in sources(stage) if p.name == "__init__.py"}
    assert set(sources(stage)) - rooms == {p for p in used if p.name != "__init__.py"}
    assert len(starts) >= len(STARTS[stage])


# How a stage's code may load what it does not import
LOADED = {"model": "models", "effect": "effects", "optimizer": "optimizers", "reader": "ingest/readers"}


@pytest.mark.parametrize("stage", STARTS)
def test_what_the_registry_loads_by_name_is_in_the_keys(stage: str) -> None:
    inside = set(sources(stage))
    # keys name what is loaded, and load nothing
    text = "".join(p.read_text(encoding="utf-8") for p in inside - {PACKAGE / "io" / "keys.py"})
    for kind, folder in LOADED.items():
        if f'registry.load("{kind}"' in text or f'registry.names("{kind}"' in text:
            assert {p for p in (PACKAGE / folder).glob("*.py") if p.name != "__init__.py"} <= inside


def test_a_stage_does_not_depend_on_what_it_does_not_use() -> None:
    names = {stage: {p.relative_to(PACKAGE).as_posix() for p in sources(stage)} for stage in STARTS}
    for used in names.values():
        assert not [n for n in used if n.startswith(("report/", "compare/", "cli/"))]
    for stage in ("ingest", "flux", "segment"):
        assert not [n for n in names[stage] if n.startswith(("kernels/", "fit/", "models/", "search/"))]
    assert "core/workers.py" not in names["segment"] and "core/workers.py" in names["fit"]
    assert {"signal/cycles.py", "io/workspace.py"} <= names["segment"]
    assert names["fit"] > {"kernels/jit.py", "models/boucwen.py", "effects/delay.py", "optimizers/pso.py"}
    assert names["discover"] > names["fit"]
    assert {p.relative_to(PACKAGE).as_posix() for p in sources()} >= {"report/page.py", "cli/main.py"}


def test_an_edit_changes_the_keys_of_the_stages_that_use_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {stage: code_version(stage) for stage in STARTS}
    read = Path.read_bytes

    def edited(path: Path) -> bytes:
        return read(path) + (b"\n# edited" if path.parts[-2:] == ("flux", "integral.py") else b"")

    monkeypatch.setattr(Path, "read_bytes", edited)
    code_version.cache_clear()
    try:
        assert {s for s in STARTS if code_version(s) != versions[s]} == {"flux"}
    finally:
        monkeypatch.undo()
        code_version.cache_clear()


def test_a_key_can_be_that_of_other_code() -> None:
    assert (
        key_of(1, stage="fit") == key_of(1, stage="fit", code=code_version("fit")) != key_of(1, stage="fit", code="x")
    )
    made = fit_key({"seed": 1, "jobs": 2}, {"a": "1"}, [], "x")
    assert made == fit_key({"seed": 1, "jobs": 4}, {"a": "1"}, [], "x") != fit_key({"seed": 1}, {"a": "1"}, [])
