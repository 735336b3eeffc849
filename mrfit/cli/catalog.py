"""Public data sets: a catalog of files with their sizes and SHA-256, and fetching them verified."""

import contextlib
import hashlib
import os
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, BinaryIO

from pydantic import Field, TypeAdapter, ValidationError

from mrfit.core.progress import Progress, silent
from mrfit.errors import ConfigError, DataError, unknown_name
from mrfit.io.atomic import accessing
from mrfit.io.toml_file import TomlTable, read_toml

DOWNLOAD_CHUNK = 1 << 16
SECONDS = 30.0
"""Longest silence of a server."""
MAP_NAME = "mrfit.toml"


class CatalogFile(TomlTable):
    """One file of a data set."""

    # a name with a folder in it could be written anywhere; a hidden one would not be read
    name: Annotated[str, Field(pattern=r"^[^./\\][^/\\]*$")]
    address: Annotated[str, Field(pattern=r"^https?://")]
    size: Annotated[int, Field(gt=0)]
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class DataSet(TomlTable):
    """One data set; ``map`` is the channel map with which its files can be read."""

    title: str
    licence: str
    cite: str
    files: Annotated[list[CatalogFile], Field(min_length=1)]
    map: str = ""

    @property
    def size(self) -> int:
        """Bytes of all files together."""
        return sum(f.size for f in self.files)


class _TooLong(Exception):
    """The server sends more than the catalog says."""


def default_catalog() -> Path:
    """Return the catalog that comes with mrfit: inside an installed package, in ``datasets`` of a clone."""
    package = Path(__file__).parents[1]
    installed = package / "catalog.toml"
    return installed if installed.is_file() else package.parent / "datasets" / "catalog.toml"


def read_catalog(path: Path | None = None) -> dict[str, DataSet]:
    """Return the data sets of a catalog by name.

    Raises
    ------
    ConfigError
        If the file is missing, is no TOML, or holds a wrong or unknown key; the message names it.
    """
    file = path or default_catalog()
    try:
        return TypeAdapter(dict[str, DataSet]).validate_python(read_toml(file, "a data catalog"))
    except ValidationError as error:
        fault = error.errors()[0]
        key = ".".join(str(part) for part in fault["loc"])
        got = str(fault["input"])[:60]
        raise ConfigError(f"{file}: {key}: {fault['msg'].lower()} (got {got!r}); correct the catalog") from None


def rows(sets: dict[str, DataSet]) -> list[dict[str, Any]]:
    """Return one row for each data set: name, title, number of files, bytes, licence, how to cite."""
    return [
        {"name": n, "title": s.title, "files": len(s.files), "bytes": s.size, "licence": s.licence, "cite": s.cite}
        for n, s in sets.items()
    ]


def fetch(
    sets: dict[str, DataSet], name: str, folder: Path | None = None, progress: Progress = silent
) -> dict[str, Any]:
    """Bring a data set into a folder; files that lie there already and are right are not fetched again.

    A file appears under its name only once its size and SHA-256 are right.

    Parameters
    ----------
    sets
        The catalog.
    name
        Which data set.
    folder
        Where its files go; default: a folder of the set's name.
    progress
        Called with the bytes of the whole set.

    Returns
    -------
    dict
        ``name``, ``folder``, ``cite``, ``licence``, ``next`` (a command), ``notes``, and ``files``: ``name``,
        ``bytes``, ``sha256``, ``state`` (fetched, replaced or there).

    Raises
    ------
    ConfigError
        If the catalog has no such data set.
    DataError
        If the network or the folder fails, or files are not what the catalog says; all others are then in place.
    """
    if name not in sets:
        raise unknown_name("data set", name, list(sets), "mrfit datasets")
    chosen, target = sets[name], folder or Path(name)
    with _folder(target):
        files, faults = _bring_all(chosen, target, name, progress)
        notes = _write_map(chosen.map, target / MAP_NAME) if files else []
    if faults:
        more = f" (and {len(faults) - 1} more of {len(chosen.files)} files)" if len(faults) > 1 else ""
        raise DataError(f"{faults[0]}{more}; see {chosen.cite}")
    return {
        "name": name,
        "folder": str(target),
        "files": files,
        "notes": notes,
        "licence": chosen.licence,
        "cite": chosen.cite,
        "next": f"mrfit ingest {shlex.quote(str(target))}",
    }


class _Fault(Exception):
    """One file is not available; the others may be."""


class _Counter:
    """Report the progress of a data set, file by file."""

    def __init__(self, progress: Progress, what: str, before: int, total: int) -> None:
        self.progress, self.what, self.before, self.total = progress, what, before, total

    def __call__(self, received: int) -> None:
        self.progress(self.what, min(self.before + received, self.total - 1), self.total)


class _Sink:
    """Write to a file, hash and count what comes, and stop where more comes than should."""

    def __init__(self, handle: BinaryIO, size: int, counter: _Counter) -> None:
        self.handle, self.size, self.counter = handle, size, counter
        self.hash = hashlib.sha256()
        self.received = 0

    def write(self, chunk: bytes) -> int:
        self.received += len(chunk)
        if self.received > self.size:
            raise _TooLong
        self.hash.update(chunk)
        self.counter(self.received)
        return self.handle.write(chunk)

    def flush(self) -> None:
        self.handle.flush()


