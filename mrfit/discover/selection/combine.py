"""Both ways of discovery together: what a base taken as exact tells, and what no law can make, whatever it is.

Where a base with its effects leaves the noise, it is taken as exact: that is the sharper way, and any effect of the
library can be told. Where it does not, its own error hides effects or imitates them. There an effect is believed that
breaks an invariance which every law keeps, and no other. Where a base alone leaves no more than the noise, nothing is
missing, and an examination has no say. Nothing is computed, read or written here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from mrfit.discover.invariance.findings import LawFindings, significance
from mrfit.discover.policy import Policy
from mrfit.discover.selection.exact_base import Selection
from mrfit.discover.selection.rules import word_of_unknown_noise
from mrfit.io.schemas.discovery import InvariantEffect

# Verdicts that leave nothing unexplained
DECIDED = ("none", "named", "ambiguous")


@dataclass(frozen=True)
class Shadow:
    """An effect that an examination names and that is not believed, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class CombinedResult:
    """The result of both ways.

    Attributes
    ----------
    verdict
        One of the five.
    named
        Effects that are named.
    ambiguous
        Sets of effects that the data cannot tell apart.
    standing
        Effects that stand whatever the law is, those that are one of a set among them; empty where the base was taken
        as exact.
    taken_back
        Whether what the base taken as exact names is not believed, since its law is open and nothing confirms it.
    shadows
        Effects that the examination names and that are not believed.
    difference
        How the two ways differ, in words; empty where they agree or only one had something to say.
    """

    verdict: str
    named: tuple[str, ...]
    ambiguous: tuple[tuple[str, ...], ...] = ()
    standing: tuple[InvariantEffect, ...] = ()
    shadows: tuple[Shadow, ...] = ()
    difference: str = ""
    taken_back: bool = False

    @property
    def ambiguous_set(self) -> tuple[str, ...]:
        """Effects that the data cannot tell apart."""
        return tuple(sorted({e for group in self.ambiguous for e in group}))

    @property
    def law_is_open(self) -> bool:
        """Whether effects are named beside a law that is off."""
        return bool(self.standing)

    @property
    def law_may_be_off(self) -> bool:
        """Whether another law may be the right one: not where nothing is missing or the base was taken as exact."""
        return self.law_is_open or self.verdict not in DECIDED


@dataclass(frozen=True)
class Floors:
    """Noise floors, of held-out conditions where nothing else is said.

    Attributes
    ----------
    noise
        The most that the noise can be, in multiples of the floor.
    measured
        Whether they were measured, by cycles or repeats. One that was guessed from what a regression or the base leaves
        holds the error of a wrong law, too: it cannot say that nothing is missing.
    told
        Whether none can hold the error of a law: those that were not measured are no larger than those that were.
    fitted
        The most that the noise of fitted conditions can be, in multiples of their floor.
    """

    noise: float
    measured: bool
    told: bool = False
    fitted: float = 1.0


def worth_examining(chosen: Selection, floors: Floors, policy: Policy) -> bool:
    """Return whether the law of a base may be off, by what its effects leave.

    Parameters
    ----------
    chosen
        What was decided with the base taken as exact.
    floors
        What is known of the noise.
    policy
        The thresholds.
    """
    above = _is_above(chosen, floors, policy)
    if chosen.verdict in ("none", "unexplained"):
        return chosen.verdict == "unexplained"
    if not floors.measured and (above or not floors.told):
        return True
    if chosen.verdict == "insufficient-data":
        return False
    return above or _leaves_much(chosen, floors.noise, policy)


def may_err(chosen: Selection, floors: Floors, policy: Policy) -> bool:
    """Return whether a model with its effects leaves something, or so much that a noise not known may be less.

    Parameters
    ----------
    chosen
        What was decided with the base taken as exact.
    floors
        What is known of the noise.
    policy
        The thresholds.
    """
    in_sight = chosen.final.holdout > policy.in_sight
    return chosen.verdict == "unexplained" or in_sight or _is_above(chosen, floors, policy)


def _is_above(chosen: Selection, floors: Floors, policy: Policy) -> bool:
    held_out = bool(chosen.final.holdout > policy.examined_above_floor * floors.noise)
    return held_out or _is_above_when_fitted(chosen, floors, policy)


def _leaves_much(chosen: Selection, noise: float, policy: Policy) -> bool:
    gap, after = chosen.base.holdout**2 - noise**2, chosen.final.holdout
    allowed = policy.left_open_in_sight if after > policy.in_sight * noise else policy.left_open
    return gap > 0.0 and after**2 - noise**2 > allowed * gap


def _is_above_when_fitted(chosen: Selection, floors: Floors, policy: Policy) -> bool:
    """Return whether a model errs beyond the noise even where it was fitted, which no exact one does."""
    return bool(chosen.final.train > policy.examined_above_floor * floors.fitted)


