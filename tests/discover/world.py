"""A world of invented fits: what each set of effects leaves is written down, nothing is simulated."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mrfit.discover.evidence import (
    Answer,
    Candidate,
    Effect,
    Fall,
    Fit,
    Growth,
    Join,
    Question,
    Reach,
    Repeats,
    Repetition,
    Screen,
    Screening,
    Search,
    Steadiness,
    Strength,
    Structure,
    Try,
)

UNCLEAR, CLEAR = 0.1, 50.0


def fit(holdout: float, *effects: str, train: float | None = None, number: int | None = None, **shapes: Any) -> Fit:
    """Return a fit with this error, in training the same unless said otherwise."""
    own = hash((holdout, train, effects)) if number is None else number
    return Fit(own, tuple(sorted(effects)), holdout if train is None else train, holdout, {}, shapes)


@dataclass
class World:
    """Answers from a table of errors; a set of effects that it does not name leaves what its best subset leaves.

    Attributes
    ----------
    errors
        Error of each set of effects; that of no effects is the base's.
    cosines
        Between two effects; 0 if not named.
    strengths, falls
        Of an effect (``a``, or in one set only ``a in a+b``), and of a set of effects over any smaller; clear if not
        named.
    aliases
        Of an effect.
    shapes
        Where in its range an effect's shape parameters end.
    growths, structure, repetition
        What else is asked of a fit.
    searched
        Error of a set of effects when it is searched for again from many starts.
    """

    errors: Mapping[tuple[str, ...], float]
    noise: float = 1.0
    cosines: Mapping[tuple[str, str], float] = field(default_factory=dict)
    strengths: Mapping[str, float] = field(default_factory=dict)
    falls: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    shapes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    growths: Mapping[str, Growth] = field(default_factory=dict)
    structure: float = 0.0
    repetition: Repetition = field(default_factory=lambda: Repetition(0.0))
    searched: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    reaches: Mapping[str, float] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    asked: list[Question[Any]] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """All effects."""
        return sorted({e for effects in self.errors for e in effects} | set(self.unseen))

    @property
    def library(self) -> dict[str, Effect]:
        """Effects with their aliases and the names of their shapes."""
        return {n: Effect(n, frozenset(self.aliases.get(n, ())), frozenset(self.shapes.get(n, {}))) for n in self.names}

    @property
    def base(self) -> Fit:
        """The fit of the base alone."""
        return self.fitted(())

    def fitted(self, effects: Sequence[str]) -> Fit:
        """Return the fit of a set of effects."""
        own = set(effects)
        error = min(e for known, e in self.errors.items() if set(known) <= own)
        shapes = {e: self.shapes[e] for e in sorted(own) if e in self.shapes}
        return Fit(hash((tuple(sorted(own)), error)), tuple(sorted(own)), error, error, {}, shapes)

    def ask_screening(self) -> Screening:
        """Return the first screening."""
        return self._screening(self.base)

    def ask(self, question: Question[Answer]) -> Answer:
        """Return the answer to one question."""
        self.asked.append(question)
        answer: Answer = self._answer(question)
        return answer

    def each(self, questions: Sequence[Question[Answer]], labels: Sequence[str] = ()) -> Generator[Answer, None, None]:
        """Yield the answers to several."""
        return (self.ask(q) for q in questions)

    def _answer(self, question: Question[Any]) -> Any:
        match question:
            case Screen(present):
                return self._screening(present)
            case Try(present, candidate):
                return self.fitted((*present.effects, candidate.name))
            case Join(effects, _):
                return self.fitted(effects)
            case Search(found):
                error = self.searched.get(found.effects, found.holdout)
                return found if error == found.holdout else fit(error, *found.effects)
            case Fall(_, after):
                return self.falls.get(after.effects, CLEAR)
            case Strength(found, effect):
                own = self.strengths.get(effect, CLEAR)
                return self.strengths.get(f"{effect} in {'+'.join(found.effects)}", own)
            case _:
                return self._property(question)

    def _property(self, question: Question[Any]) -> Any:
        match question:
            case Reach(_, effects, found):
                # to first order a set takes what its fit takes
                left = self.fitted((*found.effects, *effects)).holdout ** 2 / found.holdout**2
                return self.reaches.get(effects[0], 1.0 - left)
            case Steadiness(_, effect):
                return (self.growths[effect],) if effect in self.growths else ()
            case Structure():
                return self.structure
            case Repeats():
                return self.repetition
            case _:
                raise TypeError(question)

    def _screening(self, present: Fit) -> Screening:
        names = [n for n in self.names if n not in present.effects]
        candidates = tuple(
            Candidate(n, "cannot be judged: no channel", shown=False)
            if n in self.unseen
            else Candidate(
                n, gain=max(1.0 - self.fitted((*present.effects, n)).holdout ** 2 / present.holdout**2, 0.01)
            )
            for n in names
        )
        shown = [n for n in names if n not in self.unseen]
        cosines = tuple(
            tuple(1.0 if a == b else self.cosines.get((a, b), self.cosines.get((b, a), 0.0)) for b in shown)
            for a in shown
        )
        return Screening(present, tuple(sorted(candidates, key=lambda c: -c.gain)), cosines)
