"""The rules of a decision, each a pure function of rows of evidence and the policy."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtr

from mrfit.discover.policy import Policy
from mrfit.discover.selection.questions import Candidate, Fit, Growth, LibraryEffect, Repetition
from mrfit.signal.output_floor import SAME_FLOOR_RATIO


@dataclass(frozen=True)
class EffectTrial:
    """One effect added to a model and refitted.

    Attributes
    ----------
    name
        The effect.
    fit
        The refit.
    gain
        Share of the squared hold-out error taken away; 0 if it is no visible share of the base's gap.
    overwhelms
        Whether it takes nearly all of what is left, far above the noise.
    needed
        Standard errors from neutral that are asked of it.
    score
        Standard score of the fall in squared hold-out error; 0 where it was not asked for.
    strength
        Standard errors of the effect's parameter from neutral; 0 where they were not asked for.
    settles
        Whether it takes nearly all of what is left where it was fitted, far above the noise.
    """

    name: str
    fit: Fit
    gain: float
    overwhelms: bool
    needed: float
    score: float = 0.0
    strength: float = 0.0
    settles: bool = False


# --- what is worth a refit


def absorbed(left: float, policy: Policy) -> bool:
    """Return whether a model has an effect already, by the share of its sensitivity that is left after projection."""
    return left < policy.absorbed


def worth_a_refit(candidates: Iterable[Candidate], policy: Policy) -> list[Candidate]:
    """Return the candidates that are refitted in a round, of candidates with the most promising first."""
    return [c for c in candidates if not c.reason and c.gain > policy.worth_a_refit][: policy.most_refits]


def is_below_floors(train: float, holdout: float) -> bool:
    """Return whether errors of a fit show that the noise floors of a role are too high."""
    return min(train, holdout) < 1.0 / SAME_FLOOR_RATIO


def asks_for_pairs(present: Fit, base: Fit, noise: float, policy: Policy) -> bool:
    """Return whether so much is left beside the effects of a fit that two more may be missing.

    ``noise`` is the most that the noise can be, in multiples of the floor: what may be that is not left.
    """
    left, gap = (fit.holdout**2 - 1.0 for fit in (present, base))
    least = max(policy.above_noise, policy.clearly_above * noise)
    return not (left < policy.left_for_two * gap or present.holdout < least)


def leaves_little(pair: Fit, base: Fit, policy: Policy) -> bool:
    """Return whether a pair leaves so little that no other pair is worth a refit."""
    return pair.holdout**2 - 1.0 < policy.little_left * (base.holdout**2 - 1.0)


# --- proof


def claim(
    name: str, before: Fit, after: Fit, base: Fit, policy: Policy, alike: Mapping[str, float] | None = None
) -> EffectTrial:
    """Return the gain of an effect by the fits without and with it, and the clarity that is asked of it.

    Its share of the base's gap must be visible; beside one of those it is ``alike`` to, no less than is said there.
    """
    gaps, lefts, rests = _gaps(base, before, after)
    shares, taken = (lefts - rests) / gaps, (lefts - rests) / lefts
    of_rest = float(taken[1])
    least = policy.least_gap_of_the_rest if of_rest > policy.most_of_the_rest else policy.least_gap
    least = max((least, *(share for other, share in (alike or {}).items() if other in before.effects)))
    gain = float(1.0 - (after.holdout / before.holdout) ** 2) if shares.max() > least else 0.0
    far = np.array([before.train, before.holdout]) > policy.above_noise
    settles, nearly_all = ((taken > policy.overwhelming) & far).tolist()
    # where nothing is left on fitted conditions, held-out ones tell how a fit goes on beyond them, and nothing missing
    overwhelms = nearly_all and before.train > policy.clearly_above
    first = before == base and of_rest > policy.half and far[1]
    needed = policy.not_neutral if overwhelms else policy.clear_of_half if first else policy.clear
    return EffectTrial(name, after, gain, overwhelms, needed, settles=settles)


def _gaps(*fits: Fit) -> list[np.ndarray]:
    """Return the gaps of fits on fitted and held-out conditions, (2,) each."""
    return [np.maximum(np.array([fit.train**2, fit.holdout**2]) - 1.0, 1e-12) for fit in fits]


def counted(errors: float, degrees: float, policy: Policy) -> float:
    """Return standard errors from neutral as they count: fewer where few degrees of freedom tell them.

        z = -Phi^-1(T(-|t|)) / by_conditions, at most |t|

    T is Student's distribution, Phi the normal one.

    Parameters
    ----------
    errors
        t, the distance in standard errors.
    degrees
        Degrees of freedom of the standard error, taken as 1 at least.
    policy
        The thresholds.
    """
    tail = float(stdtr(max(degrees, 1.0), -abs(errors)))
    return min(abs(errors), -float(ndtri(tail)) / float(policy.by_conditions)) if tail > 0.0 else abs(errors)


def helps(trial: EffectTrial, policy: Policy) -> bool:
    """Return whether an effect lowers the error on held-out conditions at all."""
    return trial.gain > policy.least_gain


def beyond_chance(trial: EffectTrial, policy: Policy) -> bool:
    """Return whether what an effect takes on held-out conditions is more than chance does.

    Few of them may show it little. Chance does not take the error where it was fitted to the noise, and lower theirs.
    """
    return trial.overwhelms or trial.settles or trial.score > policy.holdout_clear


def objection(trial: EffectTrial, policy: Policy) -> str:
    """Return the objection to an effect; empty if it has proof."""
    if not helps(trial, policy):
        return "it does not lower the error on held-out conditions"
    if not beyond_chance(trial, policy):
        return "its gain on held-out conditions may be chance"
    if trial.strength <= trial.needed:
        return f"its parameter is only {trial.strength:.1f} standard errors from neutral"
    if trial.fit.levels.get(trial.name, 1.0) < policy.end_of_range:
        return "it sets in below all that was measured: it acts everywhere, as another law would"
    return ""


# --- rivals


def comparable(present: Fit, winner: Fit, rival: Fit, policy: Policy) -> bool:
    """Return whether a rival takes enough of what the winner takes to be looked at."""
    before = present.holdout**2
    best, other = before - winner.holdout**2, before - rival.holdout**2
    return other > policy.rival_min_gain * best


def leaves_far_more(winner: Fit, rival: Fit, policy: Policy) -> bool:
    """Return whether a rival leaves so much more that a wrong form of the winner is no excuse."""
    least, other = _gaps(winner, rival)
    return bool(other[1] > policy.far_behind * least[1])


def fits_worse(winner: Fit, rival: Fit, policy: Policy) -> bool:
    """Return whether a rival errs beyond the noise even where it was fitted, and the winner does not.

    Few held-out conditions may show neither of two effects, which all that were fitted tell apart.
    """
    least, other = _gaps(winner, rival)
    above = winner.train <= policy.examined_above_floor < rival.train
    return bool(above and other[0] > policy.far_behind * least[0])


def limits(fit: Fit, effect: str, rival: LibraryEffect, policy: Policy) -> int:
    """Return the number of an effect's shape parameters that ended at a bound: limits of its form.

    Those that its rival has too say nothing of which of the two it is; nor does the limit of a form that no one
    mistakes for the rival.
    """
    if effect not in rival.aliases:
        return 0
    ended = {n: at for n, at in fit.shapes.get(effect, {}).items() if n not in rival.parameters}
    return sum(min(at, 1.0 - at) < policy.end_of_range for at in ended.values())


def widens(wider: EffectTrial, other: EffectTrial, library: Mapping[str, LibraryEffect]) -> bool:
    """Return whether an effect has all shapes of another that it is mistaken for, and more.

    What little it takes more may be what the form of the other leaves, since forms are approximations.
    """
    own, shared = (set(trial.fit.shapes.get(trial.name, {})) for trial in (wider, other))
    mistaken = wider.name in library[other.name].aliases or other.name in library[wider.name].aliases
    return mistaken and bool(shared) and shared < own


def takes_little_more(base: Fit, narrow: Fit, both: Fit, policy: Policy) -> bool:
    """Return whether a wider form takes no visible share of the base's gap beside the narrow one.

    Nor may it take nearly all of what the narrow one leaves, where that is in sight: a small share of a large gap.
    """
    gaps, lefts, rests = _gaps(base, narrow, both)
    taken = lefts - rests
    if narrow.holdout > policy.in_sight and taken[1] > policy.overwhelming * lefts[1]:
        return False
    return float(np.max(taken / gaps)) < policy.least_gap_of_wider


# --- shadows


def leaves_too_much(base: Fit, final: Fit, noise: float, policy: Policy) -> bool:
    """Return whether all effects together leave so much of the base's gap that something else must be missing.

    ``noise`` is the most that the noise can be, in multiples of the floor.
    """
    before, after = (fit.holdout**2 for fit in (base, final))
    allowed = policy.visible_residual if after > (policy.in_sight * noise) ** 2 else policy.left_by_shadows
    return before > noise**2 and after - noise**2 > allowed * (before - noise**2)


def below_the_rest(final: Fit, without: Fit, policy: Policy) -> bool:
    """Return whether an effect takes less than what all together leave, by the fit without it."""
    fall = without.holdout**2 - final.holdout**2
    return not fall > policy.above_the_rest * (final.holdout**2 - 1.0)


def drift(growths: Sequence[Growth], policy: Policy) -> Growth | None:
    """Return the first strength of an effect that changes within the records, which a steady effect's does not.

    One that is neutral has no part in the effect.
    """
    for g in growths:
        if g.distance and abs(g.change) > max(policy.drifts * abs(g.distance), policy.drift_clear * g.spread):
            return g
    return None


# --- is something left without a name?


def follows_the_output(repetition: Repetition, policy: Policy) -> bool:
    """Return whether the part of the error that does not repeat is larger where the output is large.

    What comes and goes through the specimen, in a rhythm of its own, is. An instrument's noise is the same at any point
    of a cycle; that of a clock or of a coarse scale is larger where the output changes fast, and is small.
    """
    if len(repetition.powers) < policy.fewest_records:
        return False
    ratio = np.median([c.log_ratio for c in repetition.powers])
    score = np.median([c.score for c in repetition.powers])
    return bool(ratio > np.log(policy.power_ratio) and score > policy.power_clear)


def goes_on(repetition: Repetition, policy: Policy) -> bool:
    """Return whether what repeats from cycle to cycle, or what does not, cannot be noise."""
    return repetition.error > policy.far_above or follows_the_output(repetition, policy)


def clearly_left(error: float, structure: float, taken_back: bool, measured: bool, policy: Policy) -> bool:
    """Return whether an error above a noise floor that is known is no noise: something is told of it.

    Noise that was measured has its colour in the floor, one of a white spectrum may be larger than its floor.
    """
    beyond = policy.in_sight if measured else policy.beyond_any_colour
    return error > policy.clearly_above and (structure > policy.structure or taken_back or error > beyond)


def word_of_unknown_noise(error: float, noise: float, told: bool, policy: Policy) -> str:
    """Return the verdict's word where the noise floor is not known: it lies between 1 and ``noise``, as the error does.

    What is within the least noise is noise. What is above the most, or follows the inputs, is not. Of what is between,
    nothing can be said.
    """
    if error <= policy.clearly_above:
        return "none"
    return "unexplained" if told or error > policy.clearly_above * noise else "insufficient-data"
