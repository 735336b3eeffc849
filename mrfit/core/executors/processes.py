"""Processes of this machine: one pool for a command, items of any kind.

Processes are for what holds the interpreter's lock half of its time, as fits and figures do: two threads of these take
as long as one.
"""

import os
import signal
import threading
import time
from collections.abc import Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, wait
from contextlib import contextmanager, suppress
from itertools import islice
from multiprocessing.connection import Connection
from typing import Any

from mrfit.core import children, temporary
from mrfit.core.executors.items import ItemEnd, Make, end_of, made_here, made_of, packed
from mrfit.core.progress import Progress, silent
from mrfit.errors import MrfitError

KILLED = (
    "a worker process has ended: there may be too little memory, or a script may start work outside of "
    "`if __name__ == '__main__':`; try --jobs 1"
)
# Seconds between two messages of a process about its progress, and between two looks at these
QUIET_SECONDS = 0.1


class Processes:
    """So many processes; they are kept for the next call.

    Parameters
    ----------
    jobs
        How many.
    """

    apart = False

    def __init__(self, jobs: int) -> None:
        self.jobs = jobs

    def ends(self, make: Make, items: Iterable[Any], progress: Progress) -> Generator[ItemEnd[Any], None, None]:
        """Yield the ends of items as they come, at most two items per process ahead.

        Of items that were at work when a process was killed, each is made once more by a process alone: the one that
        kills it again has failed, the others have not.
        """
        work = _PoolWork(self.jobs, make, progress)
        try:
            yield from work.ends(items)
        except BaseException:
            work.pool.end()
            raise
        _IDLE.append(work.pool)


class _PoolWork:
    """Items at work in a pool."""

    def __init__(self, jobs: int, make: Make, progress: Progress) -> None:
        self.jobs, self.make, self.progress = jobs, make, progress
        self.pool = _pool(jobs, make.__module__)
        self.waiting: dict[Future[bytes], tuple[int, Any]] = {}

    def ends(self, items: Iterable[Any]) -> Iterator[ItemEnd[Any]]:
        left = iter(enumerate(items))
        while True:
            for place, item in islice(left, 2 * self.jobs - len(self.waiting)):
                yield from self._begin(place, item)
            if not self.waiting:
                return
            yield from self._completed()

    def _begin(self, place: int, item: Any) -> Iterator[ItemEnd[Any]]:
        """Send an item to the pool; yield the end of one that cannot be sent, or that finds the pool broken."""
        sent = packed(self.make, item)
        if sent is None:
            yield made_here(self.make, item, place, self.progress)
            return
        try:
            self.waiting[self.pool.submit(sent, self.progress)] = place, item
        except BrokenExecutor:
            yield from self._one_by_one([*self.waiting.values(), (place, item)])

    def _completed(self) -> Iterator[ItemEnd[Any]]:
        """Wait for one of the items at least."""
        done: set[Future[bytes]] = set()
        while not done:
            done, _ = wait(self.waiting, QUIET_SECONDS, FIRST_COMPLETED)
            self.pool.hear(self.progress)
        killed = []
        for future in [f for f in self.waiting if f in done]:
            place, item = self.waiting.pop(future)
            if isinstance(future.exception(), BrokenExecutor):
                killed.append((place, item))
            else:
                yield self._end(place, item, future.result())
        if killed:
            yield from self._one_by_one([*killed, *self.waiting.values()])

    def _end(self, place: int, item: Any, back: bytes) -> ItemEnd[Any]:
        return end_of(place, back, lambda: made_here(self.make, item, place, self.progress))

    def _one_by_one(self, suspects: list[tuple[int, Any]]) -> Iterator[ItemEnd[Any]]:
        """Yield the ends of items of which one has killed its process, each made by a process alone."""
        self.waiting = {}
        self.pool.end()
        self.pool = _ProcessPool(1, [self.make.__module__])
        for place, item in sorted(suspects, key=lambda one: one[0]):
            sent = packed(self.make, item)
            try:
                future = self.pool.submit(sent or b"", self.progress)
                while not wait([future], QUIET_SECONDS).done:
                    self.pool.hear(self.progress)
                yield self._end(place, item, future.result())
            except BrokenExecutor:
                self.pool.end()
                self.pool = _ProcessPool(1, [self.make.__module__])
                yield ItemEnd(place, error=MrfitError(KILLED))
        self.pool.end()
        self.pool = _ProcessPool(self.jobs, [self.make.__module__])


def _pool(jobs: int, module: str) -> "_ProcessPool":
    """Return processes that an earlier call left, or new ones; a search may need them a hundred times."""
    while _IDLE:
        pool = _IDLE.pop()
        if pool.jobs == jobs and pool.is_alive():
            return pool
        pool.end()
    return _ProcessPool(jobs, [module])


def begin(jobs: int, modules: Sequence[str]) -> None:
    """Begin processes for the next work, which import modules while this process goes on."""
    if jobs > 1:
        _IDLE.append(_ProcessPool(jobs, modules))


class _ProcessPool:
    """Processes that are kept.

    Parameters
    ----------
    jobs
        How many.
    modules
        What they all need to have imported.
    """

    def __init__(self, jobs: int, modules: Sequence[str]) -> None:
        self.jobs = jobs
        self.executor = children.Pool(jobs, modules, _begin)

    def submit(self, sent: bytes, progress: Progress) -> "Future[bytes]":
        """Have an item made by one of the processes."""
        with _uninterrupted():
            return self.executor.submit(_made, sent, _folder(), progress is silent)

    def is_alive(self) -> bool:
        """Return whether the processes are still there."""
        with suppress(BrokenExecutor), _uninterrupted():
            return self.executor.submit(os.getpid).result() > 0
        return False

    def end(self) -> None:
        """End the processes, whatever they are at."""
        self.executor.open.close()
        self.executor.shutdown(wait=True, cancel_futures=True)
        self.executor.ending.close()

    def hear(self, progress: Progress) -> None:
        """Pass on the progress that the processes have told."""
        while not self.executor.told.empty():
            progress(*self.executor.told.get())


# Pools that wait for the next call; what a fork inherits of them is not its own
_IDLE: list[_ProcessPool] = []
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_IDLE.clear)


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
    children.take_environment(environment)
    _TOLD[:] = [told]
    threading.Thread(target=_end_with, args=(ending,), daemon=True).start()


def _end_with(ending: Connection) -> None:
    """End this process, whatever it is at, as soon as the parent closes its end of a pipe, or is gone."""
    with suppress(EOFError, OSError):
        ending.recv()
    temporary.end_process(1)


def _made(sent: bytes, folder: str, quiet: bool) -> bytes:
    """Make an item in a process."""
    if folder:
        with suppress(OSError):
            os.chdir(folder)
    return made_of(sent, silent if quiet else now_and_then(lambda *what: _TOLD[0].put(what)))


def now_and_then(tell: Progress) -> Progress:
    """Return a listener that passes on what is the last of its kind, and one other message in ``QUIET_SECONDS``."""
    last = 0.0

    def told(what: str, done: int, total: int) -> None:
        nonlocal last
        now = time.monotonic()
        if done == total or now >= last + QUIET_SECONDS:
            last = now
            tell(what, done, total)

    return told
