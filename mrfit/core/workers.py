"""Work on many items by several workers, with results in the order of the items: how many workers changes nothing.

Threads are for what reads and unpacks files, and shares memory. Processes are for what holds the interpreter's lock
half of its time, as fits and figures do: two threads of these take as long as one.
"""

import ctypes
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar
from multiprocessing.connection import Connection, wait
from threading import Event
from typing import Any, NoReturn, TypeVar, cast

from mrfit.core.progress import Progress
from mrfit.errors import MrfitError

Item = TypeVar("Item")
Made = TypeVar("Made")

# A forked process has all that its parent has, so only results have to be sent. Elsewhere system libraries do not
# survive a fork, and whatever makes the items would have to be sent too.
FORKS = sys.platform == "linux"
# What ends a command
ENDING = (signal.SIGINT, signal.SIGTERM)
# Of prctl(2): the signal to be sent to a process when its parent ends
PR_SET_PDEATHSIG = 1
KILLED = "a worker process was killed; there may be too little memory: try --jobs 1"
# Seconds between two messages of a process about its progress
QUIET = 0.1

# Set where nobody waits any more for what a worker makes
_GIVEN_UP: ContextVar[Event | None] = ContextVar("given_up", default=None)


def in_order(make: Callable[[Item], Made], items: Iterable[Item], jobs: int) -> Iterator[Made]:
    """Yield what ``make`` makes of the items by threads, in their order, at most two items per job ahead.

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


def in_processes(
    make: Callable[[Item, Progress], Made], items: Sequence[Item], jobs: int, progress: Progress
) -> Generator[Made, None, None]:
    """Yield what ``make`` makes of the items by processes, in their order; by threads where the system cannot fork.

    If one fails, or the caller is interrupted, the others are ended.

    Parameters
    ----------
    make
        Takes an item and whom to tell of its progress. What it changes besides files is lost; what it returns, and the
        errors that it raises, are sent.
    items
        The items.
    jobs
        Most processes.
    progress
        Told what the items tell, in this process.

    Raises
    ------
    MrfitError
        If a process was killed.
    """
    jobs = min(jobs, len(items))
    if jobs < 2:
        yield from (make(item, progress) for item in items)
        return
    if not FORKS:
        yield from in_order(lambda item: make(item, progress), items, jobs)
        return
    pool = _Pool(make, items, progress)
    try:
        pool.fork(jobs)
        yield from pool.results()
    finally:
        pool.end()


class _Pool:
    """Forked processes, each with the end of a pipe: numbers of items go in, progress and what was made come out."""

    def __init__(self, make: Callable[[Any, Progress], Any], items: Sequence[Any], progress: Progress) -> None:
        self.make, self.items, self.progress = make, items, progress
        self.processes: list[int] = []
        self.pipes: list[Connection] = []
        self.busy: list[Connection] = []
        self.begun = 0
        self.made: dict[int, tuple[str, Any]] = {}

    def fork(self, jobs: int) -> None:
        """Start the processes, each with its first item."""
        with interrupts_later():
            for _ in range(jobs):
                ours, theirs = multiprocessing.Pipe()
                process = _forked()
                if process == 0:
                    # held open here, they would not tell the other processes that nobody listens any more
                    _serve(self.make, self.items, theirs, [*self.pipes, ours])
                theirs.close()
                self.processes.append(process)
                self.pipes.append(ours)
                self.busy.append(ours)
                self._begin(ours)

    def results(self) -> Iterator[Any]:
        """Yield what the processes made, in the order of the items."""
        for number in range(len(self.items)):
            while number not in self.made:
                for pipe in wait(self.busy):
                    self._hear(cast(Connection, pipe))
            how, made = self.made.pop(number)
            if how == "failed":
                raise made
            yield made

    def end(self) -> None:
        """End the processes, whatever they are at."""
        for pipe in self.pipes:
            pipe.close()
        for process in self.processes:
            os.kill(process, signal.SIGKILL)
            os.waitpid(process, 0)

    def _begin(self, pipe: Connection) -> None:
        """Give a process its next item, if there is one."""
        if self.begun == len(self.items):
            self.busy.remove(pipe)
            return
        try:
            pipe.send(self.begun)
        except OSError:
            raise MrfitError(KILLED) from None
        self.begun += 1

    def _hear(self, pipe: Connection) -> None:
        try:
            number, how, what = pipe.recv()
        except (EOFError, OSError):
            raise MrfitError(KILLED) from None
        if how == "progress":
            self.progress(*what)
            return
        self.made[number] = how, what
        if how == "failed":
            self.begun = len(self.items)
        self._begin(pipe)


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


def _forked() -> int:
    """Fork, and return the new process's number, 0 in that process."""
    with warnings.catch_warnings():
        # of other threads, as that of a progress bar: what they may hold is not asked for, see ``_serve``
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def _serve(
    make: Callable[[Any, Progress], Any], items: Sequence[Any], pipe: Connection, others: Sequence[Connection]
) -> NoReturn:
    """Make items as they are asked for, until nobody asks any more; in a forked process."""
    try:
        # an interrupt goes to all processes of a terminal, and the parent ends this one
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        # a progress bar's own streams have locks, which its thread may have held at the fork
        sys.stdout, sys.stderr = _stream(1), _stream(2)
        for other in others:
            other.close()
        while True:
            number = pipe.recv()
            _make(make, items[number], number, pipe)
    except (EOFError, OSError):
        pass
    finally:
        # nothing of the parent's is to be written, closed or tidied up twice
        os._exit(0)


def _stream(number: int) -> Any:
    """Return a standard stream that keeps no lines back; None, as Python does, where it is closed."""
    try:
        return open(number, "w", buffering=1, closefd=False)
    except OSError:
        return None


def _make(make: Callable[[Any, Progress], Any], item: Any, number: int, pipe: Connection) -> None:
    last = 0.0

    def tell(what: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done == total or now >= last + QUIET:
            last = now
            pipe.send((number, "progress", (what, done, total)))

    try:
        made = pickle.dumps((number, "made", make(item, tell)))
    except BaseException as error:
        made = pickle.dumps((number, "failed", _sendable(error)))
    pipe.send_bytes(made)


def _sendable(error: BaseException) -> BaseException:
    """Return an error with its traceback as a note; one that could not be sent as a RuntimeError that says the same."""
    note = traceback.format_exc()
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(note)
    return error
