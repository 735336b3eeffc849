"""Choice of an executor, as a command was told, and results in the order of the items."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from typing import Any, TypeVar

from mrfit.core.executors.dask import Dask
from mrfit.core.executors.items import Executor, Made
from mrfit.core.executors.processes import Processes
from mrfit.core.executors.serial import Serial
from mrfit.core.progress import Progress

Item = TypeVar("Item")

# The scheduler that this process was told to send work to, if it was
_told: list[Dask] = []


def use(address: str, shared: bool = False) -> None:
    """Send the work of this process to a Dask scheduler; it is called at the first work there is.

    Parameters
    ----------
    address
        As ``tcp://10.0.0.5:8786``; empty to do the work here again.
    shared
        Whether workers read and write the same paths as this process.

    Raises
    ------
    ConfigError
        If dask.distributed is not installed.
    Unreachable
        If no scheduler answers, or it has no workers.
    """
    for earlier in _told:
        earlier.close()
    _told.clear()
    if address:
        _told.append(Dask(address, shared))


def executor(jobs: int) -> Executor:
    """Return the executor of a command: the scheduler told, else so many processes, else this process."""
    if _told:
        return _told[0]
    return _here(jobs)


def _here(jobs: int) -> Executor:
    """Return the executor of this machine."""
    return Processes(jobs) if jobs > 1 else Serial()


def is_elsewhere() -> bool:
    """Return whether work is sent to a scheduler."""
    return bool(_told)


def is_apart() -> bool:
    """Return whether work is done where other files are seen than here."""
    return bool(_told) and _told[0].apart


def spread(
    make: Callable[[Item, Progress], Made], items: Sequence[Item], jobs: int, progress: Progress
) -> Generator[Made, None, None]:
    """Yield the results of ``make`` for the items, from an executor, in their order.

    If one fails, or the caller is interrupted, the others are ended.

    Parameters
    ----------
    make
        Takes an item and whom to tell of its progress; a function of a module. What it changes besides files is lost;
        what it returns, and the errors that it raises, are sent.
    items
        The items.
    jobs
        Most processes, where no scheduler does the work.
    progress
        Told what the items tell, in this process.

    Raises
    ------
    Unreachable
        If nobody is left to do the work.
    """
    return in_order_by(executor(min(jobs, len(items))), make, items, progress)


def in_processes(
    make: Callable[[Item, Progress], Made], items: Sequence[Item], jobs: int, progress: Progress
) -> Generator[Made, None, None]:
    """Yield as ``spread`` does, by processes of this machine whatever a command was told: figures have its fonts."""
    return in_order_by(_here(min(jobs, len(items))), make, items, progress)


def in_order_by(
    doer: Executor, make: Callable[[Item, Progress], Made], items: Iterable[Item], progress: Progress
) -> Generator[Made, None, None]:
    """Yield the results of an executor in the order of the items, and raise the first error in that order."""
    early: dict[int, Any] = {}
    following = 0
    with closing(doer.ends(make, items, progress)) as ends:
        for end in ends:
            early[end.place] = end
            while following in early:
                first = early.pop(following)
                if first.error is not None:
                    raise first.error
                following += 1
                yield first.made
