"""Tables of a workspace: columns of float64 in Parquet files, written and read row group by row group."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.arrow import floats, numbers
from mrfit.io.atomic import write_atomic
from mrfit.io.columns import columns_of, is_long
from mrfit.io.memory import check_room
from mrfit.io.unreadable import reading

ROW_GROUP = 1 << 20
"""Rows of a table written together."""


def write_table(
    path: Path,
    columns: Mapping[str, Array],
    metadata: Mapping[str, str] | None = None,
    more: Callable[[dict[str, str]], Mapping[str, str]] | None = None,
) -> None:
    """Write equal-length float64 columns as Parquet (zstd), atomically and one row group at a time.

    Columns are asked for their length and for slices only, once, so that they may be longer than memory.

    Parameters
    ----------
    path
        The file.
    columns
        Columns by name.
    metadata
        Texts kept with them.
    more
        Gives further metadata once all is written, by the columns' SHA-256.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    length = len(next(iter(columns.values()), ()))
    schema = pa.schema([(name, pa.float64()) for name in columns], dict(metadata or {}))

    def write(temporary: Path) -> None:
        digests = {name: hashlib.sha256() for name in columns}
        with pq.ParquetWriter(temporary, schema, compression="zstd", use_dictionary=False) as writer:
            for begin in range(0, max(length, 1), ROW_GROUP):
                slices = (values[begin : begin + ROW_GROUP] for values in columns.values())
                group = [np.ascontiguousarray(rows, dtype=np.float64) for rows in slices]
                for digest, rows in zip(digests.values(), group, strict=True):
                    digest.update(rows.data)
                writer.write_table(pa.Table.from_arrays([numbers(rows) for rows in group], schema=schema), ROW_GROUP)
            if more:
                writer.add_key_value_metadata(dict(more({n: d.hexdigest() for n, d in digests.items()})))

    write_atomic(path, write)


def read_table(
    path: Path, without: Sequence[str] = (), scratch: Path | None = None
) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns and metadata of a Parquet file written by ``write_table``, some columns left out.

    Those of a long one stay on disk where there is a folder for what is made of them, see ``columns``.

    Raises
    ------
    DataError
        If the file is missing or damaged, or too long for the memory there is.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    # read_table would import data sets and pandas (0.3 s)
    with reading(path, "run `mrfit ingest` again"), pq.ParquetFile(path) as file:
        names = [n for n in file.schema_arrow.names if n not in without]
        rows = file.metadata.num_rows
        if scratch and is_long(rows):
            return columns_of(path, names, rows, scratch), _decoded(file.metadata.metadata)
        check_room(f"{path}: its {rows} samples in {len(names)} columns", 8.0 * rows * len(names))
        columns = {name: np.empty(rows) for name in names}
        begin = 0
        # group by group, so that only one of them is in memory twice
        for group in range(file.num_row_groups):
            table = file.read_row_group(group, names)
            for name, values in columns.items():
                values[begin : begin + len(table)] = floats(table.column(name))
            begin += len(table)
        metadata = file.metadata.metadata
    # pyarrow keeps what it freed for itself
    pa.default_memory_pool().release_unused()
    return columns, _decoded(metadata)


def _decoded(metadata: Mapping[bytes, bytes] | None) -> dict[str, str]:
    return {k.decode(errors="replace"): v.decode(errors="replace") for k, v in (metadata or {}).items()}
