"""The error of a log that cannot be read, with its remedy apart, as ingest.json lists it."""

from pathlib import Path

from mrfit.errors import DataError

LONGEST = 400


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
        reason, remedy = excerpt(reason, LONGEST), excerpt(remedy, LONGEST)  # a damaged file's text may be anything
        super().__init__(f"{path}: {reason}; {remedy}")
        self.path, self.reason, self.remedy = str(path), reason, remedy

    def __reduce__(self) -> tuple[type["Refusal"], tuple[str, str, str]]:
        """Pickle by the three parts, so that it can leave a worker process."""
        return Refusal, (self.path, self.reason, self.remedy)


def excerpt(line: str, length: int = 60) -> str:
    """Return the beginning of a line, printable, for an error message."""
    shown = "".join(c if c.isprintable() else " " for c in line).strip()
    return shown if len(shown) <= length else shown[: length - 1] + "…"