@contextlib.contextmanager
def _folder(folder: Path) -> Iterator[None]:
    """Make a folder, and remove it again if nothing came into it."""
    with accessing(folder, "; choose another folder with --to", "cannot be made"):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            folder.rmdir()  # refused by the system where there is anything in it


def _bring_all(chosen: DataSet, folder: Path, name: str, progress: Progress) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the state of each file, and the fault of those that are not available."""
    files, faults, done = [], [], 0
    for entry in chosen.files:
        counter = _Counter(progress, f"fetch {name}  {entry.name}", done, chosen.size)
        try:
            files.append(_bring(entry, folder / entry.name, counter))
        except _Fault as fault:
            faults.append(str(fault))
        done += entry.size
        progress(f"fetch {name}", done, chosen.size)
    return files, faults


def _bring(entry: CatalogFile, path: Path, counter: _Counter) -> dict[str, Any]:
    """Fetch one file unless it is there and right, and return its state."""
    before = _sha256(path)
    state = "there" if before == entry.sha256 else "replaced" if before else "fetched"
    if state != "there":
        # hidden, so that no ingest takes what a killed run left for a log; of this process only
        part = path.parent / f".{entry.name}.{os.getpid()}.part"
        try:
            with accessing(path, "; make room or choose another folder with --to", "cannot be written"):
                with part.open("wb") as handle:
                    _download(entry, path.parent, _Sink(handle, entry.size, counter))
                part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    return {"name": entry.name, "bytes": entry.size, "sha256": entry.sha256, "state": state}


def _sha256(path: Path) -> str:
    """Return a file's hash, or the empty string where there is no file."""
    try:
        with path.open("rb") as handle:
            return hashlib.file_digest(handle, "sha256").hexdigest()
    except FileNotFoundError:
        return ""
    except OSError as error:
        raise DataError(f"{path}: cannot be read ({error.strerror}); choose another folder with --to") from None


def _download(entry: CatalogFile, folder: Path, sink: _Sink) -> None:
    """Fetch one file into a sink and check it.

    Raises
    ------
    DataError
        If the server cannot be reached at all.
    _Fault
        If this file is not there, or not what the catalog says.
    """
    import pooch
    import requests

    # compressed on the way, the length a server states would not be the file's
    get = pooch.HTTPDownloader(chunk_size=DOWNLOAD_CHUNK, timeout=SECONDS, headers={"Accept-Encoding": "identity"})
    by_hand = f"or put the file into {folder} by hand: the same command then verifies it"
    try:
        get(entry.address, sink, None)
    except _TooLong:
        raise _Fault(f"{entry.address} is longer than the {entry.size} bytes of the catalog: not kept") from None
    except requests.HTTPError as error:
        answer = error.response
        said = f"{answer.status_code} {answer.reason}" if answer is not None else str(error)
        raise _Fault(f"{entry.address} answers {said}: try later, {by_hand}") from None
    except (requests.ConnectionError, requests.Timeout, requests.exceptions.ChunkedEncodingError) as error:
        if sink.received:
            text = f"{entry.address} broke off after {sink.received} of {entry.size} bytes"
            raise _Fault(f"{text}: not kept; the same command goes on from here") from None
        text = f"{entry.address} cannot be reached ({_cause(error)})"
        raise DataError(f"{text}; check the network and HTTPS_PROXY, {by_hand}") from None
    except requests.RequestException as error:
        raise _Fault(f"{entry.address} cannot be fetched ({_cause(error)})") from None
    if sink.received != entry.size:
        text = f"{entry.address} ended after {sink.received} of {entry.size} bytes"
        raise _Fault(f"{text}: not kept; the same command goes on from here")
    if sink.hash.hexdigest() != entry.sha256:
        text = f"{entry.address} has SHA-256 {sink.hash.hexdigest()[:16]}… instead of {entry.sha256[:16]}…"
        raise _Fault(f"{text}: not kept; it is not the file the catalog means")


def _cause(error: Exception) -> str:
    """Return the innermost reason of a network error in a few words."""
    reason = getattr(error.args[0], "reason", error.args[0]) if error.args else error
    return " ".join(str(reason).split(": ")[-1].split())[:120] or type(error).__name__


def _write_map(text: str, path: Path) -> list[str]:
    """Put a data set's channel map beside its files, unless the user has one there."""
    if not text:
        return []
    try:
        if path.exists():
            same = path.read_text(encoding="utf-8") == text
            return [] if same else [f"{path}: kept as it is, though the catalog has another channel map"]
        part = path.with_name(f".{path.name}.{os.getpid()}.part")
        part.write_text(text, encoding="utf-8")
        part.replace(path)
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: cannot be written ({error}); choose another folder with --to") from None
    return [f"{path}: the channel map with which these files can be read"]
