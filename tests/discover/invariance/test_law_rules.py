"""Every threshold of a decision has evidence on either side of it."""

from dataclasses import replace

import pytest

from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.law_rules import (
    EffectPair,
    LawCandidate,
    LawScreening,
    RefinedEffect,
    beside_longer_memory,
    best_of,
    both,
    looks_early,
    lost,
    objection,
    screened_out,
    stands_further,
    stands_weighed,
    swap_candidates,
    weakest,
    worth_pairing,
    worth_refining,
    worth_weighing,
)
from mrfit.io.schemas.discovery import EffectSignificance

GOOD = EffectSignificance(share=0.6, kept=0.5, held=0.4, size=0.05, z=20.0, left=0.1, improved=1.0)


def row(
    name: str = "spring", error: float = 1.0, sign: bool = True, early: float = 0.0, **standing: float
) -> RefinedEffect:
    return RefinedEffect(name, replace(GOOD, **standing), error, sign, early)


def test_a_clear_effect_has_no_objection() -> None:
    assert objection(row(), STANDARD) == ""


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("z", STANDARD.law_clear),
        ("kept", STANDARD.kept),
        ("held", STANDARD.held),
        ("size", STANDARD.size),
        ("left", STANDARD.sensitivity_left),
    ],
)
def test_each_threshold_fires_below_and_not_above(name: str, value: float) -> None:
    for factor, fires in ((0.999, True), (1.001, False)):
        standing = replace(GOOD, **{name: value * factor})
        assert bool(objection(RefinedEffect("spring", standing, 1.0), STANDARD)) is fires


@pytest.mark.parametrize(("factor", "goes"), [(1.01, "lag"), (0.99, "")])
def test_beside_the_others_the_force_of_an_effect_has_to_be_told(factor: float, goes: str) -> None:
    unsure = RefinedEffect("lag", GOOD, 1.0, unsure=STANDARD.unsure * factor)
    assert not objection(unsure, STANDARD)
    assert weakest([row(), unsure], STANDARD)[0] == goes
    assert weakest([unsure], beside_longer_memory(STANDARD)) == ("", "")


def test_of_what_takes_nearly_all_on_conditions_left_out_too_fewer_standard_errors_are_asked_for() -> None:
    for share, kept, z, fires in (
        (0.9, STANDARD.nearly_all * 1.01, STANDARD.clear_of_nearly_all * 1.01, False),
        (0.9, STANDARD.nearly_all * 1.01, STANDARD.clear_of_nearly_all * 0.99, True),
        (0.9, STANDARD.nearly_all * 0.99, STANDARD.law_clear * 0.99, True),
        (STANDARD.nearly_all * 0.99, 0.9, STANDARD.law_clear * 0.99, True),
    ):
        assert bool(objection(row(share=share, kept=kept, z=z), STANDARD)) is fires


def test_an_effect_is_weighed_again_if_it_takes_enough() -> None:
    assert worth_weighing(row(share=1.01 * STANDARD.share, z=1.0), STANDARD)
    assert not worth_weighing(row(share=0.99 * STANDARD.share), STANDARD)
    assert not worth_weighing(row(sign=False), STANDARD)
    assert not worth_weighing(row(left=0.99 * STANDARD.sensitivity_left), STANDARD)
    assert not worth_weighing(row(early=1.01 * STANDARD.early_at_most), STANDARD)


def test_by_weights_of_its_own_an_effect_has_to_take_nearly_all() -> None:
    most = 1.01 * STANDARD.nearly_all
    assert stands_weighed(row(share=most, kept=most), STANDARD)
    assert not stands_weighed(row(share=most, kept=0.99 * STANDARD.nearly_all), STANDARD)
    assert not stands_weighed(row(share=0.99 * STANDARD.nearly_all, kept=most), STANDARD)
    assert not stands_weighed(row(share=most, kept=most, held=0.0), STANDARD)


