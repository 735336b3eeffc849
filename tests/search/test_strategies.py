"""Strategies are found by name in one place, and nowhere is a search chosen by comparing a name."""

import ast
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

import mrfit
from mrfit.cli import output
from mrfit.core import registry
from mrfit.errors import ConfigError
from mrfit.fit import stage as fit_stage
from mrfit.search import chain
from mrfit.search.auto import Auto
from mrfit.search.chain import OptimizerChain
from mrfit.search.staged import StagedIdentification
from mrfit.search.strategies import REGISTERED_STRATEGIES, Strategy, find, specs
from tests.test_layers import modules

PACKAGE = Path(mrfit.__path__[0])
# What may search, and nothing but ``search.run`` for it
CALLERS = ("fit/", "discover/", "compare/", "apply/", "report/", "cli/")


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("auto", Auto()),
        ("staged", StagedIdentification("staged")),
        ("staged-lsq", StagedIdentification("staged-lsq")),
        # in a chain `auto` is one optimizer of several
        ("auto-lsq", OptimizerChain("auto-lsq")),
        ("pso-auto", OptimizerChain("pso-auto")),
        ("multistart", OptimizerChain("multistart")),
        ("pso-fmin", OptimizerChain("pso-fmin")),
    ],
)
def test_a_name_means_one_strategy(name: str, kind: Strategy) -> None:
    assert find(name) == kind


def test_options_reach_the_optimizers_of_a_chain() -> None:
    given = (("population", 12.0),)
    assert find("woa-lsq", given) == OptimizerChain("woa-lsq", given)
    assert find("woa-lsq", given).budget(3) == 12 * 800 + 200 * 4
    assert find("staged-woa", given).budget(3) == 12 * 800 + 200 * 4


