"""Work on many items by threads, with results in the order of the items: the number of threads does not change them."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")


def in_order(make: Callable[[Item], Made], items: Iterable[Item], jobs: int) -> Iterator[Made]:
    """Yield what ``make`` makes of the items, in their order, at most two items per job ahead.

    If one fails, those not yet begun are not made.
    """
    waiting: deque[Future[Made]] = deque()
    with ThreadPoolExecutor(max(1, jobs)) as pool:
        try:
            for item in items:
                waiting.append(pool.submit(make, item))
                if len(waiting) >= 2 * max(1, jobs):
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
