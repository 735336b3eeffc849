"""The compile policy: bits, IEEE division, and a cache that sees every edit of a kernel source."""

import os
import stat
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from mrfit.core.specs import Array
from mrfit.kernels.jit import (
    _cache_folder,
    address_of,
    array_at,
    bits,
    borrowing,
    call,
    from_bits,
    is_cold,
    kernel,
    length_in_memory,
    tuple_in_memory,
)


@kernel
def halve_exponent_bits(x: float) -> float:
    return from_bits(bits(x) - (1 << 52))


@kernel
def reciprocal(x: float) -> float:
    return 1.0 / x


def test_bits_of_a_float_are_its_ieee_754_bits() -> None:
    assert halve_exponent_bits(3.0) == 1.5
    assert halve_exponent_bits(np.pi) == np.pi / 2


def test_division_by_zero_gives_infinity_instead_of_raising() -> None:
    assert reciprocal(0.0) == np.inf


def test_cache_folder_is_named_after_the_sources() -> None:
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    assert folder.name.rsplit("-", 1)[1].isalnum()


def test_a_folder_without_compiled_kernels_is_cold(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "none"))
    assert is_cold()
    monkeypatch.undo()
    halve_exponent_bits(1.0)
    assert not is_cold()


@pytest.fixture
def no_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A common temporary folder, and a user's folder that cannot be written."""
    (tmp_path / "home").write_text("a file where the folder should be")
    (tmp_path / "tmp").mkdir()
    monkeypatch.setenv("MRFIT_CACHE", str(tmp_path / "home"))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))
    return tmp_path / "tmp"


def is_private(folder: Path) -> bool:
    found = folder.lstat()
    return stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and stat.S_IMODE(found.st_mode) == 0o700


def test_without_a_folder_of_the_user_the_cache_is_private_and_kept(no_home: Path) -> None:
    folder = _cache_folder()
    assert folder.is_relative_to(no_home) and is_private(folder) and is_private(folder.parent)
    assert _cache_folder() == folder


