"""Results come in the order of the items; a failure keeps what has not begun from being made."""

import os
import signal
import subprocess
import sys
import threading
import time
import types
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from mrfit.core import children
from mrfit.core.executors import processes
from mrfit.core.executors.order import in_processes
from mrfit.core.progress import Progress, silent
from mrfit.core.workers import give_up, in_order, interrupts_later
from mrfit.errors import DataError, MrfitError

linux = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")


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


@dataclass(frozen=True)
class Noted:
    """An item whose making leaves its process's number in a folder."""

    folder: Path
    number: int

    def note(self) -> None:
        (self.folder / str(os.getpid())).touch()


def squared_late(item: int, told: Progress) -> int:
    time.sleep(0.01 * (item % 3 == 0))
    return item**2


@pytest.mark.parametrize("jobs", [1, 2, 3])
def test_processes_give_results_in_the_order_of_the_items(jobs: int) -> None:
    assert list(in_processes(squared_late, range(11), jobs, silent)) == [k**2 for k in range(11)]
    assert list(in_processes(squared_late, [], jobs, silent)) == []


def thousand_steps(item: int, told: Progress) -> int:
    for step in range(1001):
        told(f"item {item}", step, 1000)
    return os.getpid()


def test_each_process_tells_its_progress_here() -> None:
    heard: list[tuple[str, int, int]] = []
    made = list(in_processes(thousand_steps, range(4), 2, lambda *what: heard.append(what)))
    assert os.getpid() not in made
    assert {(f"item {k}", 1000, 1000) for k in range(4)} <= set(heard)
    # not every step: listening would take longer than the work
    assert len(heard) < 100