def leaves_noise(chosen: Selection, floors: Floors, policy: Policy) -> bool:
    """Return whether effects beside a base leave so little that it may be exact, if its floor can be trusted.

    Effects that stand for a law come close to the noise, and take nearly all of a large gap. They do not reach it.
    """
    if floors.told and _is_above_when_fitted(chosen, floors, policy):
        return False
    return chosen.verdict in ("named", "ambiguous") and not _leaves_much(chosen, floors.noise, policy)


def combine(
    chosen: Selection,
    examined: LawFindings | None,
    policy: Policy,
    noisy: bool = False,
    told: bool = False,
    noise: float = 1.0,
) -> CombinedResult:
    """Return the result of both ways; without an examination, that of the base taken as exact.

    Parameters
    ----------
    chosen
        What was decided with the base taken as exact.
    examined
        The examination, None for none.
    policy
        The thresholds.
    noisy
        Whether the base with its effects leaves little more than a floor, see ``leaves_noise``. It is believed if it
        leaves as little as the best law whatever it is, or next to nothing of a gap that is told; by floors that are
        not told only if its effects take much of the error and the examination confirms them.
    told
        Whether no floor can hold the error of a law, see ``Floors``: a gap above it then is one.
    noise
        The most that the noise can be, in multiples of the floor: 1 where it is known.
    """
    exact = CombinedResult(chosen.verdict, chosen.named, chosen.ambiguous)
    if examined is None or examined.not_applicable or chosen.verdict == "none":
        return exact
    shadows = tuple(s for n in examined.named if (s := _shadow(n, chosen, examined, policy)) is not None)
    hidden, as_good = {s.name for s in shadows}, noisy and _as_good_as_any_law(examined, policy)
    standing = tuple(
        n.model_copy(update={"one_of": _partners(chosen, examined, n, policy, as_good)})
        for n in examined.named
        if n.name not in hidden
    )
    if as_good and (told or (_takes_much(chosen, policy) and _confirmed(chosen, examined, standing))):
        return exact
    if noisy and told and closes_the_gap(chosen, policy):
        return exact
    return _beside_open_law(chosen, standing, shadows, policy, noise)


def of_no_use(
    standing: Sequence[InvariantEffect], without: Mapping[str, float | None], after: float | None, policy: Policy
) -> Shadow | None:
    """Return an effect without which held-out conditions are hardly worse, or better, or None.

    An effect that is there takes something on conditions that were not fitted. Where the law errs by more than the
    largest force of the effect, what it takes is too little to be seen. What it adds to the error is seen there too.

    Parameters
    ----------
    standing
        Effects that stand whatever the law is.
    without
        Error on held-out conditions (NRMSE) without each of them, the others held.
    after
        The same with all of them.
    policy
        The thresholds.
    """
    if after is None:
        return None
    useless = {}
    for effect in standing:
        error, clear = without[effect.name], effect.standing
        if error is None or clear is None:
            continue
        least = policy.least_gain if clear.size > error else -policy.least_gain
        if after**2 >= (1.0 - least) * error**2:
            useless[effect.name] = error
    if not useless:
        return None
    name = min(useless, key=useless.__getitem__)
    return Shadow(
        name, f"the error on held-out tests is {'higher' if after > useless[name] else 'hardly lower'} with it"
    )


def turned_down(
    chosen: Selection, combined: CombinedResult, shadow: Shadow, policy: Policy, noise: float = 1.0
) -> CombinedResult:
    """Return a result beside an open law in which an effect that stood is not believed.

    Parameters
    ----------
    chosen
        What was decided with the base taken as exact.
    combined
        The result of both ways.
    shadow
        The effect and the reason against it.
    policy
        The thresholds.
    noise
        The most that the noise can be, in multiples of the floor.
    """
    rest = tuple(n for n in combined.standing if n.name != shadow.name)
    return _beside_open_law(chosen, rest, (*combined.shadows, shadow), policy, noise)


def _beside_open_law(
    chosen: Selection,
    standing: tuple[InvariantEffect, ...],
    shadows: tuple[Shadow, ...],
    policy: Policy,
    noise: float,
) -> CombinedResult:
    """Return the result with the effects that stand whatever the law is; without any, what the base leaves decides."""
    if not standing:
        back = bool(chosen.final.effects)
        alone = word_of_unknown_noise(chosen.base.holdout, noise, noise <= 1.0, policy)
        return CombinedResult(
            alone if back else chosen.verdict, (), (), (), shadows, _only_exact(chosen), taken_back=back
        )
    sets = tuple((n.name, *n.one_of) for n in standing if n.one_of)
    clear = tuple(n.name for n in standing if not n.one_of)
    return CombinedResult(
        verdict="ambiguous" if sets else "named",
        named=clear,
        ambiguous=sets,
        standing=standing,
        shadows=shadows,
        difference=_difference(chosen, clear, sets),
    )


