"""Which effects are missing: added one by one, each against its rivals, and none without proof on held-out conditions.

An effect is accepted if, refitted jointly with everything else, its parameter stands clear of neutral by more standard
errors than the number of candidates could produce by chance, and it lowers the error on held-out conditions by more
than chance. Two effects that both pass alone are put in together (an encompassing test): the one that still earns its
place beside the other is real, the other a shadow; if neither does, the data cannot tell them apart. Where no effect
alone has proof, or what was put in one by one leaves too much, two are tried together, and every effect is chosen anew
once others are beside it.

The library's forms are approximations. What the right effect leaves is small against what it takes, and a look-alike
that takes some of that is a shadow. So what an effect takes must be a visible share of the base's gap, or nearly all
that is left of it; standard errors count the scatter between conditions, since a real effect has one parameter
everywhere and a shadow has not; and what an effect takes must exceed what all together leave.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from mrfit.core import registry
from mrfit.core.progress import Progress
from mrfit.core.specs import EffectSpec
from mrfit.discover.pairs import best_pair
from mrfit.discover.refit import Fitter, Refit, paired_z
from mrfit.discover.screen import ALIKE, Screened, reach, screen
from mrfit.discover.steadiness import change_within_records
from mrfit.discover.trials import HOLDOUT_CLEAR, Trial, judge, leaves_too_much, try_out

# Screened candidates that to first order take away less of the squared error than this are not refitted
WORTH_A_REFIT = 1e-3
# A rival that leaves so many times what the winner leaves, and significantly more, is not its equal
FAR_BEHIND = 2.0
# What an effect takes must be more than this times what all together leave
ABOVE_THE_REST = 0.5
MOST_REFITS = 7
MOST_ROUNDS = 4
UNSEEN = "its sensitivity is not in the error"
# A rival that takes away at least this share of the squared error that the winner takes away is looked at
RIVAL_TAKES = 0.35
# Rivals that an effect has to face again once others are beside it
MOST_RIVALS = 4
# An effect that is not known to be mistaken for another faces it only if it could take this share of what is left then
WORTH_A_DUEL = 0.05


@dataclass
class Verdict:
    """What was decided, and what became of every candidate.

    Attributes
    ----------
    base, final
        The fit without and with the accepted effects.
    proven, doubtful
        The fit with all effects that had proof each, whether or not each takes more than they leave together, and the
        sets that could not be told apart among them.
    ambiguous
        Sets of effects that the data cannot tell apart, the one in the final fit first.
    screened
        The first screening.
    reasons
        For every effect: why it was accepted or turned down.
    gains
        Share of the squared hold-out error each took away when it was last tried.
    taken_back
        Whether none is named, since together they leave too much.
    drifting
        Rows of what drifts, where an effect only followed a drift.
    """

    base: Refit
    final: Refit
    proven: Refit
    ambiguous: list[tuple[str, ...]] = field(default_factory=list)
    screened: list[Screened] = field(default_factory=list)
    reasons: dict[str, str] = field(default_factory=dict)
    gains: dict[str, float] = field(default_factory=dict)
    doubtful: list[tuple[str, ...]] = field(default_factory=list)
    taken_back: bool = False
    drifting: list[dict[str, Any]] = field(default_factory=list)

    def alike(self, name: str) -> set[str]:
        """Return the effects whose projected sensitivity is nearly parallel to an effect's in these data."""
        seen = {s.name: s.direction for s in self.screened if len(s.direction)}
        if name not in seen:
            return set()
        return {other for other, d in seen.items() if other != name and abs(float(d @ seen[name])) > ALIKE}


def decide(fitter: Fitter, base: Refit, effects: Sequence[EffectSpec], progress: Progress) -> Verdict:
    """Return the missing effects of a base model.

    Parameters
    ----------
    fitter
        Fits assemblies to the training segments.
    base
        The fitted base.
    effects
        The library for this output.
    progress
        Told of every refit.
    """
    verdict = Verdict(base, base, base, screened=screen(fitter, base, effects))
    first = _grow(fitter, verdict, effects, progress)
    if verdict.final.effects and leaves_too_much(base, verdict.final, fitter.bench.most_noise("holdout")):
        _start_again(fitter, verdict, (effects, first), progress)
    verdict.proven, verdict.doubtful = verdict.final, verdict.ambiguous
    _remove_below_the_rest(fitter, verdict)
    _remove_drifting(fitter, verdict)
    for name in verdict.final.effects:
        verdict.reasons[name] = f"its parameter is {verdict.final.strength(name):.0f} standard errors from neutral"
    return verdict


