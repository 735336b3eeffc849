"""Two ways of discovery together: which of them is believed, where, and what is said where they differ."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.specs import Invariance
from mrfit.discover.invariance.findings import LawErrors, LawFindings
from mrfit.discover.policy import STANDARD
from mrfit.discover.selection.combine import (
    Floors,
    combine,
    leaves_noise,
    may_err,
    of_no_use,
    turned_down,
    worth_examining,
)
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.questions import EffectScreening
from mrfit.discover.selection.rules import EffectTrial
from mrfit.io.schemas.discovery import (
    BrokenInvariance,
    Confounded,
    EffectParameter,
    EffectSignificance,
    InvariantEffect,
)
from tests.discover.world import fit

CLEAR = EffectSignificance(share=0.9, kept=0.9, held=0.8, size=0.1, z=20.0, left=0.1, improved=1.0)
FORCE = EffectParameter(name="largest force", unit="N", value=100.0, low=90.0, high=110.0)
BASE = fit(20.0)
MEASURED = Floors(1.0, measured=True, told=True)


def effect(name: str, breaks: Invariance = Invariance.POSITION, *one_of: str) -> InvariantEffect:
    return InvariantEffect(name=name, breaks=breaks, tier="short-memory", force=FORCE, standing=CLEAR, one_of=one_of)


def broken(kept: float, invariance: Invariance = Invariance.POSITION) -> BrokenInvariance:
    return BrokenInvariance(invariance=invariance, share=kept, kept=kept, size=0.05)


def exact(verdict: str = "unexplained", *effects: str, left: float = 10.0, **more: object) -> Selection:
    final = fit(left, *effects) if effects else BASE
    return replace(Selection(BASE, final, final, EffectScreening(BASE)), verdict=verdict, **more)


def test_without_an_examination_the_base_taken_as_exact_decides() -> None:
    chosen = exact("ambiguous", "a", "c", ambiguous=(("a", "b"),))
    for examined in (None, LawFindings(not_applicable="no displacement")):
        found = combine(chosen, examined, STANDARD)
        assert (found.verdict, found.named, found.ambiguous) == ("ambiguous", ("c",), (("a", "b"),))
        assert not found.law_is_open and not found.difference


def test_an_effect_that_no_law_makes_is_named_where_the_base_taken_as_exact_explains_nothing() -> None:
    found = combine(exact(), LawFindings(named=(effect("s"),)), STANDARD)
    assert (found.verdict, found.named, found.ambiguous) == ("named", ("s",), ())
    assert found.law_is_open and not found.difference


def test_an_effect_that_takes_nothing_on_conditions_held_out_is_turned_down() -> None:
    lag, spring = effect("lag", Invariance.CURRENT), effect("s")
    assert of_no_use((lag, spring), {"lag": 0.06, "s": 0.041}, after=0.04, policy=STANDARD) is None
    assert of_no_use((), {}, after=0.04, policy=STANDARD) is None
    # the law errs by more than the largest force of either: what it takes is not seen, what it adds is
    assert of_no_use((lag, spring), {"lag": 0.15, "s": 0.15}, after=0.1505, policy=STANDARD) is None
    harmful = of_no_use((lag, spring), {"lag": 0.15, "s": 0.159}, after=0.16, policy=STANDARD)
    assert harmful is not None and harmful.name == "lag" and "higher with it" in harmful.reason
    # a little lower, by less than chance
    hardly = of_no_use((lag, spring), {"lag": 0.06, "s": 0.0401}, after=0.04, policy=STANDARD)
    assert hardly is not None and hardly.name == "s"
    shadow = of_no_use((lag, spring), {"lag": 0.039, "s": 0.04}, after=0.04, policy=STANDARD)
    assert shadow is not None and shadow.name == "lag"
    for others in ((spring,), ()):
        found = combine(exact(), LawFindings(named=(lag, *others)), STANDARD)
        rest = turned_down(exact(), found, shadow, STANDARD)
        assert rest.named == tuple(n.name for n in others) and rest.law_is_open == bool(others)
        assert rest.verdict == ("named" if others else "unexplained") and rest.shadows == (shadow,)


def test_a_force_that_the_base_makes_itself_is_not_missing() -> None:
    """Guo's law has a spring of its own, tied to its damping: an examination finds it in any data of that law."""
    examined = LawFindings(
        named=(effect("s"),), in_the_model=("s",), errors=LawErrors(0.2, 0.02, 0.02, 0.01, 0.02, 0.02)
    )
    found = combine(exact(), examined, STANDARD)
    assert (found.verdict, found.named) == ("unexplained", ())
    assert [s.name for s in found.shadows] == ["s"]
    # another effect beside a base that is as good as any law is confirmed, as without an examination
    beside = exact("named", "a", left=1.0)
    assert combine(beside, examined, STANDARD, noisy=True).named == ("a",)
    assert combine(beside, replace(examined, in_the_model=()), STANDARD, noisy=True).named == ("s",)
    # what the model has only since the effect was added to it is none of the base
    assert combine(exact("named", "s"), examined, STANDARD).named == ("s",)


