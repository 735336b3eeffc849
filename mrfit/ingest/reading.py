"""Read one record, from one file or its several parts, into recordings."""

import hashlib
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from os import fsencode
from pathlib import Path
from typing import cast

from mrfit.core import registry
from mrfit.core.counting import few, number_of
from mrfit.core.progress import Progress, silent
from mrfit.core.protocols import JoinsParts, Reader, ReadsRows, TellsHeadings
from mrfit.core.recording import Finding, Recording
from mrfit.errors import MrfitError
from mrfit.ingest.blocks import BlockTables, text_blocks
from mrfit.ingest.build import LogOrigin, build
from mrfit.ingest.containers.memory import out_of_memory, shown
from mrfit.ingest.containers.runs import is_of_results
from mrfit.ingest.containers.shelf import Shelf, check_disk
from mrfit.ingest.containers.subprocess_reader import read_in_subprocess
from mrfit.ingest.dispatch import FALLBACK
from mrfit.ingest.hashes import BLOCKS_IN_MEMORY, Watch, watched
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.refusal import Refusal, excerpt
from mrfit.ingest.table import RejectedRow, RejectedRows, Source, Table, with_end
from mrfit.ingest.text import headings
from mrfit.ingest.text.head import Head, open_head
from mrfit.ingest.text.textlog import check_rows
from mrfit.settings.ingest import BLOCK


@dataclass(frozen=True, slots=True)
class LogItem:
    """One record to read.

    Attributes
    ----------
    files
        Its files with their hashes; several where an instrument writes one record into several.
    reader
        Registry name.
    rules
        What the channel map says of it.
    memory
        Most bytes of memory that each file may take once unpacked; None for half of what is free.
    """

    files: tuple[tuple[Path, str], ...]
    reader: str
    rules: Rules
    memory: float | None = None

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
class LogOutcome:
    """Result of reading an item: recordings without ids, and the files refused."""

    item: LogItem
    recordings: tuple[Recording, ...]
    refusals: tuple[Refusal, ...]


MEMORY_FOR_A_BYTE = 6
"""Bytes of memory that reading one byte of a text log as a whole takes, at most."""

OWN_FAULT = "a fault of mrfit's own in the reader"
PLUGIN_FAULT = "a fault in the plug-in reader"
"""How the refusal begins of a log on which something failed that no reader expects."""

_one_at_a_time = threading.Lock()


@dataclass(frozen=True, slots=True)
class BlockReading:
    """Settings by which logs are read that should not be held in memory.

    Attributes
    ----------
    folder
        Where their numbers lie meanwhile.
    block
        Bytes read at once.
    progress
        Told the megabytes read.
    """

    folder: Path
    block: int = BLOCK
    progress: Progress = silent


def read_item(item: LogItem, pieces: BlockReading | None = None) -> LogOutcome:
    """Return the recordings of an item; a file that cannot be read is among the refusals, its siblings are read.

    With ``pieces``, a log longer than a few blocks is read block by block, and its channels stay on disk.
    """
    module = registry.load("reader", item.reader)
    tables: list[Table] = []
    names: list[str] = []
    refusals: list[Refusal] = []
    for path, digest in item.files:
        try:
            shelf = Shelf(_place(pieces, path).absolute(), BLOCKS_IN_MEMORY * pieces.block) if pieces else None
            source = Source(open_head(path), item.rules, memory=item.memory, shelf=shelf)
            if pieces and len(item.files) == 1 and _is_long(module, source, pieces.block):
                with _one_at_a_time:
                    tables = _in_blocks(module, source, digest, pieces)
            else:
                tables += _whole(module, item.reader, source)
            names.append(path.name)
        except Exception as error:
            refusals.append(_refusal_of(error, path, item))
    try:
        if len(names) > 1 and (item.rules.join or isinstance(module, JoinsParts)):
            joined = _beside(tables, item) if item.rules.join else cast(JoinsParts, module).join(tables)
            told = f"joined {', '.join(names)}"
            tables = [replace(t, history=(*t.history, told)) for t in joined]
        recordings = _recordings(tables, item)
    except Exception as error:
        return LogOutcome(item, (), (*refusals, _refusal_of(error, item.files[0][0], item)))
    return LogOutcome(item, tuple(recordings), tuple(refusals))


