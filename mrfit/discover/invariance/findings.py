"""What an examination of invariances finds: effects that no law makes, and how far the law itself is off."""

from dataclasses import dataclass, field
from typing import Literal

from mrfit.core.specs import Invariance

Tier = Literal["any-law", "short-memory", "causal", "current-at-once"]
"""What has to hold for a name: nothing beyond odd, timeless and cold laws; a memory shorter than the horizon of travel;
a force that the motion so far makes; a current that acts at once."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of an effect with its 95 % interval, in SI; no ``low`` and ``high`` for a shape that was held."""

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None


@dataclass(frozen=True)
class EffectSignificance:
    """How clearly an effect shows beside the best law.

    Attributes
    ----------
    share
        Of the squared error that no law makes, how much the effect takes.
    kept
        The same on conditions left out, the effect's value from the others, the law from all.
    held
        The same with the law from the others too, of a typical condition: the geometric mean.
    size
        Largest force of the effect over the range of the output.
    z
        Standard errors of its strength from neutral: scatter over conditions and over nuisances.
    left
        Share of its sensitivity's square that no law takes.
    improved
        Share of the conditions that are predicted better with it.
    """

    share: float
    kept: float
    held: float
    size: float
    z: float
    left: float
    improved: float


@dataclass(frozen=True)
class NamedEffect:
    """An effect that is there whatever the law is, as long as the law keeps the invariance that its tier says.

    Attributes
    ----------
    name, breaks, tier
        The effect, the invariance that it breaks, and what has to hold for the name.
    parameters
        Its parameters; those of a common factor are all the same, see ``common``.
    force
        Its largest force with its 95 % interval, which the data may tell better than single parameters.
    common
        Whether its strengths were taken as one: a law whose form is open has no parts to scale apart.
    standing
        How clearly it shows.
    rivals
        Effects tested in its place that leave nearly as little: the name is one of a set.
    alike
        Effects that are in the span of every law but would make this one's mark too: the set is told as well.
    """

    name: str
    breaks: Invariance
    tier: Tier
    parameters: tuple[Parameter, ...]
    force: Parameter
    common: bool
    standing: EffectSignificance
    rivals: tuple[str, ...] = ()
    alike: tuple[str, ...] = ()


@dataclass(frozen=True)
class TurnedDown:
    """An effect that was tested and is not named.

    Attributes
    ----------
    name
        The effect.
    breaks
        The invariance that it would break.
    reason
        Why it is not there.
    share
        Of the squared error that no law makes, how much it could take to first order.
    strength
        Its strength to first order, beside what is named; no interval.
    standing
        How clearly it showed; None where screening was enough.
    """

    name: str
    breaks: Invariance
    reason: str
    share: float
    strength: Parameter
    standing: EffectSignificance | None = None


@dataclass(frozen=True)
class ConfoundedEffect:
    """An effect that the law, or the base, could make as well on these data.

    Attributes
    ----------
    name
        The effect.
    reason
        Why it cannot be told: no invariance is broken, or what is left of its sensitivity.
    test
        The experiment that would separate it.
    """

    name: str
    reason: str
    test: str


@dataclass(frozen=True)
class BrokenInvariance:
    """An invariance that is broken by something that no known effect describes.

    Attributes
    ----------
    invariance
        Which one.
    share, kept
        Of the squared error beside the named effects, how much flexible terms take; the same on conditions left out.
    size
        Largest force of these terms over the range of the output.
    """

    invariance: Invariance
    share: float
    kept: float
    size: float


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
class LawErrorPlace:
    """A part of the samples and the share of the law's squared error that lies there.

    Attributes
    ----------
    over
        What is binned: ``travel`` since the motion turned, ``speed``, ``current``.
    low, high, unit
        The bin, in SI.
    share, samples
        Of the law's squared error and of the samples, how much lies in it.
    """

    over: str
    low: float
    high: float
    unit: str
    share: float
    samples: float


@dataclass(frozen=True)
class LawGap:
    """How far the base's law itself is off: its response less that of the best law, effects put aside.

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
    where: tuple[LawErrorPlace, ...] = ()


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
    travel, time
        Horizon of travel (m or rad) and time (s) within which a law was let remember.
    """

    not_applicable: str = ""
    named: tuple[NamedEffect, ...] = ()
    turned_down: tuple[TurnedDown, ...] = ()
    confounded: tuple[ConfoundedEffect, ...] = ()
    broken: tuple[BrokenInvariance, ...] = ()
    errors: LawErrors = field(default_factory=lambda: LawErrors(None, 0.0, 0.0, 0.0))
    law_gap: LawGap | None = None
    travel: float = 0.0
    time: float = 0.0
