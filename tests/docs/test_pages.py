"""Every link, command and block of code of the pages is in order; `make docs` runs those that run."""

import ast
import re
import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

import mrfit
from docs.reference import commands as reference
from docs.reference.write import pages
from mrfit.core.built_in import own_names
from mrfit.search import strategies
from tests.conftest import ROOT
from tests.docs.pages import PAGES, anchors, blocks, commands, prose, text_of

KNOWN = reference.commands()
GENERATED = {ROOT / "docs" / "generated" / name: text for name, text in pages().items()}
ITEMS = {name for kind in ("model", "effect", "optimizer", "reader") for name in own_names(kind)} | {
    *strategies.REGISTERED_STRATEGIES
}
every_page = pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))


def fault_of(words: list[str]) -> str:
    """Return what is wrong with a command, empty if nothing."""
    name, rest = "mrfit", words
    while rest and f"{name} {rest[0]}" in KNOWN:
        name, rest = f"{name} {rest[0]}", rest[1:]
    if name == "mrfit" and rest and not rest[0].startswith("-"):
        return f"there is no command {rest[0]}"
    options = {o: p for p in KNOWN[name].params for o in p.opts if o.startswith("-")}
    for place, word in enumerate(rest):
        option, equals, _ = word.partition("=")
        if re.fullmatch(r"--?[a-z][\w-]*", option) and option not in (*options, "--help", "-h"):
            return f"{name} has no option {option}"
        # an option alone is spoken of, not written
        if option in options and not options[option].is_flag and not equals and 0 < place == len(rest) - 1:
            return f"{option} takes a value"
    return ""


@every_page
def test_every_link_leads_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"https?:", target):
            continue
        file, _, anchor = target.partition("#")
        where = (page.parent / file).resolve() if file else page
        assert where.exists() or where in GENERATED, f"{page.name}: {target}"
        if anchor and where in GENERATED:
            assert f"({anchor})=" in GENERATED[where], target
        elif anchor and where.suffix == ".md":
            assert anchor in anchors(where) | ITEMS, f"{page.name}: {target}"


@every_page
def test_every_command_is_one_that_mrfit_takes(page: Path) -> None:
    faults = [f"{' '.join(words)}: {fault}" for words in commands(page) if (fault := fault_of(words))]
    assert not faults


@pytest.mark.parametrize(
    ("command", "fault"),
    [
        (["fit", "--modle", "tanh"], "has no option --modle"),
        (["fix"], "there is no command fix"),
        (["apply", "track", "--wheel"], "has no option --wheel"),
        (["fit", "--model", "tanh", "--opt"], "--opt takes a value"),
        (["apply", "track", "--fit", "f", "--sine", "1:0.01"], ""),
    ],
)
def test_a_wrong_command_is_found(command: list[str], fault: str) -> None:
    found = fault_of(command)
    assert fault in found and bool(found) == bool(fault)


def test_commands_are_found_on_the_pages() -> None:
    assert sum(len(list(commands(p))) for p in PAGES) > 60


def test_the_examples_of_commands_are_ones_that_mrfit_takes() -> None:
    for name, command in KNOWN.items():
        if example := re.search(r"Example: mrfit (.+)", " ".join((command.help or "").split())):
            assert not fault_of(example[1].split(" ")), name


@every_page
def test_programs_and_targets_are_there(page: Path) -> None:
    text = text_of(page)
    for module in re.findall(r"python -m ((?:benchmarks|datasets|tests|mrfit)[\w.]*\w)", text):
        assert find_spec(module), module
    makefile = (ROOT / "Makefile").read_text()
    for target in re.findall(r"(?:^    |`)make ([a-z-]+)", text, re.MULTILINE):
        assert re.search(rf"^{target}:", makefile, re.MULTILINE), target


@every_page
def test_tables_of_toml_are_toml(page: Path) -> None:
    for block in blocks(page, "toml"):
        assert tomllib.loads(block), block


@every_page
def test_python_is_python_and_uses_what_mrfit_has(page: Path) -> None:
    for block in blocks(page, "python", "{code-cell}"):
        if block.startswith("%%sh"):
            continue
        for node in ast.walk(ast.parse(block)):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "mrfit":
                assert hasattr(mrfit, node.attr), node.attr


def test_every_page_is_in_a_table_of_contents() -> None:
    docs = ROOT / "docs"
    listed: set[Path] = set()
    for page in PAGES:
        for entries in blocks(page, "{toctree}"):
            for entry in filter(None, entries.split("\n")):
                one = [p for kind in (".md", ".ipynb") if (p := page.parent / f"{entry}{kind}").is_file()]
                found = page.parent.glob("*.md") if entry == "*" else one or [page.parent / f"{entry}.md"]
                listed |= {p.resolve() for p in found}
    written = [*PAGES, *docs.glob("tutorials/*.ipynb")]
    own = {p for p in written if docs in p.parents} | {p for p in GENERATED if p.name != "policy.md"}
    assert own - listed == {docs / "index.md"}, "name the page in a toctree, as those of docs/index.md"
    assert listed - own == set()


def test_every_file_of_a_benchmark_has_a_title_and_is_not_longer_than_a_page_can_be() -> None:
    for page in (ROOT / "docs" / "benchmarks").glob("*.md"):
        assert text_of(page).startswith("# "), page.name


def test_the_readme_is_no_longer_than_150_lines() -> None:
    assert len(text_of(ROOT / "README.md").split("\n")) <= 151


def names_in(text: str) -> Any:
    return re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE)


@pytest.mark.parametrize("kind", ["model", "effect", "optimizer", "reader"])
def test_every_item_is_on_the_page_of_its_kind(kind: Any) -> None:
    text = GENERATED[ROOT / "docs" / "generated" / f"{kind}s.md"]
    expected = [*own_names(kind)] + ([*strategies.REGISTERED_STRATEGIES] if kind == "optimizer" else [])
    assert sorted(names_in(text)) == sorted(expected)
    if kind in ("model", "effect"):
        parts = re.split(r"^\([\w-]+\)=$", text, flags=re.MULTILINE)[1:]
        assert all("```text" in part and "Source" in part and "| `" in part for part in parts)