def _grow(fitter: Fitter, verdict: Verdict, effects: Sequence[EffectSpec], progress: Progress) -> list[Trial]:
    """Add effects until none has proof; return the first round's trials."""
    first: list[Trial] = []
    for number in range(MOST_ROUNDS):
        present = verdict.final
        candidates = screen(fitter, present, effects) if present.effects else verdict.screened
        trials = _trials(fitter, present, candidates, verdict, (number, progress))
        first = first or trials
        passing = sorted((t for t in trials if t.passes), key=lambda t: t.fit.chi("holdout"))
        if passing:
            winner, equals = duel(fitter, present, passing, verdict)
            _accept(fitter, verdict, winner.fit, equals and (winner.name, *equals))
        else:
            both = best_pair(fitter, present, verdict.base, (candidates, trials), progress)
            if both is None:
                break
            _accept(fitter, verdict, both)
        _remove_shadows(fitter, verdict)
        _choose_again(fitter, verdict)
    return first


def _start_again(
    fitter: Fitter, verdict: Verdict, known: tuple[Sequence[EffectSpec], list[Trial]], progress: Progress
) -> None:
    """Begin with the best pair, where effects put in one by one leave too much: the first may imitate two others."""
    effects, first = known
    both = best_pair(fitter, verdict.base, verdict.base, (verdict.screened, first), progress)
    if both is None or set(both.effects) <= set(verdict.final.effects):
        return
    other = replace(verdict, ambiguous=[], reasons=dict(verdict.reasons), gains=dict(verdict.gains))
    _accept(fitter, other, both)
    _choose_again(fitter, other)
    _grow(fitter, other, effects, progress)
    if leaves_too_much(verdict.base, other.final, fitter.bench.most_noise("holdout")):
        return
    for name in set(verdict.final.effects) - set(other.final.effects):
        other.reasons[name] = f"it adds nothing beside {' and '.join(other.final.effects)}"
    verdict.final, verdict.ambiguous, verdict.reasons = other.final, other.ambiguous, other.reasons


def _accept(fitter: Fitter, verdict: Verdict, fit: Refit, equals: Sequence[str] = ()) -> None:
    """Take a fit with more effects; ``equals`` cannot be told from each other."""
    verdict.final = fitter.thorough(fit)
    if equals:
        verdict.ambiguous.append(tuple(equals))


def _trials(
    fitter: Fitter,
    present: Refit,
    candidates: Sequence[Screened],
    verdict: Verdict,
    listener: tuple[int, Progress],
) -> list[Trial]:
    worth = [c for c in candidates if not c.reason and c.gain > WORTH_A_REFIT][:MOST_REFITS]
    number, progress = listener
    trials: list[Trial] = []
    for trial in try_out(fitter, present, worth, verdict.base, verdict.alike):
        trials.append(trial)
        if number == 0 or trial.passes or verdict.reasons[trial.name] == UNSEEN:
            beside = f", beside {' and '.join(present.effects)}" if number else ""
            verdict.gains[trial.name] = trial.gain
            verdict.reasons[trial.name] = trial.reason + beside
        progress(f"round {number + 1}: refit with {trial.name}", len(trials), len(worth))
    for candidate in candidates:
        verdict.reasons.setdefault(candidate.name, candidate.reason or UNSEEN)
    return trials


def aliases_of(name: str) -> set[str]:
    """Return the effects that an effect is mistaken for, or that are mistaken for it."""
    own = set(registry.load("effect", name).SPEC.aliases)
    return own | {e for e in registry.names("effect") if name in registry.load("effect", e).SPEC.aliases}


def duel(fitter: Fitter, present: Refit, passing: Sequence[Trial], verdict: Verdict) -> tuple[Trial, tuple[str, ...]]:
    """Return the best trial after encompassing tests against its rivals, and the rivals it cannot be told from.

    Parameters
    ----------
    fitter
        Fits assemblies to the training segments.
    present
        The model beside which each was tried.
    passing
        Trials, the one with the least error on held-out conditions first.
    verdict
        Gives the base; is told why a rival was turned down.
    """
    winner = passing[0]
    equals: list[str] = []
    for rival in passing[1:]:
        if not _comparable(present, winner, rival):
            verdict.reasons[rival.name] = f"it closes less of the gap than {winner.name}"
            continue
        both = fitter.refit(
            [*present.effects, winner.name, rival.name], [rival.fit.values | winner.fit.values, winner.fit.values]
        )
        again = [_started_from(fitter, present, both, t, verdict) for t in (winner, rival)]
        if again[1].fit.chi("holdout") < again[0].fit.chi("holdout"):
            again, equals = again[::-1], []
        winner, rival = again
        adds = judge(rival.name, winner.fit, both, verdict.base, verdict.alike(rival.name)).passes
        needed = judge(winner.name, rival.fit, both, rival.fit).passes
        if adds and needed:
            continue
        if adds:
            verdict.reasons[winner.name] = f"it adds nothing beside {rival.name}"
            winner, equals = rival, []
        elif needed:
            verdict.reasons[rival.name] = f"it adds nothing beside {winner.name}"
        elif _far_behind(winner, rival):
            verdict.reasons[rival.name] = f"it closes less of the gap than {winner.name}"
        elif _limits(rival, winner) > _limits(winner, rival):
            verdict.reasons[rival.name] = f"its shape ends at a bound, where it is no other than {winner.name}"
        elif _limits(rival, winner) < _limits(winner, rival):
            verdict.reasons[winner.name] = f"its shape ends at a bound, where it is no other than {rival.name}"
            winner, equals = rival, []
        else:
            verdict.reasons[rival.name] = f"these data cannot tell it from {winner.name}"
            equals.append(rival.name)
    return winner, tuple(equals)


