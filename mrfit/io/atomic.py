"""The one way in which files of a workspace are written: beside their place, then renamed."""

import errno
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from mrfit.errors import DataError
from mrfit.io.replaced import about_to_replace


def refuse_link(path: Path) -> None:
    """Refuse a path that leads elsewhere.

    Raises
    ------
    DataError
        If it is a symbolic link.
    """
    if path.is_symlink():
        raise DataError(f"{path}: a symbolic link, which mrfit does not follow; remove it")


def opened_to_append(path: Path) -> IO[bytes]:
    """Return a file opened for writing at its end, made if it is not there; what is not a file itself is refused.

    A link would lead out of the workspace, and nobody may read what is written into a pipe.

    Raises
    ------
    OSError
        If it is a link, a pipe or a folder, or cannot be written.
    """
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)
    if path.is_symlink():
        raise OSError(errno.ELOOP, "a symbolic link")
    handle = os.fdopen(os.open(path, flags, 0o666), "ab")
    if not stat.S_ISREG(os.fstat(handle.fileno()).st_mode):
        handle.close()
        raise OSError(errno.EINVAL, "no plain file")
    return handle


@contextmanager
def accessing(path: Path, remedy: str = "; choose another folder", what: str = "cannot write") -> Iterator[None]:
    """Name the file or folder that the system refuses, and the remedy."""
    try:
        yield
    except OSError as error:
        raise DataError(f"{path}: {what} ({error.strerror or error}){remedy}") from error


def write_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Call ``write`` with a temporary name beside ``path``, flush to disk, rename.

    Raises
    ------
    DataError
        If the folder cannot be written, or the path names no file.
    """
    if not path.name:
        raise DataError(f"{path}: no name of a file; give one")
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with accessing(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            temporary.unlink(missing_ok=True)  # a link of this name would be followed
            write(temporary)
            with temporary.open("rb") as handle:
                os.fsync(handle.fileno())
            about_to_replace(path, temporary)
            temporary.replace(path)
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
