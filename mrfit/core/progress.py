"""Progress of long work, told without knowing who listens."""

from collections.abc import Callable

Progress = Callable[[str, int, int], None]
"""progress(what, done, total): called often; ``done == total`` ends the line for ``what``."""


def silent(what: str, done: int, total: int) -> None:
    """Listen to nothing."""
