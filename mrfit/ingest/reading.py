"""Read one record, from one file or its several parts, into recordings."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from mrfit import registry
from mrfit.ingest.apart import read_apart
from mrfit.ingest.build import Origin, build
from mrfit.ingest.channel_map import Rules
from mrfit.ingest.head import open_head
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.recording import Recording


@dataclass(frozen=True, slots=True)
class Item:
    """One record to read.

    Attributes
    ----------
    files
        Its files with their hashes; several where an instrument writes one record into several.
    reader
        Registry name.
    rules
        What the channel map says of it.
    """

    files: tuple[tuple[Path, str], ...]
    reader: str
    rules: Rules

    @property
    def source(self) -> str:
        """Path that stands for the record: its first file's."""
        return str(self.files[0][0])

    @property
    def sha256(self) -> str:
        """Hash of the file, or of the hashes of its parts."""
        if len(self.files) == 1:
            return self.files[0][1]
        return hashlib.sha256("".join(h for _, h in self.files).encode()).hexdigest()


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of an item: recordings without ids, and the files refused."""

    item: Item
    recordings: tuple[Recording, ...]
    refusals: tuple[Refusal, ...]


def hash_of(path: Path) -> str:
    """Return the SHA-256 of a file's bytes.

    Raises
    ------
    Refusal
        If it cannot be read.
    """
    try:
        with path.open("rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except OSError as error:
        raise Refusal(path, f"cannot be read ({error.strerror or error})", "check the path and permissions") from None


def read_item(item: Item) -> Outcome:
    """Return the recordings of an item; a file that cannot be read is among the refusals, its siblings are read."""
    module = registry.load("reader", item.reader)
    tables: list[Table] = []
    names: list[str] = []
    refusals: list[Refusal] = []
    for path, _ in item.files:
        try:
            source = Source(open_head(path), item.rules)
            fragile = getattr(module, "FRAGILE", False)
            tables += read_apart(item.reader, source) if fragile else module.read(source)
            names.append(path.name)
        except Refusal as refusal:
            refusals.append(refusal)
    if len(names) > 1:
        tables = [_with_history(t, f"joined {', '.join(names)}") for t in module.join(tables)]
    try:
        recordings = _recordings(tables, item)
    except Refusal as refusal:
        return Outcome(item, (), (*refusals, refusal))
    return Outcome(item, tuple(recordings), tuple(refusals))


def _with_history(table: Table, line: str) -> Table:
    return replace(table, history=(*table.history, line))


def _recordings(tables: Sequence[Table], item: Item) -> list[Recording]:
    origin = Origin(item.source, item.sha256, item.reader, item.rules)
    return [recording for table in tables for recording in build(table, origin)]
