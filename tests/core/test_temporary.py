"""Temporary folders go with their process, or at the next start; nobody else's are touched."""

import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from mrfit.core import temporary
from mrfit.core.executors.order import in_processes
from mrfit.core.progress import Progress, silent
from tests.conftest import ROOT

unix = pytest.mark.skipif(sys.platform == "win32", reason="the system opens locks of a killed process on Unix")
KEEPS = """
import sys
from mrfit.core import temporary
made = temporary.kept("test")
(made / "file").write_text("1")
print(made, flush=True)
sys.stdin.read()
"""
HAS_PROCESSES = """
import sys
from mrfit.core.executors.order import in_processes
from mrfit.core.progress import silent
from tests.core.test_temporary import kept_there

if __name__ == "__main__":
    made = in_processes(kept_there, ["a", "b", "c"], 2, silent)
    print(next(made), flush=True)
    sys.stdin.read()
"""


@pytest.fixture
def common(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A common temporary folder of this test alone, in a process that has no other: a pool of it would need that."""
    monkeypatch.setattr(temporary, "_mine", {})
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    return tmp_path


def kept_there(item: str, told: Progress) -> str:
    return str(temporary.kept("test"))


def started(program: str) -> tuple["subprocess.Popen[str]", Path]:
    pipe = subprocess.PIPE
    process = subprocess.Popen([sys.executable, "-c", program], stdin=pipe, stdout=pipe, text=True, cwd=ROOT)
    assert process.stdout
    return process, Path(process.stdout.readline().strip())


def made_old(common: Path) -> list[Path]:
    """Make all folders older than one that is just being made, and return them."""
    folders = [p for p in common.iterdir() if p.is_dir() and not p.is_symlink()]
    for path in [p for f in folders for p in (f / temporary.LOCK, f) if p.exists()]:
        os.utime(path, (time.time() - 3600.0,) * 2)
    return folders


def test_a_folder_is_removed_after_its_use(common: Path) -> None:
    with pytest.raises(ValueError, match="x"), temporary.folder("test") as made:
        assert made.parent == common and made.is_dir()
        (made / "deeper").mkdir()
        raise ValueError("x")
    assert not list(common.iterdir())


@unix
def test_a_folder_ends_with_its_process_and_one_of_a_killed_process_at_the_next_start(common: Path) -> None:
    process, made = started(KEEPS)
    assert (made / "file").is_file()
    process.communicate("")
    assert process.returncode == 0 and not made.exists()
    process, made = started(KEEPS)
    # it lives, however old the folder is
    made_old(common)
    temporary.remove_left()
    assert (made / "file").is_file()
    process.kill()
    process.communicate()
    temporary.remove_left()
    assert not made.exists()


@unix
def test_one_that_was_just_made_is_left(common: Path) -> None:
    process, made = started(KEEPS)
    process.kill()
    process.communicate()
    temporary.remove_left()
    assert made.exists()


@unix
def test_processes_leave_no_folder_when_they_end_or_their_parent_is_killed(common: Path) -> None:
    process, _ = started(HAS_PROCESSES)
    process.communicate("")
    assert process.returncode == 0 and not list(common.iterdir())
    process, _ = started(HAS_PROCESSES)
    assert list(common.iterdir()) and not [p for p in common.iterdir() if p.name.startswith("pymp-")]
    process.send_signal(signal.SIGKILL)
    process.communicate()
    deadline = time.monotonic() + 20.0
    while list(common.iterdir()) and time.monotonic() < deadline:
        # its processes end as they notice
        time.sleep(0.1)
        made_old(common)
        temporary.remove_left()
    assert not [(f, sorted(f.iterdir())) for f in common.iterdir()]


@unix
def test_a_process_that_is_ended_leaves_no_folder_that_nobody_knows(
    common: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    is_made, ended = threading.Event(), threading.Event()

    def mkdtemp(prefix: str) -> str:
        made = common / f"{prefix}abcdefgh"
        made.mkdir(0o700)
        is_made.set()
        ended.wait(0.2)
        return str(made)

    def end(code: int) -> None:
        assert [(made / temporary.LOCK).is_file() for made in common.iterdir()] == [True]
        ended.set()

    monkeypatch.setattr(tempfile, "mkdtemp", mkdtemp)
    monkeypatch.setattr(os, "_exit", end)
    making = threading.Thread(target=temporary.kept, args=("test",))
    making.start()
    is_made.wait()
    temporary.end_process(1)
    making.join()
    assert ended.is_set()
    temporary.remove_own()
    assert not list(common.iterdir())


@unix
def test_a_folder_whose_removal_is_cut_short_still_has_its_file(common: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = temporary.kept("test")
    (made / "deeper").mkdir()
    for k in range(20):
        (made / f"{k}").touch()
        (made / "deeper" / f"{k}").touch()
    unlink, beside = os.unlink, list[str]()

    def watched(path: str, **more: int) -> None:
        if Path(path).name == temporary.LOCK:
            beside.extend(p.name for p in made.iterdir() if p.name != temporary.LOCK)
        unlink(path, **more)

    monkeypatch.setattr(os, "unlink", watched)
    temporary.remove_own()
    assert not beside and not made.exists()


def _other_name(folder: Path) -> None:
    folder.rename(folder.with_name("mrfit-mine"))


def _open_to_others(folder: Path) -> None:
    folder.chmod(0o755)


def _link(folder: Path) -> None:
    target = folder.with_name("target")
    folder.rename(target)
    folder.symlink_to(target)


def _no_lock(folder: Path) -> None:
    (folder / temporary.LOCK).unlink()


def _linked_lock(folder: Path) -> None:
    (folder / temporary.LOCK).unlink()
    (folder / temporary.LOCK).symlink_to(folder / "file")


@unix
@pytest.mark.parametrize("change", [_other_name, _open_to_others, _link, _no_lock, _linked_lock])
def test_what_may_be_another_s_is_left(change: Callable[[Path], None], common: Path) -> None:
    process, made = started(KEEPS)
    process.kill()
    process.communicate()
    change(made)
    made_old(common)
    temporary.remove_left()
    assert [p for p in common.rglob("file") if p.is_file()]


def test_a_process_of_a_pool_leaves_none_behind(common: Path) -> None:
    assert len(set(in_processes(kept_there, ["a", "b"], 2, silent))) == 2