def test_what_an_examination_does_not_confirm_is_taken_back() -> None:
    nothing = LawFindings(broken=(broken(0.9),))
    for verdict in ("ambiguous", "named"):
        found = combine(exact(verdict, "a"), nothing, STANDARD)
        assert (found.verdict, found.named, found.taken_back) == ("unexplained", (), True)
        assert "a would be there" in found.difference and not found.law_is_open
    found = combine(exact(), nothing, STANDARD)
    assert (found.verdict, found.taken_back, found.difference) == ("unexplained", False, "")
    for error, verdict in ((1.2, "none"), (1.3, "unexplained")):
        small = replace(exact("named", "a", left=1.1), base=fit(error))
        assert combine(small, nothing, STANDARD).verdict == verdict
    # a floor that is not known lies between 1 and the most that the noise can be
    for error, verdict in ((1.2, "none"), (1.61, "insufficient-data"), (1.9, "unexplained")):
        small = replace(exact("named", "a", left=1.46), base=fit(error))
        assert combine(small, nothing, STANDARD, noise=1.44).verdict == verdict
    kept = combine(exact("named", "a", "b"), LawFindings(named=(effect("a"),)), STANDARD)
    assert (kept.verdict, kept.named) == ("named", ("a",)) and "b would take part" in kept.difference


def test_a_name_with_partners_is_a_set() -> None:
    partners = effect("s", Invariance.POSITION, "t")
    found = combine(exact(), LawFindings(named=(partners, effect("u"))), STANDARD)
    assert (found.verdict, found.named, found.ambiguous) == ("ambiguous", ("u",), (("s", "t"),))
    assert found.law_is_open


def test_a_base_with_effects_that_close_the_gap_is_believed_though_the_best_law_leaves_less() -> None:
    less = LawFindings(errors=LawErrors(0.2, 0.02, 0.02, 0.01, exact=0.04, open=0.02))
    for left, believed in ((1.9, True), (4.0, False)):
        chosen = replace(exact("named", "a"), final=fit(left, "a", train=1.1))
        found = combine(chosen, less, STANDARD, leaves_noise(chosen, MEASURED, STANDARD), told=True)
        assert (found.verdict == "named", found.taken_back) == (believed, not believed)
        assert combine(chosen, less, STANDARD, True, Floors(1.0, False).told).taken_back


def test_effects_that_stand_for_a_law_leave_more_than_noise_where_they_were_fitted_and_are_no_names() -> None:
    best = LawFindings(errors=LawErrors(0.2, 0.02, 0.02, 0.01, exact=0.02, open=0.02))
    for fitted, held_out in ((1.47, 1.38), (2.1, 2.4), (1.29, 1.15)):
        shadows = replace(exact("named", "a", "b"), base=fit(30.0), final=fit(held_out, "a", "b", train=fitted))
        assert worth_examining(shadows, MEASURED, STANDARD)
        found = combine(shadows, best, STANDARD, leaves_noise(shadows, MEASURED, STANDARD), told=True)
        assert (found.verdict, found.named, found.taken_back) == ("unexplained", (), True)
        # where the noise of fitted tests may be as large, or no floor is told, that is no objection
        for floors in (replace(MEASURED, fitted=2.0), Floors(1.0, measured=False)):
            assert leaves_noise(shadows, floors, STANDARD)


def test_a_partner_that_breaks_no_invariance_is_told_beside_the_base_where_it_takes_much_less() -> None:
    lag = effect("lag", Invariance.CURRENT, "late", "slow")
    untried = (Confounded(name="late", reason="it breaks no invariance: any law may have it", test=""),)
    examined = LawFindings(named=(lag,), confounded=untried)

    def partners(late: float, *proven: str) -> tuple[str, ...]:
        trials = tuple(EffectTrial(n, fit(left, n), 0.5, False, 4.0) for n, left in (("lag", 9.0), ("late", late)))
        chosen = replace(exact(), trials=(*trials, replace(trials[1], name="slow")), proven=fit(9.0, *proven))
        found = combine(chosen, examined, STANDARD)
        return found.ambiguous[0] if found.ambiguous else found.named

    assert partners(18.0, "lag") == ("lag", "slow")
    assert partners(12.0, "lag") == ("lag", "late", "slow")
    assert partners(18.0) == partners(18.0, "lag", "late") == ("lag", "late", "slow")


