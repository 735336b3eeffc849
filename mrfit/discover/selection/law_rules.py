"""The decision: evidence in, effects out. Nothing here computes, reads or writes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Protocol

from mrfit.core.specs import Invariance
from mrfit.discover.policy import Policy
from mrfit.discover.selection.rules import counted
from mrfit.io.schemas.discovery import BrokenInvariance, EffectParameter, EffectSignificance

# Levels of the nuisance
TRAVEL, TIME, FULL = 2, 3, 4


@dataclass(frozen=True)
class LawCandidate:
    """Screening of one effect beside the best law.

    Attributes
    ----------
    name
        Of the effect.
    share
        Of the squared error beside the best law, how much it could take to first order.
    left
        Share of its sensitivity's square that no law takes.
    theta
        Parameters to start from.
    wrong
        Whether its strength has a sign that is not physical.
    tried
        Which of the starts that were screened it is.
    """

    name: str
    share: float
    left: float
    theta: tuple[float, ...] = ()
    wrong: bool = False
    tried: int = -1

    @property
    def rank(self) -> float:
        """Share, 0 for one of the wrong sign."""
        return 0.0 if self.wrong else self.share


@dataclass(frozen=True)
class EffectPair:
    """Two effects that could take more together than either alone: opposed, each hides the other.

    Attributes
    ----------
    names
        Of the effects.
    share
        Of the squared error beside the best law, how much they could take together to first order.
    thetas
        Parameters to start from.
    """

    names: tuple[str, str]
    share: float
    thetas: tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class LawScreening:
    """Screening of every effect, and of pairs, those that could take most first."""

    candidates: tuple[LawCandidate, ...] = ()
    pairs: tuple[EffectPair, ...] = ()


@dataclass(frozen=True)
class RefinedEffect:
    """An effect refined beside those that are there already.

    Attributes
    ----------
    name
        Of the effect.
    standing
        How clearly it shows.
    error
        Squared error with it.
    sign
        Whether its strength has a physical sign.
    early
        Share that a record which is early would take, over its own; 0 where that is no rival.
    beyond
        What such a record would take beside the effect, over what the effect takes beside it.
    numbers
        Numbers that were fitted.
    unsure
        Half the 95 % interval of its largest force, over that force.
    degrees
        Degrees of freedom of its standard error: groups of samples, less one.
    """

    name: str
    standing: EffectSignificance
    error: float
    sign: bool = True
    early: float = 0.0
    beyond: float = 0.0
    numbers: int = 1
    unsure: float = 0.0
    degrees: float = inf


@dataclass(frozen=True)
class EffectDescription:
    """An effect of a state: the row that is decided on, its parameters and its largest force with intervals."""

    row: RefinedEffect
    parameters: tuple[EffectParameter, ...]
    force: EffectParameter


State = Mapping[str, tuple[float, ...]]
"""Effects that are taken to be there, each with its parameters."""


@dataclass(frozen=True)
class LawFit:
    """The best law beside effects at their best numbers, and how clearly those that were asked for show."""

    state: State
    described: tuple[EffectDescription, ...]


@dataclass(frozen=True)
class TestedEffect:
    """An effect of the library as it is tested.

    Attributes
    ----------
    invariance
        What it breaks.
    level
        Highest level of the nuisance beside which it can be told.
    constant
        Whether it adds a force that nothing changes.
    """

    invariance: Invariance
    level: int
    constant: bool


class LawSource(Protocol):
    """Answers to the questions of a decision that takes no law as given.

    Samples are weighed by the residual of the best law with the effects ``weighed``; a law remembers twice as long
    where ``longer``.
    """

    @property
    def library(self) -> Mapping[str, TestedEffect]:
        """The effects that can be tested."""

    @property
    def groups(self) -> int:
        """Number of groups of samples from which an error is told."""

    def screen(self, state: State, weighed: State) -> LawScreening:
        """Return the screening of every effect, and of every two, beside a state."""

    def refit(self, start: State, weighed: State, names: Sequence[str], level: int, longer: bool = False) -> LawFit:
        """Return effects at their best numbers beside the best law up to a level, with the standing of some."""

    def left(self, state: State, longer: bool = False) -> float:
        """Return the mean squared error that the best law leaves beside effects as they are."""

    def broken(self, state: State, longer: bool = False) -> tuple[BrokenInvariance, ...]:
        """Return the invariances that something without a name breaks, the clearest first."""

    def beside(self, state: State, name: str, invariance: Invariance) -> tuple[float, float]:
        """Return share and standard errors of an effect beside the flexible terms of an invariance."""


def worth_refining(candidates: Sequence[LawCandidate], policy: Policy) -> tuple[list[LawCandidate], list[LawCandidate]]:
    """Return the candidates to refine, the one that could take most first, and those that are turned down at once."""
    ordered = sorted(candidates, key=lambda c: -c.rank)
    least = policy.worth_refining * policy.share
    good = [c for c in ordered if c.left >= policy.sensitivity_left and c.rank >= least][: policy.most_refined]
    return good, [c for c in ordered if c not in good]


def worth_pairing(screening: LawScreening, policy: Policy) -> list[EffectPair]:
    """Return the pairs to refine where no effect alone is there: together they take more than both alone."""
    alone = {c.name: c.rank for c in screening.candidates}
    return [
        p
        for p in screening.pairs
        if p.share >= max(policy.pair_share, policy.gain_of_pair * sum(alone[n] for n in p.names))
    ][: policy.most_law_pairs]


def both(rows: Sequence[RefinedEffect], policy: Policy) -> bool:
    """Return whether two effects stand beside each other without objection."""
    return all(not objection(row, policy) for row in rows)


def screened_out(candidate: LawCandidate, policy: Policy) -> str:
    """Return the reason for which a candidate is not refined."""
    if candidate.left < policy.sensitivity_left:
        return "the law may have it"
    if candidate.wrong and candidate.share >= policy.worth_refining * policy.share:
        return "its strength would have the wrong sign"
    return f"takes only {candidate.share:.0%} of what no law makes"


def looks_early(row: RefinedEffect, policy: Policy) -> bool:
    """Return whether a record that is early cannot be told from an effect.

    It takes much less, or less and nothing of its own beside the effect.
    """
    if row.early <= policy.early:
        return False
    return row.early > policy.early_at_most or row.beyond > policy.early_beyond


def objection(row: RefinedEffect, policy: Policy) -> str:
    """Return the objection to a refined effect; empty if there is none."""
    s = row.standing
    reasons = (
        (s.left < policy.sensitivity_left, "the law may have it"),
        (not row.sign, "its strength would have the wrong sign"),
        (looks_early(row, policy), f"a record that is early would take {row.early:.0%} of what it takes"),
        (counted(s.z, row.degrees, policy) < _clear(s, policy), f"only {s.z:.1f} standard errors from neutral"),
        (s.share < _share(s, policy), f"takes only {s.share:.0%} of what no law makes"),
        (s.kept < policy.kept, f"takes only {s.kept:.0%} on conditions left out"),
        (s.held < policy.held, f"takes only {s.held:.0%} on conditions left out, the law from the others too"),
        (s.size < policy.size, f"at most {s.size:.2%} of the range"),
    )
    return next((text for fails, text in reasons if fails), "")


def _clear(s: EffectSignificance, policy: Policy) -> float:
    """Return the standard errors that are asked for: fewer of what takes nearly all, on conditions left out too.

    Where one condition tells most of an effect, its strength without that one scatters, though it is there as well.
    """
    return policy.clear_of_nearly_all if _takes_most(s, policy) else policy.law_clear


def _share(s: EffectSignificance, policy: Policy) -> float:
    """Return the share that is asked for: less of what is plain, beside a law that leaves much else unexplained."""
    return policy.share_if_plain if s.z >= policy.plain else policy.share


def _takes_most(s: EffectSignificance, policy: Policy) -> bool:
    return min(s.share, s.kept) >= policy.nearly_all


def worth_weighing(row: RefinedEffect, policy: Policy) -> bool:
    """Return whether an effect without proof deserves weights of its own: it takes enough, where it was fitted."""
    s = row.standing
    return row.sign and s.left >= policy.sensitivity_left and s.share >= policy.share and not looks_early(row, policy)


def stands_weighed(row: RefinedEffect, policy: Policy) -> bool:
    """Return whether an effect stands by weights of its own, which favour it: it has to take nearly all."""
    return _takes_most(row.standing, policy) and not objection(row, policy)


@dataclass(frozen=True)
class RefinementRound:
    """Decision of one round of refinements: the effect to add, or none, its rivals, and objections to others."""

    winner: str
    rivals: tuple[str, ...]
    reasons: tuple[tuple[str, str], ...]


def best_of(rows: Sequence[RefinedEffect], policy: Policy) -> RefinementRound:
    """Return the effect that leaves least among those without objection; rivals leave hardly more.

    One with fewer numbers wins over it where it leaves as little.
    """
    reasons = tuple((r.name, objection(r, policy)) for r in rows)
    good = sorted((r for r, (_, why) in zip(rows, reasons, strict=True) if not why), key=lambda r: r.error)
    if not good:
        return RefinementRound("", (), reasons)
    near = [r for r in good if r.error <= policy.simpler_error * good[0].error]
    winner = min(near, key=lambda r: r.numbers)
    rivals = tuple(r.name for r in good if r is not winner and r.error < policy.rival_error * winner.error)
    return RefinementRound(winner.name, rivals, reasons)


def swap_candidates(candidates: Sequence[LawCandidate], present: RefinedEffect, policy: Policy) -> list[LawCandidate]:
    """Return the candidates to refine instead of an effect that is there, with everything else."""
    least = policy.swap_share * present.standing.share
    good = [c for c in candidates if c.left >= policy.sensitivity_left and c.name != present.name and c.rank >= least]
    return sorted(good, key=lambda c: -c.rank)[: policy.most_law_pairs]


def weakest(rows: Sequence[RefinedEffect], policy: Policy) -> tuple[str, str]:
    """Return the effect with an objection that takes least beside the others, and the objection; empty if none has.

    Its force has to be told, too: between laws that leave as little it may be anything where one of them imitates it.
    """
    bad = [(r, objection(r, policy) or _unsure(r, policy)) for r in rows]
    bad = [(r, why) for r, why in bad if why]
    if not bad:
        return "", ""
    row, why = min(bad, key=lambda b: b[0].standing.share)
    return row.name, why


def _unsure(row: RefinedEffect, policy: Policy) -> str:
    return f"its force is told to ± {row.unsure:.0%} only" if row.unsure > policy.unsure else ""


def beside_longer_memory(policy: Policy) -> Policy:
    """Return thresholds with what is asked for beside a law that remembers for longer."""
    lowered = ("law_clear", "clear_of_nearly_all", "share", "share_if_plain", "plain", "kept", "held")
    asked = {name: policy.further * getattr(policy, name) for name in lowered}
    return replace(policy, **asked, **{"unsure": policy.unsure / policy.further})


def stands_further(row: RefinedEffect, before: float, policy: Policy) -> bool:
    """Return whether a law of longer memory leaves an effect its force, also on conditions left out.

    ``before`` is the size of its force beside a law of shorter memory.
    """
    s = row.standing
    return row.sign and s.kept >= policy.further * policy.kept and abs(1.0 - s.size / before) <= policy.force_drifts


def lost(rows: Sequence[RefinedEffect], before: Mapping[str, float], policy: Policy) -> tuple[str, str]:
    """Return the effect that does not hold where a law may remember for longer, and why; empty if all hold.

    Parameters
    ----------
    rows
        The effects beside such a law.
    before
        Size of each beside a law of shorter memory.
    policy
        Thresholds.
    """
    name, why = weakest(rows, beside_longer_memory(policy))
    if name:
        return name, why
    taken = {r.name: 1.0 - r.standing.size / before[r.name] for r in rows}
    most = max(taken, key=lambda n: taken[n], default="")
    if most and taken[most] > policy.force_drifts:
        return most, f"it takes over {taken[most]:.0%} of its force"
    return "", ""
