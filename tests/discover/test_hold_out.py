"""No test is held out that alone tells of a law of current."""

from dataclasses import replace

import pytest

from mrfit.core.recording import Segment
from mrfit.discover.hold_out import with_laws_trained, with_their_currents_trained, with_their_speeds_trained

SEGMENT = Segment("s", "c", "r", 0, 100, 0, "sine", "displacement", 1.0, 0.01, 0.0, 2, 0.0, float("nan"), "train")


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
    def segment(word: str, role: str) -> Segment:
        current = float("nan") if word[0] == "n" else float(word[0])
        return replace(SEGMENT, id=word, condition=word, current=current, role=role)

    segments = [*(segment(w, "train") for w in trained.split()), *(segment(w, "holdout") for w in held.split())]
    found, word = with_their_currents_trained(segments)
    changed = [s.condition for s, was in zip(found, segments, strict=True) if s.role != was.role]
    assert changed == moved.split() and all(s.role == "train" for s in found if s.condition in changed)
    assert bool(word) == bool(moved) and moved in word


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
    def segment(word: str, role: str) -> Segment:
        current = float("nan") if word[0] == "n" else float(word[0])
        frequency = 0.5 if word[1] == "s" else 5.0
        named = replace(SEGMENT, id=f"{word} {role}", condition=f"{word} {role}", frequency=frequency)
        return replace(named, current=current, role=role)

    segments = [*(segment(w, "train") for w in trained.split()), *(segment(w, "holdout") for w in held.split())]
    found, word = with_their_speeds_trained(segments)
    changed = [s.condition for s, was in zip(found, segments, strict=True) if s.role != was.role]
    assert [c.split()[0] for c in changed] == moved.split() and all(c in word for c in changed)
    assert bool(word) == bool(moved)
    assert with_laws_trained(segments)[0] == found
