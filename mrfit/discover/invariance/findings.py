"""Findings of an examination of invariances: effects that no law makes, and the error of the law itself."""

from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Literal

from mrfit.discover.policy import STANDARD
from mrfit.io.schemas.discovery import (
    BrokenInvariance,
    Confounded,
    EffectParameter,
    EffectSignificance,
    InvariantEffect,
    LawPlace,
)

Tier = Literal["any-law", "short-memory", "causal", "current-at-once"]
"""What has to hold for a name: nothing beyond odd, timeless and cold laws; a memory shorter than the horizon of travel;
a force that the motion so far makes; a current that acts at once."""


def closed(p: EffectParameter) -> EffectParameter:
    """Return a parameter without the ends of an interval of which one is open."""
    ends = [end for end in (p.low, p.high) if end is not None and isfinite(end)]
    return p if len(ends) == 2 else replace(p, low=None, high=None)


def significance(effect: InvariantEffect) -> EffectSignificance:
    """Return the significance of an effect that is named, or was before another one cast a doubt on it."""
    assert effect.standing is not None
    return effect.standing


def finite(s: EffectSignificance) -> EffectSignificance:
    """Return a significance in which a number that is not finite, as of an effect without scatter, is cut."""
    most = STANDARD.largest_score
    return EffectSignificance(**{n: min(max(v, -most), most) if v == v else 0.0 for n, v in vars(s).items()})


@dataclass(frozen=True)
class LawErrors:
    """Root mean square errors over the range of the output, on means over a few samples.

    Attributes
    ----------
    base
        Of the base; None where no response of one was given.
    law, after
        Of the best law alone, and with the named effects.
    noise
        Of white noise.
    exact
        Of a model taken as exact; None where none was given.
    open
        What the best law with the named effects would leave of records it was not fitted to, by its columns.
    """

    base: float | None
    law: float
    after: float
    noise: float
    exact: float | None = None
    open: float = 0.0


@dataclass(frozen=True)
class LawGap:
    """Error of the base's law itself: its response less that of the best law, effects put aside.

    Attributes
    ----------
    error
        Root mean square over the range of the output.
    share
        Of the base's squared error beyond what no law makes, how much the law is.
    where
        The bins of each kind, the one with most of it first.
    """

    error: float
    share: float
    where: tuple[LawPlace, ...] = ()


@dataclass(frozen=True)
class LawFindings:
    """All that an examination finds.

    Attributes
    ----------
    not_applicable
        Why nothing was examined; empty otherwise.
    named, turned_down, confounded, broken
        Effects, by what became of them, and invariances broken by something that has no name.
    errors
        Of the base, of the best law alone, of the best law with the named effects, and noise.
    law_gap
        How far the base's law is off; None where no response of a base was given.
    in_the_model
        Named effects whose force the model taken as exact has itself, as strong as it was found.
    travel, time
        Horizon of travel (m or rad) and time (s) within which a law was let remember.
    """

    not_applicable: str = ""
    named: tuple[InvariantEffect, ...] = ()
    turned_down: tuple[InvariantEffect, ...] = ()
    confounded: tuple[Confounded, ...] = ()
    broken: tuple[BrokenInvariance, ...] = ()
    errors: LawErrors = field(default_factory=lambda: LawErrors(None, 0.0, 0.0, 0.0))
    law_gap: LawGap | None = None
    in_the_model: tuple[str, ...] = ()
    travel: float = 0.0
    time: float = 0.0
