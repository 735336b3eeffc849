"""Workers of a Dask scheduler, on other machines as well.

A task that a worker did not end, since it was killed, is given to another one by the scheduler. What is sent and what
comes back are bytes, so that a worker without this mrfit says so in words.
"""

import ctypes
import hashlib
import logging
import os
import pickle
import queue
import sys
import threading
import uuid
import warnings
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from importlib.metadata import version
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mrfit.core.executors.items import ItemEnd, Make, end_of, made_here, made_of, packed
from mrfit.core.executors.processes import QUIET_SECONDS, now_and_then
from mrfit.core.progress import Progress, silent
from mrfit.errors import ConfigError, MrfitError, Unreachable

if TYPE_CHECKING:
    from distributed import Client, Future

# Seconds in which a scheduler has to answer, and a worker to be there
SCHEDULER_PATIENCE = 10.0
# Items sent ahead for each thread of a worker, so that none waits for the way there and back
ITEMS_AHEAD = 2
# Least items sent ahead, while workers come and go
LEAST_AHEAD = 4
# What decides about the last digit of a result
DECIDING = ("numpy", "scipy", "numba")
# Options of glibc's mallopt, and the bytes up to which freed memory is kept: the most it takes for either
M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, KEPT_BYTES = -1, -3, 1 << 25
# The folder a process works in is one for all its threads
_one_at_a_time = threading.Lock()


class Dask:
    """Workers of a scheduler.

    Parameters
    ----------
    address
        Of the scheduler, as ``tcp://10.0.0.5:8786``.
    shared
        Whether its workers read and write the same paths as this process.

    Raises
    ------
    ConfigError
        If dask.distributed is not installed.
    Unreachable
        If no scheduler answers, or it has no workers.
    """

    def __init__(self, address: str, shared: bool) -> None:
        self.address, self.apart = address, not shared
        self._client: Client | None = None
        self._connected()

    def ends(self, make: Make, items: Iterable[Any], progress: Progress) -> Generator[ItemEnd[Any], None, None]:
        """Yield the ends of items as they come, two items per thread of the workers ahead.

        Raises
        ------
        Unreachable
            If no scheduler answers, it has no workers, or is gone.
        """
        client = self._connected()
        work = _SchedulerWork(self, client, make, progress)
        try:
            with work.telling():
                yield from work.ends(items)
        finally:
            work.cancel()

    def _connected(self) -> "Client":
        if self._client is None:
            try:
                from distributed import Client
            except ImportError:
                raise ConfigError("--on needs dask.distributed: python -m pip install 'mrfit[dask]'") from None
            # what becomes of a connection is said in one line
            for name in [n for n in logging.root.manager.loggerDict if n.startswith("distributed")]:
                logging.getLogger(name).setLevel(logging.CRITICAL + 1)
            try:
                self._client = Client(self.address, timeout=SCHEDULER_PATIENCE, set_as_default=False, name="mrfit")
            except (OSError, ValueError, TimeoutError) as error:
                text = f"{type(error).__name__}: {error}".splitlines()[0][:120]
                raise Unreachable(
                    f"--on {self.address}: no Dask scheduler answers ({text}); start one with `dask scheduler`, or "
                    "leave --on out"
                ) from None
            try:
                self._client.wait_for_workers(1, timeout=SCHEDULER_PATIENCE)
            except TimeoutError:
                self.close()
                raise Unreachable(
                    f"--on {self.address}: the scheduler has no workers; start some with `dask worker {self.address}`"
                ) from None
        return self._client

    def close(self) -> None:
        """Leave the scheduler."""
        if self._client is not None:
            with suppress(Exception):
                self._client.close(timeout=1.0)
            self._client = None

    def gone(self) -> MrfitError:
        """Return the message on a scheduler that is no longer there."""
        self.close()
        return Unreachable(
            f"--on {self.address}: the Dask scheduler is gone; the work done so far is kept: start it and its workers "
            "again and repeat the command, or repeat it without --on"
        )


