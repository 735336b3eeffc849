"""Missing effects: added one by one, each against its rivals, and none without proof on held-out conditions.

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

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import cast

from mrfit.discover.policy import Policy
from mrfit.discover.selection.duels import Inquiry, duel
from mrfit.discover.selection.pairs import best_pair
from mrfit.discover.selection.questions import Candidate, EffectScreening, EvidenceSource, Fit, Growth, Join, Try, refit
from mrfit.discover.selection.record import Evidence, EvidenceReader
from mrfit.discover.selection.rules import (
    EffectTrial,
    below_the_rest,
    clearly_left,
    drift,
    goes_on,
    is_below_floors,
    leaves_too_much,
    limits,
    objection,
    word_of_unknown_noise,
    worth_a_refit,
)
from mrfit.discover.selection.stepwise import grow, prune, prune_each

UNSEEN = "its sensitivity is not in the error"


@dataclass(frozen=True)
class Follower:
    """An effect that only followed a drift, and the drift's growth."""

    effect: str
    growth: Growth


@dataclass(frozen=True)
class Selection:
    """Decision, and the fate of every candidate.

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
    trials
        Of the first round.
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
    trials: tuple[EffectTrial, ...] = ()

    @property
    def effects(self) -> tuple[str, ...]:
        """The accepted effects."""
        return self.final.effects

    @property
    def named(self) -> tuple[str, ...]:
        """The accepted effects that no other is as good as."""
        return tuple(e for e in self.final.effects if not any(e in group for group in self.ambiguous))

    @property
    def ambiguous_set(self) -> tuple[str, ...]:
        """Effects that the data cannot tell apart."""
        return tuple(sorted({e for group in self.ambiguous for e in group}))

    def because(self, name: str, reason: str) -> "Selection":
        """Return the same with what became of an effect."""
        return self.because_of({name: reason})

    def because_of(self, reasons: Mapping[str, str]) -> "Selection":
        """Return the same with what became of several effects."""
        return replace(self, reasons={**self.reasons, **reasons})

    def without(self, name: str, rest: Fit, reason: str) -> "Selection":
        """Return the same with an effect taken out, and the fit of the others."""
        ambiguous = tuple(s for s in self.ambiguous if name not in s)
        return replace(self, final=rest, ambiguous=ambiguous).because(name, reason)


@dataclass(frozen=True)
class SelectionRound:
    """A screening beside what is in, and the trials of its candidates one by one."""

    screening: EffectScreening
    trials: tuple[EffectTrial, ...]


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
    comparison = ExactBase(Inquiry(source, policy, source.screen(source.base)))
    chosen = comparison.selected()
    chosen = replace(chosen, proven=chosen.final, doubtful=chosen.ambiguous)
    chosen = prune_each(prune(chosen, comparison.without_below_the_rest), comparison.without_drifting)
    chosen = prune_each(chosen, comparison.without_limit)
    for name in chosen.effects:
        strength = source.strength(chosen.final, name)
        chosen = chosen.because(name, f"its parameter is {strength:.0f} standard errors from neutral")
    chosen = take_back(without_noise(without_idle(chosen), policy), source.noise, policy)
    return comparison.with_verdict(chosen)


@dataclass(frozen=True)
class ExactBase:
    """Comparison of effects by what they take of the held-out error beside a base that is taken as exact."""

    inquiry: Inquiry

    def selected(self) -> Selection:
        """Return the selection after effects were added one by one, or in pairs where that leaves too much."""
        base, source = self.inquiry.base, self.inquiry.source
        chosen = grow(self, Selection(base, base, base, self.inquiry.screening))
        if not chosen.effects or not self._leaves_too_much(chosen):
            return chosen
        # the first of those put in one by one may imitate two others
        both = best_pair(self.inquiry, chosen.screening, chosen.trials)
        if both is None or set(both.effects) <= set(chosen.effects):
            return chosen
        other = replace(chosen, final=source.search(both), ambiguous=())
        other = grow(self, self._chosen_again(other))
        if self._leaves_too_much(other):
            return chosen
        for name in set(chosen.effects) - set(other.effects):
            other = other.because(name, _idle_beside(other.final))
        return replace(other, gains=chosen.gains)

    def is_open(self, chosen: Selection, number: int) -> bool:
        """Return whether another round of trials may follow."""
        return number < self.inquiry.policy.most_rounds

    def trials(self, chosen: Selection, number: int) -> tuple[Selection, SelectionRound]:
        """Try the candidates of a screening one by one beside what is in."""
        present, gains, reasons = chosen.final, dict(chosen.gains), dict(chosen.reasons)
        screening = self.inquiry.source.screen(present) if present.effects else chosen.screening
        worth = worth_a_refit(screening.candidates, self.inquiry.policy)
        trials = self._trials(present, worth, [f"round {number + 1}: refit with {c.name}" for c in worth])
        for trial in trials:
            against = objection(trial, self.inquiry.policy)
            if number == 0 or not against or reasons[trial.name] == UNSEEN:
                beside = f", beside {' and '.join(present.effects)}" if number else ""
                gains[trial.name] = trial.gain
                takes = f"it takes away {trial.gain:.0%} of the squared hold-out error"
                reasons[trial.name] = (against or takes) + beside
        for candidate in screening.candidates:
            reasons.setdefault(candidate.name, candidate.reason or UNSEEN)
        first = chosen.trials or trials
        return replace(chosen, gains=gains, reasons=reasons, trials=first), SelectionRound(screening, trials)

    def additions(self, chosen: Selection, found: SelectionRound) -> Iterator[Selection]:
        """Yield the selection with the effect that wins over its rivals, or with the best pair where none has proof."""
        passing = self._passing(found.trials)
        if passing:
            ending = duel(self.inquiry, chosen.final, passing)
            yield self._accepted(chosen.because_of(ending.reasons), ending.winner.fit, ending.together)
        elif both := best_pair(self.inquiry, found.screening, found.trials):
            yield self._accepted(chosen, both)

    def reassessed(self, chosen: Selection) -> Selection:
        """Take out what is worth nothing since a later effect is in, and let each stand against its rivals again."""
        return self._chosen_again(prune_each(chosen, self._without_shadow))

    def without_below_the_rest(self, chosen: Selection) -> Selection | None:
        """Take out the effect that takes least, if less than all together leave: it may be a shadow of that."""
        rests = {e: fit for e in chosen.effects if (fit := self._rest(chosen.final, e)) is not None}
        least = min(rests, key=lambda e: rests[e].holdout ** 2 - chosen.final.holdout**2, default="")
        if not least or not below_the_rest(chosen.final, rests[least], self.inquiry.policy):
            return None
        return chosen.without(least, rests[least], "it takes less than what is left without a name")

    def without_drifting(self, chosen: Selection, name: str) -> Selection | None:
        """Take out an effect that follows a drift: its strength changes within the records, which it cannot."""
        found = drift(self.inquiry.source.growths(chosen.final, name), self.inquiry.policy)
        if found is None:
            return None
        rest = self._rest(chosen.final, name) or self.inquiry.base
        reason = f"it changes by {abs(found.change / found.distance):.0%} in half a record: a drift, not this effect"
        return replace(chosen, drifting=(*chosen.drifting, Follower(name, found))).without(name, rest, reason)

    def without_limit(self, chosen: Selection, name: str) -> Selection | None:
        """Take out an effect that ended at an end of its form beside one that it is mistaken for, if this is enough."""
        source, policy = self.inquiry.source, self.inquiry.policy
        others = [e for e in chosen.effects if limits(chosen.final, name, source.library[e], policy)]
        rest = self._rest(chosen.final, name) if others else None
        if rest is None or leaves_too_much(self.inquiry.base, rest, source.noise, policy):
            return None
        return chosen.without(name, rest, f"beside {others[0]} it ended at an end of its form, and adds little")

    def with_verdict(self, chosen: Selection) -> Selection:
        """Return the selection with its verdict, by what a model predicts of the error that knows no physics."""
        structure = self.inquiry.source.structure(chosen.final)
        return replace(chosen, structure=structure, verdict=self._verdict(chosen, structure))

    def _verdict(self, chosen: Selection, structure: float) -> str:
        """Return the verdict's word."""
        policy, source, final = self.inquiry.policy, self.inquiry.source, chosen.final
        if chosen.ambiguous:
            return "ambiguous"
        if final.effects:
            return "named"
        if source.noise > 1.0:
            told = chosen.taken_back or structure > policy.structure
            return word_of_unknown_noise(final.holdout, source.noise, told, policy)
        left = clearly_left(final.holdout, structure, chosen.taken_back, source.noise_is_told, policy)
        return "unexplained" if left or goes_on(source.repetition(final), policy) else "none"

    def _leaves_too_much(self, chosen: Selection) -> bool:
        return leaves_too_much(self.inquiry.base, chosen.final, self.inquiry.source.noise, self.inquiry.policy)

    def _passing(self, trials: Sequence[EffectTrial]) -> list[EffectTrial]:
        """Return the trials with proof, the one with the least error on held-out conditions first."""
        return sorted((t for t in trials if self.inquiry.passes(t)), key=lambda t: t.fit.holdout)

    def _accepted(self, chosen: Selection, fit: Fit, equals: tuple[str, ...] = ()) -> Selection:
        """Return the selection with a fit of more effects; ``equals`` cannot be told from each other."""
        ambiguous = (*chosen.ambiguous, equals) if equals else chosen.ambiguous
        return replace(chosen, final=self.inquiry.source.search(fit), ambiguous=ambiguous)

    def _trials(
        self, present: Fit, candidates: Sequence[Candidate], labels: Sequence[str] = ()
    ) -> tuple[EffectTrial, ...]:
        fits = self.inquiry.source.refits([Try(present, c) for c in candidates], labels)
        return tuple(self.inquiry.trial(c.name, present, fit) for c, fit in zip(candidates, fits, strict=True))

    def _rest(self, final: Fit, name: str) -> Fit | None:
        """Return the fit of all effects but one; None if there are no others."""
        rest = tuple(e for e in final.effects if e != name)
        return refit(self.inquiry.source, Join(rest, (final.values,))) if rest else None

    def _without_shadow(self, chosen: Selection, name: str) -> Selection | None:
        """Take out an effect that adds nothing beside the others."""
        rest = self._rest(chosen.final, name)
        if rest is None or self.inquiry.passes(self.inquiry.trial(name, rest, chosen.final)):
            return None
        return chosen.without(name, rest, _idle_beside(rest))

    def _chosen_again(self, chosen: Selection) -> Selection:
        """Let every effect stand against its rivals beside the others; take out what that makes idle."""
        for name in chosen.effects:
            rest = self._rest(chosen.final, name) if name in chosen.effects else None
            if rest is None:
                continue
            own = self.inquiry.trial(name, rest, chosen.final)
            passing = self._passing([own, *self._trials(rest, self._rivals(chosen, name, rest))])
            ending = duel(self.inquiry, rest, passing or [own])
            ambiguous = tuple(s for s in chosen.ambiguous if name not in s)
            chosen = replace(chosen.because_of(ending.reasons), ambiguous=ambiguous)
            if ending.winner.name != name or ending.winner.fit.train < chosen.final.train:
                chosen = self._accepted(chosen, ending.winner.fit, ending.together)
            elif ending.equals:
                chosen = replace(chosen, ambiguous=(*ambiguous, ending.together))
        return prune_each(chosen, self._without_shadow)

    def _rivals(self, chosen: Selection, name: str, rest: Fit) -> list[Candidate]:
        """Return the effects that could take the place of one beside the rest of those accepted."""
        source, policy = self.inquiry.source, self.inquiry.policy
        aliases = source.library[name].aliases
        rivals = [
            c
            for c in self.inquiry.screening.candidates
            if not c.reason
            and c.name not in chosen.effects
            and (c.name in aliases or source.reach(self.inquiry.base, (c.name,), rest) > policy.worth_a_duel)
        ]
        return sorted(rivals, key=lambda c: (c.name not in aliases, -c.gain))[: policy.most_rivals]


