"""Two effects at once: each may be worth nothing before the other is there, or look like a third."""

from collections.abc import Mapping, Sequence
from itertools import chain, combinations

from mrfit.core.progress import Progress
from mrfit.discover.refit import Fitter, Refit
from mrfit.discover.screen import Screened, reach
from mrfit.discover.trials import ABOVE_NOISE, Trial, judge, try_out

# Pairs are looked for where more than this share of the gap is left, and stands above the noise
LEFT_FOR_TWO = 0.05
# Pairs that are refitted, the most promising first, until one leaves no more than this share of the gap
MOST_PAIRS = 8
LITTLE_LEFT = 0.01


def best_pair(
    fitter: Fitter,
    present: Refit,
    base: Refit,
    found: tuple[Sequence[Screened], Sequence[Trial]],
    progress: Progress,
) -> Refit | None:
    """Return the fit with the two effects that leave least, of those of which each has proof beside the other.

    Parameters
    ----------
    fitter
        Fits assemblies to the training segments.
    present, base
        The model the two are added to, and that without any effect.
    found
        Candidates as screened at ``present``, and those that were tried there alone.
    progress
        Told of every refit.
    """
    left, gap = (fit.chi("holdout") ** 2 - 1.0 for fit in (present, base))
    if left < LEFT_FOR_TWO * gap or present.chi("holdout") < ABOVE_NOISE:
        return None
    screened, trials = found
    tried = {t.name: t for t in trials}
    known = {s.name: s for s in screened}
    best: Refit | None = None
    promising = _promising(fitter, present, tried, screened)[:MOST_PAIRS]
    lacking = [known[name] for name in dict.fromkeys(chain.from_iterable(promising)) if name not in tried]
    tried |= {trial.name: trial for trial in try_out(fitter, present, lacking, base)}
    values = {name: trial.fit.values for name, trial in tried.items()}
    starts = [[values[one] | values[other], values[other] | values[one]] for one, other in promising]
    fits = fitter.refits([([*present.effects, *names], own) for names, own in zip(promising, starts, strict=True)])
    for done, (names, both) in enumerate(zip(promising, fits, strict=True), 1):
        one, other = (tried[n] for n in names)
        if best is None or both.chi("holdout") < best.chi("holdout"):
            proven = judge(other.name, one.fit, both, base).passes and judge(one.name, other.fit, both, base).passes
            best = both if proven else best
        progress(f"refit with {' and '.join(names)}", done, len(promising))
        if best is not None and best.chi("holdout") ** 2 - 1.0 < LITTLE_LEFT * gap:
            break
    return best


def _promising(
    fitter: Fitter, present: Refit, tried: Mapping[str, Trial], screened: Sequence[Screened]
) -> list[tuple[str, str]]:
    """Return the pairs, first those that to first order leave least.

    What both could take of the present error is one guess; better ones are what either could take of the error that
    the other leaves where that was fitted.
    """
    left: dict[tuple[str, str], float] = {}
    for one, other in combinations([s for s in screened if len(s.columns)], 2):
        guesses = [
            (present, (one, other)),
            *((tried[a.name].fit, (b,)) for a, b in ((one, other), (other, one)) if a.name in tried),
        ]
        left[one.name, other.name] = min(f.chi("train") ** 2 * (1.0 - reach(c, f, fitter.stride)) for f, c in guesses)
    return sorted(left, key=lambda pair: left[pair])
