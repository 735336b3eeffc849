"""Executors, and the items of work that are sent to one and come back."""

import pickle
import traceback
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

from mrfit.core.progress import Progress

Item = TypeVar("Item")
Made = TypeVar("Made")
Make = Callable[[Any, Progress], Any]
"""Takes an item and whom to tell of its progress; a function of a module, so that it can be sent by name."""

# How an item went where it was sent to
MADE, FAILED, UNKNOWN_ITEM = "made", "failed", "unknown"


@dataclass(frozen=True)
class ItemEnd(Generic[Made]):
    """An item's end.

    Attributes
    ----------
    place
        Its number among the items, from 0.
    made
        What came of it; None where it failed.
    error
        Why it failed, or None.
    """

    place: int
    made: Made | None = None
    error: BaseException | None = None


class Executor(Protocol):
    """Place in which items of work are done; results do not depend on which one it is.

    Attributes
    ----------
    apart
        Whether workers see other files than this process does.
    """

    apart: bool

    def ends(self, make: Make, items: Iterable[Any], progress: Progress) -> Generator[ItemEnd[Any], None, None]:
        """Yield the ends of items as they come, in any order; an item that fails ends no other.

        Closing the generator cancels what has not begun and ends, or no longer waits for, what has.

        Raises
        ------
        Unreachable
            If nobody is left to do the work.
        """


def packed(make: Make, item: object) -> bytes | None:
    """Return a function and its item as they are sent; None if they cannot be, as what was defined in a function."""
    try:
        return pickle.dumps((make, item))
    except (pickle.PicklingError, TypeError, AttributeError):
        return None


def made_of(sent: bytes, progress: Progress) -> bytes:
    """Make an item that was sent: return how that went, and what came of it, as it is sent back."""
    try:
        make, item = pickle.loads(sent)
    except Exception:
        # of what the parent has and this process does not, as a model that a notebook defines
        return pickle.dumps((UNKNOWN_ITEM, None))
    try:
        return pickle.dumps((MADE, make(item, progress)))
    except BaseException as error:
        return pickle.dumps((FAILED, sendable(error)))


def sendable(error: BaseException) -> BaseException:
    """Return an error with its traceback as a note; one that could not be sent as a RuntimeError that says the same."""
    note = traceback.format_exc()
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(note)
    return error


def made_here(make: Make, item: object, place: int, progress: Progress) -> ItemEnd[Any]:
    """Return the end of an item that is made in this process."""
    try:
        return ItemEnd(place, make(item, progress))
    except Exception as error:
        return ItemEnd(place, error=error)


def end_of(place: int, back: bytes, again: Callable[[], ItemEnd[Any]]) -> ItemEnd[Any]:
    """Return the end of an item from what was sent back of it; ``again`` makes it here where it was not known there."""
    how, made = pickle.loads(back)
    if how == UNKNOWN_ITEM:
        return again()
    return ItemEnd(place, error=made) if how == FAILED else ItemEnd(place, made)
