"""Read fragile binary formats in a process of its own, since their libraries crash or hang on damaged files."""

import multiprocessing
import os
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

from mrfit import registry
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table

SECONDS = 600.0
"""Longest time a file may take."""

_lock = threading.Lock()
_workers: list[ProcessPoolExecutor] = []


def read_apart(reader: str, source: Source, seconds: float = SECONDS) -> list[Table]:
    """Return what a reader makes of a file, read in a worker process.

    Raises
    ------
    Refusal
        If the reader refuses the file, or its library crashes on it or does not come to an end.
    """
    path = source.head.path
    with _lock:
        if not _workers:
            _workers.append(ProcessPoolExecutor(1, multiprocessing.get_context("spawn"), _apart_from_terminal))
        try:
            return _workers[0].submit(_read, reader, source).result(timeout=seconds)
        except BrokenProcessPool:
            _end()
            raise Refusal(path, f"damaged: the {reader} library crashes on it", "copy or save it again") from None
        except TimeoutError:
            _end()
            raise Refusal(path, f"damaged: reading it takes more than {seconds:g} s", "copy or save it again") from None


def _read(reader: str, source: Source) -> list[Table]:
    tables: list[Table] = registry.load("reader", reader).read(source)
    return tables


def _apart_from_terminal() -> None:
    """Keep what a crashing library prints away from the user's terminal."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)


def _end() -> None:
    worker = _workers.pop()
    for process in list((worker._processes or {}).values()):
        process.kill()  # a hanging library does not hear anything else
    worker.shutdown(wait=False, cancel_futures=True)