def _beside(tables: Sequence[Table], item: LogItem) -> list[Table]:
    """Return the tables of files that the channel map joins as one: their columns side by side."""
    rows = [t.rows for t in tables]
    if len(set(rows)) > 1:
        what = f"the files joined as '{item.rules.join}' have {', '.join(map(str, rows))} rows"
        raise Refusal(item.files[0][0], what, "join files of one record only, and name others in [[files]]")
    columns = [c for t in tables for c in t.columns]
    return [replace(tables[0], columns=tuple(replace(c, index=k) for k, c in enumerate(columns)))]


def _refusal_of(error: Exception, path: Path, item: LogItem) -> Refusal:
    """Return the refusal of a log on which something failed, so that the logs beside it are read all the same.

    Raises
    ------
    MrfitError
        If the fault is not the log's, as that of a full disk.
    """
    if isinstance(error, Refusal):
        return error
    if isinstance(error, (MrfitError, SystemError)):  # compiled code makes a SystemError of an interrupt
        raise error
    if isinstance(error, MemoryError):
        return out_of_memory(path, Source(open_head(path), item.rules, memory=item.memory).room().limit)
    text = f"({type(error).__name__}: {(str(error).splitlines() or [''])[0]})"
    what, remedy = f"{OWN_FAULT} {item.reader} {text}", "report it with the file"
    if where := registry.where("reader", item.reader):
        what, remedy = f"{PLUGIN_FAULT} {item.reader} ({where}) {text}", "mend the plug-in"
    refusal = Refusal(path, what, f"{remedy}; `mrfit --debug ingest` of it alone shows where")
    refusal.__cause__ = error
    return refusal


def _whole(module: Reader, reader: str, source: Source) -> list[Table]:
    if module.SPEC.fragile:
        tables = read_in_subprocess(reader, source)
    else:
        _check_memory(source)
        tables = (
            _by_headings(module, source) if source.head.encoding and module.SPEC.blocks else list(module.read(source))
        )
    return [with_end(t) for t in tables]


def _by_headings(module: Reader, source: Source) -> list[Table]:
    """Return the tables of a text log, each part read by the header above it, up to a header that cannot be used."""
    first, *others = headings.cut_at_headings(source, _teller(module))
    tables = _first_read(module, first.source)
    if others and sum(t.rows for t in tables) < 2:
        tables, others = _below_a_note(module, source, tables, others[0]), others[1:]
    for part in others:
        try:
            found = _read_below(module, source, part)
        except Refusal as refusal:
            text = f"{part.told()}: nothing is read from there on ({part.in_words(refusal.reason)}); cut the log there"
            return [*tables[:-1], tables[-1].finding("another-header", text)]
        text = f"{part.told()}: its rows are read by it"
        tables += [part.placed(t).finding("another-header", text) for t in found]
    return tables


def _below_a_note(module: Reader, source: Source, above: Sequence[Table], part: headings.HeadedPart) -> list[Table]:
    """Return the tables of a log below a few values with a header of their own, as of the greatest force.

    Raises
    ------
    Refusal
        If a column has a name that stands above, too: which header holds is unclear.
    """
    found = _read_below(module, source, part)
    if {c.name.lower() for t in above for c in t.columns} & {c.name.lower() for t in found for c in t.columns}:
        raise Refusal(source.head.path, f"{part.told()} and no two rows stand above it", "delete what does")
    text = f"{part.told()}: what stands above it has no two rows, and is not read"
    lost = [RejectedRow("row above the header", int(n)) for t in above for n in t.lines]
    found = [part.placed(t).finding("another-header", text) for t in found]
    return [replace(t, refused=RejectedRows([*lost, *t.refused])) if t is found[0] else t for t in found]


def _read_below(module: Reader, source: Source, part: headings.HeadedPart) -> list[Table]:
    """Return the tables of a part of a log by its own header.

    Raises
    ------
    Refusal
        If its header cannot be used, or no row can be read.
    """
    if odd := part.odd or (_by_place(source.rules) and "the channel map names columns by place"):
        raise Refusal(source.head.path, odd, "cut the log there")
    found = _reader_below(module, part).read(part.source)
    found = _with_rows_above(part.source.head, list(found), part=True)
    check_rows(part.source.head, sum(t.rows for t in found), [r for t in found for r in t.refused])
    return found


