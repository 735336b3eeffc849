"""Work on many items by several workers, with results in the order of the items: how many workers changes nothing.

Threads are for what reads and unpacks files, and shares memory. Processes are for what holds the interpreter's lock
half of its time, as fits and figures do: two threads of these take as long as one.
"""

import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import traceback
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from itertools import islice
from multiprocessing.connection import Connection
from threading import Event
from typing import Any, TypeVar, cast

from mrfit.core.progress import Progress, silent
from mrfit.errors import MrfitError

Item = TypeVar("Item")
Made = TypeVar("Made")

# How processes begin. A fork of this one would copy locks that other threads hold; one of a server that has imported
# what is needed, and has no threads, costs once a command 0.7 s (fit), 0.5 s (report) or 2 s (discover) of processor
# time, for imports and for compiled kernels, which a fork inherits. Elsewhere than on Linux no fork is safe.
START = "forkserver" if sys.platform == "linux" else "spawn"
# How an item went in a process
MADE, FAILED, UNKNOWN = "made", "failed", "unknown"
# What ends a command
ENDING = (signal.SIGINT, signal.SIGTERM)
KILLED = (
    "a worker process has ended: there may be too little memory, or a script may start work outside of "
    "`if __name__ == '__main__':`; try --jobs 1"
)
# Seconds between two messages of a process about its progress, and between two looks at these
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
    """Yield what ``make`` makes of the items by processes, in their order; here, where it cannot be sent to one.

    If one fails, or the caller is interrupted, the others are ended.

    Parameters
    ----------
    make
        Takes an item and whom to tell of its progress; a function of a module. What it changes besides files is lost;
        what it returns, and the errors that it raises, are sent.
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
    if jobs < 2 or _packed(make, items[0]) is None:
        yield from (make(item, progress) for item in items)
        return
    pool = _pool(jobs, make.__module__)
    try:
        yield from _results(pool, make, items, progress)
    except BaseException:
        pool.end()
        raise
    _IDLE.append(pool)


def _results(
    pool: "_Pool", make: Callable[[Item, Progress], Made], items: Sequence[Item], progress: Progress
) -> Iterator[Made]:
    """Yield what a pool makes of the items in their order, at most two items per process ahead."""
    waiting: deque[tuple[Item, Future[bytes] | None]] = deque()
    left = iter(items)
    while True:
        for item in islice(left, 2 * pool.jobs - len(waiting)):
            packed = _packed(make, item)
            waiting.append((item, None if packed is None else pool.submit(packed, progress)))
        if not waiting:
            return
        item, future = waiting.popleft()
        how, made = (UNKNOWN, None) if future is None else pool.result(future, progress)
        if how == FAILED:
            raise cast(BaseException, made)
        yield make(item, progress) if how == UNKNOWN else cast(Made, made)


def _packed(make: Callable[[Item, Progress], Made], item: Item) -> bytes | None:
    """Return a function and its item as they are sent; None if they cannot be, as what was defined in a function."""
    try:
        return pickle.dumps((make, item))
    except (pickle.PicklingError, TypeError, AttributeError):
        return None


def _pool(jobs: int, module: str) -> "_Pool":
    """Return processes that an earlier call left, or new ones; a search may need them a hundred times."""
    while _IDLE:
        pool = _IDLE.pop()
        if pool.jobs == jobs and pool.is_alive():
            return pool
        pool.end()
    return _Pool(jobs, module)


class _Pool:
    """Processes with a way to tell of their progress, and a pipe at whose end they end.

    Parameters
    ----------
    jobs
        How many.
    module
        What they all need to have imported.
    """

    def __init__(self, jobs: int, module: str) -> None:
        self.jobs = jobs
        context: Any = multiprocessing.get_context(START)
        if START == "forkserver":
            context.set_forkserver_preload([module])
        self.told = context.SimpleQueue()
        self.ending, self.open = context.Pipe(duplex=False)
        begin = (self.told, self.ending, dict(os.environ))
        self.executor = ProcessPoolExecutor(jobs, context, _begin, begin)

    def submit(self, packed: bytes, progress: Progress) -> "Future[bytes]":
        """Have an item made by one of the processes."""
        with _killed(), _uninterrupted():
            return self.executor.submit(_made, packed, _folder(), progress is silent)

    def result(self, future: "Future[bytes]", progress: Progress) -> tuple[str, Any]:
        """Return how an item was made, and what, telling of progress while it is."""
        while not future.done():
            self._hear(progress)
            wait([future], QUIET)
        self._hear(progress)
        with _killed():
            return cast(tuple[str, Any], pickle.loads(future.result()))

    def is_alive(self) -> bool:
        """Return whether the processes are still there."""
        with suppress(BrokenExecutor), _uninterrupted():
            return self.executor.submit(os.getpid).result() > 0
        return False

    def end(self) -> None:
        """End the processes, whatever they are at."""
        self.open.close()
        self.executor.shutdown(wait=True, cancel_futures=True)
        self.ending.close()

    def _hear(self, progress: Progress) -> None:
        while not self.told.empty():
            progress(*self.told.get())


# Pools that wait for the next call; what a fork inherits of them is not its own
_IDLE: list[_Pool] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_IDLE.clear)


@contextmanager
def _killed() -> Iterator[None]:
    """Say what it means that a process has ended by itself."""
    try:
        yield
    except BrokenExecutor:
        raise MrfitError(KILLED) from None


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Keep interrupts from processes that begin in here, which the parent ends, until they ignore them."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _folder() -> str:
    """Return the current folder; empty where it has been removed."""
    try:
        return os.getcwd()
    except OSError:
        return ""


# In a process: whom to tell of progress
_TOLD: list[Any] = []


def _begin(told: Any, ending: Connection, environment: dict[str, str]) -> None:
    """Prepare a process."""
    # an interrupt goes to all processes of a terminal, and the parent ends this one
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.update(environment)
    _TOLD[:] = [told]
    threading.Thread(target=_end_with, args=(ending,), daemon=True).start()


def _end_with(ending: Connection) -> None:
    """End this process, whatever it is at, as soon as the parent closes its end of a pipe, or is gone."""
    with suppress(EOFError, OSError):
        ending.recv()
    os._exit(1)


def _made(packed: bytes, folder: str, quiet: bool) -> bytes:
    """Make an item in a process: return how that went, and what came of it, as it is sent."""
    last = 0.0

    def tell(what: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done == total or now >= last + QUIET:
            last = now
            _TOLD[0].put((what, done, total))

    try:
        make, item = pickle.loads(packed)
    except Exception:
        # of what the parent has and this process does not, as a model that a notebook defines
        return pickle.dumps((UNKNOWN, None))
    try:
        if folder:
            os.chdir(folder)
        return pickle.dumps((MADE, make(item, silent if quiet else tell)))
    except BaseException as error:
        return pickle.dumps((FAILED, _sendable(error)))


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


def _sendable(error: BaseException) -> BaseException:
    """Return an error with its traceback as a note; one that could not be sent as a RuntimeError that says the same."""
    note = traceback.format_exc()
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        error = RuntimeError(f"{type(error).__name__}: {error}")
    error.add_note(note)
    return error
