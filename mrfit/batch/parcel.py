"""Files sent to a worker that sees others, and back: every file lies there where it lies here, below one folder.

Paths relative to the current folder mean the same there, so that what is written of them is the same.
"""

import os
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from mrfit.io.atomic import write_atomic

# The current folder is that of all threads of a process
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
    with _moving, TemporaryDirectory(prefix="mrfit-") as root:
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
    """Write a worker's files into a folder here; what it removed is removed, but for the folder's lock."""
    wanted = {folder / name: content for name, content in files}
    for path, content in wanted.items():
        write_atomic(path, lambda p, content=content: p.write_bytes(content))  # type: ignore[misc]
    for path in [p for p in folder.rglob("*") if p.is_file() and p not in wanted and p.name != ".lock"]:
        path.unlink()


def _below(root: str, path: str) -> Path:
    """Return where an absolute path lies below a folder."""
    return Path(root) / Path(path).relative_to(Path(path).anchor)
