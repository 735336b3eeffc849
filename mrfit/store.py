"""The workspace on disk: where each stage keeps what it made, written so that a kill leaves old or new, never half.

Every file is written to a temporary name in the same folder and renamed. A stage ends by writing its JSON summary,
which carries the key of all that made it; a run whose key is already there has nothing to do.
"""

import hashlib
import json
import math
import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np

from mrfit.arrow import floats, numbers, table, texts
from mrfit.errors import DataError
from mrfit.keys import content_of, fit_key, flux_key, segment_key
from mrfit.recording import Finding, Recording, Segment
from mrfit.specs import Array

T = TypeVar("T")
LOCK_SECONDS = 600.0
ROW_GROUP = 1 << 20
"""Rows of a table written together."""
CONTENT = "mrfit.content"
"""Name in a recording's metadata of the hash of its content."""
COPIES = 3
"""How many times the numbers of a table are in memory while it is used."""


def plain(value: object) -> Any:
    """Return ``value`` as JSON can hold it: arrays as lists, non-finite numbers as null."""
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple, set)):
        return [plain(v) for v in value]
    return value


def write_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Call ``write`` with a temporary name beside ``path``, flush to disk, rename.

    Raises
    ------
    DataError
        If the folder cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(temporary)
        with temporary.open("rb") as handle:
            os.fsync(handle.fileno())
        temporary.replace(path)
    except OSError as error:
        raise DataError(f"{path}: cannot write ({error.strerror or error}); choose another --work folder") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically, in UTF-8 with plain line feeds."""
    write_atomic(path, lambda p: p.write_bytes(text.encode()))


def write_json(path: Path, value: object) -> None:
    """Write JSON atomically, keys in the given order, two spaces deep."""
    write_text(path, json.dumps(plain(value), indent=2, ensure_ascii=False, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Return the content of a JSON file, or None if there is no such file or it cannot be parsed."""
    try:
        return json.loads(path.read_text())
    except (OSError, ValueError):
        return None


def stored_settings(kind: type[T], path: Path, summary: Mapping[str, Any] | None, command: str) -> T:
    """Return the settings in a stage's ``summary``, or defaults where ``path``, which ``command`` writes, is not there.

    Raises
    ------
    DataError
        If the file is damaged or another version's: defaults in place of what the user had chosen would go unnoticed.
    """
    if not path.exists():
        return kind()
    with _reading(path, f"run `{command}` with the settings you want"):
        if summary is None:
            raise ValueError("no settings in it")
        return kind(**summary["settings"])


