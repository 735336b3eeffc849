"""A world of invented fits: what each set of effects leaves is written down, nothing is simulated."""

from collections.abc import Generator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from mrfit.discover.selection.questions import (
    Candidate,
    EffectScreening,
    Fit,
    Growth,
    Join,
    LibraryEffect,
    Repetition,
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
    aliases, of_one_input
        Of an effect.
    shapes
        Where in its range an effect's shape parameters end.
    values
        Of an effect's other parameters, as ``a.k``.
    growing, predicted, repeating
        What else is asked of a fit.
    searched
        Error of a set of effects when it is searched for again from many starts.
    """

    errors: Mapping[tuple[str, ...], float]
    noise: float = 1.0
    noise_is_told: bool = False
    cosines: Mapping[tuple[str, str], float] = field(default_factory=dict)
    strengths: Mapping[str, float] = field(default_factory=dict)
    falls: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    aliases: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    of_one_input: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    shapes: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)
    growing: Mapping[str, Growth] = field(default_factory=dict)
    predicted: float = 0.0
    repeating: Repetition = field(default_factory=lambda: Repetition(0.0))
    searched: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    reaches: Mapping[str, float] = field(default_factory=dict)
    unseen: tuple[str, ...] = ()
    asked: list[tuple[Any, ...]] = field(default_factory=list)

    @property
    def names(self) -> list[str]:
        """All effects."""
        return sorted({e for effects in self.errors for e in effects} | set(self.unseen))

    @property
    def library(self) -> dict[str, LibraryEffect]:
        """Effects with their aliases and the names of their shapes."""
        return {
            n: LibraryEffect(
                n,
                frozenset(self.aliases.get(n, ())),
                frozenset({*self.shapes.get(n, {}), *self._own(n)}),
                frozenset(self.of_one_input.get(n, ())),
            )
            for n in self.names
        }

    def _own(self, effect: str) -> list[str]:
        return [key.partition(".")[2] for key in self.values if key.startswith(f"{effect}.")]

    @property
    def base(self) -> Fit:
        """The fit of the base alone."""
        return self.fitted(())

    def fitted(self, effects: Sequence[str]) -> Fit:
        """Return the fit of a set of effects."""
        own = set(effects)
        error = min(e for known, e in self.errors.items() if set(known) <= own)
        shapes = {e: self.shapes[e] for e in sorted(own) if e in self.shapes}
        values = {f"{e}.{k}": self.values[f"{e}.{k}"] for e in sorted(own) for k in self._own(e)}
        return Fit(hash((tuple(sorted(own)), error)), tuple(sorted(own)), error, error, values, shapes)

    def ask_screening(self) -> EffectScreening:
        """Return the first screening."""
        return self._screening(self.base)

    def refits(self, wanted: Sequence[Try | Join], labels: Sequence[str] = ()) -> Generator[Fit, None, None]:
        """Yield the fits of several sets of effects."""
        for one in wanted:
            self.asked.append(("refits", one))
            own = (*one.present.effects, one.candidate.name) if isinstance(one, Try) else one.effects
            yield self.fitted(own)

    def screen(self, present: Fit) -> EffectScreening:
        """Return the screening at a fit."""
        self.asked.append(("screen", present))
        return self._screening(present)

    def search(self, found: Fit) -> Fit:
        """Return the fit of a set of effects that is searched for again."""
        self.asked.append(("search", found))
        error = self.searched.get(found.effects, found.holdout)
        return found if error == found.holdout else fit(error, *found.effects)

    def fall(self, before: Fit, after: Fit) -> float:
        """Return how clear the fall to a set of effects is."""
        self.asked.append(("fall", before, after))
        return self.falls.get(after.effects, CLEAR)

    def strength(self, found: Fit, effect: str) -> float:
        """Return how clear an effect is."""
        self.asked.append(("strength", found, effect))
        return self.strengths.get(f"{effect} in {'+'.join(found.effects)}", self.strengths.get(effect, CLEAR))

    def reach(self, screened: Fit, effects: tuple[str, ...], found: Fit) -> float:
        """Return what effects could take; to first order a set takes what its fit takes."""
        self.asked.append(("reach", screened, effects, found))
        left = self.fitted((*found.effects, *effects)).holdout ** 2 / found.holdout**2
        return self.reaches.get(effects[0], 1.0 - left)

    def growths(self, found: Fit, effect: str) -> tuple[Growth, ...]:
        """Return how an effect grows over the records."""
        self.asked.append(("growths", found, effect))
        return (self.growing[effect],) if effect in self.growing else ()

    def structure(self, found: Fit) -> float:
        """Return what a model without physics predicts."""
        self.asked.append(("structure", found))
        return self.predicted

    def repetition(self, found: Fit) -> Repetition:
        """Return what repeats."""
        self.asked.append(("repetition", found))
        return self.repeating

    def _screening(self, present: Fit) -> EffectScreening:
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
        return EffectScreening(present, tuple(sorted(candidates, key=lambda c: -c.gain)), cosines)
