"""A stage is done again where what it reads, its settings or the code it uses has changed, and not otherwise."""

import ast
from pathlib import Path

import pytest

import mrfit.io.keys
from mrfit.io.keys import ROOMS, code_version, sources

PACKAGE = Path(mrfit.io.keys.__file__).parents[1]


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


@pytest.mark.parametrize("stage", ROOMS)
def test_all_code_a_stage_uses_is_in_its_keys(stage: str) -> None:
    starts = sources(stage)
    used = set().union(*(needed(p) for p in starts))
    assert used <= set(sources(stage)), f"add to ROOMS: {sorted(map(str, used - set(sources(stage))))}"


def test_what_only_shows_results_is_in_no_key() -> None:
    for stage in ROOMS:
        names = {str(p.relative_to(PACKAGE)) for p in sources(stage)}
        assert not [n for n in names if n.startswith(("report/", "compare/", "cli/"))]
    assert "fit/stage.py" not in {str(p.relative_to(PACKAGE)) for p in sources("segment")}
    assert {str(p.relative_to(PACKAGE)) for p in sources()} >= {"report/page.py", "cli/main.py"}


def test_an_edit_changes_the_keys_of_the_stages_that_use_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {stage: code_version(stage) for stage in ROOMS}
    read = Path.read_bytes

    def edited(path: Path) -> bytes:
        return read(path) + (b"\n# edited" if path.parts[-2:] == ("flux", "integral.py") else b"")

    monkeypatch.setattr(Path, "read_bytes", edited)
    code_version.cache_clear()
    try:
        assert {s for s in ROOMS if code_version(s) != versions[s]} == {"flux"}
    finally:
        monkeypatch.undo()
        code_version.cache_clear()
