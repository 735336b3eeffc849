"""Work on many items by threads, with results in the order of the items: the number of threads does not change them."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextvars import ContextVar
from threading import Event
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")

# Set where nobody waits any more for what a worker makes
_GIVEN_UP: ContextVar[Event | None] = ContextVar("given_up", default=None)


def in_order(make: Callable[[Item], Made], items: Iterable[Item], jobs: int) -> Iterator[Made]:
    """Yield what ``make`` makes of the items, in their order, at most two items per job ahead.

    If one fails, or the caller is interrupted, those not yet begun are not made, and those begun may ``give_up``.
    """
    waiting: deque[Future[Made]] = deque()
    given_up = Event()

    def begun(item: Item) -> Made:
        _GIVEN_UP.set(given_up)
        return make(item)

    with ThreadPoolExecutor(max(1, jobs)) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(begun, item))
                if len(waiting) >= 2 * max(1, jobs):
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            given_up.set()
            for future in waiting:
                future.cancel()


def give_up() -> None:
    """End long work that nobody waits for any more, to be called from time to time.

    Raises
    ------
    KeyboardInterrupt
        In a worker of ``in_order`` whose caller has failed or was interrupted.
    """
    given_up = _GIVEN_UP.get()
    if given_up is not None and given_up.is_set():
        raise KeyboardInterrupt
