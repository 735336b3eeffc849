"""Progress of long work, told without knowing who listens."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

Progress = Callable[[str, int, int], None]
"""progress(what, done, total): called often; ``done == total`` ends the line for ``what``."""


def silent(what: str, done: int, total: int) -> None:
    """Listen to nothing."""


_compilation: list[Progress] = []


@contextmanager
def on_compilation(listen: Progress) -> Iterator[None]:
    """Have it told, instead of who listens now, when kernels are compiled."""
    before = _compilation.copy()
    _compilation[:] = [listen]
    try:
        yield
    finally:
        _compilation[:] = before


def tell_compilation(done: int) -> None:
    """Tell the listener that the compilation of a kernel begins, 0, or ends, 1."""
    for listen in _compilation:
        listen("compiling kernels, kept for later commands", done, 1)
