"""Which effects are missing: added one by one, each against its rivals, and none without proof on held-out conditions.

An effect is accepted if, refitted jointly with everything else, its parameter stands clear of neutral by more standard
errors than the number of candidates could produce by chance, and it lowers the error on held-out conditions by more
than chance. Two effects that both pass alone are put in together (an encompassing test): the one that still earns its
place beside the other is real, the other a shadow; if neither does, the data cannot tell them apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

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
# Least share of the squared hold-out error that an effect must take away, and of the gap that the base alone leaves:
# an approximate form of the right effect leaves a little for others to take, its look-alikes first of all
LEAST_GAIN = 0.01
LEAST_GAP = 0.02
LEAST_GAP_OF_ALIAS = 0.1
MOST_REFITS = 7
MOST_ROUNDS = 4
# A rival that leaves at most this much more of the gap is looked at
RIVAL = 0.35


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
        if not passing:
            break
        winner, equals = _duel(fitter, present, passing, verdict)
        verdict.final = fitter.thorough(winner.fit)
        verdict.reasons[winner.name] = f"its parameter is {winner.strength:.0f} standard errors from neutral"
        if equals:
            verdict.ambiguous.append((winner.name, *equals))
        _remove_shadows(fitter, verdict)
    return verdict


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
        trial = _trial(fitter, present, candidate, verdict.base)
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


def _trial(fitter: Fitter, present: Refit, candidate: Screened, base: Refit) -> Trial:
    here = present.values
    # a nudge off neutral, what first order asks for, and thrice that where first order falls short
    starts = [{**here, **_scaled(fitter, candidate, factor)} for factor in (0.1, 1.0, 3.0)]
    fit = fitter.refit([*present.effects, candidate.name], [*starts, here])
    return judge(candidate.name, present, fit, base)


def judge(name: str, before: Refit, after: Refit, base: Refit, beside_alias: bool = True) -> Trial:
    """Return the trial of an effect from the fits without and with it; its share of the base's gap must be visible.

    Beside one of its aliases it must take more, unless the caller asks which of the two is the real one.
    """
    fall = before.chi("holdout") ** 2 - after.chi("holdout") ** 2
    gap = base.chi("holdout") ** 2 - 1.0
    aliases = set(registry.load("effect", name).SPEC.aliases)
    least = LEAST_GAP_OF_ALIAS if beside_alias and aliases & set(before.effects) else LEAST_GAP
    gain = fall / before.chi("holdout") ** 2 if gap > 0 and fall > least * gap else 0.0
    return Trial(name, after, gain, after.strength(name), paired_z(before.holdout, after.holdout))


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
        adds = judge(rival.name, winner.fit, both, verdict.base).passes
        needed = judge(winner.name, rival.fit, both, rival.fit, beside_alias=False).passes
        if adds and not needed:
            verdict.reasons[winner.name] = f"it adds nothing beside {rival.name}"
            winner, equals = rival, []
        elif needed and not adds:
            verdict.reasons[rival.name] = f"it adds nothing beside {winner.name}"
        elif not needed and not adds and rival.fit.degenerate(rival.name) > winner.fit.degenerate(winner.name):
            verdict.reasons[rival.name] = f"its shape ends at a bound, where it is no other than {winner.name}"
        elif not needed and not adds and rival.fit.degenerate(rival.name) < winner.fit.degenerate(winner.name):
            verdict.reasons[winner.name] = f"its shape ends at a bound, where it is no other than {rival.name}"
            winner, equals = rival, []
        elif not needed and not adds:
            verdict.reasons[rival.name] = f"these data cannot tell it from {winner.name}"
            equals.append(rival.name)
    return winner, tuple(equals)


def _comparable(present: Refit, winner: Trial, rival: Trial) -> bool:
    before = present.chi("holdout") ** 2
    best, other = before - winner.fit.chi("holdout") ** 2, before - rival.fit.chi("holdout") ** 2
    return other > RIVAL * best


def _remove_shadows(fitter: Fitter, verdict: Verdict) -> None:
    """Take out what helped first and is worth nothing since a later effect is in."""
    for name in verdict.final.effects:
        rest = [e for e in verdict.final.effects if e != name]
        if not rest:
            continue
        without = fitter.refit(rest, [verdict.final.values])
        if not judge(name, without, verdict.final, verdict.base).passes:
            verdict.final = without
            verdict.reasons[name] = f"it adds nothing beside {' and '.join(rest)}"
            verdict.ambiguous = [s for s in verdict.ambiguous if name not in s]
