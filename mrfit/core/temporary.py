"""Temporary folders of mrfit: each is removed with its process, or at the next start where that was killed.

A folder holds a locked file for as long as its process lives; the system opens the lock of a process that is killed.
"""

import atexit
import os
import re
import shutil
import stat
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NoReturn

try:
    import fcntl
except ImportError:  # Windows removes no folder of a file that is open, and has no common temporary folder
    fcntl = None  # type: ignore[assignment]

FOLDER_NAME = re.compile(r"mrfit-[a-z]+-[a-z0-9_]{8}")
LOCK = ".mrfit-alive"
# Seconds for which a folder whose file is not locked may be one that is just being made
JUST_MADE = 60.0
# Folders of this process, with the descriptor of each one's lock
_mine: dict[Path, int] = {}
# Held while a folder gets its file or is removed: without the file nobody would know whose it is
_halfway = threading.Lock()


def _own_nothing() -> None:
    """Begin a process that is a fork: the folders are another's, and so is what held the lock."""
    global _halfway
    _mine.clear()
    _halfway = threading.Lock()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_own_nothing)


@contextmanager
def folder(purpose: str) -> Iterator[Path]:
    """Give a folder that is removed afterwards.

    Parameters
    ----------
    purpose
        A word in small letters, which its name says.
    """
    made = kept(purpose)
    try:
        yield made
    finally:
        _remove(made)


def kept(purpose: str) -> Path:
    """Return a new folder that is removed when this process ends."""
    with _halfway:
        made = Path(tempfile.mkdtemp(prefix=f"mrfit-{purpose}-"))
        lock = os.open(made / LOCK, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o600)
        if fcntl:
            fcntl.flock(lock, fcntl.LOCK_EX)
        if not _mine:
            # not earlier: what is registered first is called last, and a command ends its process then
            atexit.register(remove_own)
        _mine[made] = lock
    return made


def remove_own() -> None:
    """Remove the folders of this process, which ends."""
    for made in list(_mine):
        _remove(made)


def end_process(code: int) -> NoReturn:
    """Remove the folders of this process and end it at once, whatever its other threads are at."""
    remove_own()
    with _halfway:
        os._exit(code)


def _remove(made: Path) -> None:
    with _halfway:
        lock = _mine.pop(made, None)
        if lock is not None:
            os.close(lock)
            _take_apart(made)


def _take_apart(made: Path) -> None:
    """Remove a folder, its file last: what a kill leaves of it is removed at the next start."""
    with suppress(OSError), os.scandir(made) as entries:
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            elif entry.name != LOCK:
                os.unlink(entry.path)
    shutil.rmtree(made, ignore_errors=True)


def remove_left() -> None:
    """Remove the folders of this user's processes that were killed."""
    if not fcntl:
        return
    with suppress(OSError), os.scandir(tempfile.gettempdir()) as entries:
        for left in [Path(e.path) for e in entries if FOLDER_NAME.fullmatch(e.name)]:
            with suppress(OSError):
                if _is_left(left):
                    _take_apart(left)


def _is_left(left: Path) -> bool:
    """Return whether a folder is this user's alone, and the process that made it is gone.

    One without the file is anybody's, however it is named: a script's ``mktemp -d /tmp/mrfit-work-XXXXXXXX``.
    """
    found = left.lstat()
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != os.getuid() or stat.S_IMODE(found.st_mode) != 0o700:
        return False
    lock = os.open(left / LOCK, os.O_RDWR | os.O_NOFOLLOW)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return time.time() - os.fstat(lock).st_mtime > JUST_MADE
    except BlockingIOError:
        return False
    finally:
        os.close(lock)
