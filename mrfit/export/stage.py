"""Write a fit in the formats asked for; files of an earlier export are replaced."""

import importlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from mrfit.core.progress import Progress, silent
from mrfit.errors import ConfigError, DataError, MrfitError
from mrfit.export.c_parts import prefix_of
from mrfit.export.source import ExportSource
from mrfit.export.text import LONGEST_SYMBOL
from mrfit.io.atomic import write_atomic
from mrfit.settings.export import Settings

# Format -> module that has its ``files(source, settings)``
EXPORT_FORMATS = {
    "c": "c",
    "fmu": "fmu",
    "json": "json_file",
    "lookup": "lookup",
    "matlab": "matlab",
    "modelica": "modelica",
    "ssv": "ssv",
}
# Those that can have a tracker beside the model
TRACKING = frozenset({"c", "fmu", "matlab"})
# Those of a driven mass
WITH_MASS = frozenset({"c", "fmu"})


@dataclass(frozen=True)
class Files:
    """Files of one format.

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
class ExportedFiles:
    """Files written, by format, with remarks and errors; and the reasons for formats that failed."""

    folder: Path
    files: dict[str, list[str]] = field(default_factory=dict)
    said: dict[str, list[str]] = field(default_factory=dict)
    errors: dict[str, float | None] = field(default_factory=dict)
    failed: dict[str, str] = field(default_factory=dict)


def check(formats: Sequence[str]) -> None:
    """Refuse formats that do not exist.

    Raises
    ------
    ConfigError
        If one does not.
    """
    if not formats:
        raise ConfigError(f"--to: name a format: {', '.join(EXPORT_FORMATS)}")
    for name in formats:
        if name not in EXPORT_FORMATS:
            raise ConfigError(f"--to {name}: no such format; choose one of {', '.join(EXPORT_FORMATS)}")


def run(
    source: ExportSource, formats: Sequence[str], folder: Path, settings: Settings, progress: Progress = silent
) -> ExportedFiles:
    """Write a fit in formats.

    Nothing is written before all formats are made. One that cannot be made does not take the others.

    Raises
    ------
    ConfigError
        If a format does not exist, the prefix is no name, a tracker is asked for without a format that has one, or the
        only format needs a program that is not there.
    DataError
        If the fit has no form in the only format, or in none of several; if the folder cannot be written.
    """
    asked = list(dict.fromkeys(formats))
    check(asked)
    if settings.track and source.is_driven:
        raise ConfigError(f"--track: {source.name} is a driven mass; a tracker is made of a model of force or flux")
    if settings.track and not TRACKING & {*asked}:
        raise ConfigError(f"--track: a tracker is made beside the model with --to {' or '.join(sorted(TRACKING))}")
    source = _prefixed(source, settings.prefix)
    made: dict[str, Files] = {}
    written = ExportedFiles(folder)
    for done, name in enumerate(asked):
        progress("exporting", done, len(asked))
        module: Any = importlib.import_module(f"mrfit.export.{EXPORT_FORMATS[name]}")
        write: Callable[[ExportSource, Settings], Files] = module.files
        try:
            _check_driven(source, name)
            made[name] = write(source, settings)
        except MrfitError as error:
            written.failed[name] = str(error)
            if len(written.failed) == len(asked):
                raise
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


def _check_driven(source: ExportSource, name: str) -> None:
    if source.is_driven and name not in WITH_MASS:
        formats = " or ".join(sorted(WITH_MASS))
        raise DataError(f"--to {name}: a driven mass has no such form; --to {formats} has, force in and motion out")


def _prefixed(source: ExportSource, prefix: str) -> ExportSource:
    """Return a source whose files and functions have names that begin so.

    Raises
    ------
    ConfigError
        If C takes no such name.
    """
    if not prefix:
        return source
    if not re.fullmatch(rf"[A-Za-z][A-Za-z0-9_]{{0,{LONGEST_SYMBOL - 1}}}", prefix) or prefix_of(prefix) != prefix:
        raise ConfigError(
            f"--prefix takes up to {LONGEST_SYMBOL} letters, digits and underscores that no language or function of "
            f"mrfit's has taken, such as front_damper, not '{prefix}'"
        )
    return replace(source, prefix=prefix)


def _write(path: Path, content: bytes) -> None:
    try:
        write_atomic(path, lambda temporary: temporary.write_bytes(content))
    except DataError as error:
        reason = error.__cause__.strerror if isinstance(error.__cause__, OSError) else error
        raise DataError(f"{path}: cannot be written ({reason}); choose another --out") from None
