"""Effects that no law makes are chosen on invented rows: nothing is regressed, each step shows by what was asked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import t as student

from mrfit.core.specs import Invariance
from mrfit.discover.policy import STANDARD, Policy
from mrfit.discover.selection import law_rules
from mrfit.discover.selection.any_law import AnyLaw, LawSelection, choose
from mrfit.discover.selection.law_rules import (
    FULL,
    TIME,
    EffectDescription,
    EffectPair,
    LawCandidate,
    LawFit,
    LawScreening,
    RefinedEffect,
    State,
)
from mrfit.discover.selection.stepwise import grow
from mrfit.io.schemas.discovery import BrokenInvariance, EffectParameter, EffectSignificance

GOOD = EffectSignificance(share=0.6, kept=0.5, held=0.4, size=0.05, z=20.0, left=0.1, improved=1.0)
FORCE = EffectParameter(name="largest force", unit="N", value=100.0, low=90.0, high=110.0)
NUMBER = EffectParameter(name="k", unit="N/m", value=10.0, low=9.0, high=11.0)


@dataclass
class LawWorld:
    """Answers from tables.

    Attributes
    ----------
    shares
        Of the residual that each effect could take, to first order.
    rows
        What differs from a good standing of an effect: by its name, or more precisely by ``a longer``, ``a weighed``.
    pairs, unnamed
        Pairs that could take something, and invariances that something without a name breaks beside a state.
    levels, invariances, constant
        Of effects.
    taken
        What an effect takes beside flexible terms: share and standard errors.
    number, moved
        Parameter of every effect, and what a longer memory moves it by.
    """

    shares: Mapping[str, float]
    rows: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    pairs: Sequence[EffectPair] = ()
    unnamed: Mapping[tuple[str, ...], Sequence[BrokenInvariance]] = field(default_factory=dict)
    levels: Mapping[str, int] = field(default_factory=dict)
    invariances: Mapping[str, Invariance] = field(default_factory=dict)
    constant: Sequence[str] = ()
    taken: tuple[float, float] = (0.5, 20.0)
    number: EffectParameter = NUMBER
    moved: float = 0.0
    asked: list[tuple[Any, ...]] = field(default_factory=list)
    groups: int = 8

    @property
    def library(self) -> dict[str, law_rules.TestedEffect]:
        """Effects as they are tested."""
        return {
            n: law_rules.TestedEffect(
                self.invariances.get(n, Invariance.POSITION), self.levels.get(n, FULL), n in self.constant
            )
            for n in self.shares
        }

    def screen(self, state: State, weighed: State) -> LawScreening:
        """Return the effects that are not there yet."""
        lacking = {n: s for n, s in self.shares.items() if n not in state}
        pairs = tuple(p for p in self.pairs if set(p.names) <= set(lacking))
        return LawScreening(tuple(LawCandidate(n, s, 0.1, (1.0,)) for n, s in lacking.items()), pairs)

    def refit(self, start: State, weighed: State, names: Sequence[str], level: int, longer: bool = False) -> LawFit:
        """Return effects as they were, with the standing of some."""
        self.asked.append((tuple(start), tuple(weighed), tuple(names), level, longer))
        return LawFit(start, tuple(self._described(n, weighed, longer) for n in names))

    def _described(self, name: str, weighed: State, longer: bool) -> EffectDescription:
        own = dict(self.rows.get(name, {}))
        own |= self.rows.get(f"{name} longer", {}) if longer else {}
        own |= self.rows.get(f"{name} weighed", {}) if name in weighed else {}
        other = {n: own.pop(n) for n in ("error", "sign", "numbers", "unsure") if n in own}
        row = RefinedEffect(name, replace(GOOD, **own), **{"error": 1.0, **other})
        number = replace(self.number, value=self.number.value + self.moved * longer)
        return EffectDescription(row, (number,), FORCE)

    def left(self, state: State, longer: bool = False) -> float:
        """Return the error of the best law, the same for any."""
        return 1.0

    def broken(self, state: State, longer: bool = False) -> tuple[BrokenInvariance, ...]:
        """Return the invariances that are broken beside a state."""
        self.asked.append(("broken", tuple(state)))
        return tuple(self.unnamed.get(tuple(state), ()))

    def beside(self, state: State, name: str, invariance: Invariance) -> tuple[float, float]:
        """Return what an effect takes beside flexible terms."""
        self.asked.append(("beside", name, invariance))
        return self.taken


def selected(world: LawWorld, policy: Policy = STANDARD) -> LawSelection:
    return AnyLaw(world, policy).selected()


WEAK = {"z": 1.0}


def test_an_effect_without_objection_is_added_and_every_other_has_its_reason() -> None:
    found = selected(LawWorld({"a": 0.6, "b": 0.3, "c": 0.05}, {"b": WEAK | {"share": 0.1}}))
    assert found.effects == ("a",)
    assert found.reasons["b"] == "only 1.0 standard errors from neutral"
    assert found.reasons["c"] == "takes only 5% of what no law makes"
    assert [d.row.name for d in found.found] == ["a"]
    assert found.screened["c"].share == 0.05 and set(found.rows) == {"a", "b"}


def test_effects_are_added_one_by_one_but_no_more_than_are_named() -> None:
    world = LawWorld({n: 0.3 for n in "abcde"})
    assert len(selected(world).effects) == STANDARD.most_named == 4
    assert len(selected(world, replace(STANDARD, most_named=2)).effects) == 2


def test_an_effect_is_refined_beside_as_much_of_a_law_as_it_can_be_told_from() -> None:
    world = LawWorld({"a": 0.6}, levels={"a": TIME})
    selected(world)
    assert world.asked[0] == (("a",), (), ("a",), TIME, False)
    # beside the others all of a law takes part
    assert world.asked[-1] == (("a",), ("a",), ("a",), FULL, False)


def test_where_none_stands_the_one_that_takes_most_is_weighed_by_what_is_left_beside_it() -> None:
    strong = {"share": 0.7, "kept": 0.7, "z": 3.0}
    rows = {"a": WEAK, "a weighed": strong, "b": WEAK | {"share": 0.5}}
    world = LawWorld({"a": 0.3, "b": 0.5}, rows)
    found = grow(AnyLaw(world, STANDARD), LawSelection())
    weighed = [q for q in world.asked if q[2] == ("a",) and q[1] == ("a",)]
    assert found.effects == ("a",) and len(weighed) == 1
    assert found.rows["a"].standing.z == 3.0


def test_an_effect_is_weighed_in_a_few_rounds_only() -> None:
    world = LawWorld({"a": 0.6}, {"a": WEAK})
    assert selected(world).effects == ()
    assert [q[1] for q in world.asked] == [(), *STANDARD.most_weighings * [("a",)]]


def test_what_takes_little_is_not_weighed_again() -> None:
    world = LawWorld({"a": 0.6}, {"a": WEAK | {"share": 0.14}})
    assert selected(world).effects == ()
    assert [q[1] for q in world.asked] == [()]


PAIR = EffectPair(("a", "b"), 0.5, ((1.0,), (2.0,)))


def test_two_that_oppose_each_other_are_added_together_if_both_have_proof() -> None:
    world = LawWorld({"a": 0.05, "b": 0.05}, pairs=[PAIR], levels={"a": TIME})
    found = selected(world)
    assert found.effects == ("a", "b") and dict(found.state) == {"a": (1.0,), "b": (2.0,)}
    assert world.asked[0] == (("a", "b"), (), ("a", "b"), TIME, False)
    assert selected(replace(world, rows={"b": WEAK})).effects == ()
    assert selected(world, replace(STANDARD, most_named=1)).effects == ()


@pytest.mark.parametrize(("breaks", "stays"), [(Invariance.POSITION, False), (Invariance.MEMORY, True)])
def test_beside_a_force_of_the_place_a_constant_force_is_none_of_its_own(breaks: Invariance, stays: bool) -> None:
    world = LawWorld(
        {"offset": 0.6, "spring": 0.5},
        constant=["offset"],
        invariances={"offset": Invariance.ODDNESS, "spring": breaks},
    )
    found = selected(world)
    assert ("offset" in found.effects) is stays and "spring" in found.effects
    reason = found.reasons["offset"]
    assert (reason == "the origin of a force of the place may be anywhere") is not stays


def test_the_weakest_without_proof_beside_the_others_goes_first_and_the_others_are_judged_again() -> None:
    rows = {"a weighed": {"z": 1.0, "share": 0.4}, "b weighed": {"z": 1.0, "share": 0.3}}
    world = LawWorld({"a": 0.6, "b": 0.5}, rows)
    state = {"a": (1.0,), "b": (1.0,)}
    found = AnyLaw(world, STANDARD).judged_together(LawSelection(state=state))
    assert found.effects == () and found.found == ()
    assert list(found.reasons) == ["b", "a"]
    assert found.reasons["b"] == "beside the others only 1.0 standard errors from neutral"
    unsure = LawWorld({"a": 0.6}, {"a": {"unsure": 0.8}})
    judged = AnyLaw(unsure, STANDARD).judged_together(LawSelection(state={"a": (1.0,)}))
    assert judged.reasons["a"] == "beside the others its force is told to ± 80% only"


def test_another_effect_that_leaves_less_takes_the_place_of_one_that_is_in() -> None:
    world = LawWorld({"a": 0.9, "b": 0.5}, {"b": {"error": 0.5}})
    found = AnyLaw(world, STANDARD).judged_together(LawSelection(state={"a": (1.0,)}))
    assert found.effects == ("b",) and [d.row.name for d in found.found] == ["b"]
    assert found.reasons["a"] == "another leaves less in its place"


@pytest.mark.parametrize(("error", "rivals"), [(1.29, ("b",)), (1.31, ()), (0.95, ("b",))])
def test_what_leaves_hardly_more_in_the_place_of_an_effect_is_its_rival(error: float, rivals: tuple[str, ...]) -> None:
    """One that leaves hardly less is none the less a rival where it takes more numbers."""
    world = LawWorld({"a": 0.9, "b": 0.5}, {"b": {"error": error, "numbers": 2}})
    found = AnyLaw(world, STANDARD).judged_together(LawSelection(state={"a": (1.0,)}))
    assert (found.effects, found.rivals["a"]) == (("a",), rivals)


def test_what_could_take_too_little_of_it_is_not_tried_in_an_effect_s_place() -> None:
    """Six tenths of what the effect takes, 0.6, are asked for."""
    for share, tried in ((0.37, True), (0.35, False)):
        world = LawWorld({"a": 0.9, "b": share}, {"b": {"error": 0.5}})
        found = AnyLaw(world, STANDARD).judged_together(LawSelection(state={"a": (1.0,)}))
        assert found.effects == (("b",) if tried else ("a",))


@pytest.mark.parametrize(("most", "last"), [(3, "b"), (2, "a")])
def test_effects_that_take_turns_are_exchanged_a_few_times_only(most: int, last: str) -> None:
    rows = {"a": {"error": 0.5}, "b": {"error": 0.5}, "a weighed": {"error": 1.0}, "b weighed": {"error": 1.0}}
    found = AnyLaw(LawWorld({"a": 0.9, "b": 0.9}, rows), replace(STANDARD, most_swaps=most)).judged_together(
        LawSelection(state={"a": (1.0,)})
    )
    assert found.effects == (last,)


def test_what_a_law_of_longer_memory_may_have_is_taken_out() -> None:
    for z, stands in ((2.1, True), (1.9, False)):
        world = LawWorld({"a": 0.6}, {"a longer": {"z": z, "kept": 0.2, "share": 0.2}})
        comparison = AnyLaw(world, STANDARD)
        found = comparison.beside_longer_memory(comparison.selected())
        assert found.effects == (("a",) if stands else ())
        assert world.asked[-1][-1] is True
        if not stands:
            assert found.reasons["a"].startswith("a law that remembers for longer may have it: only 1.9")


def test_an_interval_knows_what_a_longer_memory_moves_a_number_by() -> None:
    """Half of it is that over groups beside the shift, times the quantile of 8 groups."""
    for number, half in ((NUMBER, np.hypot(1.0, student.ppf(0.975, 7) * 0.6)), (replace(NUMBER, low=None), None)):
        comparison = AnyLaw(LawWorld({"a": 0.6}, number=number, moved=-0.6), STANDARD)
        (found,) = comparison.beside_longer_memory(comparison.selected()).found
        told = found.parameters[0]
        assert told.value == 10.0
        assert (told.low, told.high) == (pytest.approx((10.0 - half, 10.0 + half)) if half else (None, 11.0))
        assert found.force == FORCE


def unnamed(share: float, breaks: Invariance = Invariance.ODDNESS) -> BrokenInvariance:
    return BrokenInvariance(invariance=breaks, share=share, kept=share, size=0.1)


@pytest.mark.parametrize(
    ("row", "taken", "stands", "asked"),
    [
        (unnamed(0.9), (0.16, 4.1), True, True),
        (unnamed(0.9), (0.14, 4.1), False, True),
        (unnamed(0.9), (0.16, 3.9), False, True),
        # what takes less than the effect does, or breaks what the effect breaks, does not speak against it
        (unnamed(0.4), (0.0, 0.0), True, False),
        (unnamed(0.9, Invariance.POSITION), (0.0, 0.0), True, False),
    ],
)
def test_an_effect_has_to_stand_beside_something_without_a_name(
    row: BrokenInvariance, taken: tuple[float, float], stands: bool, asked: bool
) -> None:
    rows = {"a": {"share": 0.3}}
    world = LawWorld({"a": 0.6}, rows, unnamed={("a",): [row], (): [unnamed(0.5)]}, taken=taken)
    comparison = AnyLaw(world, STANDARD)
    found, broken = comparison.beside_unnamed(comparison.selected())
    assert (found.effects == ("a",)) is stands
    assert (("beside", "a", row.invariance) in world.asked) is asked
    # what is broken is told beside the effects that stand
    assert broken == ((row,) if stands else (unnamed(0.5),))
    assert ("something without a name" in found.reasons["a"]) is not stands


def test_a_choice_is_judged_beside_longer_memory_and_then_beside_what_has_no_name() -> None:
    world = LawWorld({"a": 0.6, "b": 0.6}, {"a longer": {"z": 0.1, "kept": 0.0}}, unnamed={("b",): [unnamed(0.1)]})
    found, broken = choose(world, STANDARD)
    assert found.effects == ("b",) and broken == (unnamed(0.1),)
    assert world.asked[-1] == ("broken", ("b",))
