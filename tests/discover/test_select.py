"""The decision on invented evidence: what is named, what is not, and why; no simulation, milliseconds each."""

import ast
from collections.abc import Sequence
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mrfit.discover
from mrfit.discover.evidence.gather import gather
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection.duels import Inquiry
from mrfit.discover.selection.exact_base import (
    ExactBase,
    Selection,
    decide,
    select,
    take_back,
    without_idle,
    without_noise,
)
from mrfit.discover.selection.questions import Contrast, Fit, Growth, Join, Repetition, Try
from mrfit.discover.selection.rules import leaves_too_much
from tests.discover.world import UNCLEAR, World, fit


def chosen(world: World, policy: Policy = STANDARD) -> Selection:
    return select(gather(world, policy), policy)


def test_where_only_noise_is_left_nothing_is_named() -> None:
    found = chosen(World({(): 1.02, ("a",): 1.02, ("b",): 1.02}))
    assert (found.verdict, found.final.effects) == ("none", ())
    assert found.reasons["a"] == "it does not lower the error on held-out conditions"


def test_an_effect_with_proof_is_named_and_one_without_is_not() -> None:
    found = chosen(World({(): 10.0, ("a",): 1.05, ("b",): 9.99}))
    assert (found.verdict, found.named) == ("named", ("a",))
    assert found.reasons["a"] == "its parameter is 50 standard errors from neutral"
    unclear = chosen(World({(): 10.0, ("a",): 8.0}, strengths={"a": UNCLEAR}))
    assert unclear.final.effects == ()
    assert unclear.reasons["a"] == "its parameter is only 0.1 standard errors from neutral"
    by_chance = chosen(World({(): 10.0, ("a",): 8.0}, falls={("a",): 1.0}))
    assert by_chance.reasons["a"] == "its gain on held-out conditions may be chance"


def test_an_effect_that_the_data_cannot_show_is_never_fitted_and_says_why() -> None:
    world = World({(): 10.0, ("a",): 1.05}, unseen=("z",))
    found = chosen(world)
    assert found.reasons["z"] == "cannot be judged: no channel"
    assert not [q for q in world.asked if isinstance(q[1], Try) and q[1].candidate.name == "z"]


def test_an_effect_that_does_not_help_is_never_asked_for_its_interval() -> None:
    world = World({(): 3.0, ("a",): 3.0, ("b",): 2.5}, falls={("b",): 1.0})
    chosen(world)
    assert not [q for q in world.asked if q[0] == "strength"]
    assert {q[2].effects for q in world.asked if q[0] == "fall"} == {("b",)}
    overwhelming = World({(): 10.0, ("a",): 1.05})
    chosen(overwhelming)
    assert [q for q in overwhelming.asked if q[0] == "strength"]
    assert not [q for q in overwhelming.asked if q[0] == "fall"]


@pytest.mark.parametrize(("narrow", "left", "named"), [(1.3, 1.05, "dry"), (2.0, 1.2, "dry"), (2.8, 1.2, "falling")])
def test_a_wider_form_takes_a_visible_share_of_the_gap_beside_the_narrow_one(
    narrow: float, left: float, named: str
) -> None:
    """Friction that falls with speed is mistaken for one that does not, whose shape it has, too."""
    world = World(
        {(): 10.0, ("dry",): narrow, ("falling",): left},
        aliases={"dry": ("falling",)},
        shapes={"dry": {"r": 0.5}, "falling": {"r": 0.5, "vs": 0.5}},
        cosines={("dry", "falling"): 0.95},
        strengths={"dry in dry+falling": UNCLEAR},
    )
    found = chosen(world)
    assert found.named == (named,)
    if named == "dry":
        assert found.reasons["falling"] == "its wider form takes hardly more of the gap than dry"
        # neither of two of which neither is the wider form of the other gives way
        for other in (replace(world, shapes={"falling": {"vs": 0.5}}), replace(world, aliases={})):
            assert chosen(other).named == ("falling",)


