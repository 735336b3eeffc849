"""Two effects at once: each may be worth nothing before the other is there, or look like a third."""

from collections.abc import Mapping, Sequence
from contextlib import closing
from itertools import chain, combinations

from mrfit.discover.selection.duels import Inquiry
from mrfit.discover.selection.questions import EffectScreening, Fit, Join, Try
from mrfit.discover.selection.rules import EffectTrial, asks_for_pairs, leaves_little


def best_pair(inquiry: Inquiry, screening: EffectScreening, trials: Sequence[EffectTrial]) -> Fit | None:
    """Return the fit with the two effects that leave least, of those of which each has proof beside the other.

    Parameters
    ----------
    inquiry
        Evidence and policy.
    screening
        Of the model that the two are added to.
    trials
        Effects that were tried there alone.
    """
    source, policy, present = inquiry.source, inquiry.policy, screening.present
    if not asks_for_pairs(present, inquiry.base, source.noise, policy):
        return None
    alone = {t.name: t.fit for t in trials}
    known = {c.name: c for c in screening.candidates}
    promising = _promising(inquiry, screening, alone)[: policy.most_pairs]
    lacking = [known[name] for name in dict.fromkeys(chain.from_iterable(promising)) if name not in alone]
    tried = source.refits([Try(present, c) for c in lacking])
    alone |= {c.name: fit for c, fit in zip(lacking, tried, strict=True)}
    questions = [
        Join((*present.effects, one, other), (_together(alone[one], alone[other]), _together(alone[other], alone[one])))
        for one, other in promising
    ]
    # where a search with one effect more ended worse, the fit without it is what the other is judged by
    without = {name: fit if fit.train <= present.train else present for name, fit in alone.items()}
    best: Fit | None = None
    with closing(source.refits(questions, [f"refit with {one} and {other}" for one, other in promising])) as fits:
        for pair, both in zip(promising, fits, strict=True):
            if (best is None or both.holdout < best.holdout) and _proven(inquiry, pair, without, both):
                best = both
            if best is not None and leaves_little(best, inquiry.base, policy):
                break
    return best


def _together(first: Fit, second: Fit) -> dict[str, float]:
    return {**first.values, **second.values}


def _proven(inquiry: Inquiry, pair: tuple[str, str], without: Mapping[str, Fit], both: Fit) -> bool:
    """Return whether each of two effects has proof beside the other."""
    one, other = pair
    return inquiry.passes(inquiry.judged(other, without[one], both)) and inquiry.passes(
        inquiry.judged(one, without[other], both)
    )


def _promising(inquiry: Inquiry, screening: EffectScreening, alone: Mapping[str, Fit]) -> list[tuple[str, str]]:
    """Return the pairs, first those that to first order leave least.

    What both could take of the present error is one guess; better ones are what either could take of the error that
    the other leaves where that was fitted.
    """
    present = screening.present
    left: dict[tuple[str, str], float] = {}
    for one, other in combinations(screening.shown, 2):
        guesses = [
            (present, (one, other)),
            *((alone[a], (b,)) for a, b in ((one, other), (other, one)) if a in alone),
        ]
        left[one, other] = min(
            fit.train**2 * (1.0 - inquiry.source.reach(present, effects, fit)) for fit, effects in guesses
        )
    return sorted(left, key=lambda pair: left[pair])
