"""Memory that may be had, and what needs more of it."""

import math
import os
from collections.abc import Callable
from pathlib import Path

from mrfit.errors import MissingResource

SAMPLE_COPIES = 3
"""How many times the numbers of a table are in memory while it is used."""

TOLD_BYTES = 1e9
"""Bytes from which on a command says what something needs, before it begins."""
# Who is told, and what was told as the most so far: parts of what was told of are not told of again
_listeners: list[Callable[[str], None]] = []
_most: list[float] = [0.0]


def on_need(tell: Callable[[str], None] | None) -> None:
    """Have it told, before work begins, what it needs where that is much; None to tell nobody."""
    _listeners[:] = [tell] if tell else []
    _most[0] = 0.0


def free_memory() -> float:
    """Return the bytes of memory that may be had; all there are where the system does not say."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        return 1024.0 * next(float(line.split()[1]) for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        pass
    try:
        return float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    except (AttributeError, ValueError, OSError):
        return math.inf


def check_room(what: str, size: float) -> None:
    """State the memory that numbers of so many bytes need, and refuse to begin where they would not fit into memory.

    Raises
    ------
    DataError
        If they do not; the message says how much they need, and what would fit.
    """
    needed, free = SAMPLE_COPIES * size, free_memory()
    if needed > free:
        raise MissingResource(
            f"{what} need about {needed / 1e9:.1f} GB of memory and {free / 1e9:.1f} GB are free; write decimate = "
            f"{math.ceil(needed / max(free, 1.0))} or more in the channel map, or cut the log into shorter ones, and "
            "ingest it again"
        )
    if needed >= TOLD_BYTES and needed > _most[0]:
        _most[0] = needed
        for tell in _listeners:
            tell(f"{what} are held in memory: about {needed / 1e9:.1f} GB, {free / 1e9:.1f} GB are free")
