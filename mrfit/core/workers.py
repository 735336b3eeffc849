"""Work on many items by several threads, with results in the order of the items: how many changes nothing.

Threads are for what reads and unpacks files, and shares memory. What holds the interpreter's lock half of its time, as
fits and figures do, goes to ``executors``.
"""

import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from threading import Event
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")

# What ends a command
ENDING = (signal.SIGINT, signal.SIGTERM)

# Set where nobody waits any more for what a worker makes
_GIVEN_UP: ContextVar[Event | None] = ContextVar("given_up", default=None)


def in_order(make: Callable[[Item], Made], items: Iterable[Item], jobs: int) -> Iterator[Made]:
    """Yield the results of ``make`` for the items, by threads, in their order, at most two items per job ahead.

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


@contextmanager
def interrupts_later() -> Iterator[None]:
    """Hold back what ends a command: what Python itself does around a fork, or LLVM while it compiles, swallows it."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    before = {one: signal.signal(one, lambda number, frame: came.append(number)) for one in ENDING}
    try:
        yield
    finally:
        for one, handler in before.items():
            signal.signal(one, handler)
    for number in came:
        handler = before[signal.Signals(number)]
        if callable(handler):
            handler(number, None)
        elif handler == signal.SIG_DFL:
            signal.raise_signal(number)