def test_a_wider_form_that_leaves_a_little_less_than_a_floor_is_no_better() -> None:
    """The narrow form leaves 4 % more than the noise: many times nothing, and next to nothing of the gap."""
    world = World(
        {(): 10.0, ("dry",): 1.04, ("falling",): 0.97},
        aliases={"dry": ("falling",)},
        shapes={"dry": {"r": 0.5}, "falling": {"r": 0.5, "vs": 0.5}},
        strengths={"dry in dry+falling": UNCLEAR, "falling in dry+falling": UNCLEAR},
    )
    found = chosen(world)
    assert (
        found.named == ("dry",) and found.reasons["falling"] == "its wider form takes hardly more of the gap than dry"
    )
    assert chosen(replace(world, aliases={})).named == ("falling",)


@pytest.mark.parametrize(("dry", "falling"), [(1.05, 1.12), (1.12, 1.05)])
def test_of_a_wide_and_a_narrow_form_that_both_leave_noise_the_narrow_one_is_named(dry: float, falling: float) -> None:
    world = World(
        {(): 10.0, ("dry",): dry, ("falling",): falling},
        aliases={"dry": ("falling",)},
        shapes={"dry": {"r": 0.5}, "falling": {"r": 0.5, "vs": 0.5}},
        strengths={"dry in dry+falling": UNCLEAR, "falling in dry+falling": UNCLEAR},
    )
    assert chosen(world).named == ("dry",) and chosen(world).ambiguous == ()
    # neither is the wider form of the other
    assert chosen(replace(world, aliases={})).named == (("dry",) if dry < falling else ("falling",))


def test_of_two_alike_that_are_fitted_together_one_start_has_half_of_each() -> None:
    world = World({(): 10.0, ("a",): 1.5, ("b",): 1.5}, shapes={"a": {"v": 0.5}}, values={"a.k": 8.0, "b.k": 3.0})
    chosen(world)
    together = [q[1] for q in world.asked if isinstance(q[1], Join) and set(q[1].effects) == {"a", "b"}]
    assert {"a.k": 4.0, "b.k": 1.5} in together[0].starts


def test_of_two_that_change_one_input_the_second_has_to_take_more_of_the_gap() -> None:
    """With shapes of its own it follows what the first leaves, though their sensitivities were not parallel."""
    world = World({(): 8.4, ("play",): 1.45, ("slip",): 2.4, ("play", "slip"): 1.1})
    both = {"play": ("slip",), "slip": ("play",)}
    assert chosen(world).named == ("play", "slip")
    assert chosen(replace(world, of_one_input=both)).named == ("play",)
    much = replace(world, errors={(): 8.4, ("play",): 2.0, ("slip",): 2.4, ("play", "slip"): 1.1})
    assert chosen(replace(much, of_one_input=both)).named == ("play", "slip")


def test_two_that_leave_the_same_alone_and_together_are_ambiguous() -> None:
    found = chosen(World({(): 10.0, ("a",): 1.5, ("b",): 1.5}))
    assert (found.verdict, found.named) == ("ambiguous", ())
    assert found.ambiguous == (("a", "b"),)
    assert found.reasons["b"] == "these data cannot tell it from a"


def test_a_shadow_adds_nothing_beside_what_it_imitates() -> None:
    errors = {(): 10.0, ("a",): 1.2, ("b",): 5.0, ("a", "b"): 1.2}
    found = chosen(World(errors))
    assert (found.verdict, found.named) == ("named", ("a",))
    assert found.reasons["b"] == "it adds nothing beside a"


def test_the_better_fit_loses_to_a_rival_beside_which_it_has_no_proof() -> None:
    errors = {(): 10.0, ("a",): 1.9, ("b",): 2.0, ("a", "b"): 1.05}
    found = chosen(World(errors, strengths={"a in a+b": UNCLEAR}))
    assert found.named == ("b",) and found.reasons["a"] == "it adds nothing beside b"
    assert chosen(World(errors, strengths={"b in a+b": UNCLEAR})).named == ("a",)
    assert chosen(World(errors)).named == ("a", "b")