def _takes_much(chosen: Selection, policy: Policy) -> bool:
    """Return whether the effects of a base take so much of the held-out error that no floor is needed to tell it."""
    return bool(chosen.final.holdout**2 < policy.left_by_guess * chosen.base.holdout**2)


def _confirmed(chosen: Selection, examined: LawFindings, standing: Sequence[InvariantEffect]) -> bool:
    """Return whether the effects of a base are those of an examination, which has none or these.

    A base that lacks one of them is not exact. Beside them, what any law may have may be the law's own error.
    """
    known = {*chosen.named, *chosen.ambiguous_set}
    untried = {c.name for c in examined.confounded}
    names = {n for effect in standing for n in (effect.name, *effect.one_of)}
    lacking = any(not known & {n.name, *n.one_of} for n in standing)
    return not standing or not (lacking or (set(chosen.named) - names) & untried)


def closes_the_gap(chosen: Selection, policy: Policy) -> bool:
    """Return whether effects take next to all of a gap on held-out conditions.

    What a form of an effect leaves is small against what it takes. A wrong base with a wrong effect leaves more.
    """
    before, after = chosen.base.holdout, chosen.final.holdout
    return after <= policy.examined_above_floor or after**2 - 1.0 < policy.left_if_closed * (before**2 - 1.0)


def _partners(
    chosen: Selection, examined: LawFindings, effect: InvariantEffect, policy: Policy, as_good: bool
) -> tuple[str, ...]:
    """Return the effects that an effect is not told from: beside any law, nor beside the base.

    A partner that breaks no invariance cannot be tried beside any law. Beside the base both are tried, in one error of
    its law: there the partner is told from an effect with proof if it takes much less, fitted and held out. A base that
    is ``as_good`` as any law has no such error: it tells what it names.
    """
    untried = {c.name for c in examined.confounded}
    if as_good and effect.name in chosen.named:
        return tuple(p for p in effect.one_of if p not in untried or p in chosen.effects)
    takes = {
        t.name: (chosen.base.train**2 - t.fit.train**2, chosen.base.holdout**2 - t.fit.holdout**2)
        for t in chosen.trials
    }
    if effect.name not in chosen.proven.effects or effect.name not in takes:
        return effect.one_of

    def told(partner: str) -> bool:
        if partner not in untried or partner not in takes or partner in chosen.proven.effects:
            return False
        pairs = zip(takes[partner], takes[effect.name], strict=True)
        return all(other < policy.partner_takes * own for other, own in pairs)

    return tuple(p for p in effect.one_of if not told(p))


def _as_good_as_any_law(examined: LawFindings, policy: Policy) -> bool:
    """Return whether a model taken as exact leaves hardly more than the best law does."""
    errors = examined.errors
    return errors.exact is not None and errors.exact <= policy.as_good * max(errors.open, errors.noise)


def _shadow(effect: InvariantEffect, chosen: Selection, examined: LawFindings, policy: Policy) -> Shadow | None:
    """Return the reason against an effect; None if it is believed.

    What the base makes itself is not missing. What breaks the same invariance beside an effect, and takes no little
    share of what it takes, may be all that is there: the effect would be a part of something else.
    """
    if effect.name in examined.in_the_model and effect.name not in chosen.effects:
        return Shadow(effect.name, "the base makes this force itself, as strong as it was found")
    share = significance(effect).share
    for row in examined.broken:
        if row.invariance == effect.breaks and row.kept * (1.0 - share) > policy.broken_beside * share:
            return Shadow(
                effect.name,
                f"something else breaks the same invariance ({row.invariance}): it takes {row.kept:.0%} of what "
                f"{effect.name} leaves on conditions left out, so that this may be a part of it",
            )
    return None


def _only_exact(chosen: Selection) -> str:
    """Return the difference where only the base taken as exact tells of effects."""
    if not chosen.final.effects:
        return ""
    names = _listed(chosen.final.effects)
    return f"with the base taken as exact {names} would be there; beside an open law that has no proof"


def _difference(chosen: Selection, clear: Sequence[str], sets: Sequence[Sequence[str]]) -> str:
    """Return the difference of the ways in words, where an examination names effects."""
    suspected = chosen.final.effects or chosen.proven.effects
    mine = {*clear, *(n for group in sets for n in group)}
    others = [n for n in suspected if n not in mine]
    if not others:
        return ""
    return (
        f"with the base taken as exact {_listed(others)} would take part of the gap; beside an open law that has no "
        "proof: the law may make it"
    )


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
