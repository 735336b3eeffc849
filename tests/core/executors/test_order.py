"""Results of an executor in the order of the items, whatever the order in which they come."""

from collections.abc import Generator, Iterable
from dataclasses import dataclass, field
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrfit.core.executors import order
from mrfit.core.executors.items import FAILED, MADE, UNKNOWN_ITEM, ItemEnd, Make, end_of, made_of, packed, sendable
from mrfit.core.executors.order import executor, in_order_by
from mrfit.core.executors.processes import QUIET_SECONDS, Processes, now_and_then
from mrfit.core.executors.serial import Serial
from mrfit.core.progress import Progress, silent


@dataclass
class Shuffled:
    """Yields the ends of its items in a given order, and notes how far it was asked and that it was closed."""

    places: list[int]
    apart: bool = False
    asked: list[int] = field(default_factory=list)
    closed: bool = False

    def ends(self, make: Make, items: Iterable[Any], progress: Progress) -> Generator[ItemEnd[Any], None, None]:
        held = list(items)
        try:
            for place in self.places:
                self.asked.append(place)
                try:
                    yield ItemEnd(place, make(held[place], progress))
                except ValueError as error:
                    yield ItemEnd(place, error=error)
        finally:
            self.closed = True


def negated(item: int, told: Progress) -> int:
    if item < 0:
        raise ValueError(f"item {item}")
    return -item


@given(st.permutations(range(6)))
def test_results_come_in_the_order_of_the_items(places: list[int]) -> None:
    doer = Shuffled(places)
    assert list(in_order_by(doer, negated, range(6), silent)) == [0, -1, -2, -3, -4, -5]
    assert doer.closed


def test_a_result_is_given_as_soon_as_those_before_it_are_there() -> None:
    doer = Shuffled([2, 0, 1, 3])
    made = in_order_by(doer, negated, range(4), silent)
    assert next(made) == 0 and doer.asked == [2, 0]
    assert [next(made), next(made)] == [-1, -2] and doer.asked == [2, 0, 1]


@pytest.mark.parametrize("places", [[2, 0, 1, 3], [2, 1, 0, 3]])
def test_of_several_errors_the_first_in_the_order_of_the_items_is_raised_and_the_rest_is_given_up(
    places: list[int],
) -> None:
    doer = Shuffled(places)
    made = in_order_by(doer, negated, [5, -1, -2, 7], silent)
    assert next(made) == -5
    with pytest.raises(ValueError, match="item -1"):
        next(made)
    assert doer.asked == places[:3] and doer.closed


def test_work_that_is_no_longer_wanted_is_ended() -> None:
    doer = Shuffled([0, 1, 2])
    made = in_order_by(doer, negated, range(3), silent)
    next(made)
    made.close()
    assert doer.closed and doer.asked == [0]


def test_one_job_is_done_here_and_several_by_processes_unless_a_scheduler_was_told(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert isinstance(executor(1), Serial) and isinstance(executor(0), Serial)
    several = executor(3)
    assert isinstance(several, Processes) and several.jobs == 3
    assert not order.is_elsewhere() and not order.is_apart()
    for apart in (True, False):
        scheduler = Shuffled([], apart)
        monkeypatch.setattr(order, "_told", [scheduler])
        assert executor(1) is scheduler and executor(4) is scheduler
        assert order.is_elsewhere() and order.is_apart() is apart


def test_an_item_that_fails_here_ends_no_other() -> None:
    ends = list(Serial().ends(negated, [1, -2, 3], silent))
    assert [(e.place, e.made, str(e.error or "")) for e in ends] == [(0, -1, ""), (1, None, "item -2"), (2, -3, "")]


class OfTwo(Exception):
    """Cannot be made again from its one text."""

    def __init__(self, what: str, row: int) -> None:
        super().__init__(f"{what} in row {row}")


def fails(item: int, told: Progress) -> None:
    raise OfTwo("no number", item)


def test_an_error_is_sent_as_it_is_where_it_can_be_and_says_where_it_arose() -> None:
    try:
        negated(-3, silent)
    except ValueError as error:
        sent = sendable(error)
        assert sent is error and "in negated" in sent.__notes__[-1]
    try:
        fails(3, silent)
    except OfTwo as error:
        sent = sendable(error)
        assert type(sent) is RuntimeError and str(sent) == "OfTwo: no number in row 3"
        assert "in fails" in sent.__notes__[-1]


def test_what_cannot_be_sent_is_not_packed_and_what_is_not_known_there_is_made_here() -> None:
    assert packed(lambda item, told: item, 1) is None
    sent = packed(negated, 4)
    assert sent is not None
    here: ItemEnd[int] = ItemEnd(7, 0)
    assert end_of(7, made_of(sent, silent), lambda: here) == ItemEnd(7, -4)
    assert end_of(7, made_of(sent.replace(b"negated", b"no_such"), silent), lambda: here) is here
    failed = packed(negated, -4)
    assert failed is not None
    end = end_of(2, made_of(failed, silent), lambda: here)
    assert (end.place, end.made, str(end.error)) == (2, None, "item -4")
    assert len({MADE, FAILED, UNKNOWN_ITEM}) == 3


def test_progress_is_passed_on_now_and_then_and_always_at_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, heard = [100.0], list[tuple[str, int]]()
    monkeypatch.setattr("mrfit.core.executors.processes.time.monotonic", lambda: clock[0])
    told = now_and_then(lambda what, done, total: heard.append((what, done)))
    told("a", 1, 9)
    for done, later in ((2, 0.5), (3, 0.9), (4, 1.1)):
        clock[0] = 100.0 + later * QUIET_SECONDS
        told("a", done, 9)
    # at the same moment, but the last of its kind
    told("a", 9, 9)
    told("b", 1, 5)
    assert heard == [("a", 1), ("a", 4), ("a", 9)]
