"""A place on the disk for numbers that should not be held in memory, where a library gives them array by array."""

import shutil
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.ingest import series
from mrfit.ingest.containers.memory import FREE_MEMORY_SHARE, shown
from mrfit.ingest.refusal import TransientRefusal


@dataclass(frozen=True, slots=True)
class Shelf:
    """Place of the long arrays of one file.

    Attributes
    ----------
    folder
        Made at the first array; who made the object removes it.
    above
        Bytes of an array, as floats, from which it is put here.
    """

    folder: Path
    above: int

    def takes(self, size: int) -> bool:
        """Whether a column of ``size`` numbers is put here."""
        return 8 * size > self.above

    def put(self, array: Any, length: int, width: int) -> list[Array]:
        """Return the columns of an array of shape (length, width) as they lie on the disk.

        Raises
        ------
        DataError
            If the disk is full.
        """
        step = max(1, series.SERIES_CHUNK // width)
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            place = next(k for k in count() if not (self.folder / f"{k}-0").exists())
            paths = [self.folder / f"{place}-{k}" for k in range(width)]
            with ExitStack() as stack:
                files = [stack.enter_context(path.open("wb")) for path in paths]
                for begin in range(0, length, step):
                    values = np.asarray(array[begin : begin + step], dtype=np.float64)
                    for file, column in zip(files, values.T, strict=True):
                        file.write(np.ascontiguousarray(column).data)
        except OSError as error:
            if error.errno is None:
                raise  # a library's, of its own file
            raise DataError(f"{self.folder}: cannot write ({error.strerror or error})") from error
        return [series.stored(path, length) for path in paths]

    def kept(self, values: Array) -> Array:
        """Return an array as it is, or as it lies here if it is long."""
        return self.put(values[:, None], len(values), 1)[0] if self.takes(len(values)) else values


def check_disk(path: Path, numbers: float, folder: Path) -> None:
    """Refuse a file before its numbers fill the disk.

    Raises
    ------
    Refusal
        If they take more than half of what is free in ``folder``.
    """
    existing = next(p for p in (folder, *folder.parents) if p.exists())
    needed, free = 8.0 * numbers, float(shutil.disk_usage(existing).free)
    if needed > FREE_MEMORY_SHARE * free:
        text = f"its {numbers:.3g} numbers take {shown(needed)} of disk while they are read, and {shown(free)} are free"
        raise TransientRefusal(path, text, "choose another --work folder, or cut it into shorter logs")