@pytest.mark.parametrize("cache", ["", ".", "cache"])
def test_a_cache_beside_the_logs_is_not_used(cache: str, no_home: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs = no_home.parent / "logs"
    logs.mkdir()
    monkeypatch.chdir(logs)
    for name, value in (("MRFIT_CACHE", cache), ("XDG_CACHE_HOME", cache), ("HOME", "home")):
        monkeypatch.setenv(name, value)
    assert _cache_folder().is_relative_to(no_home)
    monkeypatch.setattr(tempfile, "tempdir", str(logs))
    first, second = _cache_folder(), _cache_folder()
    # what is made anew was not laid there
    assert first != second and is_private(first)


@pytest.mark.parametrize("trap", ["open", "link", "another's", "open within"])
def test_a_cache_that_somebody_else_may_have_made_is_not_used(
    trap: str, no_home: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = _cache_folder()
    if trap == "open":
        usual.parent.chmod(0o777)
    elif trap == "open within":
        usual.chmod(0o777)
    elif trap == "link":
        usual.parent.rename(no_home / "elsewhere")
        usual.parent.symlink_to(no_home / "elsewhere")
    else:
        monkeypatch.setattr(os, "getuid", lambda: 4711)
        (no_home / "mrfit-4711" / usual.name).mkdir(parents=True, mode=0o700)
    folder = _cache_folder()
    monkeypatch.setattr(os, "getuid", lambda: usual.lstat().st_uid)
    assert folder != usual and folder.parent == no_home and is_private(folder)


def test_a_user_s_own_cache_is_used_and_closed_to_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MRFIT_CACHE", str(tmp_path))
    folder = _cache_folder()
    assert folder.parent == tmp_path / "mrfit" and is_private(folder)


INTERRUPTED = """
import os, signal
from llvmlite import binding

# numba's hooks, which LLVM calls whenever it has compiled a module: what is raised in one is printed and forgotten
wire = binding.ExecutionEngine.set_object_cache

def wired(self, notify, getbuffer):
    def interrupted(*arguments):
        os.kill(os.getpid(), signal.SIGINT)
        return notify(*arguments)

    wire(self, interrupted, getbuffer)

binding.ExecutionEngine.set_object_cache = wired
from mrfit.kernels.jit import kernel

@kernel
def twice(x):
    return 2.0 * x

try:
    twice(1.0)
    print("swallowed")
except KeyboardInterrupt:
    print("kept")
print(twice(1.0))
"""


def run_with_cache(folder: Path, script: str) -> "subprocess.CompletedProcess[str]":
    """Run a script whose kernels are cached in a folder."""
    file = folder / "script.py"
    # the cache forgets what it has of a file that is written again
    if not file.exists():
        file.write_text(script)
    environment = {**os.environ, "MRFIT_CACHE": str(folder)}
    environment.pop("NUMBA_CACHE_DIR", None)
    command = [sys.executable, str(folder / "script.py")]
    return subprocess.run(command, capture_output=True, text=True, env=environment, timeout=120)


def test_an_interrupt_during_compilation_is_kept_until_its_end(tmp_path: Path) -> None:
    ran = run_with_cache(tmp_path, INTERRUPTED)
    assert ran.stdout.split() == ["kept", "2.0"], ran.stderr


COMMAND = """
import typer
from mrfit.cli import console
from mrfit.kernels.jit import kernel

app = typer.Typer()

@kernel
def twice(x):
    return 2.0 * x

@kernel
def fourfold(x):
    return twice(twice(x))

def halved(x):
    return 0.5 * x

@app.command()
def command():
    kernel(halved, kept=False)(1.0)
    console.note("of a plug-in")
    fourfold(1.0)
    twice(1)

console.run(app)
"""


def test_a_command_says_once_that_kernels_are_compiled(tmp_path: Path) -> None:
    said = ["of a plug-in", "compiling kernels, kept for later commands"]
    assert run_with_cache(tmp_path, COMMAND).stderr.splitlines() == said
    # now they are there; a plug-in's are compiled by every command
    assert run_with_cache(tmp_path, COMMAND).stderr.splitlines() == said[:1]


def assign(rows: np.ndarray, row: np.ndarray) -> None:
    rows[1] = row


def test_an_array_that_does_not_fit_a_slice_is_refused_by_code_that_compiles_quickly() -> None:
    # code from the cache of an earlier run cannot be inspected
    assigned = kernel(assign, kept=False)
    rows = np.zeros((2, 3))
    assigned(rows, np.arange(3.0))
    assert rows.tolist() == [[0.0, 0.0, 0.0], [0.0, 1.0, 2.0]]
    with pytest.raises(ValueError, match="an array does not fit the slice that it is assigned to"):
        assigned(rows, np.zeros(2))
    # numba's own would put shapes into a text
    assert not [name for name in assigned.inspect_llvm(assigned.signatures[0]).split() if "unicode" in name]


def test_a_private_borrowing_kernel_is_called_by_kernels_and_refuses_python() -> None:
    @partial(kernel, kept=False, counted=False)
    def _more(x: float) -> float:
        return x + 1.0

    @partial(kernel, kept=False)
    def most(x: float) -> float:
        return _more(x) + 1.0

    assert most(1.0) == 3.0
    with pytest.raises(TypeError, match="by kernels alone"):
        _more(1.0)


class _Pair(NamedTuple):
    values: Array
    place: int


_write_pair, _read_pair = tuple_in_memory(_Pair(np.zeros(1), 0))


def _sum_of(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> float:
    pair = _read_pair(past)
    return float(pair.values[pair.place] + array_at(state, 2)[1] + dt)


@borrowing
def summed(address: int, state: Array, memory: Array, dt: float) -> float:
    """Call a function of a tuple in memory."""
    return float(call(address, state, 0, state, 0, state, 0, state, 0, dt, memory, 0))


@kernel
def put(pair: _Pair, memory: Array) -> None:
    """Keep a pair in memory."""
    _write_pair(memory, pair)


def test_a_tuple_in_memory_is_read_by_a_function_called_by_its_address() -> None:
    pair = _Pair(np.array([1.0, 20.0]), 1)
    memory = np.zeros(length_in_memory(pair))
    put(pair, memory)
    pair.values[1] += 1.0
    assert summed(address_of(_sum_of, kept=False, counted=False), np.array([0.0, 300.0]), memory, 0.5) == 321.5
