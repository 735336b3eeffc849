"""No test is held out that alone tells of a law of current."""

from dataclasses import replace

import pytest

from mrfit.core.recording import Segment
from mrfit.discover.hold_out import (
    too_little,
    with_laws_trained,
    with_their_currents_trained,
    with_their_speeds_trained,
)
from mrfit.discover.policy import STANDARD

SEGMENT = Segment("s", "c", "r", 0, 100, 0, "sine", "displacement", 1.0, 0.01, 0.0, 2, 0.0, float("nan"), "train")


def segments(trained: str, held: str) -> list[Segment]:
    """Return tests of words: a current in A, n for one that moves, and f for a fast one."""

    def segment(word: str, role: str) -> Segment:
        current = float("nan") if word[0] == "n" else float(word[0])
        condition, frequency = f"{word} {role}", 5.0 if word[1] == "f" else 0.5
        named = replace(SEGMENT, id=condition, condition=condition, frequency=frequency)
        return replace(named, current=current, role=role)

    return [*(segment(w, "train") for w in trained.split()), *(segment(w, "holdout") for w in held.split())]


def are_moved(found: list[Segment], tests: list[Segment], moved: str, word: str) -> None:
    """Assert that tests of some words, and no others, are trained now, and named."""
    changed = [s for s, was in zip(found, tests, strict=True) if s.role != was.role]
    assert [s.condition.split()[0] for s in changed] == moved.split()
    assert all(s.role == "train" and s.condition in word for s in changed) and bool(word) == bool(moved)


@pytest.mark.parametrize(
    ("trained", "held", "moved"),
    [
        # every current is trained: as it was
        ("1a 2a", "1b 2b", ""),
        # of two at a current that is not trained the first is
        ("1a 3a", "2a 2b", "2a"),
        # one alone is trained where another stays held out, not where it is all there is to judge by
        ("1a 3a", "2a 3b", "2a"),
        ("1a 3a", "2a", ""),
        ("1a 3a", "2a 4a", ""),
        # a current that moves or is not known is at no level
        ("1a 3a", "na nb", ""),
    ],
)
def test_what_is_held_out_is_at_currents_that_are_trained_where_it_can_be(trained: str, held: str, moved: str) -> None:
    tests = segments(trained, held)
    found, word = with_their_currents_trained(tests)
    are_moved(found, tests, moved, word)


@pytest.mark.parametrize(
    ("trained", "held", "moved"),
    [
        # two of three fast tests are held out: the farther of them is trained
        ("0s 1s 2s 2f", "0f 1f", "0f"),
        ("0s 1s 2s 0f", "1f 2f", "2f"),
        # the same where a third is trained, at its current or at another
        ("0s 1s 2s 2f 3f", "0f 1f", ""),
        ("0s 1s 2s 0f 2f", "1f 1s", ""),
        ("0s 1s 0f 1f", "0f 1s", ""),
        # a slow one is reached by fast ones
        ("1s 0f 1f 2f", "0s 2s", ""),
        # no trained test is as fast, or it is all there is to judge by
        ("0s 1s 2s", "0f 1f", ""),
        ("0s 1s 2s 2f", "0f", ""),
        # a current that moves is at no level
        ("0s 1s 2s 2f", "nf 1f", "1f"),
    ],
)
def test_what_is_held_out_is_not_beside_one_current_of_tests_as_fast(trained: str, held: str, moved: str) -> None:
    tests = segments(trained, held)
    found, word = with_their_speeds_trained(tests)
    are_moved(found, tests, moved, word)
    assert with_laws_trained(tests)[0] == found


def test_without_a_held_out_condition_no_verdict_is_given_and_it_is_said_how_to_hold_one_out() -> None:
    said = too_little(segments("1a 2a 3a", ""), STANDARD)
    assert said.startswith("no held-out condition (conditions: 3)") and "`mrfit segment --holdout PATTERN`" in said
    assert too_little(segments("1a 2a", "3a"), STANDARD) == ""


@pytest.mark.parametrize(
    ("changes", "enough"),
    [({}, False), ({"cycles": 0}, True), ({"drive": "excitation_force"}, True), ({"drive": "base_acceleration"}, True)],
)
def test_one_condition_is_enough_only_where_it_is_no_periodic_test_of_a_device(
    changes: dict[str, int | str], enough: bool
) -> None:
    """Where a mass is driven, or the drive is no cycle, one test visits many speeds."""
    train, held = segments("1a", "2a")
    for one in (train, replace(train, id="again")):
        tests = [replace(train, **changes), replace(one, **changes), held]  # type: ignore[arg-type]
        assert (too_little(tests, STANDARD) == "") is enough
        assert enough or "only one periodic training condition" in too_little(tests, STANDARD)
