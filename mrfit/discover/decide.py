"""Which effects are missing: added one by one, each against its rivals, and none without proof on held-out conditions.

An effect is accepted if, refitted jointly with everything else, its parameter stands clear of neutral by more standard
errors than the number of candidates could produce by chance, and it lowers the error on held-out conditions by more
than chance. Two effects that both pass alone are put in together (an encompassing test): the one that still earns its
place beside the other is real, the other a shadow; if neither does, the data cannot tell them apart. Where no effect
alone has proof, two are tried together, and every effect is chosen anew once others are beside it.

The library's forms are approximations. What the right effect leaves is small against what it takes, and a look-alike
that takes some of that is a shadow. So what an effect takes must be a visible share of the base's gap, or nearly all
that is left of it; standard errors count the scatter between conditions, since a real effect has one parameter
everywhere and a shadow has not; and what an effect takes must exceed what all together leave.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from mrfit import registry
from mrfit.discover.refit import Fitter, Refit, paired_z
from mrfit.discover.screen import Screened, screen
from mrfit.progress import Progress
from mrfit.specs import EffectSpec

# Standard errors from neutral: twenty candidates reach 3 by chance in 5 of 100 data sets, 4 in 1 of 1000
CLEAR = 4.0
# Screened candidates that to first order take away less of the squared error than this are not refitted
WORTH_A_REFIT = 1e-3
# Standard score of the fall in squared hold-out error
HOLDOUT_CLEAR = 2.0
# Least share of the squared hold-out error that an effect must take away
LEAST_GAIN = 0.01
# Least share of the gap that the base alone leaves, for an effect and for the look-alike of one that is in already …
LEAST_GAP = 0.02
LEAST_GAP_OF_ALIKE = 0.1
# … or, where it takes this share of the gap that is left and is no look-alike, so much of the base's
MOST_OF_THE_REST, LEAST_GAP_OF_THE_REST = 0.5, 0.005
# Cosine between projected sensitivities from which a wrong form of one effect may well look like the other
ALIKE = 0.8
# A rival that leaves so many times what the winner leaves, and significantly more, is not its equal
FAR_BEHIND = 2.0
# What an effect takes must be more than this times what all together leave
ABOVE_THE_REST = 0.5
MOST_REFITS = 7
MOST_ROUNDS = 4
# A rival that leaves at most this much more of the gap is looked at
RIVAL = 0.35
# Two effects at once are looked for among so many, where this share of the gap is left and stands this far above noise
COUPLED = 4
LEFT_FOR_TWO, ABOVE_NOISE = 0.05, 1.5
# Rivals that an effect has to face again once others are beside it
MOST_RIVALS = 4


@dataclass(frozen=True)
class Trial:
    """One effect added to the present model and refitted.

    Attributes
    ----------
    name
        The effect.
    fit
        The refit.
    gain
        Share of the squared hold-out error taken away.
    strength
        Standard errors of the effect's parameter from neutral.
    score
        Standard score of the fall in squared hold-out error.
    """

    name: str
    fit: Refit
    gain: float
    strength: float
    score: float

    @property
    def passes(self) -> bool:
        """Whether the effect has proof."""
        return self.strength > CLEAR and self.gain > LEAST_GAIN and self.score > HOLDOUT_CLEAR


@dataclass
class Verdict:
    """What was decided, and what became of every candidate.

    Attributes
    ----------
    base, final
        The fit without and with the accepted effects.
    ambiguous
        Sets of effects that the data cannot tell apart, the one in the final fit first.
    screened
        The first screening.
    reasons
        For every effect: why it was accepted or turned down.
    gains
        Share of the squared hold-out error each took away when it was last tried.
    """

    base: Refit
    final: Refit
    ambiguous: list[tuple[str, ...]] = field(default_factory=list)
    screened: list[Screened] = field(default_factory=list)
    reasons: dict[str, str] = field(default_factory=dict)
    gains: dict[str, float] = field(default_factory=dict)

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
    verdict = Verdict(base, base, screened=screen(fitter, base, effects))
    for number in range(MOST_ROUNDS):
        present = verdict.final
        candidates = verdict.screened if not number else screen(fitter, present, effects)
        trials = _trials(fitter, present, candidates, verdict, (number, progress))
        passing = sorted((t for t in trials if t.passes), key=lambda t: t.fit.chi("holdout"))
        if passing:
            winner, equals = _duel(fitter, present, passing, verdict)
            _accept(fitter, verdict, winner, equals)
        elif not _couple(fitter, present, trials, verdict):
            break
        _remove_shadows(fitter, verdict)
        _choose_again(fitter, verdict)
    _remove_below_the_rest(fitter, verdict)
    return verdict


def _accept(fitter: Fitter, verdict: Verdict, winner: Trial, equals: Sequence[str]) -> None:
    verdict.final = fitter.thorough(winner.fit)
    verdict.reasons[winner.name] = f"its parameter is {winner.strength:.0f} standard errors from neutral"
    if equals:
        verdict.ambiguous.append((winner.name, *equals))


def _couple(fitter: Fitter, present: Refit, trials: Sequence[Trial], verdict: Verdict) -> bool:
    """Put in the best two effects of which each has proof beside the other only; return whether there are such."""
    left, gap = (fit.chi("holdout") ** 2 - 1.0 for fit in (present, verdict.base))
    if left < LEFT_FOR_TWO * gap or present.chi("holdout") < ABOVE_NOISE:
        return False
    near = sorted(trials, key=lambda t: t.fit.chi("train"))[:COUPLED]
    best: Refit | None = None
    for one, other in combinations(near, 2):
        starts = [one.fit.values | other.fit.values, other.fit.values | one.fit.values]
        both = fitter.refit([*present.effects, one.name, other.name], starts)
        proven = judge(other.name, one.fit, both, verdict.base).passes
        proven = proven and judge(one.name, other.fit, both, verdict.base).passes
        if proven and (best is None or both.chi("holdout") < best.chi("holdout")):
            best = both
    if best is None:
        return False
    verdict.final = fitter.thorough(best)
    for name in set(best.effects) - set(present.effects):
        verdict.reasons[name] = f"its parameter is {best.strength(name):.0f} standard errors from neutral"
    return True


def _trials(
    fitter: Fitter,
    present: Refit,
    candidates: Sequence[Screened],
    verdict: Verdict,
    listener: tuple[int, Progress],
) -> list[Trial]:
    worth = [c for c in candidates if not c.reason and c.gain > WORTH_A_REFIT][:MOST_REFITS]
    number, progress = listener
    trials = []
    for done, candidate in enumerate(worth, 1):
        trial = _trial(fitter, present, candidate, verdict)
        trials.append(trial)
        if number == 0 or trial.passes:
            verdict.gains[candidate.name] = trial.gain
            verdict.reasons[candidate.name] = _reason(trial)
        progress(f"round {number + 1}: refit with {candidate.name}", done, len(worth))
    tried = {c.name for c in worth}
    for candidate in candidates:
        if candidate.name not in tried:
            why = candidate.reason or "its sensitivity is not in the error"
            verdict.reasons.setdefault(candidate.name, why)
    return trials


def _trial(fitter: Fitter, present: Refit, candidate: Screened, verdict: Verdict) -> Trial:
    here = present.values
    # a nudge off neutral, what first order asks for, and thrice that where first order falls short
    starts = [{**here, **_scaled(fitter, candidate, factor)} for factor in (0.1, 1.0, 3.0)]
    fit = fitter.refit([*present.effects, candidate.name], [*starts, here])
    return judge(candidate.name, present, fit, verdict.base, verdict.alike(candidate.name))


def judge(name: str, before: Refit, after: Refit, base: Refit, alike: Collection[str] = ()) -> Trial:
    """Return the trial of an effect from the fits without and with it; its share of the base's gap must be visible.

    Beside one of those it is ``alike`` to, it must take more.
    """
    roles = ("train", "holdout")
    squares = [[fit.chi(role) ** 2 for role in roles] for fit in (base, before, after)]
    gaps, lefts, rests = (np.maximum(np.array(row) - 1.0, 1e-12) for row in squares)
    shares, of_rest = (lefts - rests) / gaps, float((lefts - rests)[1] / lefts[1])
    least = LEAST_GAP_OF_ALIKE if set(alike) & set(before.effects) else LEAST_GAP
    if of_rest > MOST_OF_THE_REST and least == LEAST_GAP:
        least = LEAST_GAP_OF_THE_REST
    gain = float(1.0 - squares[2][1] / squares[1][1]) if shares.max() > least else 0.0
    return Trial(name, after, gain, after.strength(name), paired_z(before.holdout, after.holdout))


def aliases_of(name: str) -> set[str]:
    """Return the effects that an effect is mistaken for, or that are mistaken for it."""
    own = set(registry.load("effect", name).SPEC.aliases)
    return own | {e for e in registry.names("effect") if name in registry.load("effect", e).SPEC.aliases}


def _scaled(fitter: Fitter, candidate: Screened, factor: float) -> dict[str, float]:
    params = {p.name: p for p in fitter.assembly([candidate.name]).spec.params}
    scaled = {}
    for name, value in candidate.start.items():
        p = params[name]
        wanted = value if p.role == "shape" else p.start + factor * (value - p.start)
        scaled[name] = min(max(wanted, p.low), p.high)
    return scaled


def _reason(trial: Trial) -> str:
    if trial.strength <= CLEAR:
        return f"its parameter is only {trial.strength:.1f} standard errors from neutral"
    if trial.gain <= LEAST_GAIN:
        return "it does not lower the error on held-out conditions"
    if trial.score <= HOLDOUT_CLEAR:
        return "its gain on held-out conditions may be chance"
    return f"it takes away {trial.gain:.0%} of the squared hold-out error"


def _duel(fitter: Fitter, present: Refit, passing: Sequence[Trial], verdict: Verdict) -> tuple[Trial, tuple[str, ...]]:
    """Return the best trial after encompassing tests against its rivals, and the rivals it cannot be told from."""
    winner = passing[0]
    equals: list[str] = []
    for rival in passing[1:]:
        if not _comparable(present, winner, rival):
            verdict.reasons[rival.name] = f"it closes less of the gap than {winner.name}"
            continue
        both = fitter.refit(
            [*present.effects, winner.name, rival.name], [rival.fit.values | winner.fit.values, winner.fit.values]
        )
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
        elif rival.fit.degenerate(rival.name) > winner.fit.degenerate(winner.name):
            verdict.reasons[rival.name] = f"its shape ends at a bound, where it is no other than {winner.name}"
        elif rival.fit.degenerate(rival.name) < winner.fit.degenerate(winner.name):
            verdict.reasons[winner.name] = f"its shape ends at a bound, where it is no other than {rival.name}"
            winner, equals = rival, []
        else:
            verdict.reasons[rival.name] = f"these data cannot tell it from {winner.name}"
            equals.append(rival.name)
    return winner, tuple(equals)


def _comparable(present: Refit, winner: Trial, rival: Trial) -> bool:
    before = present.chi("holdout") ** 2
    best, other = before - winner.fit.chi("holdout") ** 2, before - rival.fit.chi("holdout") ** 2
    return other > RIVAL * best


def _far_behind(winner: Trial, rival: Trial) -> bool:
    """Return whether a rival fits held-out conditions so much worse that a wrong form of the winner is no excuse."""
    least, other = (max(t.fit.chi("holdout") ** 2 - 1.0, 0.0) for t in (winner, rival))
    return other > FAR_BEHIND * least and paired_z(rival.fit.holdout, winner.fit.holdout) > HOLDOUT_CLEAR


def _remove_shadows(fitter: Fitter, verdict: Verdict) -> None:
    """Take out what helped first and is worth nothing since a later effect is in."""
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
    """Let every effect stand once more against its rivals, now that the others are in."""
    for name in verdict.final.effects:
        rest = [e for e in verdict.final.effects if e != name]
        if not rest or name not in verdict.final.effects:
            continue
        without = fitter.refit(rest, [verdict.final.values])
        alike = aliases_of(name)
        rivals = [s for s in verdict.screened if not s.reason and s.name not in verdict.final.effects]
        rivals = sorted(rivals, key=lambda s: (s.name not in alike, -s.gain))[:MOST_RIVALS]
        trials = [_trial(fitter, without, s, verdict) for s in rivals]
        own = judge(name, without, verdict.final, verdict.base, verdict.alike(name))
        passing = sorted((t for t in (own, *trials) if t.passes), key=lambda t: t.fit.chi("holdout"))
        winner, equals = _duel(fitter, without, passing or [own], verdict)
        verdict.ambiguous = [s for s in verdict.ambiguous if name not in s]
        if winner.name != name:
            _accept(fitter, verdict, winner, equals)
        elif equals:
            verdict.ambiguous.append((name, *equals))


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