@contextmanager
def _reading(path: Path, remedy: str) -> Iterator[None]:
    """Say which file cannot be read and what to do; pyarrow's own errors are ValueErrors."""
    try:
        yield
    except (OSError, TypeError, KeyError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        raise DataError(f"{path}: missing, damaged or another mrfit's: cannot be read ({reason}); {remedy}") from error


def write_table(
    path: Path,
    columns: Mapping[str, Array],
    metadata: Mapping[str, str] | None = None,
    more: Callable[[dict[str, str]], Mapping[str, str]] | None = None,
) -> None:
    """Write equal-length float64 columns as Parquet (zstd), atomically and one row group at a time.

    Columns are asked for their length and for slices only, once, so that they may be longer than memory.

    Parameters
    ----------
    path
        The file.
    columns
        Columns by name.
    metadata
        Texts kept with them.
    more
        Gives further metadata once all is written, by the columns' SHA-256.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    length = len(next(iter(columns.values()), ()))
    schema = pa.schema([(name, pa.float64()) for name in columns], dict(metadata or {}))

    def write(temporary: Path) -> None:
        digests = {name: hashlib.sha256() for name in columns}
        with pq.ParquetWriter(temporary, schema, compression="zstd", use_dictionary=False) as writer:
            for begin in range(0, max(length, 1), ROW_GROUP):
                slices = (values[begin : begin + ROW_GROUP] for values in columns.values())
                group = [np.ascontiguousarray(rows, dtype=np.float64) for rows in slices]
                for digest, rows in zip(digests.values(), group, strict=True):
                    digest.update(rows.data)
                writer.write_table(pa.Table.from_arrays([numbers(rows) for rows in group], schema=schema), ROW_GROUP)
            if more:
                writer.add_key_value_metadata(dict(more({n: d.hexdigest() for n, d in digests.items()})))

    write_atomic(path, write)


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


def _check_room(path: Path, rows: int, columns: int) -> None:
    """Refuse to load what would not fit, rather than be ended by the operating system."""
    needed, free = COPIES * 8.0 * rows * columns, free_memory()
    if needed > free:
        raise DataError(
            f"{path}: its {rows} samples in {columns} columns need about {needed / 1e9:.1f} GB of memory and "
            f"{free / 1e9:.1f} GB are free; cut the log into shorter ones, or keep every n-th row, and ingest it again"
        )


def read_table(path: Path) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns and metadata of a Parquet file written by ``write_table``.

    Raises
    ------
    DataError
        If the file is missing or damaged, or too long for the memory there is.
    """
    import pyarrow.parquet as pq

    # read_table would import data sets and pandas (0.3 s)
    with _reading(path, "run `mrfit ingest` again"), pq.ParquetFile(path) as file:
        _check_room(path, file.metadata.num_rows, file.metadata.num_columns)
        table = file.read()
        metadata = file.metadata.metadata or {}
    columns = {name: floats(table.column(name)) for name in table.column_names}
    return columns, {k.decode(): v.decode(errors="replace") for k, v in metadata.items()}


class _Times:
    """Sample times k·dt, computed slice by slice."""

    def __init__(self, samples: int, dt: float) -> None:
        self.samples, self.dt = samples, dt

    def __len__(self) -> int:
        return self.samples

    def __getitem__(self, rows: slice) -> Array:
        begin, end, _ = rows.indices(self.samples)
        return np.arange(begin, end, dtype=np.float64) * self.dt


class Workspace:
    """The folder one study works in.

    Parameters
    ----------
    root
        The folder; made at the first write.
    """

    def __init__(self, root: Path) -> None:
        self.root = root

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
        """Return the folder of the named fit."""
        return self.root / "fits" / name

    @property
    def report_folder(self) -> Path:
        """Folder of the report."""
        return self.root / "report"

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the workspace's lock, waiting for another command to finish.

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
            if not os.access(self.root, os.W_OK):
                raise PermissionError(13, "Permission denied")
            lock.acquire()
        except Timeout as error:
            raise DataError(f"{self.root}: in use by another mrfit command; wait for it to end") from error
        except OSError as error:
            text = error.strerror or error
            raise DataError(f"{self.root}: cannot write here ({text}); choose another --work folder") from error
        try:
            for left in self.root.rglob(".*.tmp"):
                left.unlink(missing_ok=True)  # of a command that was killed: whoever writes holds the lock
            yield
        finally:
            lock.release()
            if not existed:
                self._forget_if_empty()

    def _forget_if_empty(self) -> None:
        """Remove a workspace folder that a failing command made and put nothing into."""
        if all(p.name == ".lock" for p in self.root.iterdir()):
            (self.root / ".lock").unlink(missing_ok=True)
            self.root.rmdir()

    def ingest_summary(self) -> dict[str, Any]:
        """Return ingest.json.

        Raises
        ------
        DataError
            If nothing has been ingested.
        """
        summary = read_json(self.ingest_json)
        if not summary or not summary.get("recordings"):
            raise DataError(f"{self.root}: nothing ingested here; run `mrfit ingest LOGS… --work {self.root}` first")
        return cast(dict[str, Any], summary)

    def recording_file(self, identifier: str, stage: str = "recordings") -> Path:
        """Return the Parquet file of a recording as ``stage`` (``recordings`` or ``flux``) left it."""
        return self.root / stage / f"{identifier}.parquet"

    def write_recording(self, recording: Recording, stage: str = "recordings") -> None:
        """Write a recording: samples as columns beside ``time``, everything else as metadata."""
        time = cast(Array, _Times(recording.samples, recording.dt))
        metadata = {"mrfit": json.dumps(plain(recording.about()), ensure_ascii=False)}
        write_table(
            self.recording_file(recording.id, stage),
            {"time": time, **recording.channels},
            metadata,
            lambda digests: {CONTENT: content_of(recording, digests)},
        )

    def content(self, identifier: str, stage: str = "recordings") -> str:
        """Return the hash of a recording's content, written with it (see ``content_of``).

        Raises
        ------
        DataError
            If its file is missing or damaged, or of an mrfit that wrote none.
        """
        import pyarrow.parquet as pq

        path = self.recording_file(identifier, stage)
        with _reading(path, "run `mrfit ingest` on its log again"):
            metadata = pq.read_metadata(path).metadata or {}
            if CONTENT.encode() not in metadata:
                raise ValueError("an older mrfit's, without a hash of its content")
        return str(metadata[CONTENT.encode()].decode())

    def contents(self, identifiers: Iterable[str], stage: str = "recordings") -> dict[str, str]:
        """Return the hashes of recordings' contents by id."""
        return {i: self.content(i, stage) for i in sorted(set(identifiers))}

    @property
    def identifiers(self) -> list[str]:
        """Ids of the recordings that ingest left."""
        return [r["id"] for r in self.ingest_summary()["recordings"]]

    def read_recording(self, identifier: str, stage: str = "recordings") -> Recording:
        """Return a recording as ``stage`` left it.

        Raises
        ------
        DataError
            If its file is missing or damaged.
        """
        columns, metadata = read_table(self.recording_file(identifier, stage))
        about = json.loads(metadata["mrfit"])
        columns.pop("time")
        return Recording(
            channels=columns,
            units={c["name"]: c["unit"] for c in about["channels"]},
            columns={c["name"]: c["column"] for c in about["channels"] if c["column"] is not None},
            findings=tuple(Finding(**f) for f in about["findings"]),
            history=tuple(about["history"]),
            **{k: about[k] for k in ("id", "source", "sha256", "reader", "dt", "start", "rows_kept", "rows_refused")},
            **{k: about.get(k, {}) for k in ("condition", "wording")},
        )

    def write_segments(self, segments: Sequence[Segment], metadata: Mapping[str, str]) -> None:
        """Write the table of segments, one row each."""
        import pyarrow.parquet as pq

        columns = {f.name: [getattr(s, f.name) for s in segments] for f in fields(Segment)}
        made = {name: texts(v) if v and isinstance(v[0], str) else numbers(v) for name, v in columns.items()}
        rows = table(made).replace_schema_metadata(dict(metadata))
        write_atomic(self.segments_file, lambda p: pq.write_table(rows, p, compression="zstd"))

    def read_segments(self) -> tuple[list[Segment], dict[str, str]]:
        """Return the segments and the metadata written with them.

        Raises
        ------
        DataError
            If the segment stage has not run, or its table is damaged.
        """
        import pyarrow.parquet as pq

        if not self.segments_file.is_file():
            raise DataError(f"{self.root}: no segments here; run `mrfit segment --work {self.root}` first")
        with _reading(self.segments_file, "run `mrfit segment` with the settings you want"):
            rows = pq.ParquetFile(self.segments_file).read()
            segments = [Segment(**row) for row in rows.to_pylist()]
        return segments, {k.decode(): v.decode() for k, v in (rows.schema.metadata or {}).items()}

    @property
    def latest(self) -> str:
        """Stage whose recordings are the latest: ``flux`` where it has run."""
        return "flux" if self.flux_json.is_file() else "recordings"

    def made_from(self, segments: Sequence[Segment]) -> tuple[dict[str, str], list[dict[str, Any]]]:
        """Return what results depend on: the content of the segments' recordings by id, and the segments."""
        return self.contents((s.recording for s in segments), self.latest), [asdict(s) for s in segments]

    def outdated(self, fits: Sequence[Mapping[str, Any]], key: Callable[..., str] = fit_key) -> list[str]:
        """Return the names of fits that other data than are here now, or another mrfit, made, by their fit.json.

        ``key`` computes what their keys would be now.
        """
        try:
            segments, metadata = self.read_segments()
            here = self.made_from(segments)
            if self._behind(metadata):
                return [f["name"] for f in fits]
        except DataError:
            return [f["name"] for f in fits]
        return [f["name"] for f in fits if f["key"] != key(f["settings"], *here)]

    def _behind(self, metadata: Mapping[str, str]) -> bool:
        """Return whether flux or segments are of other recordings than ingest left, or made by another mrfit."""
        if not self.ingest_json.is_file():
            return False
        flux, cut = read_json(self.flux_json) or {}, json.loads(metadata.get("mrfit", "{}"))
        # what has no key does not say what it was made from
        if "key" in flux and flux["key"] != flux_key(flux["settings"], self.contents(self.identifiers)):
            return True
        return "key" in cut and cut["key"] != segment_key(cut["settings"], self.contents(self.identifiers, self.latest))

    def fit_names(self) -> list[str]:
        """Return the names of all finished fits, sorted."""
        return sorted(p.parent.name for p in self.root.glob("fits/*/fit.json"))


def recording_id(source: Path, taken: set[str]) -> str:
    """Return a file-system-safe identifier for a log: its stem, numbered if another log already has it."""
    stem = re.sub(r"[^A-Za-z0-9._-]+", "-", source.stem).strip("-.") or "recording"
    name, number = stem, 2
    while name.lower() in taken:
        name, number = f"{stem}-{number}", number + 1
    taken.add(name.lower())
    return name
