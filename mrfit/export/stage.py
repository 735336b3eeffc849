"""Write a fit in the formats asked for; files of an earlier export are replaced."""

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mrfit.core.progress import Progress, silent
from mrfit.errors import ConfigError, DataError
from mrfit.export.source import Source
from mrfit.io.atomic import write_atomic
from mrfit.settings.export import Settings

# Format -> module that has its ``files(source, settings)``
FORMATS = {
    "c": "c",
    "fmu": "fmu",
    "json": "json_file",
    "lookup": "lookup",
    "matlab": "matlab",
    "modelica": "modelica",
    "ssv": "ssv",
}


@dataclass(frozen=True)
class Files:
    """What one format gives.

    Attributes
    ----------
    contents
        File name, relative to the folder -> its bytes.
    said
        What is told of it: a line each.
    error
        Largest difference from the simulation in Python as a share of the output's range, None where not measured.
    earlier
        Pattern of file names that an earlier export may have left, and that are taken away.
    """

    contents: Mapping[str, bytes]
    said: tuple[str, ...] = ()
    error: float | None = None
    earlier: str = ""


@dataclass(frozen=True)
class Written:
    """What was written: format -> its files, what is told, and the error."""

    folder: Path
    files: dict[str, list[str]] = field(default_factory=dict)
    said: dict[str, list[str]] = field(default_factory=dict)
    errors: dict[str, float | None] = field(default_factory=dict)


def check(formats: Sequence[str]) -> None:
    """Refuse formats that do not exist.

    Raises
    ------
    ConfigError
        If one does not.
    """
    if not formats:
        raise ConfigError(f"--to: name a format: {', '.join(FORMATS)}")
    for name in formats:
        if name not in FORMATS:
            raise ConfigError(f"--to {name}: no such format; choose of {', '.join(FORMATS)}")


def run(
    source: Source, formats: Sequence[str], folder: Path, settings: Settings, progress: Progress = silent
) -> Written:
    """Write a fit in formats.

    Nothing is written before all formats are made.

    Raises
    ------
    ConfigError
        If a format does not exist, or needs a program that is not there.
    DataError
        If the fit has no form in a format, or the folder cannot be written.
    """
    asked = list(dict.fromkeys(formats))
    check(asked)
    made: dict[str, Files] = {}
    for done, name in enumerate(asked):
        progress("exporting", done, len(asked))
        module: Any = importlib.import_module(f"mrfit.export.{FORMATS[name]}")
        write: Callable[[Source, Settings], Files] = module.files
        made[name] = write(source, settings)
    written = Written(folder)
    for name, files in made.items():
        for left in folder.glob(files.earlier) if files.earlier else ():
            left.unlink(missing_ok=True)
        for file, content in files.contents.items():
            _write(folder / file, content)
        written.files[name] = list(files.contents)
        written.said[name] = list(files.said)
        written.errors[name] = files.error
    progress("exporting", len(asked), len(asked))
    return written


def _write(path: Path, content: bytes) -> None:
    try:
        write_atomic(path, lambda temporary: temporary.write_bytes(content))
    except DataError as error:
        reason = error.__cause__.strerror if isinstance(error.__cause__, OSError) else error
        raise DataError(f"{path}: cannot be written ({reason}); choose another --out") from None
