"""Choice of the reader of a file, and of the files that are parts of one record."""

import os
import re
from os import fsencode
from pathlib import Path

from mrfit.core import registry
from mrfit.core.protocols import JoinsParts
from mrfit.errors import MrfitError
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.head import HEAD_BYTES, Head, open_head

LONGEST_STEM = 200
"""Bytes of a log's name: a file system takes 255, and recordings of a log have numbers and endings behind its name."""
FALLBACK = "delimited"
"""The reader for text that no instrument's reader claims."""


def claims(head: Head) -> list[str]:
    """Return the readers, the fallback apart, that know a file as theirs; at most one if all is well.

    Raises
    ------
    Refusal
        If a plug-in's reader fails on the file.
    """
    return [n for n in registry.names("reader") if n != FALLBACK and _sniffs(n, head)]


def _sniffs(name: str, head: Head) -> bool:
    reader, where = registry.load("reader", name), registry.where("reader", name)
    if not where:
        return reader.sniff(head)
    try:
        return bool(reader.sniff(head))
    except MrfitError:
        raise
    except Exception as error:
        what = f"the plug-in reader {name} ({where}) failed to tell whether it is its own"
        raise Refusal(
            head.path, f"{what} ({type(error).__name__}: {error})", "mend the plug-in, or leave it out"
        ) from error


def _told(name: str) -> str:
    """Return a reader's name, of a plug-in's with where it comes from."""
    where = registry.where("reader", name)
    return f"{name} of {where}" if where else name


def reader_of(head: Head) -> str:
    """Return the name of the reader for a file.

    Raises
    ------
    Refusal
        If no reader knows it, or more than one.
    """
    claimed = claims(head)
    if len(claimed) > 1:
        names = " and ".join(_told(n) for n in claimed)
        remedy = "remove the header lines that are another instrument's, or export the log as plain CSV"
        if any(registry.where("reader", n) for n in claimed):
            remedy = "let the plug-in's sniff ask for more, or leave the plug-in out"
        raise Refusal(head.path, f"it has the marks of more than one format ({names})", remedy)
    if claimed:
        return claimed[0]
    if not head.encoding:
        raise Refusal(
            head.path, "a binary file of no known format", "export it as CSV, TDMS, MDF, HDF5, MAT or Parquet"
        )
    return FALLBACK


def part_of(head: Head, reader: str) -> str | None:
    """Return the text that the files of one record share, or None if the file is a record by itself."""
    module = registry.load("reader", reader)
    return module.part(head) if isinstance(module, JoinsParts) else None


SKIPPED_ENDINGS = frozenset(
    ".toml .md .rst .html .htm .pdf .png .jpg .jpeg .gif .bmp .svg .tex .bib .py .ipynb .m .r .jl .c .h .cpp .json "
    ".yml .yaml .ini .cfg .log~ .lock .doc .docx .ppt .pptx .gitignore".split()
)
"""Endings of files in a folder that are no logs."""


NUMBERS_IN_JSON = re.compile(
    rb"""(?:[-+\d.eE]+[\s\[\],]+){8}|(?:"\d+"\s*:\s*[-+\d.eE]+[\s,]+){8}"""
    rb"""|(?:"[^"]*"\s*:\s*[-\d][-+\d.eE]*\s*,?\s*){2,}\}\s*,?\s*\{"""
)
"""Eight numbers on end, with or without numbered keys, or records of numbers: such a JSON file in a folder is a log."""


def expand(paths: list[Path]) -> list[tuple[Path, Path]]:
    """Return every file meant by ``paths`` with the folder up to which a channel map is looked for.

    Folders stand for all files in them, sorted by name, but for hidden ones, ``SKIPPED_ENDINGS`` and workspaces.
    A JSON file is among them where it holds rows of numbers.

    Raises
    ------
    Refusal
        If a path does not exist, or a folder holds no file.
    """
    files: dict[Path, Path] = {}
    for path in paths:
        if not _exists(path):
            raise Refusal(path, "no such file", "check the path and its spelling")
        if path.is_dir():
            found = sorted(path.rglob("*"))
            made = {p.parent for p in found if p.name == "ingest.json" and (p.parent / "recordings").is_dir()}
            if path in made:
                said = "a workspace, which mrfit wrote (ingest.json), not a folder of logs"
                raise Refusal(path, said, "name another folder, or the logs themselves")
            inside = [p for p in found if made.isdisjoint(p.parents) and _is_file(p) and _is_log(p, path)]
            if not inside:
                raise Refusal(path, "no log in this folder", "name a folder with logs, or the logs themselves")
            for file in inside:
                files.setdefault(file, path)
        else:
            files.setdefault(path, path.parent)
    return list(files.items())


def _exists(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a name that is too long
        return False


def _is_file(path: Path) -> bool:
    """Return whether a path is a file, or a link that leads nowhere, which is named and not passed over."""
    return path.is_file() or path.is_symlink() and not path.exists()


def _is_log(path: Path, root: Path) -> bool:
    hidden = any(p.startswith(".") for p in path.relative_to(root).parts)
    if hidden or path.suffix.lower() != ".json":
        return not hidden and path.suffix.lower() not in SKIPPED_ENDINGS
    try:
        with path.open("rb") as file:
            return bool(NUMBERS_IN_JSON.search(file.read(HEAD_BYTES)))
    except OSError:
        return False


def look(path: Path) -> tuple[Head, str]:
    """Return the beginning of a file and its reader's name.

    Raises
    ------
    Refusal
        If recordings cannot be named after it, it is no file, or no reader knows it.
    """
    try:
        fsencode(path).decode()
    except UnicodeDecodeError as error:
        raise Refusal(path, "its path is not UTF-8", "rename it") from error
    if (length := len(fsencode(path.stem))) > LONGEST_STEM:
        text = f"its name is {length} bytes long, and recordings are named after logs"
        raise Refusal(path, text, f"rename it to {LONGEST_STEM} or fewer")
    if path.is_symlink() and not path.exists():
        raise Refusal(path, f"a symbolic link to {os.readlink(path)}, which is not there", "mend or remove the link")
    if path.exists() and not path.is_file():
        raise Refusal(path, "no plain file", "copy its content into one")
    head = open_head(path)
    return head, reader_of(head)
