"""Read fragile binary formats in a process of its own, since their libraries crash or hang on damaged files."""

import atexit
import contextlib
import errno
import os
import pickle
import signal
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from typing import IO, Any

from mrfit.core import children, plugins, registry
from mrfit.ingest.containers.memory import held_to, out_of_memory
from mrfit.ingest.refusal import Refusal, TransientRefusal
from mrfit.ingest.table import Source, Table

READING_SECONDS = 25.0
SECONDS_FOR_A_MEGABYTE = 5.0
"""A file may take so much computing, and so much more for each megabyte: damaged ones lead libraries in circles."""
WAITING = 4.0
"""How many times longer it may take by the clock, on a machine with much else to do."""
HAS_TIMER = hasattr(signal, "setitimer")
"""Whether the system counts computing; else the clock has to do."""


def read_tables(reader: str, source: Source, named: str | None = None) -> list[Table]:
    """Return the tables that a reader makes of a file, in this process, which may take ``source.memory`` for it.

    ``named`` are the plug-in files of the process that asks, which may have been named since this one was started.
    """
    if named is not None:
        os.environ[plugins.VARIABLE] = named
    module = registry.load("reader", reader)
    for library in module.SPEC.libraries:  # loaded before memory is counted; the reader says what to do without one
        with contextlib.suppress(ImportError):
            import_module(library)
    try:
        with held_to(source.memory):
            tables: list[Table] = module.read(source)
    except ModuleNotFoundError:
        raise
    except (SystemError, ImportError) as error:
        # compiled code that is refused memory may fail without saying why, and a library may not be loaded
        raise MemoryError from error
    except OSError as error:
        if error.errno == errno.ENOMEM:
            raise MemoryError from error
        raise
    return tables


class Worker:
    """A second Python that calls functions for this one; started at the first call, and again after a crash."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.process: children.Process | None = None

    def call(self, seconds: float, function: Callable[..., Any], *arguments: object) -> Any:
        """Return ``function(*arguments)``, or raise what it raises.

        Raises
        ------
        EOFError
            If the process dies.
        TimeoutError
            If the function computes for longer than ``seconds``; the process is then ended.
        """
        with self.lock:
            if self.process is None or self.process.poll() is not None:
                self.process = children.answering("mrfit.ingest.containers.subprocess_reader")
            process, late = self.process, threading.Event()
            watch = threading.Timer(WAITING * seconds if HAS_TIMER else seconds, _stop, (process, late))
            watch.start()
            try:
                assert process.stdin and process.stdout
                _send(process.stdin, (seconds, function, arguments))
                sound, result = pickle.load(process.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                _end(process)
                self.process = None
                timed = late.is_set() or HAS_TIMER and process.returncode == -signal.SIGPROF
                raise (TimeoutError() if timed else EOFError()) from None
            finally:
                watch.cancel()
        if not sound:
            raise result
        return result

    def close(self) -> None:
        """End the process."""
        if self.process is not None:
            _end(self.process)
            self.process = None


def _stop(process: children.Process, late: threading.Event) -> None:
    late.set()
    process.kill()


def _end(process: children.Process) -> None:
    process.kill()
    for pipe in (process.stdin, process.stdout):
        with contextlib.suppress(OSError):
            if pipe:
                pipe.close()
    process.wait()


def _send(pipe: IO[bytes], value: object) -> None:
    pickle.dump(value, pipe, protocol=pickle.HIGHEST_PROTOCOL)
    pipe.flush()


def serve() -> None:
    """Answer calls from standard input until it closes."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints must not get between the answers
    while True:
        try:
            seconds, function, arguments = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        _end_after(seconds)
        try:
            answer = (True, function(*arguments))
        except Exception as error:  # handed to the caller, whatever it is
            answer = (False, error)
        _end_after(0.0)
        _send(answers, answer)


def _end_after(seconds: float) -> None:
    """Let the system end this process when it has computed for so long, whether or not the caller lives; 0: never."""
    if HAS_TIMER:
        signal.setitimer(signal.ITIMER_PROF, seconds)


_worker = Worker()
atexit.register(_worker.close)


def read_in_subprocess(reader: str, source: Source, seconds: float | None = None) -> list[Table]:
    """Return the tables that a reader makes of a file, read in the worker process.

    Raises
    ------
    Refusal
        If the reader refuses the file, or its library crashes on it, does not come to an end or asks for more memory
        than the file may take.
    """
    path, remedy, limit = source.head.path, "copy or save it again", source.room().limit
    if seconds is None:
        seconds = READING_SECONDS + SECONDS_FOR_A_MEGABYTE * source.head.size / 1e6
    try:
        named = os.environ.get(plugins.VARIABLE, "")
        tables: list[Table] = _worker.call(seconds, read_tables, reader, replace(source, memory=limit), named)
    except MemoryError:
        raise out_of_memory(path, limit) from None
    except EOFError:
        raise Refusal(path, f"damaged: the {reader} library crashes on it", remedy) from None
    except TimeoutError:
        raise TransientRefusal(path, f"damaged: reading it takes more than {seconds:.0f} s", remedy) from None
    return tables


if __name__ == "__main__":
    serve()
