"""Message on a file that cannot be read."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from mrfit.errors import DataError

# What reading a table that somebody has edited may raise; pyarrow's own errors are among these
UNREADABLE = (OSError, TypeError, LookupError, ValueError, ArithmeticError, NotImplementedError, AttributeError)


@contextmanager
def reading(path: Path, remedy: str) -> Iterator[None]:
    """Name the file that cannot be read and the remedy."""
    try:
        yield
    except UNREADABLE as error:
        reason = str(error).partition("\n")[0]
        fault = "damaged, or another mrfit's: cannot be read" if path.exists() else "missing"
        raise DataError(f"{path}: {fault} ({reason}); {remedy}") from error
