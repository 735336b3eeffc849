"""A log read block by block: its text cut between rows, its numbers gathered on disk."""

import codecs
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import IO, Any

import numpy as np

from mrfit.ingest import series
from mrfit.ingest.hashes import Watch
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Block, Column, RejectedRows, Source, Table
from mrfit.ingest.text.body import NUMBER_ROW
from mrfit.ingest.text.head import TAIL_BYTES, Head, plain_feeds
from mrfit.ingest.text.textlog import check_rows
from mrfit.io.atomic import accessing

MIB = 1 << 20


def text_blocks(head: Head, size: int, watch: Watch) -> Iterator[Block]:
    """Yield a text log in blocks of about ``size`` bytes, each cut where a row of numbers follows on another.

    Line ends, byte-order marks and UTF-16 are treated as ``body_bytes`` treats them.

    Raises
    ------
    Refusal
        If no line ends for many megabytes.
    """
    plain = _Normaliser(head.encoding)
    pending, line, before = b"", 1, b""
    with head.path.open("rb") as handle:
        raw = handle.read(size)
        while raw:
            watch(raw)
            following = handle.read(size)
            pending += plain(raw, not following)
            raw = following
            end = _cut(pending, size) if raw else len(pending)
            if end == 0:
                if len(pending) > max(16 * size, 16 * MIB):
                    raise Refusal(head.path, f"no line end in {len(pending) // MIB} MB", "check what wrote it")
                continue
            block = Block(pending[:end], line, not raw, before)
            before = (before + block.data)[-TAIL_BYTES:]
            line += block.data.count(b"\n")
            pending = pending[end:]
            yield block


def _cut(text: bytes, size: int) -> int:
    """Return the place to cut at: behind a line end between two rows of numbers; 0 to wait for more."""
    feed = text.rfind(b"\n", 0, len(text) - 1)
    wide = len(text) > max(4 * size, MIB)
    while feed > 0:
        above = text.rfind(b"\n", 0, feed) + 1
        if wide or (NUMBER_ROW.match(text, feed + 1) and NUMBER_ROW.match(text, above, feed)):
            return feed + 1
        feed = above - 1
    return 0


class _Normaliser:
    """Turns pieces of a file into text with ASCII digits and plain line feeds, or CR LF throughout."""

    def __init__(self, encoding: str) -> None:
        self.begun = False
        self.held = b""
        self.decoder: Any = None
        if encoding.startswith("utf-16"):
            self.decoder = codecs.getincrementaldecoder(encoding)("replace")

    def __call__(self, raw: bytes, final: bool) -> bytes:
        text = raw if self.decoder is None else self.decoder.decode(raw, final).encode("utf-8", "replace")
        text = self.held + text
        if not self.begun and (len(text) >= len(codecs.BOM_UTF8) or final):
            text, self.begun = text.removeprefix(codecs.BOM_UTF8), True
        kept = text if final else text.rstrip(b"\r") if self.begun else b""
        self.held = text[len(kept) :]
        return plain_feeds(kept)


class BlockTables:
    """The tables of a log, put together from those of its blocks; their numbers lie in files in a folder.

    Parameters
    ----------
    folder
        Made here; who made the object removes it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.tables: list[Table] = []
        self.rows: list[int] = []
        self.refused: list[RejectedRows] = []
        self.stack = ExitStack()
        self.files: dict[Path, IO[bytes]] = {}

    def __enter__(self) -> "BlockTables":
        self.folder.mkdir(parents=True, exist_ok=True)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> None:
        self.stack.close()

    def add(self, tables: list[Table], source: Source) -> None:
        """Append the tables of the next block.

        Raises
        ------
        Refusal
            If they are others than those before.
        DataError
            If the disk is full.
        """
        if not self.tables:
            self.tables, self.rows = tables, [0] * len(tables)
            self.refused = [RejectedRows() for _ in tables]
        elif [_shape(t) for t in tables] != [_shape(t) for t in self.tables]:
            where = f" (line {source.block.line})" if source.block else ""
            remedy = "cut the log there and read the parts one by one"
            raise Refusal(source.head.path, f"its columns, or the times they share, change further down{where}", remedy)
        else:
            self.tables = [_merged(old, new) for old, new in zip(self.tables, tables, strict=True)]
        for number, table in enumerate(tables):
            self.rows[number] += table.rows
            self.refused[number].add([r.kind for r in table.refused], [r.line for r in table.refused])
            for name, values in _columns(table).items():
                self._append(self.folder / f"{number}-{name}", values)

    def _append(self, path: Path, values: series.Values) -> None:
        with accessing(path.parent, "; choose another --work folder, with room for as much as the log"):
            if path not in self.files:
                self.files[path] = self.stack.enter_context(path.open("wb"))
            self.files[path].write(np.ascontiguousarray(values).data)

    def result(self, head: Head) -> list[Table]:
        """Return the whole tables.

        Raises
        ------
        Refusal
            If there is no row.
        """
        for path, file in self.files.items():
            with accessing(path.parent, ""):
                file.flush()
        whole = []
        for number, table in enumerate(self.tables):
            rows, refused = self.rows[number], self.refused[number]
            check_rows(head, rows, refused)
            place = f"{self.folder}/{number}-"
            columns = tuple(_on_disk(c, Path(f"{place}{k}"), rows) for k, c in enumerate(table.columns))
            time = table.time and _on_disk(table.time, Path(f"{place}time"), rows)
            lines = series.stored(Path(f"{place}lines"), rows, np.int64)
            whole.append(replace(table, columns=columns, time=time, lines=lines, refused=refused))
        return whole


def _shape(table: Table) -> tuple[object, ...]:
    return tuple((c.name, c.unit, c.index) for c in table.columns), table.time and table.time.index, table.dt


def _columns(table: Table) -> dict[str, series.Values]:
    named: dict[str, series.Values] = {str(k): c.values for k, c in enumerate(table.columns)}
    return named | {"lines": table.lines} | ({"time": table.time.values} if table.time else {})


def _on_disk(column: Column, path: Path, rows: int) -> Column:
    return replace(column, values=series.stored(path, rows))


def _merged(old: Table, new: Table) -> Table:
    """Return the statements on a table, from its blocks so far and the next one."""
    return replace(
        old,
        breaks=(*old.breaks, *new.breaks),
        comments=(*old.comments, *new.comments),
        findings=tuple(dict.fromkeys((*old.findings, *new.findings))),
        open_line=new.open_line,
        stated_rows=old.stated_rows if new.stated_rows is not None else None,
    )
