"""What a base leaves by floors that are not 1, and partners that it tells from an effect: both sides of each."""

from dataclasses import replace

import pytest

from mrfit.discover.invariance.findings import LawErrors, LawFindings
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.combine import Floors, closes_the_gap, combine, leaves_noise, of_no_use
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import EffectScreening, Fit
from mrfit.discover.selection.rules import EffectTrial
from mrfit.io.schemas.discovery import Confounded
from tests.discover.test_combine import effect
from tests.discover.world import fit


def named(before: float, after: float, *effects: str) -> Selection:
    base, final = fit(before), fit(after, *effects or ("a",))
    return Selection(base, final, final, EffectScreening(base), verdict="named")


@pytest.mark.parametrize(
    ("before", "after", "noise", "little"),
    [
        # a fifth of the gap beyond the noise, 0.2 (25 - 2.25) = 4.55 beyond 2.25
        (5.0, 2.60, 1.5, True),
        (5.0, 2.62, 1.5, False),
        # in sight, from 2.5 times the noise on, a hundredth: 4.98 beyond 2.25
        (22.4, 3.74, 1.5, True),
        (22.4, 3.76, 1.5, False),
        # no gap beyond what the noise can be
        (5.0, 4.9, 5.0, True),
    ],
)
def test_what_may_be_left_is_a_share_of_the_gap_beyond_the_noise(
    before: float, after: float, noise: float, little: bool
) -> None:
    assert leaves_noise(named(before, after), Floors(noise, measured=False), STANDARD) is little


@pytest.mark.parametrize(
    ("before", "after", "closed"),
    [
        # a fiftieth of 99
        (10.0, 1.72, True),
        (10.0, 1.73, False),
        # next to nothing above the noise, whatever the gap
        (1.3, 1.19, True),
        (1.3, 1.21, False),
    ],
)
def test_a_gap_is_closed_where_next_to_nothing_of_it_is_left(before: float, after: float, closed: bool) -> None:
    assert closes_the_gap(named(before, after), STANDARD) is closed
    # by floors that are told it is then believed, though the best law leaves far less
    errors = LawErrors(base=0.05, law=0.01, after=0.01, noise=0.002, exact=0.04, open=0.01)
    found = combine(named(before, after), LawFindings(errors=errors), STANDARD, noisy=True, told=True)
    assert (found.named == ("a",)) is closed
    for less in ({"told": False, "noisy": True}, {"told": True, "noisy": False}):
        assert combine(named(before, after), LawFindings(errors=errors), STANDARD, **less).named == ()


UNTRIED = (Confounded(name="late", reason="any law may have it", test="steps"),)


def tried(name: str, train: float, holdout: float) -> EffectTrial:
    return EffectTrial(name, fit(holdout, name, train=train), 0.5, False, 4.0)


def partner_of(trials: tuple[EffectTrial, ...], confounded: tuple[Confounded, ...] = UNTRIED) -> tuple[str, ...]:
    """Return the partners of a lag that takes 96 of 100 beside a base of error 10."""
    base = fit(10.0)
    proven: Fit = fit(2.0, "lag")
    chosen = Selection(base, proven, proven, EffectScreening(base), verdict="unexplained", trials=trials)
    lag = effect("lag").model_copy(update={"one_of": ("late",)})
    (found,) = combine(chosen, LawFindings(named=(lag,), confounded=confounded), STANDARD).standing
    return found.one_of


@pytest.mark.parametrize(
    ("train", "holdout", "told"),
    [
        # half of 96 leaves 52, an error of 7.21
        (7.3, 7.3, True),
        (7.1, 7.3, False),
        (7.3, 7.1, False),
    ],
)
def test_a_partner_that_takes_far_less_beside_the_base_fitted_and_held_out_is_told_from_an_effect(
    train: float, holdout: float, told: bool
) -> None:
    assert partner_of((tried("lag", 2.0, 2.0), tried("late", train, holdout))) == (() if told else ("late",))


def test_a_partner_that_was_not_tried_beside_the_base_or_was_beside_any_law_stays() -> None:
    assert partner_of((tried("lag", 2.0, 2.0),)) == ("late",)
    assert partner_of((tried("late", 9.0, 9.0),)) == ("late",)
    assert partner_of((tried("lag", 2.0, 2.0), tried("late", 9.0, 9.0)), ()) == ("late",)


def test_an_effect_of_which_no_error_is_known_is_not_turned_down() -> None:
    one, other = effect("s"), effect("m").model_copy(update={"standing": None})
    assert of_no_use((one, other), {"s": None, "m": 0.01}, after=0.04, policy=STANDARD) is None
    assert of_no_use((one,), {"s": 0.04}, after=None, policy=STANDARD) is None
    found = of_no_use((one,), {"s": 0.04}, after=0.04, policy=STANDARD)
    assert found is not None and "hardly lower with it" in found.reason


def test_several_effects_are_listed() -> None:
    found = combine(named(10.0, 5.0, "a", "b", "c"), LawFindings(), STANDARD)
    assert "with the base taken as exact a, b and c would be there" in found.difference
    sets = replace(named(10.0, 5.0, "b", "a"), ambiguous=(("b", "z"), ("a", "c")), verdict="ambiguous")
    assert combine(sets, None, STANDARD).ambiguous_set == ("a", "b", "c", "z")