def test_of_two_alike_the_one_whose_shape_ends_at_a_bound_is_the_limit_of_the_other() -> None:
    errors = {(): 10.0, ("a",): 1.5, ("b",): 1.5}
    aliases = {"a": ("b",), "b": ("a",)}
    found = chosen(World(errors, aliases=aliases, shapes={"a": {"v": 0.99}}))
    assert found.named == ("b",)
    assert found.reasons["a"] == "its shape ends at a bound, where it is no other than b"
    assert chosen(World(errors, aliases=aliases, shapes={"b": {"v": 0.01}})).named == ("a",)
    assert chosen(World(errors, aliases=aliases, shapes={"a": {"v": 0.5}})).verdict == "ambiguous"
    assert chosen(World(errors, shapes={"a": {"v": 0.99}})).verdict == "ambiguous"


def test_a_rival_that_leaves_far_more_for_certain_is_no_equal() -> None:
    errors = {(): 10.0, ("a",): 1.5, ("b",): 2.4}
    together = {"a in a+b": UNCLEAR, "b in a+b": UNCLEAR}
    assert chosen(World(errors, strengths=together)).reasons["b"] == "it closes less of the gap than a"
    # b leaves more than twice what a leaves, but that may be chance
    by_chance = World(errors, strengths=together, falls={("a",): 1.0})
    assert chosen(by_chance).verdict == "ambiguous"


def test_two_effects_are_both_named_where_each_has_proof_beside_the_other() -> None:
    found = chosen(World({(): 20.0, ("a",): 8.0, ("b",): 18.0, ("a", "b"): 1.05}))
    assert (found.verdict, found.named) == ("named", ("a", "b"))


def test_two_effects_neither_of_which_helps_alone_are_found_as_a_pair() -> None:
    errors = {(): 10.0, ("a",): 10.0, ("b",): 10.0, ("c",): 9.99, ("a", "b"): 1.05}
    assert chosen(World(errors)).named == ("a", "b")
    assert chosen(World(errors | {("a", "b"): 9.99})).final.effects == ()


def test_no_pair_is_fitted_where_little_is_left() -> None:
    world = World({(): 1.3, ("a",): 1.3, ("b",): 1.3})
    chosen(world)
    assert not [q for q in world.asked if isinstance(q[1], Join)]
    far = World({(): 10.0, ("a",): 10.0, ("b",): 10.0})
    chosen(far)
    assert [q for q in far.asked if isinstance(q[1], Join)]


def test_no_pair_is_asked_for_what_may_be_noise() -> None:
    errors = {(): 5.0, ("a",): 1.6, ("b",): 5.0, ("c",): 5.0, ("a", "b", "c"): 1.0}
    known, unknown = World(errors), World(errors, noise=2.4)
    assert (chosen(known).final.effects, chosen(unknown).final.effects) == (("a", "b", "c"), ("a",))


def test_effects_of_a_pair_are_not_judged_by_a_search_that_ended_worse() -> None:
    errors = {(): 7.0, ("a",): 2.2, ("b",): 7.0, ("c",): 7.0, ("a", "b"): 6.0, ("a", "c"): 6.0}

    class WorldOfWorseSearches(World):
        """Answers in which a search with one effect more may end where more is left."""

        def fitted(self, effects: Sequence[str]) -> Fit:
            own = tuple(sorted(effects))
            return fit(self.errors[own], *own, number=hash(own)) if own in self.errors else super().fitted(effects)

    strengths = {"a": 9.0, "b": 2.0, "c": 2.0}
    found = chosen(WorldOfWorseSearches({**errors, ("a", "b", "c"): 1.4}, strengths=strengths))
    assert "b" not in found.final.effects and "c" not in found.final.effects


