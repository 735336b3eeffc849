"""Every threshold of a decision has evidence on either side of it."""

from dataclasses import replace

import pytest

from mrfit.discover.invariance.findings import Standing
from mrfit.discover.invariance.policy import STANDARD
from mrfit.discover.invariance.selection import (
    Candidate,
    Refined,
    decide,
    objection,
    screened_out,
    weakest,
    worth_refining,
)

GOOD = Standing(share=0.6, kept=0.5, held=0.4, size=0.05, z=20.0, left=0.1, improved=1.0)


def row(name: str = "spring", error: float = 1.0, sign: bool = True, early: float = 0.0, **standing: float) -> Refined:
    return Refined(name, replace(GOOD, **standing), error, sign, early)


def test_a_clear_effect_has_no_objection() -> None:
    assert objection(row(), STANDARD) == ""


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("z", STANDARD.clear),
        ("share", STANDARD.share),
        ("kept", STANDARD.kept),
        ("held", STANDARD.held),
        ("size", STANDARD.size),
        ("left", STANDARD.left),
    ],
)
def test_each_threshold_fires_below_and_not_above(name: str, value: float) -> None:
    assert objection(row(**{name: value * 0.999}), STANDARD)
    assert not objection(row(**{name: value * 1.001}), STANDARD)


def test_a_sign_that_is_not_physical_and_a_record_that_is_early_are_objections() -> None:
    assert "sign" in objection(row(sign=False), STANDARD)
    assert "early" in objection(row(early=STANDARD.early * 1.01), STANDARD)
    assert not objection(row(early=STANDARD.early * 0.99), STANDARD)


def test_the_effect_that_leaves_least_wins_and_near_ones_are_rivals() -> None:
    near, far = STANDARD.rival * 0.99, STANDARD.rival * 1.01
    found = decide([row("b", near), row("a", 1.0), row("c", far)], STANDARD)
    assert (found.winner, found.rivals) == ("a", ("b",))


def test_an_effect_with_an_objection_neither_wins_nor_rivals() -> None:
    found = decide([row("a", 0.5, z=1.0), row("b", 1.0)], STANDARD)
    assert (found.winner, found.rivals) == ("b", ())
    assert dict(found.reasons)["a"]
    assert decide([row("a", z=1.0)], STANDARD).winner == ""


def test_only_what_could_be_named_is_refined_and_no_more_than_a_few() -> None:
    least = STANDARD.worth_refining * STANDARD.share
    rows = [
        Candidate("a", least * 1.01, 0.1), Candidate("b", least * 0.99, 0.1), Candidate("c", 0.9, STANDARD.left * 0.9),
        Candidate("d", 0.9, 0.1, wrong=True),
    ]  # fmt: skip
    good, rest = worth_refining(rows, STANDARD)
    assert [c.name for c in good] == ["a"]
    assert {c.name for c in rest} == {"b", "c", "d"}
    many = [Candidate(str(k), 0.5 + 0.01 * k, 0.1) for k in range(STANDARD.most_refined + 1)]
    good, rest = worth_refining(many, STANDARD)
    assert len(good) == STANDARD.most_refined
    assert [c.name for c in rest] == ["0"]


def test_what_is_not_refined_is_told_why() -> None:
    assert "law" in screened_out(Candidate("c", 0.9, STANDARD.left * 0.9), STANDARD)
    assert "sign" in screened_out(Candidate("c", 0.9, 0.1, wrong=True), STANDARD)
    assert "2%" in screened_out(Candidate("c", 0.02, 0.1), STANDARD)


def test_the_weakest_without_proof_goes_first() -> None:
    assert weakest([row("a"), row("b")], STANDARD) == ("", "")
    assert weakest([row("a", share=0.1), row("b", share=0.05), row("c")], STANDARD)[0] == "b"
