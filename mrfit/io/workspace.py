"""The workspace on disk: where each stage keeps what it made, written so that a kill leaves old or new, never half.

Every file is written to a temporary name in the same folder and renamed. A stage ends by writing its JSON summary,
which carries the key of all that made it; a run whose key is already there has nothing to do.

What reads and writes samples is imported where that is done: a command that only looks at summaries loads no numpy.
"""

import json
import math
import os
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from mrfit.core import temporary
from mrfit.core.counting import number_of
from mrfit.core.recording import Finding, Recording, Segment
from mrfit.errors import ConfigError, DataError, MissingResource
from mrfit.io.atomic import refuse_link, write_atomic
from mrfit.io.escapes import visible_in_page
from mrfit.io.faults import plain_fault
from mrfit.io.footer import written_text
from mrfit.io.keys import content_of, file_digest, stamp
from mrfit.io.memory import check_room
from mrfit.io.schemas.fit import Fit
from mrfit.io.schemas.reading import Document, File, load, of_json, of_row, parsed
from mrfit.io.schemas.reading import plain as plain
from mrfit.io.schemas.stages import AS_RECORDED, RECORDING, About, FluxFile, IngestFile, SegmentRow, SegmentsFile
from mrfit.io.unreadable import UNREADABLE, reading

if TYPE_CHECKING:
    from mrfit.io.schemas.discovery import DiscoveryFile

IDENTIFIER = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]*")
"""Ids of recordings, which name files."""
FIT_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._+-]*")
"""Names of fits, which name folders and stand in tables."""
LONGEST_NAME = 200
"""Characters of a fit's name; file systems take 255 bytes."""
FOLDERS = (
    *("recordings", "flux", "fits", "report", "discover", "compare", "advise", "apply", "export", "predict"),
    *("track", "plot", "sheet"),
)
"""Folders of a workspace."""
FILES = ("ingest.json", "flux.json", "segments.parquet")
"""Files of a workspace beside its folders, without which it holds no fit."""
NO_LINKS = ("channel-map.toml", "batch.jsonl")
"""Files that are no links: what they lead to would be believed, or written into."""
TEMPORARY = re.compile(r"\..+\.\d+\.tmp")
"""Names of files not yet written whole."""
TEMPORARY_NAMES = (".ingest.json.", ".flux.json.", ".segments.parquet.", ".batch.parquet.", ".batch.html.")
"""Beginnings of such names in the workspace itself, where files of others may lie."""
REMOVED = ".mrfit-removed-"
"""Beginning of the names of folders of fits that are being removed."""
LOCK_SECONDS = 600.0
CONTENT = "mrfit.content"
"""Name in a recording's metadata of the hash of its content."""


def checked(document: File) -> File:
    """Return the results of a stage as its file will state them: plain numbers, None for what is not finite."""
    return of_json(type(document), json.dumps(plain(document)))


def to_json(document: Document) -> dict[str, Any]:
    """Return a document as a command tells it: what its file has, then what is said of the run."""
    return {name: plain(getattr(document, name)) for name in document.written(told=True)}


def check_name(name: str, option: str = "") -> None:
    """Refuse a name of a fit that would not be a plain name of a folder; ``option`` gave it.

    Raises
    ------
    ConfigError
        If it is not one.
    """
    if not FIT_NAME.fullmatch(name) or len(name) > LONGEST_NAME:
        shown = name if len(name) <= 60 else name[:57] + "…"
        raise ConfigError(
            f"{f'{option} ' if option else ''}'{shown}' is no name for a file: give up to {LONGEST_NAME} letters, "
            "digits, . _ - and +, the first a letter, a digit or _"
        )


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically, in UTF-8 with plain line feeds; a page shows control characters."""
    text = visible_in_page(text) if path.suffix == ".html" else text
    write_atomic(path, lambda p: p.write_bytes(text.encode(errors="backslashreplace")))


def write_json(path: Path, value: object) -> None:
    """Write JSON atomically, keys in the given order, two spaces deep."""
    write_text(path, json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Return the content of a JSON file, or None if there is no such file or it cannot be parsed."""
    try:
        return json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError):
        return None


