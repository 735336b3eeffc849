"""The stepwise selection of effects, whatever tells whether one has proof.

Effects are added while one has proof, alone or together with another; after every addition, those that are in are
judged again beside the new one. An ``EffectComparison`` says what proof is: beside a base that is taken as exact
(``exact_base``), or beside any law (``any_law``). Which refit comes next depends on what was decided of the last.
"""

from collections.abc import Callable, Iterator
from typing import Protocol, TypeVar


class EffectSelection(Protocol):
    """Effects selected so far, with what was said of every candidate; never changed in place."""

    @property
    def effects(self) -> tuple[str, ...]:
        """Names of the effects that are in."""


S = TypeVar("S", bound=EffectSelection)
R = TypeVar("R")


class EffectComparison(Protocol[S, R]):
    """Judge of effects: ``S`` is what stands, ``R`` what a round of trials found."""

    def is_open(self, chosen: S, number: int) -> bool:
        """Return whether another round of trials may follow after so many."""

    def trials(self, chosen: S, number: int) -> tuple[S, R]:
        """Return the selection with the fate of every candidate, and the trials of this round."""

    def additions(self, chosen: S, found: R) -> Iterator[S]:
        """Yield the selection after each way to add: with more effects, or with the same where none has proof."""

    def reassessed(self, chosen: S) -> S:
        """Return the selection after every effect was judged again beside the others."""


def grow(comparison: EffectComparison[S, R], chosen: S) -> S:
    """Add effects until none has proof."""
    number = 0
    while comparison.is_open(chosen, number):
        chosen, found = comparison.trials(chosen, number)
        present, number = chosen.effects, number + 1
        for further in comparison.additions(chosen, found):
            chosen = further
            if chosen.effects != present:
                break
        if chosen.effects == present:
            break
        chosen = comparison.reassessed(chosen)
    return chosen


def prune(chosen: S, take_out: Callable[[S], S | None]) -> S:
    """Take effects out one after the other until none has to go, which is None; each is judged beside the rest."""
    while chosen.effects and (rest := take_out(chosen)) is not None:
        chosen = rest
    return chosen


def prune_each(chosen: S, take_out: Callable[[S, str], S | None]) -> S:
    """Judge every effect once beside those that are still in, and take it out if it has to go."""
    for name in chosen.effects:
        chosen = take_out(chosen, name) or chosen
    return chosen
