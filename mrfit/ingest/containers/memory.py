"""Memory that a file may take, asked before it is unpacked and held to while a library unpacks it."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mrfit.ingest.refusal import Refusal, TransientRefusal
from mrfit.io.memory import free_memory

FREE_MEMORY_SHARE = 0.5
"""Part of the free memory that one file may take unless the user says another amount."""
UNPACKED_COPIES = 4
"""How many times the numbers of a file are in memory, at most, while they are unpacked, sent on and used."""


def shown(size: float) -> str:
    """Return bytes in words."""
    return f"{size / 1e9:.1f} GB" if size >= 0.95e9 else f"{max(size / 1e6, 0.1):.3g} MB"


def too_much(path: Path, needs: str, limit: float, remedy: str = "cut it into shorter logs") -> Refusal:
    """Return the refusal of a file that needs more memory than it may take."""
    remedy = f"give it more with `mrfit ingest --max-memory`, or {remedy}"
    return TransientRefusal(path, f"{needs}, and it may take {shown(limit)}", remedy)


def out_of_memory(path: Path, limit: float) -> Refusal:
    """Return the refusal of a file whose library asked for more than the file may take."""
    return too_much(path, "unpacking it asks for more memory than it states it needs", limit, "copy it again")


class Room:
    """The memory that one file may take.

    Parameters
    ----------
    path
        The file.
    limit
        Most bytes it may take; None for half of what is free.
    """

    def __init__(self, path: Path, limit: float | None = None) -> None:
        self.path = path
        self.limit = FREE_MEMORY_SHARE * free_memory() if limit is None else limit
        self.numbers = 0.0

    def expect(self, numbers: float) -> None:
        """Check that so many numbers may be unpacked, before they are.

        Raises
        ------
        Refusal
            If they need, with those taken before, more memory than the file may take.
        """
        total = self.numbers + float(numbers)
        self.hold(f"it unpacks to {total:.3g} numbers", UNPACKED_COPIES * 8.0 * total)

    def take(self, numbers: float) -> None:
        """Count numbers that are kept from now on.

        Raises
        ------
        Refusal
            As ``expect``.
        """
        self.expect(numbers)
        self.numbers += float(numbers)

    def hold(self, what: str, size: float) -> None:
        """Check that ``size`` bytes may be taken for what the file holds.

        Raises
        ------
        Refusal
            If they may not; it says how much is needed and how much there is.
        """
        if size > self.limit:
            raise too_much(self.path, f"{what}: about {shown(size)} of memory are needed", self.limit)


@contextmanager
def held_to(limit: float | None) -> Iterator[None]:
    """Let this process take at most ``limit`` bytes more than it has, so that a library which asks for more fails.

    The system sees to it on Linux; elsewhere nothing is held.
    """
    taken = _taken()
    if limit is None or taken is None:
        yield
        return
    import resource

    before, hard = resource.getrlimit(resource.RLIMIT_DATA)
    ends = [int(taken + limit), *(end for end in (before, hard) if end != resource.RLIM_INFINITY)]
    resource.setrlimit(resource.RLIMIT_DATA, (min(ends), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (before, hard))


def _taken() -> float | None:
    """Return the bytes this process has for itself; None where the system does not say."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
        return 1024.0 * next(float(line.split()[1]) for line in lines if line.startswith("VmData"))
    except (OSError, StopIteration):
        return None