@pytest.fixture
def spawned(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Processes as on macOS and Windows."""
    monkeypatch.setattr(children, "START", "spawn")
    monkeypatch.setattr(processes, "_IDLE", [])
    yield
    for pool in processes._IDLE:
        pool.end()


def test_spawned_processes_do_the_same(spawned: None) -> None:
    heard: list[tuple[str, int, int]] = []
    made = list(in_processes(thousand_steps, range(4), 2, lambda *what: heard.append(what)))
    assert os.getpid() not in made and {(f"item {k}", 1000, 1000) for k in range(4)} <= set(heard)
    with pytest.raises(RuntimeError, match="OfTwo: no number in row 3"):
        list(in_processes(raises_of_two, range(3), 2, silent))


def own_number(item: int, told: Progress) -> int:
    time.sleep(0.05)
    return os.getpid()


def test_a_second_call_goes_to_the_same_processes() -> None:
    first, second = (set(in_processes(own_number, range(4), 2, silent)) for _ in range(2))
    assert first & second


def fails_at_one(item: Noted, told: Progress) -> int:
    item.note()
    if item.number == 1:
        raise DataError("item 1: no such column")
    time.sleep(0.0 if item.number == 0 else 60.0)
    return item.number


@linux
def test_a_failure_in_a_process_ends_the_others(tmp_path: Path) -> None:
    begin, made = time.monotonic(), in_processes(fails_at_one, [Noted(tmp_path, k) for k in range(9)], 3, silent)
    assert next(made) == 0
    with pytest.raises(DataError, match="item 1: no such column"):
        next(made)
    assert time.monotonic() - begin < 30.0
    made_by = [int(p.name) for p in tmp_path.iterdir()]
    assert os.getpid() not in made_by
    assert len(_eventually(lambda: [w for w in made_by if _ended(w)], len(made_by))) == len(made_by)


class OfTwo(Exception):
    """Cannot be made again from its one text, as is done with what is sent."""

    def __init__(self, what: str, row: int) -> None:
        super().__init__(f"{what} in row {row}")


def gives_a_function(item: int, told: Progress) -> Callable[[], int]:
    return lambda: item


def raises_of_two(item: int, told: Progress) -> int:
    raise OfTwo("no number", 3)


def test_what_cannot_be_sent_back_is_told() -> None:
    with pytest.raises(Exception, match="pickle"):
        list(in_processes(gives_a_function, range(3), 2, silent))
    with pytest.raises(RuntimeError, match="OfTwo: no number in row 3") as raised:
        list(in_processes(raises_of_two, range(3), 2, silent))
    assert "in raises_of_two" in raised.value.__notes__[0]


def called(item: Callable[[], int], told: Progress) -> int:
    told("called", 1, 1)
    return item()


def test_what_cannot_be_sent_to_a_process_is_made_here() -> None:
    heard: list[str] = []
    items = [lambda k=k: 1000 * k + (os.getpid() == parent) for k in range(3)]
    parent = os.getpid()
    assert list(in_processes(called, items, 2, lambda what, done, total: heard.append(what))) == [1, 1001, 2001]
    assert heard == ["called"] * 3
    # one among others that can
    assert list(in_processes(called, [os.getpid, *items[1:]], 2, silent))[1:] == [1001, 2001]


def test_what_only_this_process_knows_is_made_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """As a model that a notebook defines: it can be sent by name, and another process does not know the name."""
    module = types.ModuleType("known_here")
    exec("import os\ndef twice(item, told):\n    return 2 * item, os.getpid()", module.__dict__)
    monkeypatch.setitem(sys.modules, "known_here", module)
    assert list(in_processes(module.twice, range(4), 2, silent)) == [(2 * k, os.getpid()) for k in range(4)]


HELD = threading.Lock()


def takes_the_lock(item: int, told: Progress) -> bool:
    return HELD.acquire(timeout=5.0) and not HELD.release()


def test_no_process_begins_with_a_lock_that_a_thread_holds() -> None:
    """A process forked while another thread writes to the terminal would wait for that thread for ever."""
    with HELD:
        assert all(in_processes(takes_the_lock, range(3), 2, silent))


def place(item: int, told: Progress) -> tuple[str, str | None]:
    return os.getcwd(), os.environ.get("MRFIT_TOLD")


def test_processes_are_where_this_one_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        assert {folder for folder, _ in in_processes(place, range(3), 2, silent)} == {str(tmp_path / name)}


def test_an_interrupt_waits_for_the_end_of_what_would_swallow_it() -> None:
    after = []
    with pytest.raises(KeyboardInterrupt), interrupts_later():
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(0.05)
        after.append(1)
    assert after


def killed_at_two(item: int, told: Progress) -> int:
    if item == 2:
        os.kill(os.getpid(), signal.SIGKILL)
    return item


def test_a_killed_process_is_told_and_the_next_call_has_new_ones() -> None:
    with pytest.raises(MrfitError, match="--jobs 1"):
        list(in_processes(killed_at_two, range(5), 2, silent))
    assert list(in_processes(squared_late, range(5), 2, silent)) == [0, 1, 4, 9, 16]


def kill_oneself(item: int, told: Progress) -> int:
    threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGKILL)).start()
    return item


def test_processes_that_were_killed_between_two_calls_are_replaced() -> None:
    assert list(in_processes(kill_oneself, range(4), 2, silent)) == [0, 1, 2, 3]
    time.sleep(0.5)
    assert list(in_processes(squared_late, range(5), 2, silent)) == [0, 1, 4, 9, 16]


SLEEPERS = """
import os, time
from pathlib import Path

def work(item, told):
    Path({folder!r}, str(os.getpid())).touch()
    time.sleep(1000.0)
"""


@pytest.fixture
def sleeping(tmp_path: Path) -> Iterator[tuple["subprocess.Popen[str]", list[int]]]:
    """A command of its own group with two processes at work, and their numbers."""
    (tmp_path / "noted").mkdir()
    (tmp_path / "sleepers.py").write_text(SLEEPERS.format(folder=str(tmp_path / "noted")))
    program = "import sleepers\nfrom mrfit.core.executors.order import in_processes\n"
    program += "list(in_processes(sleepers.work, range(2), 2, print))\n"
    path = os.pathsep.join([str(tmp_path), *sys.path])
    parent = subprocess.Popen(
        [sys.executable, "-c", program],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,
    )
    yield parent, _eventually(lambda: [int(p.name) for p in (tmp_path / "noted").iterdir()], 2)
    parent.kill()
    parent.communicate()


@linux
def test_processes_end_when_their_parent_is_killed(sleeping: tuple["subprocess.Popen[str]", list[int]]) -> None:
    parent, children = sleeping
    assert len(children) == 2 and parent.pid not in children
    parent.kill()
    assert _eventually(lambda: [w for w in children if _ended(w)], 2)


@linux
def test_an_interrupt_ends_all_and_only_the_parent_tells(sleeping: tuple["subprocess.Popen[str]", list[int]]) -> None:
    """Ctrl-C goes to every process of the terminal."""
    parent, children = sleeping
    assert len(children) == 2
    os.killpg(parent.pid, signal.SIGINT)
    _, errors = parent.communicate(timeout=30.0)
    assert errors.count("KeyboardInterrupt") == 1
    assert _eventually(lambda: [w for w in children if _ended(w)], 2)


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


def of_the_environment(item: str, told: Progress) -> str | None:
    return os.environ.get(item)


def test_a_process_has_the_environment_of_this_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(processes, "_IDLE", [])
    monkeypatch.setenv("A_NAME", "a value")
    monkeypatch.setenv("PATH", os.environ["PATH"] + os.pathsep)
    before = dict(os.environ)
    # those that only its start needed, or a program started in it would have them too
    names = ["A_NAME", "PATH", "PYTHONSAFEPATH", "PYTHONPATH"]
    assert list(in_processes(of_the_environment, names, 2, silent)) == [before.get(name) for name in names]
    assert dict(os.environ) == before
