"""Results come in the order of the items; a failure keeps what has not begun from being made."""

import io
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mrfit.core.progress import Progress, silent
from mrfit.core.workers import FORKS, give_up, in_order, in_processes, interrupts_later
from mrfit.errors import DataError, MrfitError

forks = pytest.mark.skipif(not FORKS, reason="no processes are forked here")


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


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_processes_give_results_in_the_order_of_the_items(jobs: int) -> None:
    def late(item: int, told: Progress) -> int:
        time.sleep(0.01 * (item % 3 == 0))
        return item**2

    assert list(in_processes(late, range(11), jobs, silent)) == [k**2 for k in range(11)]
    assert list(in_processes(late, [], jobs, silent)) == []


@forks
def test_each_process_tells_its_progress_here() -> None:
    heard: list[tuple[str, int, int]] = []

    def work(item: int, told: Progress) -> int:
        for step in range(1001):
            told(f"item {item}", step, 1000)
        return os.getpid()

    made = list(in_processes(work, range(4), 2, lambda *what: heard.append(what)))
    assert os.getpid() not in made
    assert {(f"item {k}", 1000, 1000) for k in range(4)} <= set(heard)
    # not every step: listening would take longer than the work
    assert len(heard) < 100


@forks
def test_a_failure_in_a_process_ends_the_others(tmp_path: Path) -> None:
    def fail(item: int, told: Progress) -> int:
        (tmp_path / str(os.getpid())).touch()
        if item == 1:
            raise DataError("item 1: no such column")
        time.sleep(0.0 if item == 0 else 60.0)
        return item

    begin, made = time.monotonic(), in_processes(fail, range(9), 3, silent)
    assert next(made) == 0
    with pytest.raises(DataError, match="item 1: no such column"):
        next(made)
    assert time.monotonic() - begin < 10.0
    assert all(not Path(f"/proc/{p.name}").exists() for p in tmp_path.iterdir())


class OfTwo(Exception):
    """Cannot be made again from its one text, as is done with what is sent."""

    def __init__(self, what: str, row: int) -> None:
        super().__init__(f"{what} in row {row}")


@forks
def test_what_cannot_be_sent_is_told() -> None:
    with pytest.raises(Exception, match="pickle"):
        list(in_processes(lambda item, told: lambda: item, range(3), 2, silent))

    def fail(item: int, told: Progress) -> int:
        raise OfTwo("no number", 3)

    with pytest.raises(RuntimeError, match="OfTwo: no number in row 3") as raised:
        list(in_processes(fail, range(3), 2, silent))
    assert "in fail" in raised.value.__notes__[0]


@forks
def test_a_process_writes_to_streams_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of a progress bar have locks, which nobody may ever let go of after a fork."""
    ours = io.StringIO()
    monkeypatch.setattr(sys, "stderr", ours)

    def written(item: int, told: Progress) -> bool:
        print("", end="", file=sys.stderr)
        return sys.stderr is not ours and sys.stdout is not None

    assert all(in_processes(written, range(3), 2, silent))


def test_an_interrupt_waits_for_the_end_of_a_fork() -> None:
    after = []
    with pytest.raises(KeyboardInterrupt), interrupts_later():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.05)
        after.append(1)
    assert after


@forks
def test_a_killed_process_is_told() -> None:
    def killed(item: int, told: Progress) -> int:
        if item == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    with pytest.raises(MrfitError, match="--jobs 1"):
        list(in_processes(killed, range(5), 2, silent))


@forks
def test_processes_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    program = f"""
import os, time
from pathlib import Path
from mrfit.core.workers import in_processes

def work(item, told):
    Path({str(tmp_path)!r}, str(os.getpid())).touch()
    time.sleep(1000.0)

list(in_processes(work, range(2), 2, print))
"""
    parent = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.DEVNULL)
    workers = _eventually(lambda: [int(p.name) for p in tmp_path.iterdir()], 2)
    parent.kill()
    parent.wait()
    assert _eventually(lambda: [w for w in workers if _ended(w)], 2)


def _ended(process: int) -> bool:
    status = Path(f"/proc/{process}/stat")
    # nobody may have asked yet how an orphan ended
    return not status.exists() or ") Z " in status.read_text()


def _eventually(found: Callable[[], list[int]], count: int) -> list[int]:
    """Return what is found as soon as there are so many, or after half a minute."""
    end = time.monotonic() + 30.0
    while len(found()) < count and time.monotonic() < end:
        time.sleep(0.02)
    return found() if len(found()) >= count else []