def test_what_breaks_the_same_invariance_beside_an_effect_makes_it_a_shadow() -> None:
    for kept, invariance, believed in (
        (0.8, Invariance.POSITION, False),
        (0.6, Invariance.POSITION, True),
        (0.8, Invariance.TIME, True),
    ):
        found = combine(exact(), LawFindings(named=(effect("s"),), broken=(broken(kept, invariance),)), STANDARD)
        assert (found.named == ("s",), found.verdict == "named") == (believed, believed)
        assert [s.name for s in found.shadows] == ([] if believed else ["s"])
        assert found.verdict == ("named" if believed else "unexplained")


def test_the_way_that_has_no_proof_for_an_effect_of_the_other_is_told() -> None:
    proven = exact(proven=fit(5.0, "lag", "s"), taken_back=True)
    found = combine(proven, LawFindings(named=(effect("s"),)), STANDARD)
    assert "lag would take part of the gap" in found.difference and " s " not in found.difference
    assert not combine(proven, LawFindings(named=(effect("s"), effect("lag"))), STANDARD).difference
    resolved = combine(exact("ambiguous", "a", ambiguous=(("a", "b"),)), LawFindings(named=(effect("a"),)), STANDARD)
    assert (resolved.verdict, resolved.named, resolved.difference) == ("named", ("a",), "")


@pytest.mark.parametrize(
    ("chosen", "noise", "open_"),
    [
        (exact("none"), 1.0, False),
        (exact("insufficient-data"), 1.0, False),
        (exact("unexplained"), 1.0, True),
        (exact("named", "a", left=1.19), 1.0, False),
        (exact("named", "a", left=1.21), 1.0, True),
        (exact("named", "a", left=2.6), 1.0, True),
        (exact("named", "a", left=12.0), 1.0, True),
        (exact("ambiguous", "a", left=1.19), 1.0, False),
        (exact("ambiguous", "a", left=12.0), 1.0, True),
        # within what the noise can be
        (exact("named", "a", left=12.0), 12.0, False),
        (exact("named", "a", left=12.0), 30.0, False),
    ],
)
def test_a_law_is_examined_only_where_the_base_does_not_leave_the_noise(
    chosen: Selection, noise: float, open_: bool
) -> None:
    assert worth_examining(chosen, Floors(noise, True, fitted=noise), STANDARD) == open_


@pytest.mark.parametrize("verdict", ["named", "ambiguous"])
def test_what_leaves_a_guessed_floor_is_believed_if_no_law_leaves_clearly_less(verdict: str) -> None:
    chosen = exact(verdict, "a", left=1.1)
    assert leaves_noise(chosen, MEASURED, STANDARD)
    assert not leaves_noise(exact(verdict, "a", left=12.0), MEASURED, STANDARD)
    assert not leaves_noise(exact("none"), MEASURED, STANDARD)
    assert worth_examining(chosen, Floors(1.0, False), STANDARD)
    assert not worth_examining(chosen, Floors(1.0, True), STANDARD)
    for left, believed in ((0.012, True), (0.020, False)):
        errors = LawErrors(base=0.05, law=0.01, after=0.01, noise=0.002, exact=left, open=0.01)
        found = combine(chosen, LawFindings(errors=errors), STANDARD, noisy=True)
        assert (found.verdict, found.taken_back) == ((verdict, False) if believed else ("unexplained", True))
        same = combine(chosen, LawFindings(errors=errors, named=(effect("a"),)), STANDARD, noisy=True)
        assert same.law_is_open is not believed


def test_by_a_guessed_floor_a_base_is_exact_only_if_an_examination_confirms_its_effects() -> None:
    errors = LawErrors(base=0.05, law=0.01, after=0.01, noise=0.002, exact=0.01, open=0.01)
    any_law = (Confounded(name="b", reason="it breaks no invariance: any law may have it", test=""),)
    for effects, named, believed in (
        (("a",), ("a",), True),
        (("a", "c"), ("a",), True),
        # one that it cannot judge, alone and beside one that stands whatever the law is
        (("b",), (), True),
        (("a", "b"), ("a",), False),
        # an effect that the base lacks
        (("a",), ("s",), False),
        (("a",), ("a", "s"), False),
    ):
        examined = LawFindings(errors=errors, named=tuple(map(effect, named)), confounded=any_law)
        for told in (False, True):
            found = combine(exact("named", *effects, left=1.1), examined, STANDARD, noisy=True, told=told)
            assert found.named == (effects if believed or told else named)
            assert found.law_is_open is not (believed or told)


