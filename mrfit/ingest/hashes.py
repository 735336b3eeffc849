"""Hashes of logs, of long ones piece by piece: whether one has changed is asked without what reads it."""

import hashlib
from collections.abc import Callable
from pathlib import Path

from mrfit.core.progress import Progress, silent
from mrfit.ingest.refusal import Refusal
from mrfit.settings.ingest import BLOCK

Watch = Callable[[bytes], None]
"""Told every piece of a file as it is read."""
BLOCKS_IN_MEMORY = 8
"""A log of more blocks than this is read block by block."""


def hash_of(path: Path, progress: Progress = silent) -> str:
    """Return the SHA-256 of a file's bytes.

    Raises
    ------
    Refusal
        If it cannot be read.
    """
    digest, watch = watched(path, "looking at", progress)
    try:
        with path.open("rb", buffering=0) as handle:
            while raw := handle.read(BLOCK):
                watch(raw)
    except OSError as error:
        raise Refusal(path, f"cannot be read ({error.strerror or error})", "check the path and permissions") from None
    return digest.hexdigest()


def watched(path: Path, what: str, progress: Progress) -> tuple["hashlib._Hash", Watch]:
    """Return a hash, and what feeds it and tells the progress of a file longer than a few blocks."""
    digest, done = hashlib.sha256(), 0
    try:
        size = path.stat().st_size
    except OSError:
        size = 0
    label = f"{what} {path.name} (MB)"

    def watch(raw: bytes) -> None:
        nonlocal done
        digest.update(raw)
        done += len(raw)
        if size > BLOCKS_IN_MEMORY * BLOCK:
            progress(label, done // 1_000_000, size // 1_000_000)

    return digest, watch