def test_what_was_put_in_one_by_one_and_leaves_too_much_gives_way_to_a_pair() -> None:
    errors = {(): 20.0, ("c",): 6.0, ("a",): 19.0, ("b",): 19.0, ("a", "b"): 1.05}
    found = chosen(World(errors))
    assert found.named == ("a", "b")
    assert found.reasons["c"].startswith("it adds nothing beside")
    alone = chosen(World({k: v for k, v in errors.items() if k != ("a", "b")}))
    assert alone.taken_back and alone.verdict == "unexplained"


def test_effects_that_leave_too_much_together_are_taken_back_and_said_to_take_part() -> None:
    found = chosen(World({(): 10.0, ("a",): 6.0}))
    assert (found.verdict, found.final.effects, found.proven.effects) == ("unexplained", (), ("a",))
    assert found.reasons["a"].startswith("a would take part of the gap, too little")
    assert chosen(World({(): 10.0, ("a",): 1.9})).verdict == "named"


def test_all_effects_with_proof_are_taken_back_though_one_was_dropped_before() -> None:
    base, one, both = fit(10.0), fit(7.0, "a"), fit(6.0, "a", "b")
    before = Selection(base, one, both, World({(): 10.0}).ask_screening())
    after = take_back(before, 1.0, STANDARD)
    assert after.taken_back and after.final == base and after.proven == both
    assert set(after.reasons) == {"a", "b"} and after.reasons["b"].startswith("a and b together would take part")
    assert not before.taken_back and before.final == one and before.reasons == {}
    little = replace(before, final=fit(1.1, "a", "b"), proven=fit(1.1, "a", "b"))
    assert take_back(little, 1.0, STANDARD) is little


def test_what_stays_of_a_pair_and_takes_nothing_is_not_named() -> None:
    errors = {(): 1.5, ("a",): 2.0, ("b",): 1.0, ("c",): 2.0, ("a", "b"): 1.0, ("a", "c"): 1.375, ("b", "c"): 1.0}
    strengths = {"a": 5.0, "b": 0.0, "c": 5.0}
    found = chosen(World({**errors, ("a", "b", "c"): 1.0}, noise=1.2, strengths=strengths))
    assert found.verdict != "named" and found.final == found.base
    assert found.reasons["c"] == "what was left beside it does not lower the error on held-out conditions"
    base, better = fit(2.0), fit(1.5, "a")
    held = Selection(base, better, better, World({(): 2.0}).ask_screening())
    assert without_idle(held) is held and without_idle(replace(held, final=fit(2.0, "a"))).final == base


@pytest.mark.parametrize(
    ("base", "final", "named"),
    [
        # fitted and held out, in multiples of the noise floors
        ((0.98, 0.99), (0.97, 0.96), False),
        ((1.04, 1.04), (0.8, 0.8), False),
        # something is left above the floors, of one role at least
        ((0.98, 1.06), (0.97, 0.96), True),
        ((1.06, 0.98), (0.97, 0.96), True),
        # the floors are too high: nothing can be said by them
        ((1.0, 1.0), (0.7, 0.9), True),
        ((1.0, 1.0), (0.9, 0.7), True),
    ],
)
def test_what_takes_a_part_of_the_noise_is_not_named(
    base: tuple[float, float], final: tuple[float, float], named: bool
) -> None:
    alone, beside = fit(base[1], train=base[0]), fit(final[1], "a", train=final[0])
    chosen = Selection(alone, beside, beside, World({(): base[1]}).ask_screening(), ambiguous=(("a", "b"),))
    found = without_noise(chosen, STANDARD)
    assert (found is chosen) == named
    if not named:
        assert found.final == alone and found.ambiguous == ()
        assert found.reasons == {"a": "the error without it is that of the noise"}


