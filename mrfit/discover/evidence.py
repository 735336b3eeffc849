"""The evidence of a discovery: an immutable table of questions and answers, in the order in which they were asked.

Which refit is worth its time depends on what the last one showed. So a decision asks for one row after the other, and
never computes one itself: ``gather`` answers by simulation and keeps the table, ``Evidence`` answers from the table.
"""

from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

Answer = TypeVar("Answer")


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
    """

    number: int
    effects: tuple[str, ...]
    train: float
    holdout: float
    values: Mapping[str, float] = field(default_factory=dict)
    shapes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class Candidate:
    """What screening says of one effect.

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
class Screening:
    """What each effect could add to a fit.

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
    """How one strength of an effect seems to grow over the records.

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
    """How the error that does not repeat depends on how large the output is, in one record.

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
    """What repeats from cycle to cycle, and what does not, of the error of a fit.

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
class Effect:
    """What the library says of one effect.

    Attributes
    ----------
    name
        Of the effect.
    aliases
        Effects that it is mistaken for, or that are mistaken for it.
    parameters
        Their names.
    """

    name: str
    aliases: frozenset[str] = frozenset()
    parameters: frozenset[str] = frozenset()


# --- questions


@dataclass(frozen=True)
class Question(Generic[Answer]):
    """What a decision may ask for."""


@dataclass(frozen=True)
class Screen(Question[Screening]):
    """What each effect could add to a fit."""

    present: Fit


@dataclass(frozen=True)
class Try(Question[Fit]):
    """What a candidate leaves that is refitted jointly with all that is in."""

    present: Fit
    candidate: Candidate


@dataclass(frozen=True)
class Join(Question[Fit]):
    """What these effects leave together, fitted from the best of several starts."""

    effects: tuple[str, ...]
    starts: tuple[Mapping[str, float], ...]


@dataclass(frozen=True)
class Search(Question[Fit]):
    """What a fit leaves that is searched for again from many starts."""

    fit: Fit


@dataclass(frozen=True)
class Fall(Question[float]):
    """By how many standard errors the squared hold-out error falls."""

    before: Fit
    after: Fit


@dataclass(frozen=True)
class Strength(Question[float]):
    """How many standard errors an effect of a fit is from neutral, by the clearest of its parameters."""

    fit: Fit
    effect: str


@dataclass(frozen=True)
class Reach(Question[float]):
    """The share of a fit's squared training error that effects could take together, as screened at another fit."""

    screened: Fit
    effects: tuple[str, ...]
    fit: Fit


@dataclass(frozen=True)
class Steadiness(Question[tuple[Growth, ...]]):
    """How the strengths of an effect grow over the records; nothing where they may."""

    fit: Fit
    effect: str


@dataclass(frozen=True)
class Structure(Question[float]):
    """The share of the squared hold-out error that a model predicts which knows no physics."""

    fit: Fit


@dataclass(frozen=True)
class Repeats(Question[Repetition]):
    """What of the error repeats from cycle to cycle, and whether what does not knows the output."""

    fit: Fit


# --- the table


class Source(Protocol):
    """What answers questions."""

    @property
    def base(self) -> Fit:
        """The fit of the base alone."""

    @property
    def noise(self) -> float:
        """The most that the noise of held-out conditions can be, in multiples of its floor."""

    @property
    def library(self) -> Mapping[str, Effect]:
        """The effects that may be missing."""

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the answer to one question."""

    def each(self, questions: Sequence[Question[Answer]], labels: Sequence[str] = ()) -> Generator[Answer, None, None]:
        """Yield the answers to questions that are known together; a label says what was done."""


@dataclass(frozen=True)
class Answered:
    """A question with its answer."""

    question: Question[Any]
    answer: Any


@dataclass(frozen=True)
class Evidence:
    """All that was asked, with the answers.

    Attributes
    ----------
    base, noise, library
        See ``Source``.
    rows
        Questions with their answers, in the order in which they were asked. A fit of the same effects may come to stand
        lower when it is asked for again, so that the order matters.
    """

    base: Fit
    noise: float
    library: Mapping[str, Effect]
    rows: tuple[Answered, ...]

    def read(self) -> "Reader":
        """Return a source that answers from the rows, from the first on."""
        return Reader(self)


class Reader:
    """Answers from a table; it is a ``Source``.

    Raises
    ------
    LookupError
        If the table does not hold the next question's answer: it was gathered under another policy.
    """

    def __init__(self, evidence: Evidence) -> None:
        self.base, self.noise, self.library = evidence.base, evidence.noise, evidence.library
        self._rows = iter(evidence.rows)

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the answer in the next row."""
        row = next(self._rows, None)
        if row is None or row.question != question:
            raise LookupError(f"the evidence does not answer {question}: gather it under this policy")
        answer: Answer = row.answer
        return answer

    def each(self, questions: Sequence[Question[Answer]], labels: Sequence[str] = ()) -> Generator[Answer, None, None]:
        """Yield the answers in the next rows."""
        return (self.ask(q) for q in questions)


class Recorder:
    """Keeps what another source answers; it is a ``Source``."""

    def __init__(self, source: Source) -> None:
        self.base, self.noise, self.library = source.base, source.noise, source.library
        self._source = source
        self._rows: list[Answered] = []

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the other source's answer."""
        answer = self._source.ask(question)
        self._rows.append(Answered(question, answer))
        return answer

    def each(self, questions: Sequence[Question[Answer]], labels: Sequence[str] = ()) -> Generator[Answer, None, None]:
        """Yield the other source's answers."""
        with closing(self._source.each(questions, labels)) as answers:
            for question, answer in zip(questions, answers, strict=True):
                self._rows.append(Answered(question, answer))
                yield answer

    def evidence(self) -> Evidence:
        """Return the table of all that was asked so far."""
        return Evidence(self.base, self.noise, self.library, tuple(self._rows))
