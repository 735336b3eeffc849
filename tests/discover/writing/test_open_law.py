"""Shares and words of a law's error, and what is told of both ways."""

from dataclasses import replace

import pytest

from mrfit.core.specs import Invariance
from mrfit.discover.invariance.findings import LawErrors, LawFindings, LawGap
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.combine import CombinedResult, Shadow
from mrfit.discover.writing.open_law import examination, law_gap, ways, with_examination, with_gap, with_laws
from mrfit.io.schemas.discovery import DiscoveryFile, FoundEffect, Gap, LawPlace
from tests.discover.test_open_law import BROKEN, EXACT, FOUND, LAG, SPRING


def place(over: str, low: float, high: float, unit: str, error: float = 0.9, samples: float = 0.1) -> LawPlace:
    return LawPlace(over=over, low=low, high=high, unit=unit, share_of_error=error, share_of_samples=samples)


def said(*places: LawPlace) -> tuple[str, ...]:
    found = law_gap(EXACT, replace(FOUND, law_gap=LawGap(0.03, 0.4, places)), STANDARD)
    assert found is not None
    return found.text


SHARES = " (90 % of it in 10 % of the samples)"


@pytest.mark.parametrize(
    ("own", "words"),
    [
        (place("travel", 0.0, 0.00158, "m"), "within 1.6 mm of a reversal"),
        (place("travel", 0.0016, 0.02, "m"), "1.6 to 20 mm after a reversal"),
        (place("travel", 0.02, 0.1, "rad"), "0.02 to 0.1 rad after a reversal"),
        (place("speed", 0.0, 0.05, "m/s"), "with a speed below 50 mm/s"),
        (place("speed", 0.05, 0.2, "m/s"), "with a speed of 50 to 200 mm/s"),
        (place("speed", 0.5, 2.0, "rad/s"), "with a speed of 0.5 to 2 rad/s"),
        (place("control", 0.0, 0.4, "A"), "with a current below 0.4 A"),
        (place("control", 1.0, 2.0, "A"), "with a current of 1 to 2 A"),
    ],
)
def test_a_place_of_the_error_is_said_in_the_units_of_the_field(own: LawPlace, words: str) -> None:
    assert said(own) == (words + SHARES,)


def test_of_each_kind_the_place_that_holds_most_beyond_its_samples_is_said_if_it_is_worth_it() -> None:
    slow, fast = place("speed", 0.0, 0.05, "m/s", 0.5, 0.45), place("speed", 0.05, 0.2, "m/s", 0.4, 0.2)
    assert said(slow, fast) == ("with a speed of 50 to 200 mm/s (40 % of it in 20 % of the samples)",)
    even, hardly = place("control", 0.0, 0.4, "A", 0.519, 0.5), place("control", 0.0, 0.4, "A", 0.521, 0.5)
    assert said(even) == () and len(said(hardly)) == 1
    assert len(said(slow, fast, hardly)) == 2


@pytest.mark.parametrize(
    ("errors", "effects", "rest", "taken"),
    [
        # of 25 - 1 parts: law 16 - 9 taken, 9 - 1 left; of what no law makes 7 of 15
        (LawErrors(0.05, 0.04, 0.03, 0.01), 7 / 24, 8 / 24, 7 / 15),
        # effects that leave more than the law alone take nothing
        (LawErrors(0.05, 0.03, 0.04, 0.01), 0.0, 15 / 24, 0.0),
        # no share is more than all, nor less than nothing
        (LawErrors(0.02, 0.05, 0.005, 0.01), 1.0, 0.0, 1.0),
        (LawErrors(0.01, 0.02, 0.02, 0.01), 0.0, 1.0, 0.0),
    ],
)
def test_shares_of_a_gap_are_of_the_squared_error_beyond_noise(
    errors: LawErrors, effects: float, rest: float, taken: float
) -> None:
    found = law_gap(EXACT, replace(FOUND, errors=errors), STANDARD)
    assert found is not None
    assert (found.effects, found.rest, found.taken) == pytest.approx((effects, rest, taken))
    assert (found.error, found.share, found.left) == (0.03, 0.36, errors.law)


def test_without_a_response_of_the_base_nothing_is_said_of_its_law() -> None:
    assert law_gap(EXACT, replace(FOUND, law_gap=None), STANDARD) is None
    assert law_gap(EXACT, replace(FOUND, errors=replace(FOUND.errors, base=None)), STANDARD) is None


def named(effects: tuple[str, ...], known: bool = True) -> DiscoveryFile:
    found = tuple(
        FoundEffect(name=n, parameters=(), holdout_nrmse_before=0.05, holdout_nrmse_after=0.011) for n in effects
    )
    gap = Gap(noise_floor=0.001 if known else None, before=0.05, after=0.011, closed=0.95 if known else None)
    rows = tuple(
        c.model_copy(update={"accepted": c.name in effects, "reason": f"about {c.name}"}) for c in EXACT.candidates
    )
    own = {"verdict": "named", "effects": found, "gap": gap, "candidates": rows, "where_text": ("everywhere",)}
    return EXACT.model_copy(update=own)


