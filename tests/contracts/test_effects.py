"""What every effect in the registry must keep, whatever its equations."""

from dataclasses import replace
from types import ModuleType, SimpleNamespace

import pytest

from mrfit.contracts.check import Check, ContractBreach, applying
from mrfit.contracts.effects import EFFECT_CHECKS, rivals_are_told_apart
from mrfit.core import registry
from mrfit.core.built_in import own_names
from mrfit.core.protocols import SLOT_FUNCTIONS
from mrfit.core.specs import SLOTS, EffectSpec

NAMES = own_names("effect")
CASES = [(name, check) for name in NAMES for check in applying(EFFECT_CHECKS, registry.load("effect", name))]


@pytest.fixture(params=NAMES)
def effect(request: pytest.FixtureRequest) -> ModuleType:
    return registry.load("effect", request.param)


@pytest.mark.parametrize(("name", "check"), CASES, ids=[f"{name} {check.name}" for name, check in CASES])
def test_effect_keeps(name: str, check: Check) -> None:
    check.run(registry.load("effect", name))


def test_specification_is_named_after_its_file_and_says_where_it_comes_from(effect: ModuleType) -> None:
    assert effect.__name__.rsplit(".", 1)[1].replace("_", "-") == effect.SPEC.name
    assert effect.SPEC.reference


def test_effects_that_discovery_does_not_propose_say_what_they_are_mistaken_for_too(effect: ModuleType) -> None:
    rivals_are_told_apart(effect)
    with pytest.raises(ContractBreach, match="no aliases"):
        rivals_are_told_apart(SimpleNamespace(SPEC=replace(effect.SPEC, aliases=())))


def test_every_slot_and_its_function_are_documented() -> None:
    told = " ".join((EffectSpec.__doc__ or "").split())
    assert [slot for slot in SLOTS if f"- ``{slot}``: ``{SLOT_FUNCTIONS[slot]}(" not in told] == []


def test_aliases_are_mutual(effect: ModuleType) -> None:
    for alias in effect.SPEC.aliases:
        if alias in NAMES:
            others = registry.load("effect", alias).SPEC.aliases
            assert effect.SPEC.name in others, f"{alias} has to name {effect.SPEC.name} among its aliases"


def test_parameters_and_their_units_are_in_the_docstring(effect: ModuleType) -> None:
    assert "Source:" in effect.__doc__, "the docstring names its source behind 'Source:'"
    for p in effect.SPEC.params:
        assert p.name in effect.__doc__
        assert f"({p.unit}" in effect.__doc__, f"the docstring lacks '({p.unit})', the unit of {p.name}"


def test_an_effect_that_knows_time_or_temperature_may_change_within_a_record(effect: ModuleType) -> None:
    assert effect.SPEC.steady == (not {"time", "temperature"} & set(effect.SPEC.inputs))


def test_what_must_move_is_an_input(effect: ModuleType) -> None:
    assert {name for name, _ in effect.SPEC.moves} <= set(effect.SPEC.inputs)
    assert all(least > 0.0 for _, least in effect.SPEC.moves)


@pytest.mark.parametrize("name", ["free-play"])
def test_contracts_are_chosen_by_the_name_of_a_file(name: str, request: pytest.FixtureRequest) -> None:
    assert any(name.replace("-", "_") in keyword for keyword in request.node.extra_keyword_matches)
