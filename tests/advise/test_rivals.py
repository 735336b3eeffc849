"""Which models a discovery left standing."""

from typing import Any

import pytest

from mrfit.advise.rivals import NO_MORE_RIVALS, rivals_of
from mrfit.errors import DataError
from mrfit.io.schemas.discovery import DiscoveryFile


def effect(name: str, value: float, *aliases: str, **more: Any) -> dict[str, Any]:
    parameter = {"name": "p", "unit": "1", "value": value, "low": 0.0, "high": 1.0}
    errors = {"holdout_nrmse_before": 0.1, "holdout_nrmse_after": 0.01}
    return {"name": name, "parameters": [parameter], "aliases": list(aliases), **errors, **more}


def candidate(name: str, reason: str) -> dict[str, Any]:
    return {"name": name, "screen": 0.0, "holdout_gain": None, "accepted": False, "reason": reason}


def found(verdict: str, model: str = "tanh", **more: Any) -> DiscoveryFile:
    whole = {
        "schema": "mrfit/discovery/1",
        "base_model": "tanh",
        "verdict": verdict,
        "effects": [],
        "ambiguous_set": [],
        "advice": ["log more"],
        "where": [],
        "gap": {"noise_floor": 0.01, "before": 0.1, "after": 0.01, "closed": 1.0},
        "candidates": [],
        "unexplained": {"share_of_gap": 0.0},
        "augmented_model": model,
        "seed": 0,
        "data_sha256": "0",
        "key": "0",
    }
    return DiscoveryFile.of(whole | more)


def test_a_stated_set_takes_turns_in_the_place_of_the_one_that_stands():
    told = found(
        "ambiguous",
        "tanh+asymmetry+inertia",
        effects=[effect("asymmetry", 0.1)],
        ambiguous_set=["delay", "inertia"],
        suspects=[effect("inertia", 3.0), effect("delay", 0.002)],
    )
    rivals = rivals_of(told)
    assert {r.name: r.effects for r in rivals} == {
        "inertia": ("asymmetry", "inertia"),
        "delay": ("asymmetry", "delay"),
    }
    assert {r.name: dict(r.start) for r in rivals} == {"inertia": {"inertia.p": 3.0}, "delay": {"delay.p": 0.002}}
    assert not any(r.hidden for r in rivals)


def test_each_of_two_stated_sets_has_its_own_place():
    told = found("ambiguous", "tanh+current-lag+inertia", ambiguous_set=["current-lag", "gas-spring", "inertia"])
    # no model is listed twice, though each of its effects is in a set
    assert [r.effects for r in rivals_of(told)] == [("current-lag", "inertia"), ("current-lag", "gas-spring")]


def test_a_named_effect_stands_against_what_looks_like_it():
    told = found("named", "tanh+inertia", effects=[effect("inertia", 3.0, "gas-spring")])
    assert [(r.name, r.effects) for r in rivals_of(told)] == [
        ("inertia", ("inertia",)),
        ("gas-spring", ("gas-spring",)),
    ]


def test_effects_that_were_taken_back_stand_against_those_in_whose_place_they_were():
    suspects = [effect("inertia", 3.0), effect("delay", 0.001, instead_of="inertia")]
    rivals = rivals_of(found("unexplained", "tanh", suspects=suspects))
    assert [r.effects for r in rivals] == [("inertia",), ("delay",)]


def test_what_the_data_cannot_show_stands_against_nothing_more():
    told = found(
        "none",
        candidates=[
            candidate("delay", "absorbed by what the model has"),
            candidate("temperature", "cannot be judged: the temperature does not move"),
            candidate("asymmetry", "its sensitivity is not in the error"),
            candidate("of-a-plug-in-not-here", "absorbed by what the model has"),
        ],
    )
    assert [(r.name, r.effects, r.hidden) for r in rivals_of(told)] == [
        (NO_MORE_RIVALS, (), False),
        ("delay", ("delay",), True),
        ("temperature", ("temperature",), True),
    ]


def test_where_nothing_is_left_it_is_said():
    with pytest.raises(DataError, match="ended with 'none' and left no rivals"):
        rivals_of(found("none", candidates=[candidate("delay", "its sensitivity is not in the error")]))
    with pytest.raises(DataError, match="too few data for rivals: log more"):
        rivals_of(found("insufficient-data"))
