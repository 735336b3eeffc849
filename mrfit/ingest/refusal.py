"""The error of a log that cannot be read, with its remedy apart, as ingest.json lists it."""

import errno
from os import fsencode
from pathlib import Path

from mrfit.errors import DataError, MissingResource, MrfitError
from mrfit.io.escapes import visible

LONGEST_REASON = 400


class Refusal(DataError):
    """A log cannot be used.

    Parameters
    ----------
    path
        The log.
    reason
        What is wrong, with row and value where there is one.
    remedy
        What to do about it.
    """

    def __init__(self, path: Path | str, reason: str, remedy: str) -> None:
        reason, remedy = (
            excerpt(reason, LONGEST_REASON),
            excerpt(remedy, LONGEST_REASON),
        )  # a damaged file's text may be anything
        self.path, self.reason, self.remedy = in_unicode(path), reason, remedy
        super().__init__(f"{excerpt(visible(self.path), 10 * LONGEST_REASON)}: {reason}; {remedy}")

    def __reduce__(self) -> tuple[type["Refusal"], tuple[str, str, str]]:
        """Pickle by the three parts, so that it can leave a worker process."""
        return type(self), (self.path, self.reason, self.remedy)


class TransientRefusal(Refusal, MissingResource):
    """A log that cannot be used here and now, and is looked at again the next time."""


def damaged(path: Path, kind: str, error: Exception, remedy: str = "copy it again") -> Refusal:
    """Return the refusal of a file on which a library raised whatever it met."""
    refused_memory = isinstance(error, MemoryError) or isinstance(error, OSError) and error.errno == errno.ENOMEM
    if refused_memory or isinstance(error, MrfitError):
        raise error  # no fault of the library's; who set a limit to memory knows what it is
    return Refusal(path, f"damaged {kind} ({(str(error).splitlines() or ['unreadable'])[0]})", remedy)


def in_unicode(path: Path | str) -> str:
    r"""Return a path as text that can be written: bytes that are no UTF-8 as ``\xe9``."""
    return fsencode(path).decode("utf-8", "backslashreplace")


def excerpt(line: str, length: int = 60) -> str:
    """Return the beginning of a line, printable, for an error message."""
    shown = "".join(c if c.isprintable() else " " for c in line).strip()
    return shown if len(shown) <= length else shown[: length - 1] + "…"
