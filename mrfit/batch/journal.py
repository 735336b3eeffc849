"""The journal of a batch: a line for every log as soon as it is done, so that a kill loses those at work alone."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import IO

from pydantic import ValidationError

from mrfit.io.atomic import accessing, opened_to_append
from mrfit.io.schemas.batch import LogRow
from mrfit.io.schemas.reading import of_json
from mrfit.io.workspace import plain, write_text

JOURNAL_NAME = "batch.jsonl"


def read_journal(path: Path) -> dict[str, LogRow]:
    """Return the last row of every log; a line that a kill left unfinished, or somebody has damaged, is passed over."""
    rows: dict[str, LogRow] = {}
    try:
        lines = path.read_bytes().splitlines()
    except OSError:
        return rows
    for line in lines:
        try:
            row = of_json(LogRow, line)
        except ValidationError:
            continue
        rows[row.log] = row
    return rows


class Journal:
    """The file that is written to.

    Parameters
    ----------
    path
        It is made if it is not there.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: IO[bytes] | None = None

    def __enter__(self) -> "Journal":
        with accessing(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = opened_to_append(self.path)
            if self._file.tell():
                # the last line may be torn
                self._file.write(b"\n")
        return self

    def __exit__(self, *_: object) -> None:
        if self._file:
            self._file.close()

    def add(self, row: LogRow) -> None:
        """Write a row, so that it outlives this process."""
        if not self._file:
            return
        with accessing(self.path, "; make room on the disk"):
            self._file.write(_line(row).encode())
            self._file.flush()


def write_journal(path: Path, rows: Mapping[str, LogRow]) -> None:
    """Write the rows in the order of their logs, one for each."""
    write_text(path, "".join(_lines(rows[name] for name in sorted(rows))))


def _lines(rows: Iterable[LogRow]) -> Iterable[str]:
    return (_line(row) for row in rows)


def _line(row: LogRow) -> str:
    return json.dumps(plain(row), ensure_ascii=False, allow_nan=False) + "\n"
