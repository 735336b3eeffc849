"""Checks of every reader, most of them on a log of the instrument's own."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mrfit.contracts.check import Check, check_of, need
from mrfit.core.protocols import Reader
from mrfit.core.recording import Recording
from mrfit.ingest.dispatch import FALLBACK, claims, reader_of
from mrfit.ingest.hashes import hash_of
from mrfit.ingest.meaning.channel_map import Rules
from mrfit.ingest.reading import OWN_FAULT, PLUGIN_FAULT, LogItem, LogOutcome, read_item
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.text.head import open_head

_OTHERS = {
    "plain.csv": b"time (s),force (N)\n" + b"".join(b"%d.%03d,%d\n" % (k // 1000, k % 1000, k % 7) for k in range(200)),
    "words.txt": b"Dear colleague,\nplease find the logs attached.\n" * 20,
    "numbers.txt": b"1 2 3\n4 5 6\n7 8 9\n" * 20,
    "bytes.bin": bytes(range(256)) * 40,
}
"""Files that are no instrument's."""


@dataclass(frozen=True)
class Case:
    """A reader with a log that it reads, and a folder for copies of this; without a log only its marks are checked.

    Attributes
    ----------
    reader
        The reader.
    folder
        An empty folder.
    name, data
        Name of the log, and its bytes; empty without a log.
    named
        Whether the reader knows its logs by their file's name too, or by other files beside them.
    whole
        Whether a log that breaks off cannot be read: compressed, or with its directory at the end.
    """

    reader: Reader
    folder: Path
    name: str = ""
    data: bytes = b""
    named: bool = False
    whole: bool = False

    def write(self, name: str = "", size: int | None = None) -> Path:
        """Write the log, or its beginning, under a name."""
        path = self.folder / (name or self.name if not self.named else self.name)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.data[:size])
        return path

    def read(self, path: Path) -> LogOutcome:
        """Return the result of reading a file."""
        return read_item(LogItem(((path, hash_of(path)),), reader_of(open_head(path)), Rules()))

    def recordings(self, path: Path) -> tuple[Recording, ...]:
        """Return the recordings of a file that can be read."""
        outcome = self.read(path)
        need(not outcome.refusals, f"refused: {'; '.join(str(r) for r in outcome.refusals)}")
        need(outcome.recordings, "no recording in it")
        return outcome.recordings


def specification_is_sound(case: Case) -> None:
    """The SPEC has a title, and parts of a record can be joined if there are some."""
    reader = case.reader
    need(reader.SPEC.title, "no title")
    need(hasattr(reader, "part") == hasattr(reader, "join"), "part and join belong together")
    need(hasattr(reader, "extent") == hasattr(reader, "read_blocks"), "extent and read_blocks belong together")


def files_of_nobody_are_not_claimed(case: Case) -> None:
    """It claims no file without its marks: a plain table, words, numbers, bytes."""
    for name, data in _OTHERS.items():
        path = case.folder / name
        path.write_bytes(data)
        need(case.reader.sniff(open_head(path)) is False, f"it claims {name}")


def own_log_is_claimed_by_it_alone(case: Case) -> None:
    """It claims its own log, and no other reader does."""
    own = case.reader.SPEC.name
    claimed = claims(open_head(case.write()))
    need(claimed == ([] if own == FALLBACK else [own]), f"claimed by {' and '.join(claimed) or 'none'}")


def own_log_is_read(case: Case) -> None:
    """It reads its own log into channels of finite samples at one rate."""
    for record in case.recordings(case.write()):
        need(record.reader == case.reader.SPEC.name, f"read by {record.reader}")
        need(record.channels, "no channel")
        need(np.isfinite(record.dt) and record.dt > 0.0, f"sample interval {record.dt}")
        for name, values in record.channels.items():
            need(len(values) == record.rows_kept > 0, f"{name} has {len(values)} samples of {record.rows_kept}")
            need(np.isfinite(np.asarray(values)).any(), f"{name} has no number")


def file_name_does_not_matter(case: Case) -> None:
    """The log is read under any name."""
    wanted = [np.asarray(v) for r in case.recordings(case.write()) for v in r.channels.values()]
    for name in ("renamed.bin", "extensionless", "UPPER.TXT"):
        found = [np.asarray(v) for r in case.recordings(case.write(f"other/{name}")) for v in r.channels.values()]
        same = len(found) == len(wanted) and all(map(np.array_equal, found, wanted))
        need(same, f"something else is read from {name}")


def half_a_log_is_read_as_far_as_it_goes(case: Case) -> None:
    """A log that breaks off is read as far as it goes."""
    whole = case.recordings(case.write())[0]
    half = case.recordings(case.write("half/" + case.name, len(case.data) // 2))[0]
    cut = half.rows_kept - 1  # the last row may be cut inside a number
    need(cut > 0.3 * whole.rows_kept, f"{half.rows_kept} rows of {whole.rows_kept} are read of half the file")
    for name, values in half.channels.items():
        wanted = np.asarray(whole.channels[name])[:cut]
        need(np.allclose(np.asarray(values)[:cut], wanted, rtol=1e-12, atol=0.0, equal_nan=True), f"{name} differs")


def _one_line(refusals: tuple[Refusal, ...], what: str) -> None:
    need([str(r).count("\n") for r in refusals] == [0], f"{what}: {len(refusals)} refusals, or of several lines")
    need(all(r.remedy for r in refusals), f"{what}: it does not say what to do")
    need(not any(r.reason.startswith((OWN_FAULT, PLUGIN_FAULT)) for r in refusals), f"{what}: {refusals[0].reason}")


def half_a_log_is_refused_in_one_line(case: Case) -> None:
    """A log that breaks off is refused in one line, since it can only be read as a whole."""
    outcome = case.read(case.write("half/" + case.name, len(case.data) // 2))
    need(not outcome.recordings, "it is read all the same")
    _one_line(outcome.refusals, "half the file")


def first_bytes_end_in_one_line(case: Case) -> None:
    """The first bytes alone are refused in one line."""
    path = case.write("first/" + case.name, 20)
    try:
        outcome = case.read(path)
    except Refusal as refusal:
        return _one_line((refusal,), "20 bytes")
    need(not outcome.recordings, "something is read from 20 bytes")
    _one_line(outcome.refusals, "20 bytes")


def _has_log(case: Case) -> bool:
    return bool(case.data)


READER_CHECKS: tuple[Check[Case], ...] = (
    check_of(specification_is_sound),
    check_of(files_of_nobody_are_not_claimed, lambda c: c.reader.SPEC.name != FALLBACK),
    check_of(own_log_is_claimed_by_it_alone, _has_log),
    check_of(own_log_is_read, _has_log),
    check_of(file_name_does_not_matter, lambda c: _has_log(c) and not c.named),
    check_of(half_a_log_is_read_as_far_as_it_goes, lambda c: _has_log(c) and not c.whole),
    check_of(half_a_log_is_refused_in_one_line, lambda c: _has_log(c) and c.whole),
    check_of(first_bytes_end_in_one_line, _has_log),
)