@pytest.mark.parametrize("known", [True, False])
def test_what_is_taken_back_leaves_the_whole_gap_of_which_a_share_is_told_if_the_floor_is(known: bool) -> None:
    combined = CombinedResult("unexplained", (), taken_back=True)
    found = with_examination(named(("delay",), known), combined, LawFindings(), "force", STANDARD)
    assert (found.gap.after, found.gap.closed) == (0.05, 0.0 if known else None)
    assert found.unexplained.share_of_gap == (1.0 if known else None)
    assert found.unexplained.text == ("everywhere",)
    reasons = {c.name: (c.accepted, c.reason) for c in found.candidates}
    assert reasons["delay"] == (False, "beside a law that is off it has no proof")
    assert reasons["gas-spring"] == (False, "about gas-spring")
    assert [s.name for s in found.suspects] == ["delay"]


def test_candidates_beside_an_open_law_are_those_that_stand_then_the_others_with_their_reasons() -> None:
    combined = CombinedResult("named", ("gas-spring",), standing=(SPRING,), shadows=(Shadow("current-lag", "a part"),))
    found = with_examination(named(("delay",)), combined, FOUND, "force", STANDARD)
    rows = [(c.name, c.accepted, c.reason) for c in found.candidates]
    assert rows == [
        ("gas-spring", True, "it takes 99% of what no law makes, 50 standard errors from neutral"),
        ("delay", False, "about delay"),
        ("current-lag", False, "a part"),
    ]
    assert found.held == (("gas-spring.k_g", 9030.0), ("gas-spring.c", 0.0)) and not found.suspects


def test_the_error_with_each_effect_is_that_of_the_fit_with_all_held() -> None:
    gap = Gap(noise_floor=0.001, before=0.05, after=0.02, closed=0.8)
    found = with_gap(named(("delay", "gas-spring")), gap, {"delay": 0.04, "gas-spring": None})
    assert [(e.holdout_nrmse_before, e.holdout_nrmse_after) for e in found.effects] == [(0.04, 0.02), (None, 0.02)]
    # without a law that was examined no rest is known
    assert (found.gap, found.unexplained.share_of_gap) == (gap, None)


def test_laws_that_were_not_fitted_are_said_beside_what_was_left_out_before() -> None:
    first = EXACT.model_copy(update={"left_out": ("plain errors",)})
    assert with_laws(first, ()).left_out == ("plain errors",)
    assert with_laws(first, (), ("spencer", "dahl")).left_out == (
        "plain errors",
        "fits of other laws that are slow to simulate (spencer, dahl)",
    )


@pytest.mark.parametrize(
    ("combined", "verdict", "effects", "sets"),
    [
        (CombinedResult("named", ("gas-spring",), standing=(SPRING,)), "named", ("gas-spring",), ()),
        (
            CombinedResult("ambiguous", ("gas-spring",), (("current-lag", "delay"),), (SPRING, LAG)),
            "ambiguous",
            ("gas-spring",),
            ("current-lag", "delay"),
        ),
        # sets of a base taken as exact are none of an examination
        (CombinedResult("ambiguous", (), (("a", "b"),)), "unexplained", (), ()),
    ],
)
def test_each_way_is_told_by_itself(
    combined: CombinedResult, verdict: str, effects: tuple[str, ...], sets: tuple[str, ...]
) -> None:
    found = ways(named(("delay",)), combined, FOUND)
    assert (found.exact_base.verdict, found.exact_base.effects) == ("named", ("delay",))
    other = found.invariances
    assert (other.verdict, other.effects, other.ambiguous_set) == (verdict, effects, sets)
    assert found.agree is True
    apart = ways(EXACT, replace(combined, difference="they differ"), FOUND)
    assert not apart.agree and apart.difference == "they differ"


def test_an_examination_is_told_with_its_horizon_in_the_unit_of_the_place() -> None:
    combined = CombinedResult("unexplained", (), shadows=(Shadow("gas-spring", "a part of something"),))
    own = replace(FOUND, broken=(BROKEN,))
    found = examination(combined, own, "torque")
    assert (found.travel, found.travel_unit, found.time) == (0.003, "rad", 0.01)
    assert (found.named, found.broken, found.base, found.noise) == ((), (BROKEN,), 0.05, 0.0)
    first = found.turned_down[0]
    assert (first.name, first.breaks, first.reason) == ("gas-spring", Invariance.POSITION, "a part of something")
    assert [e.name for e in examination(CombinedResult("named", ()), own, "force").named] == ["gas-spring"]
