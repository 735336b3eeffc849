"""The one way in which files of a workspace are written: beside their place, then renamed."""

import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from mrfit.errors import DataError
from mrfit.io.replaced import about_to_replace


def write_atomic(path: Path, write: Callable[[Path], object]) -> None:
    """Call ``write`` with a temporary name beside ``path``, flush to disk, rename.

    Raises
    ------
    DataError
        If the folder cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.unlink(missing_ok=True)  # a link of this name would be followed
        write(temporary)
        with temporary.open("rb") as handle:
            os.fsync(handle.fileno())
        about_to_replace(path, temporary)
        temporary.replace(path)
    except OSError as error:
        raise DataError(f"{path}: cannot write ({error.strerror or error}); choose another --work folder") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)
