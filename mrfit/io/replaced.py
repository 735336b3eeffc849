"""Files that a command writes over others of other content, so that it can say so."""

import filecmp
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

_FOUND: ContextVar[list[Path] | None] = ContextVar("replaced", default=None)


@contextmanager
def replaced_files() -> Iterator[list[Path]]:
    """Collect the files that are replaced by others of other content meanwhile."""
    found: list[Path] = []
    token = _FOUND.set(found)
    try:
        yield found
    finally:
        _FOUND.reset(token)


def about_to_replace(path: Path, by: Path) -> None:
    """Note that a file takes the place of another one, if that holds something else and somebody collects."""
    found = _FOUND.get()
    if found is not None and path.is_file() and not filecmp.cmp(path, by, shallow=False):
        found.append(path)
