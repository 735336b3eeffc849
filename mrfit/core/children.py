"""Start of every process of mrfit, so that none runs code that lies beside logs.

Python looks for modules in the current folder when it is started with ``-m`` or ``-c``, as multiprocessing does too.
No other module starts a process.
"""

import os
import shutil
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

from mrfit.core import temporary
from mrfit.core.current_folder import without_relative

P = ParamSpec("P")
Made = TypeVar("Made")
Process = subprocess.Popen[bytes]

# How processes of a pool begin. A fork of this one would copy locks that other threads hold; one of a server that has
# imported what is needed, and has no threads, costs once a command 0.7 s (fit), 0.5 s (report) or 2 s (discover) of
# processor time, for imports and for compiled kernels, which a fork inherits. Elsewhere than on Linux no fork is safe.
START = "forkserver" if sys.platform == "linux" else "spawn"
_beginning = threading.RLock()


def _changes() -> dict[str, str]:
    """Return the changes to the environment of a child: Python's own folders are this process's."""
    mine = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, sys.path))}
    return {**without_relative(mine), "PYTHONSAFEPATH": "1"}


def program(name: str) -> str | None:
    """Return the path of a program, None where there is none; the current folder is not looked in."""
    found = shutil.which(name, path=without_relative(os.environ).get("PATH", os.defpath))
    return found and os.path.abspath(found)


def run(command: Sequence[str | Path], folder: Path, given: bytes = b"") -> "subprocess.CompletedProcess[bytes]":
    """Run a program in a folder of mrfit's own, and return its exit code and what it printed."""
    around = {**os.environ, **_changes()}
    return subprocess.run(command, cwd=folder, input=given, capture_output=True, check=False, env=around)


def python(module: str) -> list[str]:
    """Return the command that runs a module by this Python."""
    return [sys.executable, "-P", "-m", module]


def answering(module: str) -> Process:
    """Return a Python that runs a module and answers on its standard output what its standard input asks."""
    pipe, null = subprocess.PIPE, subprocess.DEVNULL
    return subprocess.Popen(python(module), stdin=pipe, stdout=pipe, stderr=null, env={**os.environ, **_changes()})


class Pool(ProcessPoolExecutor):
    """Processes to which work is submitted, with a queue in which they tell of it, and a pipe at whose end they end.

    Parameters
    ----------
    jobs
        How many.
    modules
        What they all need to have imported; a server for forks of them does so from now on.
    begin
        Called in each process before its work, with the queue, the end of the pipe and this process's environment.
    """

    def __init__(self, jobs: int, modules: Sequence[str], begin: Callable[..., None]) -> None:
        import multiprocessing

        context: Any = multiprocessing.get_context(START)
        ours: Any = multiprocessing.current_process()
        if ours._config.get("tempdir") is None:
            # where its sockets lie, whose paths are short: a folder of its own would stay when this process is killed
            ours._config["tempdir"] = str(temporary.kept("p"))
        given = dict(os.environ)
        with _environment_of_children():
            if START == "forkserver":
                from multiprocessing import forkserver

                context.set_forkserver_preload(list(modules))
                forkserver.ensure_running()
            self.told = context.SimpleQueue()
            self.ending, self.open = context.Pipe(duplex=False)
            super().__init__(jobs, context, begin, (self.told, self.ending, given))

    def submit(self, fn: Callable[P, Made], /, *args: P.args, **kwargs: P.kwargs) -> "Future[Made]":
        """Have a function called by one of the processes, which begin when they are needed."""
        with _environment_of_children():
            return super().submit(fn, *args, **kwargs)


@contextmanager
def _environment_of_children() -> Iterator[None]:
    """Have the environment of children in here: multiprocessing hands on that of this process."""
    with _beginning:
        changes = _changes()
        before = {name: os.environ.get(name) for name in changes}
        os.environ.update(changes)
        try:
            yield
        finally:
            for name, value in before.items():
                if value is None:
                    del os.environ[name]
                else:
                    os.environ[name] = value


def take_environment(given: dict[str, str]) -> None:
    """Have the environment of the process that started this one, without what only its start needed."""
    from multiprocessing.util import Finalize

    for name in set(_changes()) - set(given):
        os.environ.pop(name, None)
    os.environ.update(given)
    # a process of a pool ends without what `atexit` was told
    Finalize(None, temporary.remove_own, exitpriority=0)
