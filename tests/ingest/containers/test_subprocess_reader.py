"""What a library does to its own process must not reach ours."""

import errno
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from importlib.util import find_spec
from itertools import chain
from pathlib import Path

import pytest

from mrfit.core import plugins, registry
from mrfit.ingest.containers import subprocess_reader
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.refusal import Refusal, TransientRefusal
from mrfit.ingest.table import Source
from mrfit.ingest.text.head import open_head
from tests.conftest import ROOT
from tests.ingest.samples import sample

PLUGIN = """
import os
import numpy as np
from mrfit.core.specs import ReaderSpec
from mrfit.ingest.table import Column, Table

SPEC = ReaderSpec("fragile", "Tells which process reads it", fragile=True)


def sniff(head):
    return head.raw.startswith(b"fragile")


def read(source):
    return [Table((Column("process", None, np.array([float(os.getpid())]), 0),), np.array([1]), dt=1.0)]
"""


def crash(*_: object) -> None:
    os.abort()


def hang(*_: object) -> None:
    time.sleep(600)


@pytest.fixture
def source(tmp_path: Path) -> Source:
    _, path = sample("matlab", tmp_path)
    return Source(open_head(path), Rules())


def test_a_plugin_named_after_the_process_has_started_reads_there(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    subprocess_reader.read_in_subprocess("matlab", source)
    monkeypatch.setattr(plugins, "_store", plugins.Store())
    monkeypatch.setenv(plugins.VARIABLE, "")
    (tmp_path / "own.py").write_text(PLUGIN)
    plugins.use(tmp_path / "own.py")
    (tmp_path / "log.bin").write_bytes(b"fragile" + bytes(range(200)))
    head = open_head(tmp_path / "log.bin")
    assert registry.load("reader", "fragile").sniff(head)
    (table,) = subprocess_reader.read_in_subprocess("fragile", Source(head, Rules()))
    assert table.columns[0].values[0] not in (0.0, os.getpid())


def test_tables_come_back_whole(source: Source) -> None:
    (table,) = subprocess_reader.read_in_subprocess("matlab", source)
    assert [c.name for c in table.columns] == ["x_F[0]", "x_F[1]"]
    assert table.rows == 240


@pytest.mark.parametrize("code", [errno.ENOMEM, errno.EIO])
def test_a_library_that_cannot_be_loaded_for_want_of_memory_says_so(
    source: Source, monkeypatch: pytest.MonkeyPatch, code: int
) -> None:
    """Python lists the folder of a module before it loads it: a system that refuses the memory ends that listing."""

    def refused(_: Source) -> None:
        raise OSError(code, os.strerror(code))

    monkeypatch.setattr(registry.load("reader", "matlab"), "read", refused)
    with pytest.raises(MemoryError if code == errno.ENOMEM else OSError):
        subprocess_reader.read_tables("matlab", source)


def test_libraries_are_loaded_before_the_memory_of_a_file_is_counted() -> None:
    """Each fragile reader names what it loads, and names nothing that does not exist."""
    specs = [registry.load("reader", name).SPEC for name in registry.names("reader")]
    libraries = {spec.name: spec.libraries for spec in specs if spec.fragile}
    assert len(libraries) == 4 and all(libraries.values())
    for library in chain(*libraries.values()):
        assert find_spec(library), library


def test_a_crash_is_one_refusal_and_the_next_file_is_read(source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(subprocess_reader, "read_tables", crash)
        with pytest.raises(Refusal, match="the matlab library crashes on it"):
            subprocess_reader.read_in_subprocess("matlab", source)
    assert len(subprocess_reader.read_in_subprocess("matlab", source)) == 1


def test_a_small_file_may_take_less_than_half_a_minute(source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    """A long one longer: an hour at 10 kHz has 300 MB, and takes a slow machine minutes."""
    allowed = []
    monkeypatch.setattr(subprocess_reader._worker, "call", lambda seconds, *_: allowed.append(seconds) or [])
    subprocess_reader.read_in_subprocess("matlab", source)
    subprocess_reader.read_in_subprocess("matlab", replace(source, head=replace(source.head, size=300_000_000)))
    assert allowed[0] < 26.0 and allowed[1] > 600.0


@pytest.mark.parametrize("stuck", ["hang", "spin"])
def test_a_hang_ends(stuck: str, source: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that waits ends by the clock, and one that computes by what it computes."""
    with monkeypatch.context() as patch:
        patch.setattr(subprocess_reader, "read_tables", {"hang": hang, "spin": spin}[stuck])
        with pytest.raises(Refusal, match="takes more than 1 s"):
            subprocess_reader.read_in_subprocess("matlab", source, seconds=1.0)
    assert len(subprocess_reader.read_in_subprocess("matlab", source)) == 1


def slow(*_: object) -> str:
    time.sleep(1.5)
    return "done"


def test_waiting_for_other_work_of_the_machine_is_no_hang() -> None:
    worker = subprocess_reader.Worker()
    worker.call(60.0, os.getpid)  # its start takes long itself then
    assert worker.call(1.0, slow) == "done"
    worker.close()


STUCK = """
import os, signal, sys, threading, time
from mrfit.core import plugins, registry
from mrfit.ingest.containers import subprocess_reader
from tests.ingest.containers.test_subprocess_reader import spin
worker = subprocess_reader.Worker()
threading.Thread(target=worker.call, args=(2.0, spin), daemon=True).start()
while worker.process is None:
    time.sleep(0.01)
print(worker.process.pid, flush=True)
time.sleep(1.0)
assert worker.process.poll() is None
os.kill(os.getpid(), signal.SIGKILL)
"""


def spin(*_: object) -> None:
    while True:
        pass


@pytest.mark.slow
def test_a_stuck_library_ends_though_its_command_was_killed() -> None:
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    killed = subprocess.run([sys.executable, "-c", STUCK], capture_output=True, text=True, env=environment)
    assert killed.returncode == -signal.SIGKILL
    worker = Path(f"/proc/{killed.stdout.strip()}")
    for _ in range(100):
        if not worker.exists() or "Z" in worker.joinpath("stat").read_text().split()[2]:
            return
        time.sleep(0.1)
    os.kill(int(killed.stdout), signal.SIGKILL)
    raise AssertionError("it goes on")


@pytest.mark.parametrize(("reader", "library"), [("hdf5", "h5py"), ("tdms", "nptdms"), ("mdf", "asammdf")])
def test_a_missing_extra_is_named_with_its_command(
    reader: str, library: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    _, path = sample(reader, tmp_path)
    monkeypatch.setitem(sys.modules, library, None)  # type: ignore[arg-type]
    with pytest.raises(Refusal) as error:
        registry.load("reader", reader).read(Source(open_head(path), Rules()))
    assert error.value.remedy == f"install it: pip install 'mrfit[{reader}]'"
    assert isinstance(error.value, TransientRefusal)  # read once it is installed


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (ImportError("_philox.so: cannot map zero-fill pages"), MemoryError),
        (SystemError("a call failed and said nothing"), MemoryError),
        (ModuleNotFoundError("No module named 'asammdf'"), ModuleNotFoundError),
    ],
)
def test_a_library_that_cannot_be_loaded_for_want_of_memory_is_no_fault_of_the_reader(
    fault: Exception, said: type[Exception], source: Source, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(_: Source) -> list[object]:
        raise fault

    monkeypatch.setattr(registry.load("reader", "matlab"), "read", read)
    with pytest.raises(said):
        subprocess_reader.read_tables("matlab", source)