@pytest.mark.parametrize(
    ("name", "message"),
    [("atuo", "unknown optimizer 'atuo': did you mean auto"), ("pso--lsq", "empty part"), ("lsq-points", "is a start")],
)
def test_a_wrong_name_is_told_with_what_there_is(name: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        find(name)


def test_what_a_strategy_is_in_a_chain_is_an_optimizer() -> None:
    assert set(chain.STRATEGY_PARTS) == set(REGISTERED_STRATEGIES)
    assert set(chain.STRATEGY_PARTS.values()) <= set(registry.names("optimizer"))
    assert not set(REGISTERED_STRATEGIES) & set(registry.names("optimizer"))


def test_every_strategy_and_optimizer_describes_itself() -> None:
    assert list(specs()) == sorted({*REGISTERED_STRATEGIES, *registry.names("optimizer")}) == chain.names()
    for name, spec in specs().items():
        assert spec.name == name and spec.title and spec.reference
        assert find(name).budget(3) > 0


def test_only_starts_are_read_off_the_data_and_only_some_strategies_use_several() -> None:
    assert [n for n in specs() if find(n).from_points] == ["points"]
    assert find("points-lsq").from_points and not find("pso-lsq").from_points
    assert [n for n in specs() if find(n).from_means] == ["means"] and find("means-lsq").from_means
    assert [n for n in specs() if find(n).many_starts] == ["auto"]


def asked_for_by_name(tree: ast.AST) -> list[str]:
    """Return the comparisons in a syntax tree with a strategy's or an optimizer's name.

    A name is written out, or the one that a module says of itself (``staged.NAME``, ``auto.SPEC.name``). The word
    ``auto`` is a resistance's, an order's and a hold-out's as well: it counts beside what tells of a search.
    """
    known, own = set(chain.names()), re.compile(r"\b(?:\w+\.)?(?:NAME|SPEC\.name)\b")
    found = []
    for node in ast.walk(tree):
        if isinstance(node, (ast.Compare, ast.Match)) or (
            isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in STRING_TESTS
        ):
            inner = list(ast.walk(node))
            words = {n.value for n in inner if isinstance(n, ast.Constant) and isinstance(n.value, str)} & known
            names = {
                n.id if isinstance(n, ast.Name) else n.attr for n in inner if isinstance(n, (ast.Name, ast.Attribute))
            }
            if not words and not names & {"NAME", "SPEC"}:
                continue  # to write a node out takes far longer
            written = ast.unparse(node)
            of_search = re.search(r"opt|strateg|search|chain|part|step|link", written)
            if words - {"auto"} or (words or own.search(written)) and of_search:
                found.append(written)
    return found


STRING_TESTS = ("startswith", "endswith", "removeprefix", "removesuffix", "count", "index", "find", "get")


def test_no_strategy_and_no_optimizer_is_asked_for_by_its_name() -> None:
    assert {name: found for name, tree in modules() if (found := asked_for_by_name(tree))} == {}


@pytest.mark.parametrize(
    ("code", "seen"),
    [
        ('if optimizer == "points": pass', True),
        ("if staged.NAME in chain.parts(name): pass", True),
        ("return [w] if optimizer == NAME else []", True),
        ('if settings.optimizer != "auto": pass', True),
        ('chosen = name in ("pso", "woa")', True),
        ('if optimizer.startswith("staged"): pass', True),
        ("match optimizer:\n    case 'lsq': pass", True),
        ('if settings.resistance == "auto": pass', False),
        ('SPEC = OptimizerSpec(name="points")', False),
        ('step = OptimizerChain("multistart")', False),
        ("if strategy.begins_with: pass", False),
    ],
)
def test_a_comparison_with_a_name_is_seen_and_nothing_else(code: str, seen: bool) -> None:
    assert bool(asked_for_by_name(ast.parse(code))) == seen


def test_strategies_say_what_they_begin_with_and_whether_they_search() -> None:
    assert {n for n in specs() if not find(n).searches} == {"means", "points"} and find("points-lsq").searches
    assert {n: find(n).begins_with for n in (*specs(), "staged-lsq") if find(n).begins_with} == {
        "means": "fits of the conditions",
        "staged": "stages",
        "staged-lsq": "stages",
    }


def test_a_start_of_a_plugin_is_treated_as_the_built_in_one(monkeypatch: pytest.MonkeyPatch) -> None:
    points = registry.load("optimizer", "points")
    other = SimpleNamespace(SPEC=replace(points.SPEC, name="corners"), minimise=points.minimise)
    names, load = registry.names, registry.load
    monkeypatch.setattr(registry, "names", lambda kind: sorted([*names(kind), "corners"]))
    monkeypatch.setattr(registry, "load", lambda kind, name: other if name == "corners" else load(kind, name))
    assert find("corners").from_points and not find("corners").searches and find("corners-lsq").searches
    (said,) = fit_stage._no_search_warnings(find("corners"), "corners")
    assert said.kind == "no-search" and "corners-lsq searches on" in said.text
    assert fit_stage._no_search_warnings(find("corners-lsq"), "corners-lsq") == []


def test_a_strategy_refuses_what_it_cannot_be_used_for() -> None:
    find("auto").check("bingham", "condition")
    find("pso-lsq").check("bingham", "condition")
    find("staged").check("hammerstein-wiener", "all")
    for model, per, message in (("bingham", "all", "no stages"), ("hammerstein-wiener", "condition", "add --per all")):
        with pytest.raises(ConfigError, match=f"--opt staged-lsq.*{message}"):
            find("staged-lsq").check(model, per)


def test_rooms_above_the_search_enter_it_by_its_one_door() -> None:
    """No room above makes an objective or runs an optimizer, and none reaches into a strategy."""
    for source, tree in modules():
        if source.startswith(CALLERS):
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom) and node.module:
                    names = {a.name for a in node.names}
                    assert node.module != "mrfit.optimizers.cost.objective" or not names & {"Objective"}, source
                    inner = {"coarse_to_fine", "reparametrised", "variable_projection"}
                    assert node.module.rpartition(".")[2] not in inner, source
                    assert node.module != "mrfit.search" or not names & inner, source
                if isinstance(node, ast.Call):
                    called = ast.unparse(node.func)
                    assert called not in ("chain.run", "chain.run_steps", "strategy.search"), f"{source}: {called}"


def test_the_objective_is_written_by_itself_alone() -> None:
    """What it counts and remembers is its own: nobody else sets a field of an objective."""
    for source, tree in modules():
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
                owner = ast.unparse(node.value)
                assert owner not in ("objective", "fine", "coarse", "self._objective"), f"{source}: {ast.unparse(node)}"


def test_the_walk_through_a_search_names_files_that_there_are() -> None:
    text = (PACKAGE.parent / "docs" / "architecture.md").read_text()
    walk = text.partition("## How a parameter vector walks through a search")[2].partition("## ")[0]
    named = re.findall(r"`((?:\w+/)?\w+\.py)`", walk)
    assert len(named) > 10
    for name in named:
        assert (PACKAGE / name).exists() or (PACKAGE / "search" / name).exists(), name


def test_the_list_of_optimizers_shows_strategies_beside_them() -> None:
    assert [row["name"] for row in output.registry_rows("optimizers")] == chain.names()
    assert (output.item("auto")["kind"], output.item("staged")["kind"]) == ("global", "local")
    assert "stages" in output.item("staged")["text"]


def test_an_optimizer_with_the_name_of_a_strategy_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "names", lambda kind: ["auto", "lsq"])
    with pytest.raises(ConfigError, match="'auto' has the name of a strategy"):
        find("lsq")