def test_a_sign_that_is_not_physical_and_a_record_that_is_early_are_objections() -> None:
    assert "sign" in objection(row(sign=False), STANDARD)
    assert "early" in objection(row(early=STANDARD.early_at_most * 1.01), STANDARD)
    assert not objection(row(early=STANDARD.early * 0.99), STANDARD)


@pytest.mark.parametrize(
    ("early", "beyond", "fires"),
    [
        (STANDARD.early * 1.01, STANDARD.early_beyond * 0.99, False),
        (STANDARD.early * 1.01, STANDARD.early_beyond * 1.01, True),
        (STANDARD.early * 0.99, STANDARD.early_beyond * 1.01, False),
        (STANDARD.early_at_most * 0.99, 0.0, False),
        (STANDARD.early_at_most * 1.01, 0.0, True),
    ],
)
def test_an_early_record_is_no_mass_if_it_takes_much_or_something_of_its_own(
    early: float, beyond: float, fires: bool
) -> None:
    assert looks_early(replace(row(), early=early, beyond=beyond), STANDARD) is fires


def test_the_effect_that_leaves_least_wins_and_near_ones_are_rivals() -> None:
    near, far = STANDARD.rival_error * 0.99, STANDARD.rival_error * 1.01
    found = best_of([row("b", near), row("a", 1.0), row("c", far)], STANDARD)
    assert (found.winner, found.rivals) == ("a", ("b",))


def test_an_effect_with_an_objection_neither_wins_nor_rivals() -> None:
    found = best_of([row("a", 0.5, z=1.0), row("b", 1.0)], STANDARD)
    assert (found.winner, found.rivals) == ("b", ())
    assert dict(found.reasons)["a"]
    assert best_of([row("a", z=1.0)], STANDARD).winner == ""


def test_only_what_could_be_named_is_refined_and_no_more_than_a_few() -> None:
    least = STANDARD.worth_refining * STANDARD.share
    rows = [
        LawCandidate("a", least * 1.01, 0.1), LawCandidate("b", least * 0.99, 0.1),
        LawCandidate("c", 0.9, STANDARD.sensitivity_left * 0.9),
        LawCandidate("d", 0.9, 0.1, wrong=True),
    ]  # fmt: skip
    good, rest = worth_refining(rows, STANDARD)
    assert [c.name for c in good] == ["a"]
    assert {c.name for c in rest} == {"b", "c", "d"}
    many = [LawCandidate(str(k), 0.5 + 0.01 * k, 0.1) for k in range(STANDARD.most_refined + 1)]
    good, rest = worth_refining(many, STANDARD)
    assert len(good) == STANDARD.most_refined
    assert [c.name for c in rest] == ["0"]


def test_what_is_not_refined_is_told_why() -> None:
    assert "law" in screened_out(LawCandidate("c", 0.9, STANDARD.sensitivity_left * 0.9), STANDARD)
    assert "sign" in screened_out(LawCandidate("c", 0.9, 0.1, wrong=True), STANDARD)
    assert "2%" in screened_out(LawCandidate("c", 0.02, 0.1), STANDARD)


def test_the_weakest_without_proof_goes_first() -> None:
    assert weakest([row("a"), row("b")], STANDARD) == ("", "")
    assert weakest([row("a", share=0.1), row("b", share=0.05), row("c")], STANDARD)[0] == "b"


def test_a_pair_is_refined_only_if_it_takes_much_and_more_than_both_alone() -> None:
    alone = (LawCandidate("a", 0.2, 0.1), LawCandidate("b", 0.2, 0.1))

    def paired(share: float) -> int:
        return len(worth_pairing(LawScreening(alone, (EffectPair(("a", "b"), share, ((1.0,), (1.0,))),)), STANDARD))

    least = max(STANDARD.pair_share, STANDARD.gain_of_pair * 0.4)
    assert paired(least * 1.01) == 1
    assert paired(least * 0.99) == 0
    weak = LawScreening(
        (LawCandidate("a", 0.0, 0.1), LawCandidate("b", 0.0, 0.1)), (EffectPair(("a", "b"), 0.39, ((), ())),)
    )
    assert not worth_pairing(weak, STANDARD)
    many = tuple(EffectPair(("a", "b"), 0.9, ((), ())) for _ in range(STANDARD.most_law_pairs + 1))
    assert len(worth_pairing(LawScreening(alone, many), STANDARD)) == STANDARD.most_law_pairs


