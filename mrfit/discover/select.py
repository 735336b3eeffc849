"""Which effects are missing: added one by one, each against its rivals, and none without proof on held-out conditions.

An effect is accepted if, refitted jointly with everything else, its parameter stands clear of neutral by more standard
errors than the number of candidates could produce by chance, and it lowers the error on held-out conditions by more
than chance. Two effects that both pass alone are put in together (an encompassing test): the one that still earns its
place beside the other is real, the other a shadow; if neither does, the data cannot tell them apart. Where no effect
alone has proof, or what was put in one by one leaves too much, two are tried together, and every effect is chosen again
once others are beside it.

The library's forms are approximations. What the right effect leaves is small against what it takes, and a look-alike
that takes some of that is a shadow. So what an effect takes must be a visible share of the base's gap, or nearly all
that is left of it; standard errors count the scatter between conditions, since a real effect has one parameter
everywhere and a shadow has not; and what an effect takes must exceed what all together leave.

Nothing here is simulated, read or written. Which refit comes next depends on what was decided of the last, so every
step takes the evidence so far and the policy, and returns what then stands.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

from mrfit.discover.duels import Inquiry, duel, judge
from mrfit.discover.evidence import (
    Candidate,
    EffectScreening,
    EvidenceSource,
    Fit,
    Growth,
    Join,
    Try,
    refit,
)
from mrfit.discover.pairs import best_pair
from mrfit.discover.policy import Policy
from mrfit.discover.record import Evidence, EvidenceReader
from mrfit.discover.rules import (
    EffectTrial,
    below_the_rest,
    clearly_left,
    drift,
    goes_on,
    leaves_too_much,
    objection,
    word_of_unknown_noise,
    worth_a_refit,
)

UNSEEN = "its sensitivity is not in the error"


@dataclass(frozen=True)
class Follower:
    """An effect that only followed a drift, and the drift's growth."""

    effect: str
    growth: Growth


@dataclass(frozen=True)
class Selection:
    """What was decided, and what became of every candidate.

    Attributes
    ----------
    base, final
        The fit without and with the accepted effects.
    proven, doubtful
        The fit with all effects that had proof each, whether or not each takes more than they leave together, and the
        sets that could not be told apart among them.
    screening
        The first screening.
    ambiguous
        Sets of effects that the data cannot tell apart, the one in the final fit first.
    reasons
        For every effect: why it was accepted or turned down.
    gains
        Share of the squared hold-out error each took away when it was last tried.
    taken_back
        Whether none is named, since together they leave too much.
    drifting
        Effects that only followed a drift.
    verdict
        ``none``, ``named``, ``ambiguous``, ``unexplained`` or ``insufficient-data``.
    structure
        Share of the remaining squared hold-out error that a nonparametric model predicts.
    """

    base: Fit
    final: Fit
    proven: Fit
    screening: EffectScreening
    ambiguous: tuple[tuple[str, ...], ...] = ()
    doubtful: tuple[tuple[str, ...], ...] = ()
    reasons: Mapping[str, str] = field(default_factory=dict)
    gains: Mapping[str, float] = field(default_factory=dict)
    taken_back: bool = False
    drifting: tuple[Follower, ...] = ()
    verdict: str = ""
    structure: float = 0.0

    @property
    def named(self) -> tuple[str, ...]:
        """The accepted effects that no other is as good as."""
        return tuple(e for e in self.final.effects if not any(e in group for group in self.ambiguous))

    def because(self, name: str, reason: str) -> "Selection":
        """Return the same with what became of an effect."""
        return replace(self, reasons={**self.reasons, name: reason})

    def without(self, name: str, rest: Fit, reason: str) -> "Selection":
        """Return the same with an effect taken out, and the fit of the others."""
        ambiguous = tuple(s for s in self.ambiguous if name not in s)
        return replace(self, final=rest, ambiguous=ambiguous).because(name, reason)


@dataclass(frozen=True)
class SelectionRound:
    """What stands after effects were tried one by one, and their trials."""

    chosen: Selection
    trials: tuple[EffectTrial, ...] = ()


def select(evidence: Evidence, policy: Policy) -> Selection:
    """Return the missing effects of a base model and the verdict: the same for the same evidence and policy.

    Raises
    ------
    LookupError
        If the policy asks for a refit that the evidence does not hold.
    """
    return decide(cast(EvidenceSource, EvidenceReader(evidence)), policy)


def decide(source: EvidenceSource, policy: Policy) -> Selection:
    """Return the same from whatever answers questions."""
    screening = source.screen(source.base)
    inquiry = Inquiry(source, policy, screening)
    grown = _grow(inquiry, Selection(source.base, source.base, source.base, screening))
    chosen = grown.chosen
    if chosen.final.effects and leaves_too_much(source.base, chosen.final, source.noise, policy):
        chosen = _start_again(inquiry, grown)
    chosen = replace(chosen, proven=chosen.final, doubtful=chosen.ambiguous)
    chosen = _without_drifting(inquiry, _without_below_the_rest(inquiry, chosen))
    for name in chosen.final.effects:
        strength = source.strength(chosen.final, name)
        chosen = chosen.because(name, f"its parameter is {strength:.0f} standard errors from neutral")
    return _with_verdict(inquiry, take_back(without_idle(chosen), source.noise, policy))