def _idle_beside(fit: Fit) -> str:
    return f"it adds nothing beside {' and '.join(fit.effects)}"


def without_idle(chosen: Selection) -> Selection:
    """Leave out all effects if together they do not lower the held-out error, as what stays of a pair may not."""
    if not chosen.final.effects or chosen.final.holdout < chosen.base.holdout:
        return chosen
    reason = "what was left beside it does not lower the error on held-out conditions"
    return replace(chosen.because_of(dict.fromkeys(chosen.effects, reason)), final=chosen.base, ambiguous=())


def without_noise(chosen: Selection, policy: Policy) -> Selection:
    """Leave out all effects if the base alone leaves no more than the noise floors, and they no less than these allow.

    What they take then is noise. Where they leave much less, the floors are too high, and no floors at all.
    """
    base, final = chosen.base, chosen.final
    above = max(base.train, base.holdout) > policy.at_the_floor
    if not final.effects or above or is_below_floors(final.train, final.holdout):
        return chosen
    reason = "the error without it is that of the noise"
    return replace(chosen.because_of(dict.fromkeys(chosen.effects, reason)), final=base, ambiguous=())


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
    chosen = chosen.because_of(dict.fromkeys(proven.effects, f"{together}, {left}"))
    return replace(chosen, final=chosen.base, ambiguous=(), taken_back=True)