def test_two_stand_only_if_both_have_proof() -> None:
    assert both([row("a"), row("b")], STANDARD)
    assert not both([row("a"), row("b", z=1.0)], STANDARD)


@pytest.mark.parametrize(("factor", "winner"), [(0.99, "simple"), (1.01, "rich")])
def test_fewer_numbers_win_where_they_leave_as_little(factor: float, winner: str) -> None:
    rich = replace(row("rich", 1.0), numbers=4)
    assert best_of([rich, row("simple", STANDARD.simpler_error * factor)], STANDARD).winner == winner


@pytest.mark.parametrize(("factor", "tried"), [(1.01, ["b"]), (0.99, [])])
def test_another_is_tried_in_an_effect_s_place_if_it_could_take_much_of_it(factor: float, tried: list[str]) -> None:
    rows = [LawCandidate("b", STANDARD.swap_share * GOOD.share * factor, 0.1), LawCandidate("spring", 1.0, 0.1)]
    assert [c.name for c in swap_candidates(rows, row(), STANDARD)] == tried


@pytest.mark.parametrize(("factor", "name"), [(0.99, ""), (1.01, "spring")])
def test_a_force_that_a_law_of_longer_memory_takes_over_is_the_law_s(factor: float, name: str) -> None:
    size = GOOD.size * (1.0 - STANDARD.force_drifts * factor)
    assert lost([row(size=size)], {"spring": GOOD.size}, STANDARD)[0] == name
    assert lost([row(size=2.0 * GOOD.size)], {"spring": GOOD.size}, STANDARD)[0] == ""
    least = STANDARD.law_clear * STANDARD.further
    assert lost([row(z=0.99 * least)], {"spring": GOOD.size}, STANDARD)[0] == "spring"
    assert lost([row(size=size, z=1.01 * least)], {"spring": GOOD.size}, STANDARD)[0] == name


@pytest.mark.parametrize(("factor", "fires"), [(0.999, True), (1.001, False)])
def test_what_is_not_plain_has_to_take_its_share(factor: float, fires: bool) -> None:
    found = row(z=0.5 * (STANDARD.law_clear + STANDARD.plain), share=STANDARD.share * factor)
    assert bool(objection(found, STANDARD)) is fires


@pytest.mark.parametrize(("z", "share", "stands"), [(1.01, 1.01, True), (0.99, 1.01, False), (1.01, 0.99, False)])
def test_what_is_plain_may_take_less(z: float, share: float, stands: bool) -> None:
    found = row(z=STANDARD.plain * z, share=STANDARD.share_if_plain * share)
    assert (objection(found, STANDARD) == "") is stands


@pytest.mark.parametrize(
    ("kept", "size", "stands"),
    [(1.01, 1.0, True), (0.99, 1.0, False), (1.01, 1.0 + 0.99 * STANDARD.force_drifts, True),
     (1.01, 1.0 + 1.01 * STANDARD.force_drifts, False), (1.01, 1.0 - 1.01 * STANDARD.force_drifts, False)],
)  # fmt: skip
def test_an_effect_keeps_its_force_beside_a_longer_memory(kept: float, size: float, stands: bool) -> None:
    found = row(kept=STANDARD.further * STANDARD.kept * kept, size=GOOD.size * size, z=0.1)
    assert stands_further(found, GOOD.size, STANDARD) is stands
    assert not stands_further(replace(found, sign=False), GOOD.size, STANDARD)
