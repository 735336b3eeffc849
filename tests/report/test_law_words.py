"""Sentences on the law and on effects beside it: each is said where its reason holds, and not elsewhere."""

from typing import Any

import pytest

from mrfit.report.condition_names import differing_parts, spaced
from mrfit.report.law_words import (
    broken_words,
    law_sentences,
    left_besides,
    listed,
    nearer_law,
    other_base_sentences,
    other_law_sentences,
)
from tests.report.test_discovery import FOUND, NONE, OPEN, UNEXPLAINED, typed

LAW = {"model": "guo", "holdout_nrmse": 0.01, "takes": 0.91, "command": "mrfit discover --model guo"}
GAP = {"error": 0.054, "share": 0.96, "effects": 0.03, "rest": 0.01, "left": 0.006, "taken": 0.99}


def said(**given: Any) -> str:
    return " ".join(law_sentences(typed(OPEN | given)))


def test_a_law_that_errs_is_told_with_its_share_and_what_none_makes() -> None:
    text = said()
    assert "bingham itself errs by 5.40 % of the range, 96 % of its gap, most of all within 1.6 mm" in text
    assert "of which gas-spring takes 99 %" in text
    assert "as long as it forgets within 3 mm of travel" in text


def test_nothing_is_said_where_nothing_is_missing() -> None:
    assert law_sentences(typed(NONE)) == []


def test_a_law_that_takes_little_is_not_spoken_of_unless_effects_are_held() -> None:
    small = {"law_gap": GAP | {"share": 0.1}}
    assert "errs by" in said(**small)
    assert "errs by" not in said(**small, held=[])
    assert "errs by" not in " ".join(law_sentences(typed(UNEXPLAINED | small)))
    assert "errs by" in " ".join(law_sentences(typed(UNEXPLAINED | {"law_gap": GAP})))


def test_without_an_effect_what_is_left_is_more_than_noise_or_not() -> None:
    alone = UNEXPLAINED | {"law_gap": GAP}
    for left, more in ((0.05, True), (0.011, False)):
        found = typed(alone | {"law_gap": GAP | {"left": left}, "gap": FOUND["gap"]})
        assert left_besides(found) is more
        assert ("something else is missing, too" in " ".join(law_sentences(found))) is more
    assert not left_besides(typed(alone | {"gap": FOUND["gap"] | {"noise_floor": None}}))
    assert not left_besides(typed(FOUND))


def test_what_the_law_could_have_as_well_is_named_beside_an_effect_alone() -> None:
    assert "Stribeck cannot be told from the law here." in said()
    other = [{"name": "stribeck", "reason": "the data are too few", "test": "slow strokes"}]
    assert "cannot be told from the law" not in said(confounded=other)


def test_an_invariance_that_something_breaks_is_described() -> None:
    broken = [{"invariance": "position", "share": 0.5, "kept": 0.4, "size": 0.1}]
    examined = OPEN["invariance"] | {"broken": broken}
    text = said(invariance=examined)
    assert "Something depends on the place in the stroke, which no effect of the library describes: 40 %" in text
    assert "of what the effects named leave" in text
    assert "of what no law makes" in said(invariance=examined | {"named": []})


def test_an_effect_is_told_with_its_set_its_force_and_its_condition() -> None:
    ends = {"unit": "N/m", "low": 8940.0, "high": 9120.0}
    named = OPEN["invariance"]["named"][0] | {
        "one_of": ["end-stop", "inertia"],
        "parameters": [{"name": "k_g", "value": 9030.0, **ends}, {"name": "open", "value": 1.0, **ends, "low": None}],
        "force": {"name": "force", "unit": "N", "value": 90.0, "low": 89.0, "high": 91.0},
        "tier": "causal",
    }
    text = said(invariance=OPEN["invariance"] | {"named": [named]})
    assert "(gas-spring), or end-stop or inertia, which these data cannot tell from it without a law" in text
    assert "k_g = " in text and "open = " not in text and "at most 90.0 ± 1.0 N" in text
    assert "as long as it is made by the motion so far" in text
    assert "whatever the law is." in said(invariance=OPEN["invariance"] | {"named": [named | {"tier": "any-law"}]})


