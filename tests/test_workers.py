"""Results come in the order of the items; a failure keeps what has not begun from being made."""

import threading
import time

import pytest

from mrfit.workers import give_up, in_order


@pytest.mark.parametrize("jobs", [1, 3])
def test_results_come_in_the_order_of_the_items(jobs: int) -> None:
    def late(item: int) -> int:
        time.sleep(0.002 * (item % 3 == 0))
        return item**2

    assert list(in_order(late, range(20), jobs)) == [k**2 for k in range(20)]


def test_items_are_taken_no_further_ahead_than_two_a_job() -> None:
    taken: list[int] = []
    made = in_order(lambda item: item, (taken.append(k) or k for k in range(50)), 2)
    assert next(made) == 0
    assert len(taken) <= 4


def test_a_failure_is_raised_and_ends_the_work() -> None:
    begun, lock = [], threading.Lock()

    def fail(item: int) -> int:
        with lock:
            begun.append(item)
        if item == 1:
            raise ValueError("item 1")
        return item

    with pytest.raises(ValueError, match="item 1"):
        list(in_order(fail, range(100), 2))
    assert len(begun) <= 8


def test_an_interrupt_ends_long_work_at_its_next_look() -> None:
    ended = threading.Event()

    def long(item: int) -> int:
        try:
            for _ in range(1000):
                time.sleep(0.01)
                give_up()
        except KeyboardInterrupt:
            ended.set()
        return item

    made = in_order(lambda item: item if item == 0 else long(item), range(5), 2)
    assert next(made) == 0
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        made.throw(KeyboardInterrupt)  # type: ignore[attr-defined]
    assert ended.is_set()
    assert time.monotonic() - begin < 5.0


def test_work_that_is_waited_for_goes_on() -> None:
    give_up()
    assert list(in_order(lambda item: (give_up(), item)[1], range(4), 2)) == [0, 1, 2, 3]