@pytest.mark.parametrize(
    ("place", "aliases", "alone", "named"),
    [
        # a wider form that ended at an end of its range, beside the one that it then is
        (0.99, {"b": ("a",)}, 1.3, ("b",)),
        (0.50, {"b": ("a",)}, 1.3, ("a", "b")),
        (0.99, {}, 1.3, ("a", "b")),
        # without it too much is left
        (0.99, {"b": ("a",)}, 9.0, ("a", "b")),
    ],
)
def test_an_effect_at_an_end_of_its_form_goes_where_the_one_it_is_mistaken_for_is_enough(
    place: float, aliases: dict[str, tuple[str, ...]], alone: float, named: tuple[str, ...]
) -> None:
    errors = {(): 20.0, ("a",): 15.0, ("b",): alone, ("a", "b"): 1.05}
    world = World(errors, aliases=aliases, shapes={"a": {"v": place}})
    both = world.fitted(("a", "b"))
    chosen = Selection(world.base, both, both, world.ask_screening())
    comparison = ExactBase(Inquiry(world, STANDARD, world.ask_screening()))
    found = comparison.without_limit(chosen, "a")
    assert (chosen if found is None else found).effects == named
    assert found is None or found.reasons["a"].startswith("beside b it ended at an end of its form")
    assert comparison.without_limit(chosen, "b") is None


def test_an_effect_that_follows_a_drift_is_taken_out() -> None:
    errors = {(): 10.0, ("a",): 1.05}
    drifting = chosen(World(errors, growing={"a": Growth(0.1, 0.2, 0.01)}))
    assert drifting.final.effects == () and [d.effect for d in drifting.drifting] == ["a"]
    assert drifting.reasons["a"] == "it changes by 50% in half a record: a drift, not this effect"
    steady = chosen(World(errors, growing={"a": Growth(0.1, 2.0, 0.01)}))
    assert steady.named == ("a",) and not steady.drifting
    # a strength that is neutral, as at a bound, has no part in the effect
    without = chosen(World(errors, growing={"a": Growth(0.1, 0.0, 0.01)}))
    assert without.named == ("a",) and not without.drifting


def test_of_two_effects_the_one_that_takes_less_than_is_left_is_taken_out() -> None:
    errors = {(): 20.0, ("a",): 4.0, ("b",): 19.0}
    found = chosen(World(errors | {("a", "b"): 2.8}), replace(STANDARD, above_the_rest=2.0))
    assert found.proven.effects == ("a", "b") and found.final.effects == ("a",)
    assert found.reasons["b"] == "it takes less than what is left without a name"
    kept = chosen(World(errors | {("a", "b"): 2.8}))
    assert kept.final.effects == ("a", "b")


def test_a_first_effect_that_a_later_one_makes_idle_is_taken_out() -> None:
    errors = {(): 20.0, ("a",): 8.0, ("b",): 19.9, ("c",): 19.9, ("a", "b"): 5.0, ("b", "c"): 1.05}
    world = World(errors, aliases={"a": ("c",)})
    assert chosen(world).named == ("b", "c")


def test_no_more_rounds_are_made_than_the_policy_allows() -> None:
    errors = {(): 32.0, ("a",): 16.0, ("a", "b"): 6.0, ("a", "b", "c"): 1.2}
    assert chosen(World(errors)).proven.effects == ("a", "b", "c")
    assert chosen(World(errors), replace(STANDARD, most_rounds=2)).proven.effects == ("a", "b")


@pytest.mark.parametrize(
    ("error", "noise", "structure", "word"),
    [
        (1.1, 5.0, 0.9, "none"),
        (3.0, 5.0, 0.0, "insufficient-data"),
        (3.0, 5.0, 0.9, "unexplained"),
        (8.0, 5.0, 0.0, "unexplained"),
        (8.0, float("inf"), 0.0, "insufficient-data"),
        (1.1, 1.0, 0.9, "none"),
        (3.0, 1.0, 0.0, "none"),
        (3.0, 1.0, 0.9, "unexplained"),
        (9.0, 1.0, 0.0, "unexplained"),
    ],
)
def test_the_word_for_what_is_left(error: float, noise: float, structure: float, word: str) -> None:
    assert chosen(World({(): error}, noise=noise, predicted=structure)).verdict == word


