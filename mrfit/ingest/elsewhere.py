"""Logs read where work is done: by threads or processes here, or by a scheduler's workers, to which bytes are sent.

A log of more than a few blocks is read here: its numbers lie on this machine's disk meanwhile. So is one that a plug-in
reads, of which workers know nothing.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mrfit.core import registry, temporary
from mrfit.core.executors.order import executor, in_order_by, is_apart, is_elsewhere
from mrfit.core.progress import Progress, silent
from mrfit.core.recording import Recording
from mrfit.core.workers import in_order
from mrfit.ingest.hashes import BLOCKS_IN_MEMORY
from mrfit.ingest.reading import BlockReading, LogItem, LogOutcome, read_item
from mrfit.ingest.refusal import Refusal
from mrfit.settings.shared import READ_BY_PROCESSES


@dataclass(frozen=True, slots=True)
class LogParcel:
    """A record as it is sent to a worker.

    Attributes
    ----------
    item
        The record.
    contents
        Bytes of its files; None where the worker sees the same paths.
    block
        Bytes of a log read at once.
    """

    item: LogItem
    contents: tuple[bytes, ...] | None
    block: int


def outcomes(items: Sequence[LogItem], pieces: BlockReading, jobs: int) -> Iterator[LogOutcome]:
    """Yield the outcomes of items, in their order, wherever they are read."""
    if not is_elsewhere() and (jobs < 2 or len(items) < READ_BY_PROCESSES):
        yield from in_order(lambda item: read_item(item, pieces), items, jobs)
        return
    apart = is_apart()
    kept = [_size(i) > BLOCKS_IN_MEMORY * pieces.block or bool(registry.where("reader", i.reader)) for i in items]
    sent = (_sent(item, apart, pieces.block) for item, is_kept in zip(items, kept, strict=True) if not is_kept)
    with closing(in_order_by(executor(jobs), read_sent, sent, silent)) as elsewhere:
        for item, is_kept in zip(items, kept, strict=True):
            # which item it was is known here
            yield read_item(item, pieces) if is_kept else replace(next(elsewhere), item=item)
        next(elsewhere, None)  # its end leaves the processes to the next stage


def _size(item: LogItem) -> int:
    try:
        return max(path.stat().st_size for path, _ in item.files)
    except OSError:
        return 0


def _sent(item: LogItem, apart: bool, block: int) -> LogParcel:
    if not apart:
        return LogParcel(item, None, block)
    try:
        return LogParcel(item, tuple(path.read_bytes() for path, _ in item.files), block)
    except OSError:
        # the worker says of a file that is not there what is said of it here
        return LogParcel(item, None, block)


def read_sent(sent: LogParcel, progress: Progress) -> LogOutcome:
    """Read a record in a worker; its recordings are in memory, its sources and refusals bear the paths it has here."""
    with temporary.folder("ingest") as place:
        laid = _laid(sent, place)
        found = read_item(laid, BlockReading(place / "numbers", sent.block))
        names = {str(there): str(here) for (there, _), (here, _) in zip(laid.files, sent.item.files, strict=True)}

        def here(text: str) -> str:
            for there, own in names.items():
                text = text.replace(there, own)
            return text

        recordings = tuple(_renamed(in_memory(r), sent.item.source, here) for r in found.recordings)
        refusals = tuple(_refusal(r, here) for r in found.refusals)
    return LogOutcome(sent.item, recordings, refusals)


def _laid(sent: LogParcel, place: Path) -> LogItem:
    """Return the item with its files where the worker has laid them, under their own names."""
    if sent.contents is None:
        return sent.item
    files = []
    for number, ((path, digest), content) in enumerate(zip(sent.item.files, sent.contents, strict=True)):
        file = place / str(number) / path.name
        file.parent.mkdir()
        file.write_bytes(content)
        files.append((file, digest))
    return replace(sent.item, files=tuple(files))


def in_memory(recording: Recording) -> Recording:
    """Return a recording with all its numbers in memory."""
    return replace(recording, channels={n: np.array(v[:], np.float64) for n, v in recording.channels.items()})


def _renamed(recording: Recording, source: str, here: Callable[[str], str]) -> Recording:
    findings = tuple(replace(f, text=here(f.text)) for f in recording.findings)
    return replace(recording, source=source, findings=findings, history=tuple(map(here, recording.history)))


def _refusal(refusal: Refusal, here: Callable[[str], str]) -> Refusal:
    """Return a refusal of the same kind that names the path here."""
    same = type(refusal)(here(refusal.path), here(refusal.reason), here(refusal.remedy))
    same.__notes__ = getattr(refusal, "__notes__", [])
    return same