def _limits(trial: Trial, rival: Trial) -> int:
    """Return how many times an effect's form ended at its limit, where it may be its rival's."""
    return trial.fit.degenerate(trial.name, rival.name)


def _started_from(fitter: Fitter, present: Refit, both: Refit, trial: Trial, verdict: Verdict) -> Trial:
    """Return a trial whose fit was also started where the effect came to stand beside its rival, if that is lower."""
    fit = fitter.refit([*present.effects, trial.name], [both.values])
    if fit is trial.fit:
        return trial
    return judge(trial.name, present, fit, verdict.base, verdict.alike(trial.name))


def _comparable(present: Refit, winner: Trial, rival: Trial) -> bool:
    before = present.chi("holdout") ** 2
    best, other = before - winner.fit.chi("holdout") ** 2, before - rival.fit.chi("holdout") ** 2
    return other > RIVAL_TAKES * best


def _far_behind(winner: Trial, rival: Trial) -> bool:
    """Return whether a rival fits held-out conditions so much worse that a wrong form of the winner is no excuse."""
    least, other = (max(t.fit.chi("holdout") ** 2 - 1.0, 0.0) for t in (winner, rival))
    return other > FAR_BEHIND * least and paired_z(rival.fit.holdout, winner.fit.holdout) > HOLDOUT_CLEAR


def _remove_shadows(fitter: Fitter, verdict: Verdict) -> None:
    """Take out what helped first and is worth nothing since a later effect is in, or since one was exchanged."""
    for name in verdict.final.effects:
        rest = [e for e in verdict.final.effects if e != name]
        if not rest:
            continue
        without = fitter.refit(rest, [verdict.final.values])
        if not judge(name, without, verdict.final, verdict.base, verdict.alike(name)).passes:
            _take_out(verdict, name, without, f"it adds nothing beside {' and '.join(rest)}")


def _take_out(verdict: Verdict, name: str, without: Refit, reason: str) -> None:
    verdict.final = without
    verdict.reasons[name] = reason
    verdict.ambiguous = [s for s in verdict.ambiguous if name not in s]


def _choose_again(fitter: Fitter, verdict: Verdict) -> None:
    """Let every effect stand against its rivals again, now that the others are in; take out what that makes idle."""
    for name in verdict.final.effects:
        rest = [e for e in verdict.final.effects if e != name]
        if not rest or name not in verdict.final.effects:
            continue
        without = fitter.refit(rest, [verdict.final.values])
        alike = aliases_of(name)
        rivals = [
            s
            for s in verdict.screened
            if not s.reason
            and s.name not in verdict.final.effects
            and (s.name in alike or reach([s], without, fitter.stride) > WORTH_A_DUEL)
        ]
        rivals = sorted(rivals, key=lambda s: (s.name not in alike, -s.gain))[:MOST_RIVALS]
        trials = try_out(fitter, without, rivals, verdict.base, verdict.alike)
        own = judge(name, without, verdict.final, verdict.base, verdict.alike(name))
        passing = sorted((t for t in (own, *trials) if t.passes), key=lambda t: t.fit.chi("holdout"))
        winner, equals = duel(fitter, without, passing or [own], verdict)
        verdict.ambiguous = [s for s in verdict.ambiguous if name not in s]
        if winner.name != name or winner.fit.chi("train") < verdict.final.chi("train"):
            _accept(fitter, verdict, winner.fit, equals and (winner.name, *equals))
        elif equals:
            verdict.ambiguous.append((name, *equals))
    _remove_shadows(fitter, verdict)


def _remove_drifting(fitter: Fitter, verdict: Verdict) -> None:
    """Take out effects that follow a drift: their strength changes within the records, which it cannot."""
    for name in verdict.final.effects:
        change = change_within_records(fitter, verdict.final, name)
        if change is not None:
            rest = [e for e in verdict.final.effects if e != name]
            without = fitter.refit(rest, [verdict.final.values]) if rest else verdict.base
            verdict.drifting += change.rows
            reason = f"it changes by {abs(change.share):.0%} in half a record: a drift, not this effect"
            _take_out(verdict, name, without, reason)


def _remove_below_the_rest(fitter: Fitter, verdict: Verdict) -> None:
    """Take out, the least first, effects that take less than all together leave: they may be shadows of that."""
    while len(verdict.final.effects) > 1:
        final = verdict.final
        rest = final.chi("holdout") ** 2 - 1.0
        without = {e: fitter.refit([o for o in final.effects if o != e], [final.values]) for e in final.effects}
        falls = {e: fit.chi("holdout") ** 2 - final.chi("holdout") ** 2 for e, fit in without.items()}
        least = min(falls, key=lambda e: falls[e])
        if falls[least] > ABOVE_THE_REST * rest:
            return
        _take_out(verdict, least, without[least], "it takes less than what is left without a name")
