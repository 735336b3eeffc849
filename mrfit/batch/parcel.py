"""Files sent to a worker that sees others, and back: every file lies there where it lies here, below one folder.

Paths relative to the current folder mean the same there, so that what is written of them is the same.
"""

import os
import re
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from mrfit.core import temporary
from mrfit.errors import DataError
from mrfit.io.atomic import write_atomic
from mrfit.io.workspace import FILES, FOLDERS

# The current folder is that of all threads of a process
# Of the path of a file in a workspace: neither a way out of it nor one of another system
PART = re.compile(r"(?!\.+$)[^/\\:\x00]+")
_moving = threading.Lock()


@dataclass(frozen=True)
class Parcel:
    """Files by their absolute paths, and the folder in which relative ones are meant."""

    folder: str
    files: tuple[tuple[str, bytes], ...]


def packed(paths: Iterable[Path]) -> Parcel:
    """Return files, and all files in folders, with the current folder."""
    files = [f for p in paths for f in (sorted(p.rglob("*")) if p.is_dir() else [p]) if f.is_file()]
    return Parcel(os.getcwd(), tuple((os.path.abspath(f), f.read_bytes()) for f in files if f.name != ".lock"))


@contextmanager
def unpacked(parcel: Parcel) -> Iterator[None]:
    """Lay files below a folder of its own and work there, where relative paths mean them; it is removed afterwards."""
    with _moving, temporary.folder("batch") as root:
        before = os.getcwd()
        for name, content in parcel.files:
            path = _below(root, name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        folder = _below(root, parcel.folder)
        folder.mkdir(parents=True, exist_ok=True)
        os.chdir(folder)
        try:
            yield
        finally:
            os.chdir(before)


def returned(folder: Path) -> tuple[tuple[str, bytes], ...]:
    """Return the files of a folder of a worker, by their paths in it."""
    files = [f for f in sorted(folder.rglob("*")) if f.is_file() and f.name != ".lock"]
    return tuple((f.relative_to(folder).as_posix(), f.read_bytes()) for f in files)


def put(folder: Path, files: Iterable[tuple[str, bytes]]) -> None:
    """Write a worker's files into a workspace here; what it removed is removed, but for the folder's lock.

    Raises
    ------
    DataError
        If a file is none of a workspace's, or cannot be written: nothing is written outside of the workspace.
    """
    wanted = {folder / _checked(name): content for name, content in files}
    for path, content in wanted.items():
        write_atomic(path, lambda p, content=content: p.write_bytes(content))  # type: ignore[misc]
    for path in [p for p in folder.rglob("*") if p.is_file() and p not in wanted and p.name != ".lock"]:
        path.unlink()


def _checked(name: str) -> str:
    """Return the path of a file in a workspace, as a worker gave it."""
    first, *rest = name.split("/")
    if (first in FOLDERS and rest or first in FILES and not rest) and all(map(PART.fullmatch, rest)):
        return name
    raise DataError(f"a worker has sent a file named '{name[:80]}', which no workspace has; look after your workers")


def _below(root: Path, path: str) -> Path:
    """Return the place of an absolute path below a folder."""
    return root / Path(path).relative_to(Path(path).anchor)
