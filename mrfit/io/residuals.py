"""The table of what a fit measured and simulated, residuals.parquet, as it is read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.io.arrow import codes, floats

RESIDUAL_KEYS = ("condition", "segment", "role")
"""Its columns that say where a row belongs."""
Key = tuple[str, str, str]


def read_residuals(path: Path) -> Iterator[tuple[Key, dict[str, Array]]]:
    """Yield condition, segment and role of rows of residuals.parquet that stand together, and their other columns.

    Raises
    ------
    DataError
        If the file is missing or damaged.
    """
    import pyarrow.parquet as pq

    try:
        # words as numbers, and one row group after the other: an hour at 10 kHz has 36 million rows
        with pq.ParquetFile(path, read_dictionary=list(RESIDUAL_KEYS)) as file:
            for group in range(file.num_row_groups):
                yield from _runs(file.read_row_group(group))
    except (OSError, ValueError, KeyError) as error:
        raise unreadable(path, error) from error


def unreadable(path: Path, error: Exception) -> DataError:
    """Return the error on a table of residuals that cannot be read."""
    reason = str(error).splitlines()[0]
    return DataError(f"{path}: cannot be read ({reason}); delete its folder and run `mrfit fit` again")


def _runs(rows: Any) -> Iterator[tuple[Key, dict[str, Array]]]:
    words = [rows.column(k).combine_chunks() for k in RESIDUAL_KEYS]
    places = np.stack([codes(w) for w in words])
    edges = np.flatnonzero(np.any(np.diff(places, axis=1) != 0, axis=0)) + 1
    columns = {n: floats(rows.column(n)) for n in rows.column_names if n not in RESIDUAL_KEYS}
    for begin, end in zip([0, *edges.tolist()], [*edges.tolist(), len(rows)], strict=True):
        found = (str(w.dictionary[int(code)].as_py()) for w, code in zip(words, places[:, begin], strict=True))
        yield cast(Key, tuple(found)), {name: values[begin:end] for name, values in columns.items()}