def _first_read(module: Reader, source: Source) -> list[Table]:
    """Return the tables of the beginning of a log, every row above the header that holds counted as refused."""
    tables: list[Table] = module.read(source)
    _check_one_header(source.head, tables)
    return _with_rows_above(source.head, tables)


def _with_rows_above(head: Head, tables: list[Table], part: bool = False) -> list[Table]:
    """Return tables with the rows above the header that holds as refused; all numbers above that of a ``part``."""
    kept = [t for t in tables if len(t.lines)]
    first = min((n for t in kept for n in (int(t.lines[0]), *t.comments, *(r.line for r in t.refused))), default=1)
    lost = [RejectedRow("row above the header", line) for line in headings.rows_above(head, first, part)]
    return [replace(t, refused=RejectedRows([*lost, *t.refused])) if lost and t is kept[0] else t for t in tables]


def _check_one_header(head: Head, tables: Sequence[Table]) -> None:
    """Refuse a log in which another header follows on the first, a few rows below at most: which one holds is unclear.

    Raises
    ------
    Refusal
        If a line that was read as a damaged row names columns or units, and is no line of the header.
    """
    refused = {r.line for t in tables for r in t.refused}
    begins = [min((*t.lines[:1], *t.comments, *refused), default=1) for t in tables]
    rows = max((int(t.lines[: headings.FEW_ROWS][-1]) for t in tables if len(t.lines)), default=0)
    above = head.lines[: min(begins, default=1) - 1]
    named = [line.strip() for line in above if line.strip() and not headings.is_of_numbers(line)]
    header = named[-headings.NAMING_LINES :]
    for line in sorted(refused):
        text = head.lines[line - 1] if line < min(rows, len(head.lines)) else ""
        if headings.resembles(text, header) or text.strip() not in header and headings.names_columns(text):
            what = f"line {line} is another header right below the first ('{excerpt(text)}')"
            raise Refusal(head.path, what, "delete the one that does not hold")


def _teller(module: Reader) -> headings.Teller:
    """Return the function that tells the headers of a log: also those of further exports of the instrument."""
    if isinstance(module, TellsHeadings):
        return module.heading

    def tell(head: Head) -> headings.Heading | None:
        found = headings.heading(head)
        own = module.SPEC.name != FALLBACK and module.sniff(head)
        return replace(found or headings.Heading((), ()), export=headings.exported(head)) if own else found

    return tell


def _reader_below(module: Reader, part: headings.HeadedPart) -> Reader:
    """Return the reader of a part: the log's own where the header is one of its kind, else that of delimited text."""
    own = isinstance(module, TellsHeadings) or module.sniff(part.source.head)
    return module if own else registry.load("reader", FALLBACK)


def _by_place(rules: Rules) -> bool:
    return any(isinstance(column, int) for column in rules.columns)


def _check_memory(source: Source) -> None:
    """Refuse a text log that would not fit into memory, rather than be ended by the operating system."""
    size = source.head.size
    if source.head.encoding and source.block is None:
        source.room().hold(f"its {shown(size)} are read as a whole", MEMORY_FOR_A_BYTE * size)


def _is_long(module: Reader, source: Source, block: int) -> bool:
    """Whether a log is longer than a few blocks, and can be read block by block."""
    if isinstance(module, ReadsRows):
        rows, columns = module.extent(source)
        return bool(8 * rows * columns > BLOCKS_IN_MEMORY * block)
    text = bool(source.head.encoding) and source.head.unpacked is None
    return module.SPEC.blocks and text and source.head.size > BLOCKS_IN_MEMORY * block


def _blocks(module: Reader, source: Source, size: int, watch: Watch) -> Iterator[tuple[Source, list[Table]]]:
    """Yield the tables of each block with what was read: of binary files as their reader does it."""
    if isinstance(module, ReadsRows):
        yield from ((source, tables) for tables in module.read_blocks(source, size))
        return
    tell = _teller(module)
    for block in text_blocks(source.head, size, watch):
        part = replace(source, block=block)
        if len(parts := headings.cut_at_headings(part, tell)) > 1:
            raise Refusal(
                source.head.path, parts[1].told(), "cut the log there: one so long is read by one header only"
            )
        yield part, _first_read(module, part) if block.line == 1 else module.read(part)


