"""One effect on trial: refitted jointly with all else, and what it has to show before it is believed."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.discover.refit import Fitter, Refit, Wanted, paired_z
from mrfit.discover.screen import Screened

# Standard errors from neutral: twenty candidates reach 3 by chance in 5 of 100 data sets, 4 in 1 of 1000
CLEAR = 4.0
# Standard score of the fall in squared hold-out error
HOLDOUT_CLEAR = 2.0
# Neither is asked of an effect that takes this share of all that is left, where that stands so far above noise: while a
# second effect is missing its doings widen every interval, and an error in a few bursts has no high score
OVERWHELMING, ABOVE_NOISE = 0.8, 1.5
# … but this many standard errors: an effect at neutral takes nothing, a better fit of the rest does
NOT_NEUTRAL = 1.0
# Of the first effect, 3 are enough if it takes this share of the gap on conditions it was not fitted to
HALF, CLEAR_OF_HALF = 0.5, 3.0
# Least share of the squared hold-out error that an effect must take away
LEAST_GAIN = 0.01
# Least share of the gap that the base alone leaves, for an effect and for the look-alike of one that is in already …
LEAST_GAP = 0.02
LEAST_GAP_OF_ALIKE = 0.1
# … or, where it takes this share of the gap that is left and is no look-alike, so much of the base's
MOST_OF_THE_REST, LEAST_GAP_OF_THE_REST = 0.5, 0.005
# Effects that together leave more than this share of the gap may be shadows of something else: none of them is named …
LEFT_BY_SHADOWS = 0.2
# … and already from this share on where what is left stands far above the noise
LEFT_IN_SIGHT, IN_SIGHT = 0.05, 2.5


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
        Share of the squared hold-out error taken away; 0 if it is no visible share of the base's gap.
    score
        Standard score of the fall in squared hold-out error.
    overwhelms
        Whether it takes nearly all of what is left, far above the noise.
    needed
        Standard errors from neutral that are asked of it.
    """

    name: str
    fit: Refit
    gain: float
    score: float
    overwhelms: bool
    needed: float = CLEAR

    @property
    def strength(self) -> float:
        """Standard errors of the effect's parameter from neutral."""
        return self.fit.strength(self.name)

    @property
    def passes(self) -> bool:
        """Whether the effect has proof."""
        return not self.objection

    @property
    def reason(self) -> str:
        """What speaks for the effect or against it."""
        return self.objection or f"it takes away {self.gain:.0%} of the squared hold-out error"

    @property
    def objection(self) -> str:
        """What the effect lacks for a proof; empty if nothing."""
        if self.gain <= LEAST_GAIN:
            return "it does not lower the error on held-out conditions"
        if not self.overwhelms and self.score <= HOLDOUT_CLEAR:
            return "its gain on held-out conditions may be chance"
        if self.strength <= self.needed:
            return f"its parameter is only {self.strength:.1f} standard errors from neutral"
        return ""


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
    overwhelms = of_rest > OVERWHELMING and before.chi("holdout") > ABOVE_NOISE
    first = before is base and of_rest > HALF and before.chi("holdout") > ABOVE_NOISE
    needed = NOT_NEUTRAL if overwhelms else CLEAR_OF_HALF if first else CLEAR
    return Trial(name, after, gain, paired_z(before.holdout, after.holdout), overwhelms, needed)


def try_out(
    fitter: Fitter,
    present: Refit,
    candidates: Sequence[Screened],
    base: Refit,
    alike: Callable[[str], Collection[str]] = lambda name: (),
) -> Iterator[Trial]:
    """Yield the trial of each screened effect beside those of the present model.

    Parameters
    ----------
    fitter
        Fits assemblies to the training segments.
    present, base
        The model that each is added to, and that without any effect.
    candidates
        The effects.
    alike
        Gives the effects that one is alike to, see ``judge``.
    """
    fits = fitter.refits([_wanted(fitter, present, c) for c in candidates])
    for candidate, fit in zip(candidates, fits, strict=True):
        yield judge(candidate.name, present, fit, base, alike(candidate.name))


def _wanted(fitter: Fitter, present: Refit, candidate: Screened) -> Wanted:
    here = present.values
    # a nudge off neutral, what first order asks for, and thrice that where first order falls short
    starts = [here | _scaled(fitter, candidate, factor) for factor in (0.1, 1.0, 3.0)]
    return [*present.effects, candidate.name], [*starts, here]


def _scaled(fitter: Fitter, candidate: Screened, factor: float) -> dict[str, float]:
    """Return a candidate's parameters, by name, at so many times the distance from neutral that screening found."""
    params = {p.name: p for p in fitter.assembly([candidate.name]).spec.params}
    values = {}
    for name, value in candidate.start.items():
        p = params[name]
        wanted = value if p.role == "shape" else p.start + factor * (value - p.start)
        values[name] = min(max(wanted, p.low), p.high)
    return values


def leaves_too_much(base: Refit, final: Refit, noise: float = 1.0) -> bool:
    """Return whether all effects together leave so much of the base's gap that something else must be missing.

    ``noise`` is the most that the noise can be, in multiples of the floor.
    """
    before, after = (fit.chi("holdout") ** 2 for fit in (base, final))
    allowed = LEFT_IN_SIGHT if after > (IN_SIGHT * noise) ** 2 else LEFT_BY_SHADOWS
    return before > noise**2 and after - noise**2 > allowed * (before - noise**2)