def _grow(inquiry: Inquiry, chosen: Selection) -> SelectionRound:
    """Add effects until none has proof; return what stands then, and the trials of the first round."""
    first: tuple[EffectTrial, ...] = ()
    for number in range(inquiry.policy.most_rounds):
        present = chosen.final
        screening = inquiry.source.screen(present) if present.effects else chosen.screening
        tried = _tried(inquiry, chosen, screening, number)
        chosen, first = tried.chosen, first or tried.trials
        passing = _passing(inquiry, tried.trials)
        if passing:
            ending = duel(inquiry, present, passing)
            chosen = replace(chosen, reasons={**chosen.reasons, **ending.reasons})
            chosen = _accepted(inquiry, chosen, ending.winner.fit, ending.together)
        else:
            both = best_pair(inquiry, screening, tried.trials)
            if both is None:
                break
            chosen = _accepted(inquiry, chosen, both)
        chosen = _chosen_again(inquiry, _without_shadows(inquiry, chosen))
    return SelectionRound(chosen, first)


def _passing(inquiry: Inquiry, trials: Sequence[EffectTrial]) -> list[EffectTrial]:
    """Return the trials with proof, the one with the least error on held-out conditions first."""
    return sorted((t for t in trials if inquiry.passes(t)), key=lambda t: t.fit.holdout)


def _start_again(inquiry: Inquiry, grown: SelectionRound) -> Selection:
    """Begin with the best pair, where effects put in one by one leave too much: the first may imitate two others."""
    chosen = grown.chosen
    both = best_pair(inquiry, chosen.screening, grown.trials)
    if both is None or set(both.effects) <= set(chosen.final.effects):
        return chosen
    other = _accepted(inquiry, replace(chosen, ambiguous=()), both)
    other = _grow(inquiry, _chosen_again(inquiry, other)).chosen
    if leaves_too_much(inquiry.base, other.final, inquiry.source.noise, inquiry.policy):
        return chosen
    for name in set(chosen.final.effects) - set(other.final.effects):
        other = other.because(name, f"it adds nothing beside {' and '.join(other.final.effects)}")
    return replace(other, gains=chosen.gains)


def _accepted(inquiry: Inquiry, chosen: Selection, fit: Fit, equals: tuple[str, ...] = ()) -> Selection:
    """Return what stands with a fit of more effects; ``equals`` cannot be told from each other."""
    ambiguous = (*chosen.ambiguous, equals) if equals else chosen.ambiguous
    return replace(chosen, final=inquiry.source.search(fit), ambiguous=ambiguous)


def _tried(inquiry: Inquiry, chosen: Selection, screening: EffectScreening, number: int) -> SelectionRound:
    """Try the candidates of a screening one by one beside what is in."""
    present, gains, reasons = screening.present, dict(chosen.gains), dict(chosen.reasons)
    worth = worth_a_refit(screening.candidates, inquiry.policy)
    labels = [f"round {number + 1}: refit with {c.name}" for c in worth]
    trials = _trials(inquiry, present, worth, labels)
    for trial in trials:
        against = objection(trial, inquiry.policy)
        if number == 0 or not against or reasons[trial.name] == UNSEEN:
            beside = f", beside {' and '.join(present.effects)}" if number else ""
            gains[trial.name] = trial.gain
            reasons[trial.name] = (against or f"it takes away {trial.gain:.0%} of the squared hold-out error") + beside
    for candidate in screening.candidates:
        reasons.setdefault(candidate.name, candidate.reason or UNSEEN)
    return SelectionRound(replace(chosen, gains=gains, reasons=reasons), tuple(trials))


def _trials(
    inquiry: Inquiry, present: Fit, candidates: Sequence[Candidate], labels: Sequence[str] = ()
) -> list[EffectTrial]:
    fits = inquiry.source.refits([Try(present, c) for c in candidates], labels)
    return [
        judge(inquiry, c.name, present, fit, None, inquiry.alike(c.name))
        for c, fit in zip(candidates, fits, strict=True)
    ]


def _rest(inquiry: Inquiry, final: Fit, name: str) -> Fit | None:
    """Return the fit of all effects but one; None if there are no others."""
    rest = tuple(e for e in final.effects if e != name)
    return refit(inquiry.source, Join(rest, (final.values,))) if rest else None


def _without_shadows(inquiry: Inquiry, chosen: Selection) -> Selection:
    """Take out what helped first and is worth nothing since a later effect is in, or since one was exchanged."""
    for name in chosen.final.effects:
        rest = _rest(inquiry, chosen.final, name)
        if rest is None:
            continue
        if not inquiry.passes(judge(inquiry, name, rest, chosen.final, None, inquiry.alike(name))):
            chosen = chosen.without(name, rest, f"it adds nothing beside {' and '.join(rest.effects)}")
    return chosen


