"""One effect on trial, and against its rivals: what it has to show before it is believed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from mrfit.discover.policy import Policy
from mrfit.discover.selection.questions import EffectScreening, EvidenceSource, Fit, Join, refit
from mrfit.discover.selection.rules import (
    EffectTrial,
    beyond_chance,
    claim,
    comparable,
    fits_worse,
    helps,
    leaves_far_more,
    limits,
    objection,
    takes_little_more,
    widens,
)


@dataclass(frozen=True)
class Inquiry:
    """Source, thresholds and first screening of a decision.

    Attributes
    ----------
    source
        Answers questions.
    policy
        The thresholds.
    screening
        What each effect could add to the base.
    """

    source: EvidenceSource
    policy: Policy
    screening: EffectScreening

    @property
    def base(self) -> Fit:
        """The fit of the base alone."""
        return self.source.base

    def alike(self, name: str) -> dict[str, float]:
        """Return the share of the base's gap that is asked of an effect beside each of those that it looks like.

        One that changes the same input may look like it with other shapes only. Then it follows what this one leaves,
        so that most of a small rest is no proof.
        """
        near = dict.fromkeys(self.source.library[name].of_one_input, self.policy.least_gap)
        return near | dict.fromkeys(self.screening.alike(name, self.policy.alike), self.policy.least_gap_of_alike)

    def passes(self, trial: EffectTrial) -> bool:
        """Return whether an effect has proof."""
        return not objection(trial, self.policy)

    def judged(
        self, name: str, before: Fit, after: Fit, base: Fit | None = None, alike: Mapping[str, float] | None = None
    ) -> EffectTrial:
        """Return the trial of an effect from the fits without and with it, see ``claim``.

        No more is asked than decides: an effect that does not help needs no interval.
        """
        trial = claim(name, before, after, base or self.base, self.policy, alike)
        if not helps(trial, self.policy):
            return trial
        if not (trial.overwhelms or trial.settles):
            trial = replace(trial, score=self.source.fall(before, after))
        if beyond_chance(trial, self.policy):
            trial = replace(trial, strength=self.source.strength(after, name))
        return trial

    def trial(self, name: str, before: Fit, after: Fit) -> EffectTrial:
        """Return the same of an effect of which more is asked beside those that it looks like."""
        return self.judged(name, before, after, None, self.alike(name))


@dataclass(frozen=True)
class DuelResult:
    """Result of a duel.

    Attributes
    ----------
    winner
        The best trial.
    equals
        Rivals that it cannot be told from.
    reasons
        Why others were turned down, by name.
    """

    winner: EffectTrial
    equals: tuple[str, ...] = ()
    reasons: Mapping[str, str] = field(default_factory=dict)

    @property
    def together(self) -> tuple[str, ...]:
        """The winner and those it cannot be told from; empty if there are none."""
        return (self.winner.name, *self.equals) if self.equals else ()

    def turned_down(self, name: str, reason: str) -> "DuelResult":
        """Return the same with a reason against an effect."""
        return replace(self, reasons={**self.reasons, name: reason})


def duel(inquiry: Inquiry, present: Fit, passing: Sequence[EffectTrial]) -> DuelResult:
    """Return the winner after encompassing tests of the best trial against its rivals.

    Parameters
    ----------
    inquiry
        Evidence and policy.
    present
        The model beside which each was tried.
    passing
        Trials, the one with the least error on held-out conditions first.
    """
    ending = DuelResult(passing[0])
    for rival in passing[1:]:
        if comparable(present, ending.winner.fit, rival.fit, inquiry.policy):
            ending = _against(inquiry, present, ending, rival)
        else:
            ending = ending.turned_down(rival.name, _closes_less(ending.winner))
    return ending


def _against(inquiry: Inquiry, present: Fit, ending: DuelResult, rival: EffectTrial) -> DuelResult:
    """Put both effects in together: the one that still earns its place beside the other is real, the other a shadow."""
    winner = ending.winner
    both = refit(
        inquiry.source,
        Join(
            (*present.effects, winner.name, rival.name),
            ({**rival.fit.values, **winner.fit.values}, winner.fit.values, _halves(inquiry, winner, rival)),
        ),
    )
    # each is fitted again from where it came to stand beside the other, which may be lower
    fits = [refit(inquiry.source, Join((*present.effects, t.name), (both.values,))) for t in (winner, rival)]
    again = [replace(t, fit=fit) for t, fit in zip((winner, rival), fits, strict=True)]
    if again[1].fit.holdout < again[0].fit.holdout:
        again, ending = again[::-1], replace(ending, equals=())
    winner, rival = again
    ending = replace(ending, winner=winner)
    adds = inquiry.passes(inquiry.trial(rival.name, winner.fit, both))
    needed = inquiry.passes(inquiry.judged(winner.name, rival.fit, both, rival.fit))
    if adds and needed:
        return ending
    if adds:
        return DuelResult(rival, (), ending.reasons).turned_down(winner.name, f"it adds nothing beside {rival.name}")
    if needed and _hardly_wider(inquiry, winner, rival, both):
        return DuelResult(rival, (), ending.reasons).turned_down(winner.name, _is_hardly_wider(rival))
    if needed:
        return ending.turned_down(rival.name, f"it adds nothing beside {winner.name}")
    return _without_proof(inquiry, ending, rival)


def _halves(inquiry: Inquiry, winner: EffectTrial, rival: EffectTrial) -> dict[str, float]:
    """Return values of two effects together, half of each one's strength: alone it took part of the other's share."""
    values = {**rival.fit.values, **winner.fit.values}
    for trial in (winner, rival):
        for name in inquiry.source.library[trial.name].parameters - trial.fit.shapes.get(trial.name, {}).keys():
            values[f"{trial.name}.{name}"] *= 0.5
    return values


def _without_proof(inquiry: Inquiry, ending: DuelResult, rival: EffectTrial) -> DuelResult:
    """Settle between two of which neither has proof beside the other.

    What a wider form takes more than a narrow one counts only where it is a visible share of the gap.
    """
    winner, policy, library = ending.winner, inquiry.policy, inquiry.source.library
    if _hardly_wider(inquiry, rival, winner, rival.fit):
        return ending.turned_down(rival.name, _is_hardly_wider(winner))
    if _hardly_wider(inquiry, winner, rival, winner.fit):
        return DuelResult(rival, (), ending.reasons).turned_down(winner.name, _is_hardly_wider(rival))
    if _far_behind(inquiry, winner, rival):
        return ending.turned_down(rival.name, _closes_less(winner))
    own = limits(winner.fit, winner.name, library[rival.name], policy)
    other = limits(rival.fit, rival.name, library[winner.name], policy)
    if other > own:
        return ending.turned_down(rival.name, _is_a_limit(winner))
    if other < own:
        return DuelResult(rival, (), ending.reasons).turned_down(winner.name, _is_a_limit(rival))
    ending = ending.turned_down(rival.name, f"these data cannot tell it from {winner.name}")
    return replace(ending, equals=(*ending.equals, rival.name))


def _far_behind(inquiry: Inquiry, winner: EffectTrial, rival: EffectTrial) -> bool:
    """Return whether a rival leaves far more of held-out tests, significantly so, or does not even fit the others."""
    if fits_worse(winner.fit, rival.fit, inquiry.policy):
        return True
    if not leaves_far_more(winner.fit, rival.fit, inquiry.policy):
        return False
    return inquiry.source.fall(rival.fit, winner.fit) > inquiry.policy.holdout_clear


def _hardly_wider(inquiry: Inquiry, winner: EffectTrial, rival: EffectTrial, fit: Fit) -> bool:
    """Return whether a winner is a wider form of its rival, and a fit with it takes hardly more of the gap."""
    wider = widens(winner, rival, inquiry.source.library)
    return wider and takes_little_more(inquiry.base, rival.fit, fit, inquiry.policy)


def _closes_less(winner: EffectTrial) -> str:
    return f"it closes less of the gap than {winner.name}"


def _is_hardly_wider(rival: EffectTrial) -> str:
    return f"its wider form takes hardly more of the gap than {rival.name}"


def _is_a_limit(other: EffectTrial) -> str:
    return f"its shape ends at a bound, where it is no other than {other.name}"
