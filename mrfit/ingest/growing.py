"""A log that an instrument still writes: read again and again, each time from where the last reading ended."""

from dataclasses import replace
from pathlib import Path

import numpy as np

import mrfit.ingest.stage
from mrfit.core import temporary
from mrfit.core.recording import Recording
from mrfit.errors import DataError
from mrfit.io.atomic import accessing
from mrfit.settings.ingest import Settings

CLOCK_AGREEMENT = 0.01
"""Share of a sample interval by which rows may be off the clock of those before; beyond it all is read again."""


class GrowingLog:
    """A log that grows, of text with rows in order of time; any other is read from its beginning each time.

    Parameters
    ----------
    path
        Path of the log.
    settings
        Settings by which it is read.

    Attributes
    ----------
    record
        Recording of the rows read so far; None before there are enough.
    offset
        Bytes read so far, up to the end of a line.
    """

    def __init__(self, path: Path, settings: Settings) -> None:
        self.path, self.settings = path, settings
        self.record: Recording | None = None
        self.offset, self._head = 0, b""

    def grow(self) -> bool:
        """Read the rows that were added, and return whether there were any.

        Raises
        ------
        DataError
            If the file cannot be opened.
        """
        with accessing(self.path, "", "cannot be read"), self.path.open("rb") as file:
            file.seek(self.offset)
            added = file.read()
        whole = added[: added.rfind(b"\n") + 1]
        if not whole:
            return False
        longer = self._appended(whole) if self.record and self._head else None
        if longer is None:
            return self._read_all()
        self.record, self.offset = longer, self.offset + len(whole)
        return True

    def _read_all(self) -> bool:
        """Read the file from its beginning; one that cannot be read yet is read again when it is longer."""
        text = self.path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        found = self._read(whole)
        self.offset = len(whole)
        if found is None:
            return False
        self.record = found
        # the lines above the rows; a log of several records or with rows that were refused is always read as a whole
        lines = whole.splitlines(keepends=True)
        self._head = b"" if found.rows_refused else b"".join(lines[: len(lines) - found.rows_kept])
        return True

    def _appended(self, rows: bytes) -> Recording | None:
        """Return the record with rows added; None where they are not read as those before them."""
        before = self.record
        new = self._read(self._head + rows)
        if (
            before is None
            or new is None
            or new.rows_refused
            or (new.units, list(new.channels))
            != (
                before.units,
                list(before.channels),
            )
        ):
            return None
        due = before.start + before.samples * before.dt
        drift = abs(new.dt - before.dt) * new.samples
        if max(abs(new.start - due), drift) > CLOCK_AGREEMENT * before.dt:
            return None
        joined = {n: np.concatenate([v, new.channels[n]]) for n, v in before.channels.items()}
        return replace(before, channels=joined, rows_kept=before.rows_kept + new.rows_kept)

    def _read(self, text: bytes) -> Recording | None:
        """Return the one recording that a text gives by the rules of the log's folder; None if there is no such."""
        with temporary.folder("watch") as place:
            copy = place / self.path.name
            copy.write_bytes(text)
            maps = mrfit.ingest.stage.maps_of([self.path], self.settings)
            try:
                found = mrfit.ingest.stage.read(
                    [copy], replace(self.settings, map=maps[0] if maps else None)
                ).recordings
            except DataError:
                return None
        return replace(found[0], source=str(self.path)) if len(found) == 1 else None