def _chosen_again(inquiry: Inquiry, chosen: Selection) -> Selection:
    """Let every effect stand against its rivals again, now that the others are in; take out what that makes idle."""
    for name in chosen.final.effects:
        if name not in chosen.final.effects:
            continue
        rest = _rest(inquiry, chosen.final, name)
        if rest is None:
            continue
        own = judge(inquiry, name, rest, chosen.final, None, inquiry.alike(name))
        rivals = _rivals(inquiry, chosen, name, rest)
        passing = _passing(inquiry, [own, *_trials(inquiry, rest, rivals)])
        ending = duel(inquiry, rest, passing or [own])
        ambiguous = tuple(s for s in chosen.ambiguous if name not in s)
        chosen = replace(chosen, reasons={**chosen.reasons, **ending.reasons}, ambiguous=ambiguous)
        if ending.winner.name != name or ending.winner.fit.train < chosen.final.train:
            chosen = _accepted(inquiry, chosen, ending.winner.fit, ending.together)
        elif ending.equals:
            chosen = replace(chosen, ambiguous=(*ambiguous, ending.together))
    return _without_shadows(inquiry, chosen)


def _rivals(inquiry: Inquiry, chosen: Selection, name: str, rest: Fit) -> list[Candidate]:
    """Return the effects that could take the place of one beside the rest of those accepted."""
    aliases, policy = inquiry.source.library[name].aliases, inquiry.policy
    rivals = [
        c
        for c in inquiry.screening.candidates
        if not c.reason
        and c.name not in chosen.final.effects
        and (c.name in aliases or inquiry.source.reach(inquiry.base, (c.name,), rest) > policy.worth_a_duel)
    ]
    return sorted(rivals, key=lambda c: (c.name not in aliases, -c.gain))[: policy.most_rivals]


def _without_below_the_rest(inquiry: Inquiry, chosen: Selection) -> Selection:
    """Take out, the least first, effects that take less than all together leave: they may be shadows of that."""
    while len(chosen.final.effects) > 1:
        final = chosen.final
        without = {e: fit for e in final.effects if (fit := _rest(inquiry, final, e)) is not None}
        least = min(without, key=lambda e: without[e].holdout ** 2 - final.holdout**2)
        if not below_the_rest(final, without[least], inquiry.policy):
            break
        chosen = chosen.without(least, without[least], "it takes less than what is left without a name")
    return chosen


def _without_drifting(inquiry: Inquiry, chosen: Selection) -> Selection:
    """Take out effects that follow a drift: their strength changes within the records, which it cannot."""
    for name in chosen.final.effects:
        growths = inquiry.source.growths(chosen.final, name)
        found = drift(growths, inquiry.policy)
        if found is not None:
            rest = _rest(inquiry, chosen.final, name) or inquiry.base
            share = abs(found.change / found.distance)
            reason = f"it changes by {share:.0%} in half a record: a drift, not this effect"
            chosen = replace(chosen, drifting=(*chosen.drifting, Follower(name, found))).without(name, rest, reason)
    return chosen


def without_idle(chosen: Selection) -> Selection:
    """Leave out all effects if together they do not lower the held-out error, as what stays of a pair may not."""
    if not chosen.final.effects or chosen.final.holdout < chosen.base.holdout:
        return chosen
    reason = "what was left beside it does not lower the error on held-out conditions"
    reasons = {**chosen.reasons, **dict.fromkeys(chosen.final.effects, reason)}
    return replace(chosen, final=chosen.base, ambiguous=(), reasons=reasons)


def take_back(chosen: Selection, noise: float, policy: Policy) -> Selection:
    """Take back all effects if together they leave much of the gap: what is missing then is something else.

    ``noise`` is the most that the noise can be, in multiples of the floor.
    """
    if not chosen.final.effects or not leaves_too_much(chosen.base, chosen.final, noise, policy):
        return chosen
    proven = chosen.proven
    # how much is said once, with the effect as it is refitted to the end
    together = (
        f"{' and '.join(proven.effects)}{' together' if len(proven.effects) > 1 else ''} would take part of the gap"
    )
    left = "too little to be all that is missing"
    reasons = {**chosen.reasons, **dict.fromkeys(proven.effects, f"{together}, {left}")}
    return replace(chosen, final=chosen.base, ambiguous=(), taken_back=True, reasons=reasons)


def _with_verdict(inquiry: Inquiry, chosen: Selection) -> Selection:
    structure = inquiry.source.structure(chosen.final)
    return replace(chosen, structure=structure, verdict=_verdict(inquiry, chosen, structure))


def _verdict(inquiry: Inquiry, chosen: Selection, structure: float) -> str:
    """Return the verdict's word."""
    policy, noise, final = inquiry.policy, inquiry.source.noise, chosen.final
    if chosen.ambiguous:
        return "ambiguous"
    if final.effects:
        return "named"
    if noise > 1.0:
        told = chosen.taken_back or structure > policy.structure
        return word_of_unknown_noise(final.holdout, noise, told, policy)
    left = clearly_left(final.holdout, structure, chosen.taken_back, policy)
    return "unexplained" if left or goes_on(inquiry.source.repetition(final), policy) else "none"
