"""Results that earlier calls of the ingest stage left in the workspace."""

from __future__ import annotations

from collections.abc import Iterable
from os import getcwd
from os import path as os_path
from typing import TYPE_CHECKING

from mrfit.ingest.refusal import Refusal
from mrfit.io.escapes import encodable
from mrfit.io.schemas.stages import IngestFile
from mrfit.io.workspace import Workspace

if TYPE_CHECKING:
    from mrfit.ingest.reading import LogItem


class Manifest:
    """The content of ingest.json by source.

    Attributes
    ----------
    summary
        All of it.
    keys
        Source -> key of all that determined its recordings.
    base
        Folder in which relative sources are meant: that of the first call that gave one.
    spelling
        Absolute path -> source, as the first call spelt it.
    copies
        Logs that hold the same bytes as another one.
    orphans
        Sources whose recordings are of an earlier state of a log that could not be read the last time.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.workspace = workspace
        stored = workspace.ingest_file()
        self.summary = stored or IngestFile(recordings=[], refused=[])
        self.keys, self.copies = self.summary.sources, self.summary.copies
        root = os_path.abspath(workspace.root)
        # a file without a base has absolute sources only, which are the same from anywhere
        base = (self.summary.base or ".") if stored else os_path.relpath(getcwd(), root)
        self.base = os_path.normpath(os_path.join(root, base))
        sources = [*self.keys, *(c.source for c in self.copies)]
        self.spelling: dict[str, str] = {encodable(os_path.normpath(os_path.join(self.base, s))): s for s in sources}
        self.orphans = {r.source for r in self.summary.refused if r.kept}

    def source(self, item: LogItem) -> str:
        """Return the source's name as the workspace already knows it, or as the item has it."""
        return self.name(item.source)

    def name(self, path: str) -> str:
        """Return a path as the workspace spells it already; a new one as given, if the base is the present folder."""
        absolute = os_path.abspath(path)
        if known := self.spelling.get(encodable(absolute)):
            return known
        return encodable(path if os_path.isabs(path) or self.base == getcwd() else os_path.relpath(absolute, self.base))

    def base_of(self, sources: Iterable[str]) -> str | None:
        """Return the base that ingest.json must state: none where all sources are absolute."""
        if all(os_path.isabs(s) for s in sources):
            return None
        return os_path.relpath(self.base, os_path.abspath(self.workspace.root))

    def ids(self, source: str) -> list[str]:
        """Return the ids of a source's recordings."""
        return [r.id for r in self.summary.recordings if r.source == source]

    def holds(self, item: LogItem, key: str) -> bool:
        """Whether an item has been read, with all that determines it as it is now."""
        source = self.source(item)
        if self.keys.get(source) != key:
            return False
        return all(self.workspace.is_whole(i) for i in self.ids(source))

    def reason(self, source: str, sha256: str, key: str) -> str:
        """Return the reason for which a source with recordings has been read again."""
        if any(r.sha256 != sha256 for r in self.summary.recordings if r.source == source):
            return "has changed since it was last read"
        if self.keys.get(source) == key:
            return "read again, since its recordings were damaged, changed or missing"
        return "read again, since its channel map, the options, its reader or mrfit itself has changed"

    def refusals(self, source: str) -> list[Refusal]:
        """Return the reason for which a source was refused."""
        return [Refusal(r.source, r.reason, r.remedy) for r in self.summary.refused if r.source == source]

    def same_refusals(self, refusals: list[Refusal]) -> bool:
        """Whether all of these are known."""
        known = {(r.source, r.reason) for r in self.summary.refused}
        return all((self.name(r.path), r.reason) in known for r in refusals)