def _in_blocks(module: Reader, source: Source, digest: str, pieces: BlockReading) -> list[Table]:
    """Return the tables of a long log, their numbers on disk."""
    path = source.head.path
    read, watch = watched(path, "reading", pieces.progress)
    rows = 0
    if isinstance(module, ReadsRows):
        rows, columns = module.extent(source)
        check_disk(path, rows * (columns + 1), pieces.folder)
    with BlockTables(_place(pieces, path)) as gathered:
        for part, tables in _blocks(module, source, pieces.block, watch):
            gathered.add(tables, part)
            if rows:
                pieces.progress(f"reading {path.name} (thousand rows)", gathered.rows[0] // 1000, rows // 1000)
        tables = gathered.result(source.head)
    if source.head.encoding and read.hexdigest() != digest:
        raise Refusal(path, "it changed while it was read", "wait until the program that writes it has finished")
    return [with_end(t) for t in tables]


def look_into(item: LogItem, pieces: BlockReading) -> tuple[LogOutcome, float]:
    """Return the outcome of the first block of a long log, and the log's length in such blocks; 1 if all was read."""
    block = pieces.block
    module = registry.load("reader", item.reader)
    try:
        source = Source(open_head(item.files[0][0]), item.rules, memory=item.memory)
        if len(item.files) > 1 or not _is_long(module, source, block):
            return read_item(item, pieces), 1.0
        part, tables = next(_blocks(module, source, block, lambda _: None))
        recordings = _recordings([replace(t, stated_rows=None) for t in tables], item)
        return LogOutcome(item, tuple(recordings), ()), _times_longer(module, part, tables)
    except Exception as error:
        return LogOutcome(item, (), (_refusal_of(error, item.files[0][0], item),)), 1.0


def first_tables(item: LogItem, pieces: BlockReading) -> list[Table]:
    """Return the tables of the first block of a log, or of the first of its files, as the file has them.

    Raises
    ------
    Refusal
        If the log cannot be read.
    """
    path = item.files[0][0]
    module = registry.load("reader", item.reader)
    try:
        source = Source(open_head(path), item.rules, memory=item.memory)
        if _is_long(module, source, pieces.block):
            return next(_blocks(module, source, pieces.block, lambda _: None))[1]
        return _whole(module, item.reader, source)
    except Exception as error:
        raise _refusal_of(error, path, item) from error


def _place(pieces: BlockReading, path: Path) -> Path:
    """Return the folder in which the numbers of one log lie meanwhile."""
    return pieces.folder / hashlib.sha256(fsencode(path)).hexdigest()[:16]


def _times_longer(module: Reader, part: Source, tables: list[Table]) -> float:
    if part.block is None:
        rows = module.extent(part)[0] if isinstance(module, ReadsRows) else 0
        return rows / max(tables[0].rows, 1)
    bytes_each = 2 if part.head.encoding.startswith("utf-16") else 1
    return part.head.size / (bytes_each * len(part.block.data))


def _recordings(tables: Sequence[Table], item: LogItem) -> list[Recording]:
    kept, left = _without_summaries(tables)
    made = []
    for number, table in enumerate(kept):
        rules = item.rules.of_test(number, len(kept))
        made += build(table, LogOrigin(item.source, item.sha256, item.reader, rules))
    return [replace(r, findings=(*r.findings, *left)) for r in made]


def _without_summaries(tables: Sequence[Table]) -> tuple[list[Table], list[Finding]]:
    """Return tables without small ones that have no times beside a long one, as of peaks by cycle, and what is said."""
    small = [t for t in tables if is_of_results(t, max(tables, key=lambda other: other.rows))]
    said = []
    for table in small:
        names = few([repr(c.name) for c in table.columns], 3)
        text = f"a table of {number_of('row', table.rows)} without times ({names}) stands beside the log: not read"
        said.append(Finding("not-read", "", None, text))
    return [t for t in tables if all(t is not other for other in small)], said