@pytest.mark.parametrize(("left", "known"), [(0.01, True), (0.03, False)])
def test_a_base_as_good_as_any_law_tells_an_effect_from_what_any_law_may_have(left: float, known: bool) -> None:
    errors = LawErrors(base=0.05, law=0.01, after=0.01, noise=0.002, exact=left, open=0.01)
    any_law = tuple(Confounded(name=n, reason="any law may have it", test="") for n in ("late", "b"))
    lag = effect("lag", Invariance.CURRENT, "late", "slow")
    examined = LawFindings(errors=errors, named=(lag,), confounded=any_law)
    found = combine(exact("named", "lag", "b", left=1.1), examined, STANDARD, noisy=True)
    assert found.ambiguous == ((("lag", "slow") if known else ("lag", "late", "slow")),)
    if known:
        both = combine(exact("named", "lag", "late", left=1.1), examined, STANDARD, noisy=True)
        assert both.named == ("lag", "late") and not both.law_is_open


@pytest.mark.parametrize("measured", [False, True])
def test_no_examination_overrules_a_base_that_lacks_nothing(measured: bool) -> None:
    assert not worth_examining(exact("none"), Floors(1.0, measured), STANDARD)
    found = combine(exact("none"), LawFindings(named=(effect("s"),)), STANDARD)
    assert (found.verdict, found.named, found.law_is_open, found.law_may_be_off) == ("none", (), False, False)


def test_a_floor_that_was_guessed_cannot_say_that_data_are_too_few() -> None:
    assert worth_examining(exact("insufficient-data"), Floors(1.0, False), STANDARD)
    assert not worth_examining(exact("insufficient-data"), Floors(1.0, True), STANDARD)
    nothing = combine(exact("insufficient-data"), LawFindings(), STANDARD)
    assert (nothing.verdict, nothing.named) == ("insufficient-data", ())
    assert combine(exact("insufficient-data"), LawFindings(named=(effect("s"),)), STANDARD).named == ("s",)


@pytest.mark.parametrize("verdict", ["named", "ambiguous"])
def test_a_guessed_floor_in_line_with_those_measured_is_trusted_where_only_noise_is_left(verdict: str) -> None:
    at, above = (exact(verdict, "a", left=left) for left in (STANDARD.examined_above_floor - 0.01, 1.3))
    in_line = Floors(1.0, measured=False, told=True)
    assert not worth_examining(at, in_line, STANDARD)
    assert worth_examining(at, Floors(1.0, measured=False), STANDARD)
    assert worth_examining(above, in_line, STANDARD)
    assert worth_examining(exact("unexplained", left=1.0), in_line, STANDARD)


def test_other_laws_are_fitted_only_where_the_base_is_not_taken_as_exact() -> None:
    believed = LawFindings(errors=LawErrors(base=0.05, law=0.01, after=0.01, noise=0.002, exact=0.01, open=0.01))
    assert not combine(exact("named", "a"), believed, STANDARD, noisy=True).law_may_be_off
    assert not combine(exact("none"), LawFindings(), STANDARD).law_may_be_off
    assert combine(exact("named", "a"), LawFindings(), STANDARD).law_may_be_off
    assert combine(exact(), LawFindings(), STANDARD).law_may_be_off


NAMES = st.sampled_from(["a", "b", "c", "d"])


@given(
    st.lists(NAMES, unique=True, max_size=3),
    st.lists(NAMES, unique=True, max_size=2),
    st.lists(st.tuples(st.sampled_from(list(Invariance)), st.floats(0.0, 1.0)), max_size=2),
    st.sampled_from(list(Invariance)),
)
def test_every_name_is_in_one_place_and_the_verdict_says_which(
    named: list[str], rivals: list[str], rows: list[tuple[Invariance, float]], breaks: Invariance
) -> None:
    effects = tuple(
        effect(n, breaks, *(r for r in dict.fromkeys(rivals) if r not in named and k == 0)) for k, n in enumerate(named)
    )
    found = combine(exact(), LawFindings(named=effects, broken=tuple(broken(k, i) for i, k in rows)), STANDARD)
    sets = {n for group in found.ambiguous for n in group}
    shadows = {s.name for s in found.shadows}
    assert not set(found.named) & sets and not shadows & ({*found.named} | sets)
    assert set(named) <= {*found.named} | sets | shadows
    assert found.verdict == ("ambiguous" if sets else "named" if found.named else "unexplained")


@pytest.mark.parametrize(
    ("verdict", "left", "noise", "errs"),
    [
        ("unexplained", 1.1, 1.0, True),
        ("named", 1.1, 1.0, False),
        ("named", 1.3, 1.0, True),
        # where the noise is not known, what is in sight may be no noise
        ("named", 1.3, 6.0, False),
        ("named", 2.6, 6.0, True),
    ],
)
def test_a_model_may_err_where_more_is_left_than_noise_or_more_than_is_sure_to_be(
    verdict: str, left: float, noise: float, errs: bool
) -> None:
    assert may_err(exact(verdict, "inertia", left=left), Floors(noise, False, fitted=noise), STANDARD) == errs
