"""The evidence of a decision that takes the base as exact: rows of numbers, and who answers questions with them.

Which refit is worth its time depends on what the last one showed. So a decision asks for one row after the other, and
never computes one itself: ``gather`` answers by simulation, a ``EvidenceReader`` from a table.
"""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

# --- rows


@dataclass(frozen=True)
class Fit:
    """A base and some effects, fitted jointly.

    Attributes
    ----------
    number
        Tells it from other fits, also of the same effects.
    effects
        Names of the effects beside the base, sorted.
    train, holdout
        RMS error in multiples of the noise floor: 1 where only noise is left.
    values
        Parameters by name.
    shapes
        For each effect its shape parameters that are no shares: where in their ranges, 0 to 1, they ended.
    levels
        Of each effect that sets in at a level of the output: that level over the largest output measured.
    """

    number: int
    effects: tuple[str, ...]
    train: float
    holdout: float
    values: Mapping[str, float] = field(default_factory=dict)
    shapes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    levels: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Candidate:
    """Screening of one effect.

    Attributes
    ----------
    name
        Of the effect.
    reason
        Why it cannot be judged; empty if it can.
    gain
        Share of the training error's square that it could take away, to first order.
    strength
        Standard score of that.
    shown
        Whether the data show it: it has a sensitivity that the model has not.
    start
        Parameter values to start a refit from.
    """

    name: str
    reason: str = ""
    gain: float = 0.0
    strength: float = 0.0
    shown: bool = True
    start: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class EffectScreening:
    """Screening of every effect beside a fit.

    Attributes
    ----------
    present
        The fit.
    candidates
        The effects that it lacks, the one that could take most first.
    cosines
        Cosines between the projected sensitivities of those that the data show, in this order.
    """

    present: Fit
    candidates: tuple[Candidate, ...] = ()
    cosines: tuple[tuple[float, ...], ...] = ()

    @property
    def shown(self) -> tuple[str, ...]:
        """Names in the order of the rows of ``cosines``."""
        return tuple(c.name for c in self.candidates if c.shown)

    def alike(self, name: str, least: float) -> frozenset[str]:
        """Return the effects whose sensitivity is nearly parallel to an effect's: their cosine is above ``least``."""
        shown = self.shown
        if name not in shown:
            return frozenset()
        row = self.cosines[shown.index(name)]
        return frozenset(n for n, c in zip(shown, row, strict=True) if n != name and abs(c) > least)


@dataclass(frozen=True)
class Growth:
    """Apparent growth of one strength of an effect over the records.

    Attributes
    ----------
    change
        From the middle of a record to its end, in the cube.
    distance
        Of the strength from neutral, in the cube.
    spread
        Standard error of the change.
    rates
        RMS change of the output, in its unit per second, in each training segment.
    """

    change: float
    distance: float
    spread: float
    rates: tuple[float, ...] = ()


@dataclass(frozen=True)
class Contrast:
    """Contrast of the error that does not repeat between large and small output, in one record.

    Attributes
    ----------
    log_ratio
        Logarithm of the ratio of its powers where the output is large and where it is small.
    score
        Standard score of that.
    """

    log_ratio: float
    score: float


@dataclass(frozen=True)
class Repetition:
    """Parts of the error of a fit that repeat from cycle to cycle, and that do not.

    Attributes
    ----------
    error
        RMS error in multiples of the noise floor where cycles tell the noise, 0 if nowhere; the larger one of fitted
        and held-out records.
    powers
        Of each record with enough cycles, by how much what does not repeat is larger where the output is large.
    """

    error: float
    powers: tuple[Contrast, ...] = ()


@dataclass(frozen=True)
class LibraryEffect:
    """Entry of the library on one effect.

    Attributes
    ----------
    name
        Of the effect.
    aliases
        Effects that it is mistaken for, or that are mistaken for it.
    parameters
        Their names.
    of_one_input
        The aliases that change an input from what it takes, too: with the right shapes each does what the other does.
    """

    name: str
    aliases: frozenset[str] = frozenset()
    parameters: frozenset[str] = frozenset()
    of_one_input: frozenset[str] = frozenset()


# --- refits that may be asked for


@dataclass(frozen=True)
class Try:
    """A candidate refitted jointly with all that is in."""

    present: Fit
    candidate: Candidate


@dataclass(frozen=True)
class Join:
    """Effects fitted together, from the best of several starts."""

    effects: tuple[str, ...]
    starts: tuple[Mapping[str, float], ...]


class EvidenceSource(Protocol):
    """Answers to the questions of a decision that takes the base as exact."""

    @property
    def base(self) -> Fit:
        """The fit of the base alone."""

    @property
    def noise(self) -> float:
        """The most that the noise of held-out conditions can be, in multiples of its floor."""

    @property
    def noise_is_told(self) -> bool:
        """Whether no floor of held-out conditions can hold the error of a law: it was measured, or is no larger."""

    @property
    def library(self) -> Mapping[str, LibraryEffect]:
        """The effects that may be missing."""

    def refits(self, wanted: Sequence[Try | Join], labels: Sequence[str] = ()) -> Generator[Fit, None, None]:
        """Yield refits that are known together; a label says what was done."""

    def screen(self, present: Fit) -> EffectScreening:
        """Return the screening of every effect beside a fit."""

    def search(self, fit: Fit) -> Fit:
        """Return a fit that is searched for again from many starts."""

    def fall(self, before: Fit, after: Fit) -> float:
        """Return by how many standard errors the squared hold-out error falls."""

    def strength(self, fit: Fit, effect: str) -> float:
        """Return the distance of an effect of a fit from neutral, in standard errors, by its clearest parameter."""

    def reach(self, screened: Fit, effects: tuple[str, ...], fit: Fit) -> float:
        """Return the share of a fit's squared training error that effects screened at another fit could take."""

    def growths(self, fit: Fit, effect: str) -> tuple[Growth, ...]:
        """Return the growth of an effect's strengths over the records; nothing where they may grow."""

    def structure(self, fit: Fit) -> float:
        """Return the share of the squared hold-out error that a model predicts which knows no physics."""

    def repetition(self, fit: Fit) -> Repetition:
        """Return the parts of the error that repeat from cycle to cycle and that do not."""


def refit(source: EvidenceSource, wanted: Try | Join) -> Fit:
    """Return one refit."""
    return next(source.refits([wanted]))