def test_errors_that_repeat_or_follow_the_output_are_no_noise() -> None:
    quiet = World({(): 1.1})
    assert chosen(quiet).verdict == "none"
    assert chosen(replace(quiet, repeating=Repetition(2.5))).verdict == "unexplained"
    assert chosen(replace(quiet, repeating=Repetition(1.0, (Contrast(0.5, 3.0),) * 6))).verdict == "unexplained"
    assert chosen(replace(quiet, repeating=Repetition(1.0, (Contrast(-0.5, -3.0),) * 6))).verdict == "none"
    assert chosen(replace(quiet, repeating=Repetition(1.0, (Contrast(0.5, 3.0),) * 4))).verdict == "none"


def test_evidence_gathered_under_another_policy_that_asks_for_less_is_refused() -> None:
    evidence = gather(World({(): 10.0, ("a",): 1.05, ("b",): 10.0}), STANDARD)
    assert select(evidence, STANDARD).named == ("a",)
    assert select(evidence, replace(STANDARD, region_told=0.5)) == select(evidence, STANDARD)
    with pytest.raises(LookupError, match="the evidence does not answer"):
        select(evidence, replace(STANDARD, worth_a_refit=2.0))


def test_evidence_and_policy_and_selection_cannot_be_changed() -> None:
    evidence = gather(World({(): 10.0, ("a",): 1.05}), STANDARD)
    with pytest.raises(FrozenInstanceError):
        evidence.rows = ()  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        STANDARD.clear = 1.0  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError):
        select(evidence, STANDARD).verdict = "none"  # type: ignore[misc]


def test_what_decides_imports_nothing_that_simulates_reads_or_writes() -> None:
    room = Path(mrfit.discover.__path__[0])
    allowed = ("mrfit.discover.policy", "mrfit.discover.selection.", "mrfit.discover.invariance.findings")
    for path in (*room.glob("selection/*.py"), room / "policy.py", room / "invariance" / "findings.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("mrfit.discover"):
                assert (node.module or "").startswith(allowed), f"{path.name} imports {node.module}"
            assert not (isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "open")


ERRORS = st.floats(1.0, 30.0)


@st.composite
def worlds(draw: st.DrawFn) -> World:
    errors = {(): draw(ERRORS)}
    for effects in (("a",), ("b",), ("c",), ("a", "b"), ("a", "c"), ("b", "c"), ("a", "b", "c")):
        errors[effects] = draw(ERRORS)
    return World(
        errors,
        noise=draw(st.sampled_from([1.0, 1.0, 3.0])),
        strengths={n: draw(st.floats(0.0, 10.0)) for n in "abc"},
        cosines={("a", "b"): draw(st.floats(-1.0, 1.0))},
        aliases={"a": draw(st.sampled_from([(), ("b",), ("b", "c")]))},
        predicted=draw(st.floats(-0.5, 1.0)),
    )


@given(worlds())
@settings(max_examples=40, deadline=None)
def test_in_any_world_the_same_evidence_gives_the_same_selection_and_names_stand_on_what_they_take(
    world: World,
) -> None:
    evidence = gather(world, STANDARD)
    first = select(evidence, STANDARD)
    assert first == select(evidence, STANDARD) == decide(world, STANDARD)
    assert set(first.reasons) == {"a", "b", "c"}
    if first.verdict == "named":
        assert first.final.holdout < first.base.holdout
        assert not leaves_too_much(first.base, first.final, world.noise, STANDARD)
    if first.verdict in ("none", "unexplained", "insufficient-data"):
        assert first.final == first.base and not first.ambiguous
    assert set(first.final.effects) <= set("abc")