class _SchedulerWork:
    """Items at work on a scheduler."""

    def __init__(self, dask: Dask, client: "Client", make: Make, progress: Progress) -> None:
        self.dask, self.client, self.make, self.progress = dask, client, make, progress
        self.topic = f"mrfit-{uuid.uuid4().hex}"
        self.waiting: dict[str, tuple[Future, int, Any]] = {}
        self.done: queue.SimpleQueue[str] = queue.SimpleQueue()
        self.heard: queue.SimpleQueue[tuple[str, int, int]] = queue.SimpleQueue()

    @contextmanager
    def telling(self) -> Iterator[None]:
        """Listen to what the workers tell of their progress."""
        if self.progress is silent:
            yield
            return
        self.client.subscribe_topic(self.topic, lambda event: self.heard.put(tuple(event[1])))
        try:
            yield
        finally:
            with suppress(Exception):
                self.client.unsubscribe_topic(self.topic)

    def ends(self, items: Iterable[Any]) -> Iterator[ItemEnd[Any]]:
        left = iter(enumerate(items))
        while True:
            for place, item in islice(left, max(0, self._ahead() - len(self.waiting))):
                sent = packed(self.make, item)
                if sent is None:
                    yield made_here(self.make, item, place, self.progress)
                else:
                    self._submit(sent, place, item)
            if not self.waiting:
                return
            yield from self._completed()

    def _ahead(self) -> int:
        with suppress(Exception):
            threads = sum(w["nthreads"] for w in self.client.scheduler_info(n_workers=-1)["workers"].values())
            return max(ITEMS_AHEAD * int(threads), LEAST_AHEAD)
        return LEAST_AHEAD

    def _submit(self, sent: bytes, place: int, item: Any) -> None:
        task = _Task(sent, "" if self.dask.apart else _folder(), "" if self.progress is silent else self.topic, _here())
        key = f"{self.topic}-{place}"
        with warnings.catch_warnings():
            # of its size: data of which a worker was the only holder would be lost with it
            warnings.simplefilter("ignore")
            try:
                future = self.client.submit(_made_there, pickle.dumps(task), key=key, pure=False)
            except Exception:
                raise self.dask.gone() from None
        self._wait_for(key, future, place, item)

    def _wait_for(self, key: str, future: "Future", place: int, item: Any) -> None:
        self.waiting[key] = future, place, item
        future.add_done_callback(lambda one: self.done.put(one.key))

    def _completed(self) -> Iterator[ItemEnd[Any]]:
        """Wait for one of the items."""
        from distributed import KilledWorker

        key = ""
        while not key:
            with suppress(queue.Empty):
                key = self.done.get(timeout=QUIET_SECONDS)
            while not self.heard.empty():
                self.progress(*self.heard.get())
        future, place, item = self.waiting.pop(key)
        if future.status in ("lost", "pending"):
            # the worker that held the result was killed: another one makes it again
            self._wait_for(key, future, place, item)
            return
        if future.status == "cancelled":
            raise self.dask.gone()
        try:
            back = future.result(timeout=None)
        except KilledWorker:
            yield ItemEnd(place, error=MrfitError(_killed(self.dask.address)))
            return
        except Exception as error:
            if self.client.status != "running" or future.status == "cancelled":
                raise self.dask.gone() from None
            yield ItemEnd(place, error=_unfit(self.dask.address, error))
            return
        yield end_of(place, back, lambda: made_here(self.make, item, place, self.progress))

    def cancel(self) -> None:
        """Take back what has not ended."""
        futures = [future for future, _, _ in self.waiting.values()]
        self.waiting = {}
        if futures:
            with suppress(Exception):
                self.client.cancel(futures, force=True)


def _killed(address: str) -> str:
    return (
        f"--on {address}: every worker that took this work was killed: there may be too little memory for it; start "
        "workers with more, or leave --on out"
    )


def _unfit(address: str, error: Exception) -> MrfitError:
    """Return the message on a worker that could not even begin."""
    if isinstance(error, MrfitError):
        return error
    text = f"{type(error).__name__}: {error}".splitlines()[0][:160]
    return MrfitError(f"--on {address}: a worker could not begin ({text}); install the same mrfit there as here")


@dataclass(frozen=True)
class _Versions:
    """Versions that have to be the same for the same bytes."""

    packages: tuple[tuple[str, str], ...]
    code: str


@cache
def _here() -> _Versions:
    root = Path(__file__).parents[2]
    digest = hashlib.sha256()
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return _Versions(tuple((p, version(p)) for p in DECIDING), digest.hexdigest())


@dataclass(frozen=True)
class _Task:
    """Message to a worker: an item, the folder to be in, the topic to tell of progress, what has to be the same."""

    sent: bytes
    folder: str
    topic: str
    versions: _Versions


@cache
def _one_blas_thread() -> None:
    """Let BLAS use one thread in this worker from now on, as it does in a command: others add in another order.

    For the time of a task alone it could not be: another thread of the worker may be at one.
    """
    # what is limited has to be loaded before
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    threadpool_limits(limits=1, user_api="blas")


@cache
def _freed_memory_kept() -> None:
    """Let malloc keep what is freed for the next array, as it does in a command.

    A nanny has it return everything beyond 64 kB at once (MALLOC_TRIM_THRESHOLD_), so that every array of a simulation
    is mapped again: 300 times the page faults, and a fit takes 1.6 times as long.
    """
    if sys.platform != "linux" or "MALLOC_TRIM_THRESHOLD_" not in os.environ:
        return
    libc = ctypes.CDLL(None)
    if hasattr(libc, "mallopt"):
        libc.mallopt(M_TRIM_THRESHOLD, KEPT_BYTES)
        libc.mallopt(M_MMAP_THRESHOLD, KEPT_BYTES)


def _made_there(task: bytes) -> bytes:
    """Make an item in a worker."""
    from distributed import get_worker

    _one_blas_thread()
    _freed_memory_kept()
    asked: _Task = pickle.loads(task)
    worker = get_worker()
    if asked.versions != _here():
        theirs, ours = dict(asked.versions.packages), dict(_here().packages)
        other = next((f"{p} {ours[p]}, not {theirs[p]}" for p in theirs if theirs[p] != ours[p]), "another mrfit")
        raise MrfitError(f"the Dask worker {worker.address} has {other}; install the same there as here")

    def tell(*what: object) -> None:
        worker.log_event(asked.topic, what)

    progress = now_and_then(tell) if asked.topic else silent
    if not asked.folder:
        return made_of(asked.sent, progress)
    with _one_at_a_time:
        os.chdir(asked.folder)
        return made_of(asked.sent, progress)


def _folder() -> str:
    return os.getcwd()
