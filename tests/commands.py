"""The command line as a user runs it, each command in a process of its own.

A command takes 0.6 s of processor time to import libraries and 0.2 s for mrfit itself, and the tests run hundreds.
Where a process can be forked, one that has imported both is forked for every command. A fresh command is forked from
one that has imported the libraries, and nothing of mrfit's but what compiles kernels: what it forgets to import is
missed. So is every command run somewhere, as the documented command lines are. What a start from nothing loads is the
matter of ``cli/test_start.py``.
"""

import atexit
import gc
import importlib
import json
import os
import pkgutil
import runpy
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
Done = subprocess.CompletedProcess[bytes]
LIBRARIES = (
    *("numpy", "numpy.f2py", "scipy.fft", "scipy.integrate", "scipy.interpolate", "scipy.linalg", "scipy.ndimage"),
    *("scipy.optimize", "scipy.signal", "scipy.sparse", "scipy.spatial", "scipy.special", "scipy.stats"),
    *("pyarrow.parquet", "pydantic", "typer", "typer._adapters", "rich.table", "rich.progress", "filelock", "numba"),
    *("jinja2", "matplotlib.figure", "matplotlib.backends.backend_svg"),
)
"""What commands import that is not mrfit's."""
AT_START = ("PYTHON", "LC_", "LANG", "HOME", "XDG_", "NUMBA_", "MRFIT_CACHE", "OPENBLAS_", "MPL")
"""Beginnings of the names of variables that Python or a library reads as it starts."""
AROUND: dict[str, str] = {}
"""Environment in which the process that is forked starts: that of all tests, which no single one has changed."""


def run(
    folder: Path,
    *arguments: object,
    env: Mapping[str, str] | None = None,
    timeout: float = 300.0,
    fresh: bool = False,
) -> Done:
    """Run mrfit in a folder and return its exit code and what it printed; a fresh one imports mrfit itself.

    Raises
    ------
    subprocess.TimeoutExpired
        If it has not ended after so many seconds.
    """
    words = list(map(str, arguments))
    given = dict(os.environ if env is None else env)
    if not is_forked(given):
        command = [sys.executable, "-m", "mrfit.cli", *words]
        return subprocess.run(command, cwd=folder, capture_output=True, timeout=timeout, env=given)
    return _server(fresh).run(words, folder, given, timeout)


def is_forked(env: Mapping[str, str]) -> bool:
    """Return whether a command in an environment is forked; what Python reads at its start is as in all tests."""
    return sys.platform == "linux" and _read_at_start(env) == _read_at_start(AROUND)


def text(folder: Path, *arguments: object, **how: Any) -> "subprocess.CompletedProcess[str]":
    """Return the same with what was printed as text."""
    done = run(folder, *arguments, **how)
    output, errors = (printed.decode().replace("\r\n", "\n") for printed in (done.stdout, done.stderr))
    return subprocess.CompletedProcess(done.args, done.returncode, output, errors)


def _read_at_start(environment: Mapping[str, str]) -> dict[str, str]:
    return {n: value for n, value in environment.items() if n.startswith(AT_START) and n != "PYTHONPATH"}


@cache
def _server(fresh: bool) -> "_Server":
    return _Server(fresh)


class _Server:
    """The process that is forked; it ends where its standard input does."""

    def __init__(self, fresh: bool) -> None:
        command, pipe = [sys.executable, "-m", "tests.commands", *(["fresh"] if fresh else [])], subprocess.PIPE
        self.process = subprocess.Popen(command, cwd=ROOT, stdin=pipe, stdout=pipe, text=True, env=AROUND)
        atexit.register(self.process.communicate)

    def run(self, words: list[str], folder: Path, env: Mapping[str, str], timeout: float) -> Done:
        asked, told = self.process.stdin, self.process.stdout
        assert asked and told
        with tempfile.NamedTemporaryFile() as out, tempfile.NamedTemporaryFile() as err:
            request = _Request(words, str(folder), dict(env), out.name, err.name, timeout)
            asked.write(json.dumps(vars(request)) + "\n")
            asked.flush()
            answer = told.readline().strip()
            output, errors = out.read(), err.read()
        if answer == "late":
            raise subprocess.TimeoutExpired(words, timeout, output, errors)
        return subprocess.CompletedProcess(words, int(answer), output, errors)


@dataclass(frozen=True)
class _Request:
    """A command, the folder and environment in which it runs, and the files for what it prints."""

    words: list[str]
    folder: str
    env: dict[str, str]
    out: str
    err: str
    timeout: float


def _serve() -> None:
    """Fork for every request of standard input; print the exit code of each command, or that it was late."""
    _import_libraries()
    if "fresh" not in sys.argv:
        _import_mrfit()
    # the collector of a fork leaves alone what it shares
    gc.freeze()
    for line in sys.stdin:
        request = _Request(**json.loads(line))
        child = os.fork()
        if not child:
            _become(request)
            runpy.run_module("mrfit.cli", run_name="__main__", alter_sys=True)
            return
        print(_end_of(child, request.timeout), flush=True)


def _import_libraries() -> None:
    # kernels are compiled into the folder that it names before it imports numba
    from numba.core.registry import cpu_target

    import mrfit.kernels.jit  # noqa: F401

    for name in LIBRARIES:
        __import__(name)
    # as at the call of a first kernel
    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()


def _import_mrfit() -> None:
    import mrfit

    for module in pkgutil.walk_packages(mrfit.__path__, "mrfit."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    # the registry of units takes 0.2 s of each process that reads a log
    mrfit.ingest.meaning.units.known("N")


def _become(request: _Request) -> None:
    """Be a process that was started for a command."""
    own = _paths(os.environ)
    os.chdir(request.folder)
    kernels = os.environ["NUMBA_CACHE_DIR"]
    os.environ.clear()
    os.environ.update(request.env | {"NUMBA_CACHE_DIR": kernels})
    for path, stream in ((os.devnull, 0), (request.out, 1), (request.err, 2)):
        file = os.open(path, os.O_RDONLY if stream == 0 else os.O_WRONLY)
        os.dup2(file, stream)
        os.close(file)
    # ``python -m`` puts the folder it is called in before all others
    sys.path[:] = [request.folder, *_paths(request.env), *sys.path[1 + len(own) :]]
    sys.argv = ["mrfit", *request.words]


def _paths(environment: Mapping[str, str]) -> list[str]:
    return [path for path in environment.get("PYTHONPATH", "").split(os.pathsep) if path]


def _end_of(child: int, timeout: float) -> int | str:
    def late(*_: object) -> None:
        raise TimeoutError

    signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, timeout)
    try:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    except TimeoutError:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return "late"
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


if __name__ == "__main__":
    _serve()