class Workspace:
    """The folder one study works in.

    Parameters
    ----------
    root
        The folder; made at the first write.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        self._hashes: tuple[object, Mapping[Path, str]] | None = None

    @property
    def ingest_json(self) -> Path:
        """Summary of the ingest stage."""
        return self.root / "ingest.json"

    @property
    def flux_json(self) -> Path:
        """Summary of the flux stage."""
        return self.root / "flux.json"

    @property
    def segments_file(self) -> Path:
        """Table of segments."""
        return self.root / "segments.parquet"

    def fit_folder(self, name: str) -> Path:
        """Return the folder of the named fit.

        Raises
        ------
        ConfigError
            If the name is no plain one.
        """
        check_name(name)
        return self.root / "fits" / name

    @property
    def scratch(self) -> Path:
        """Folder for what a command makes of long recordings and keeps while it runs."""
        return self.root / ".mrfit-scratch"

    @contextmanager
    def scratching(self) -> Iterator[None]:
        """Leave nothing of what is made of long recordings meanwhile."""
        try:
            yield
        finally:
            if self.scratch.is_dir():
                shutil.rmtree(self.scratch, ignore_errors=True)

    @property
    def report_folder(self) -> Path:
        """Folder of the report."""
        return self.root / "report"

    @contextmanager
    def locked(self) -> Iterator["Workspace"]:
        """Hold the workspace's lock, waiting for another command to finish, and give the workspace.

        Raises
        ------
        DataError
            If the folder cannot be written, or another command holds it for ten minutes.
        """
        from filelock import FileLock, Timeout

        existed = self.root.is_dir()
        lock = FileLock(self.root / ".lock", timeout=LOCK_SECONDS)
        try:
            self.root.mkdir(parents=True, exist_ok=True)
            refuse_link(self.root / ".lock")
            if not os.access(self.root, os.W_OK):
                raise PermissionError(13, "Permission denied")
            lock.acquire()
        except Timeout as error:
            raise MissingResource(f"{self.root}: in use by another mrfit command; wait for it to end") from error
        except OSError as error:
            text = error.strerror or error
            raise DataError(f"{self.root}: cannot write here ({text}); choose another --work folder") from error
        try:
            self._refuse_links()
            self._clean()
            temporary.remove_left()
            yield self
        finally:
            lock.release()
            if not existed:
                self._forget_if_empty()

    @contextmanager
    def aside(self) -> Iterator["Workspace"]:
        """Give another workspace for the time of one command, inside this one, and leave no trace of it.

        What a killed command left of its own is removed by the next; nothing is left in the common temporary folder,
        but where this workspace cannot be written.
        """
        from filelock import FileLock

        self._remove_left_aside()
        folder = self.root / f".predict-{os.getpid()}"
        try:
            folder.mkdir()
        except OSError:
            with temporary.folder("predict") as elsewhere:
                yield Workspace(elsewhere)
            return
        try:
            with FileLock(folder / ".lock"):
                yield Workspace(folder)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def _remove_left_aside(self) -> None:
        from filelock import FileLock, Timeout

        for left in self.root.glob(".predict-*"):
            links = left.is_symlink() or (left / ".lock").is_symlink()
            if left.name.removeprefix(".predict-").isdecimal() and not links:
                with suppress(Timeout, OSError):  # in use, or another user's
                    with FileLock(left / ".lock", timeout=0):
                        pass
                    shutil.rmtree(left, ignore_errors=True)

    def _refuse_links(self) -> None:
        """Refuse a workspace with folders that lead elsewhere: what is written into them would land there."""
        inside = [self.scratch, *(self.root / name for name in (*FOLDERS, *NO_LINKS))]
        inside += [f for name in FOLDERS for f in (self.root / name).rglob("*") if not f.is_file()]
        for folder in inside:
            refuse_link(folder)

    def _clean(self) -> None:
        """Remove what a killed command left half written; the caller holds the lock."""
        self._remove_left_aside()
        for left in (self.scratch, *self.root.glob(f"{REMOVED}*")):
            shutil.rmtree(left, ignore_errors=True)  # which follows no link
        for folder in (self.root, *(self.root / name for name in FOLDERS)):
            for left in folder.glob(".*.tmp") if folder == self.root else folder.rglob(".*.tmp"):
                if TEMPORARY.fullmatch(left.name) and (folder != self.root or left.name.startswith(TEMPORARY_NAMES)):
                    left.unlink(missing_ok=True)

    def _forget_if_empty(self) -> None:
        """Remove a workspace folder that a failing command made and put nothing into."""
        if all(p.name == ".lock" for p in self.root.iterdir()):
            (self.root / ".lock").unlink(missing_ok=True)
            self.root.rmdir()

    def ingest_summary(self) -> IngestFile:
        """Return ingest.json.

        Raises
        ------
        DataError
            If nothing has been ingested, or the file is damaged.
        """
        summary = self.ingest_file()
        if not summary or not summary.recordings:
            raise DataError(f"{self.root}: nothing ingested here; run `mrfit ingest LOGS… --work {self.root}` first")
        return summary

    def ingest_file(self) -> IngestFile | None:
        """Return ingest.json, None if there is none."""
        return load(self.ingest_json, IngestFile, "delete it and run `mrfit ingest` on the logs again")

    def flux_file(self) -> FluxFile | None:
        """Return flux.json, None if there is none."""
        return load(self.flux_json, FluxFile, self._made_again_by("flux"))

    def _made_again_by(self, stage: str) -> str:
        """Return the remedy for a file that a stage left and that cannot be read."""
        return f"delete it and run `mrfit {stage} --work {self.root}` with the settings you want"

    def recording_file(self, identifier: str, stage: str = "recordings") -> Path:
        """Return the Parquet file of a recording as ``stage`` (``recordings`` or ``flux``) left it.

        Raises
        ------
        DataError
            If the id is no plain name: what a file of the workspace says must not lead out of it.
        """
        if not IDENTIFIER.fullmatch(identifier):
            raise DataError(f"{self.root}: '{identifier}' is no id of a recording; ingest the logs again")
        return self.root / stage / f"{identifier}.parquet"

    def _file_left_by(self, stage: str, identifier: str) -> Path:
        """Return the file of a recording as ``stage`` left it: ingest's, where the flux stage did not change it."""
        path = self.recording_file(identifier, stage)
        return path if path.exists() else self.recording_file(identifier)

    def write_recording(self, recording: Recording, stage: str = "recordings") -> None:
        """Write a recording: samples as columns beside ``time``, everything else as metadata."""
        from mrfit.io.columns import SampleTimes
        from mrfit.io.tables import write_table

        time = cast(Any, SampleTimes(recording.samples, recording.dt))
        about = json.dumps({"schema": RECORDING, **plain(About.of(recording))}, ensure_ascii=False)
        metadata = {"mrfit": about}
        write_table(
            self.recording_file(recording.id, stage),
            {"time": time, **recording.channels},
            metadata,
            lambda digests: {CONTENT: content_of(recording, digests)},
        )

    def content(self, identifier: str, stage: str = "recordings") -> str:
        """Return the hash of a recording's content (see ``content_of``).

        It is the one written with it as long as its file is what was written, and computed of its samples otherwise.

        Raises
        ------
        DataError
            If its file is missing or damaged, or of an mrfit that wrote none.
        """
        path, written = self._file_left_by(stage, identifier), self._written(identifier, stage)
        if file_digest(path) == self._files().get(path):
            return written
        # which reads tables, by numpy and pyarrow
        from mrfit.io.dataset import content

        return content(self.read_recording(identifier, stage))

    def is_whole(self, identifier: str, stage: str = "recordings") -> bool:
        """Return whether a recording is there to its end, and holds what was written."""
        try:
            return self.content(identifier, stage) == self._written(identifier, stage)
        except DataError:
            return False

    def _written(self, identifier: str, stage: str) -> str:
        """Return the hash of its content that was written with a recording."""
        path = self._file_left_by(stage, identifier)
        with reading(path, "run `mrfit ingest` on its log again"):
            if (written := written_text(path, CONTENT)) is None:
                raise ValueError("an older mrfit's, without a hash of its content")
        return written

    def _files(self) -> Mapping[Path, str]:
        """Return the hashes of the recordings' files as they were written, read again where the summaries were."""
        stamps = stamp(self.ingest_json), stamp(self.flux_json)
        if self._hashes is None or self._hashes[0] != stamps:
            files: dict[Path, str] = {}
            for stage, summary in (("recordings", self.ingest_file), ("flux", self.flux_file)):
                # of a damaged summary no hash is believed; the stage that needs it says what is wrong
                with suppress(DataError):
                    made = summary()
                    files |= {self.recording_file(i, stage): h for i, h in (made.files if made else {}).items()}
            self._hashes = stamps, files
        return self._hashes[1]

    def contents(self, identifiers: Iterable[str], stage: str = "recordings") -> dict[str, str]:
        """Return the hashes of recordings' contents by id."""
        return {i: self.content(i, stage) for i in sorted(set(identifiers))}

    @property
    def identifiers(self) -> list[str]:
        """Ids of the recordings that ingest left."""
        return [r.id for r in self.ingest_summary().recordings]

    def check_room(self, identifiers: Sequence[str], stage: str = "recordings", streamed: bool = False) -> None:
        """Refuse to hold recordings side by side that would not fit into memory, but for long ones if ``streamed``.

        Raises
        ------
        DataError
            If they would not; a table that cannot be read is passed over, since reading it says more.
        """
        import pyarrow.parquet as pq

        from mrfit.io.columns import is_long

        size = 0.0
        for identifier in identifiers:
            with suppress(DataError, *UNREADABLE), pq.ParquetFile(self._file_left_by(stage, identifier)) as file:
                # times are not read
                held = not (streamed and is_long(file.metadata.num_rows))
                size += 8.0 * held * file.metadata.num_rows * (file.metadata.num_columns - 1)
        check_room(f"{self.root}: all samples of {number_of('recording', len(identifiers))}", size)

    def read_recording(self, identifier: str, stage: str = "recordings", streamed: bool = False) -> Recording:
        """Return a recording as ``stage`` left it.

        Parameters
        ----------
        identifier
            Its id.
        stage
            ``recordings`` or ``flux``.
        streamed
            Whether the channels of a long one stay on disk, see ``columns``.

        Raises
        ------
        DataError
            If its file is missing or damaged.
        """
        from mrfit.io.tables import read_table

        path, remedy = self._file_left_by(stage, identifier), "run `mrfit ingest` on its log again"
        columns, metadata = read_table(path, ("time",), self.scratch if streamed else None)
        text = metadata.get("mrfit", "")
        about = parsed(path, text, About, remedy)
        if [c.name for c in about.channels] != list(columns):
            raise DataError(f"{path}: damaged: its channels are not those it names; {remedy}")
        return Recording(
            **{name: getattr(about, name) for name in AS_RECORDED},
            channels=columns,
            units={c.name: c.unit for c in about.channels},
            columns={c.name: c.column for c in about.channels if c.column is not None},
            condition={name: value for name, value in about.condition.items() if value is not None},
            wording=about.wording,
            findings=tuple(Finding(f.kind, f.channel, f.at, f.text) for f in about.findings),
            history=tuple(about.history),
        )

    def write_segments(self, segments: Sequence[Segment], metadata: Mapping[str, str]) -> None:
        """Write the table of segments, one row each."""
        import pyarrow.parquet as pq

        from mrfit.io.arrow import numbers, table, texts

        columns = {f.name: [getattr(s, f.name) for s in segments] for f in fields(Segment)}
        made = {name: texts(v) if v and isinstance(v[0], str) else numbers(v) for name, v in columns.items()}
        rows = table(made).replace_schema_metadata(dict(metadata))
        write_atomic(self.segments_file, lambda p: pq.write_table(rows, p, compression="zstd"))

    def read_segments(self) -> list[Segment]:
        """Return the segments.

        Raises
        ------
        DataError
            If the segment stage has not run, or its table is damaged.
        """
        import pyarrow.parquet as pq

        if not self.segments_file.is_file():
            raise DataError(f"{self.root}: no segments here; run `mrfit segment --work {self.root}` first")
        remedy = self._made_again_by("segment")
        with reading(self.segments_file, remedy):
            rows = pq.ParquetFile(self.segments_file).read()
            found = rows.to_pylist()
        try:
            for row in found:
                of_row(SegmentRow, row)
        except ValueError as error:
            fault = plain_fault(error)  # type: ignore[arg-type]
            raise DataError(f"{self.segments_file}: damaged, or another mrfit's: {fault}; {remedy}") from error
        return [Segment(**row) for row in found]

    def segments_summary(self) -> SegmentsFile | None:
        """Return the summary written with the segments, None if they are not there or without one."""
        if not self.segments_file.exists():
            return None
        remedy = self._made_again_by("segment")
        with reading(self.segments_file, remedy):
            text = written_text(self.segments_file, "mrfit")
        if text is None:
            return None
        return parsed(self.segments_file, text, SegmentsFile, remedy)

    def segments(self) -> list[Segment]:
        """Return the segments, by the summary where it lists them: its table is read by pyarrow and numpy.

        Raises
        ------
        DataError
            As ``read_segments`` does.
        """
        summary = self.segments_summary()
        return [_segment(row) for row in summary.segments] if summary else self.read_segments()

    @property
    def latest(self) -> str:
        """Stage whose recordings are the latest: ``flux`` where it has run."""
        return "flux" if self.flux_json.is_file() else "recordings"

    def made_from(self, segments: Sequence[Segment]) -> tuple[dict[str, str], list[Segment]]:
        """Return the hashes that results depend on: the content of the segments' recordings by id, and the segments."""
        return self.contents((s.recording for s in segments), self.latest), list(segments)

    def stored_fit(self, name: str) -> Fit | None:
        """Return the content of a named fit's fit.json, to show it: whether its law is the one here is not asked.

        Raises
        ------
        DataError
            If it is damaged.
        """
        return load(self.fit_folder(name) / "fit.json", Fit, "delete it and run `mrfit fit` again")

    def discovery(self) -> "DiscoveryFile":
        """Return the last discovery.

        Raises
        ------
        DataError
            If there is none, or it is damaged.
        """
        # its schema takes longer to load than a short command
        from mrfit.io.schemas.discovery import DiscoveryFile

        path = self.root / "discover" / "discovery.json"
        found = load(path, DiscoveryFile, f"delete {path.parent} and run `mrfit discover` again")
        if found is None:
            raise DataError(
                f"{self.root}: no discovery here; run `mrfit discover --model NAME --work {self.root}` first"
            )
        return found

    def fit_names(self) -> list[str]:
        """Return the names of all finished fits, sorted; folders that no fit could be named by are none."""
        return sorted(p.parent.name for p in self.root.glob("fits/*/fit.json") if FIT_NAME.fullmatch(p.parent.name))

    def fit_folders(self) -> list[str]:
        """Return the names of all fits, sorted: the finished ones, and those that a later command would go on with."""
        return sorted(p.name for p in self.root.glob("fits/*") if p.is_dir() and FIT_NAME.fullmatch(p.name))


def _segment(row: SegmentRow) -> Segment:
    """Return a segment as its table has it, in which a level that no test holds is nan."""
    levels = {name: math.nan if (level := getattr(row, name)) is None else level for name in ("current", "temperature")}
    return Segment(**{f.name: getattr(row, f.name) for f in fields(Segment)} | levels)


def recording_id(source: Path, taken: set[str]) -> str:
    """Return a file-system-safe identifier for a log: its stem, numbered if another log already has it."""
    return numbered(re.sub(r"[^A-Za-z0-9._-]+", "-", source.stem).strip("-.") or "recording", taken)


def numbered(stem: str, taken: set[str]) -> str:
    """Return a name of a file, numbered if one that is taken is the same but for capitals, and add it to these."""
    name, number = stem, 2
    while name.lower() in taken:
        name, number = f"{stem}-{number}", number + 1
    taken.add(name.lower())
    return name