@pytest.mark.parametrize(("verdict", "nearer"), [("unexplained", True), ("ambiguous", True), ("named", False)])
def test_another_law_is_gone_on_from_only_where_nothing_is_certain(verdict: str, nearer: bool) -> None:
    found = typed(FOUND | {"verdict": verdict, "other_laws": [LAW]})
    assert (nearer_law(found) is not None) is nearer
    assert nearer_law(typed(FOUND | {"verdict": verdict})) is None


def test_other_laws_with_their_shares_and_commands() -> None:
    plain, *rest = other_law_sentences(typed(FOUND | {"other_laws": [LAW]}))
    assert plain == "guo takes 91 % of the gap on held-out conditions: mrfit discover --model guo" and not rest
    full = LAW | {"takes_beside": 0.95, "floors": 1.25, "near_the_floor": True}
    (text,) = other_law_sentences(typed(FOUND | {"other_laws": [full]}))
    assert "95 % with the effects held at their values and leaves 1.2 times the noise" in text
    (far,) = other_law_sentences(typed(FOUND | {"other_laws": [full | {"near_the_floor": False}]}))
    assert "times the noise" not in far


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"verdict": "none"}, "With guo taken as exact, nothing is missing, and the error on held-out conditions is"),
        ({"verdict": "insufficient-data"}, "With guo taken as exact, the verdict is insufficient data, and"),
        ({"verdict": "named", "effects": FOUND["effects"]}, "With guo taken as exact, eddy-current is missing, and"),
        (
            {"verdict": "ambiguous", "ambiguous_set": ["delay", "inertia"]},
            "With guo taken as exact, delay or inertia is",
        ),
    ],
)
def test_another_base_that_was_taken_as_exact(given: dict[str, Any], text: str) -> None:
    other = {"model": "guo", "gap": FOUND["gap"], **given}
    (line,) = other_base_sentences(typed(FOUND | {"other_base": other}))
    assert line.startswith(text) and other_base_sentences(typed(FOUND)) == []


def test_lists_in_words() -> None:
    assert [listed(n) for n in ([], ["a"], ["a", "b"], ["a", "b", "c"])] == ["", "a", "a and b", "a, b and c"]
    assert listed(["a", "b"], "or") == "a or b"
    assert broken_words("time") == "changes with time" and broken_words("new") == "breaks new"


@pytest.mark.parametrize(
    ("names", "separator", "parts"),
    [
        (["sine-5Hz-2A", "sine-5Hz-3A"], "-", ["2\u00a0A", "3\u00a0A"]),
        (["sine-1Hz-2A", "sine-5Hz-3A"], "-", ["1\u00a0Hz, 2\u00a0A", "5\u00a0Hz, 3\u00a0A"]),
        (["sine-5Hz-2A"], "-", [""]),
        (["sine-5Hz", "sine-5Hz-2A"], "-", ["sine-5Hz", "sine-5Hz-2A"]),
        (["a--2A", "a-3A"], "-", ["-2\u00a0A", "3\u00a0A"]),
        (["a-1e-3A", "a-2e-3A"], "-", ["1e-3\u00a0A", "2e-3\u00a0A"]),
        (["tanh.auto", "dahl.auto"], ".", ["tanh", "dahl"]),
    ],
)
def test_names_are_told_by_the_parts_in_which_they_differ(names: list[str], separator: str, parts: list[str]) -> None:
    assert list(differing_parts(names, separator).values()) == parts


def test_a_unit_keeps_to_its_number() -> None:
    assert spaced("0.25A") == "0.25\u00a0A" and spaced("sine") == "sine" and spaced("A5") == "A5"
