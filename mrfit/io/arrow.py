"""Arrow columns made of buffers, and read from them: pyarrow's own conversions import pandas (0.2 to 0.5 s)."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from mrfit.core.specs import Array, Index

# Rows that a repeated text is written out for
ARROW_PART = 1 << 16


def numbers(values: ArrayLike) -> Any:
    """Return a column of float64, or of int64 where all values are whole numbers by type."""
    import pyarrow as pa

    given = np.asarray(values)
    rows = np.ascontiguousarray(given, np.int64 if given.dtype.kind == "i" else np.float64)
    return pa.Array.from_buffers(pa.from_numpy_dtype(rows.dtype), len(rows), [None, pa.py_buffer(rows)])


def floats(column: Any) -> Array:
    """Return the values of a chunked column of float64, nan for null."""
    chunks = []
    for chunk in column.chunks:
        sound = chunk.fill_null(np.nan) if chunk.null_count else chunk
        values = np.frombuffer(sound.buffers()[1], dtype=np.float64)
        chunks.append(values[sound.offset : sound.offset + len(sound)])
    return np.concatenate(chunks) if chunks else np.empty(0)


def codes(words: Any) -> Index:
    """Return the place in its dictionary of every value of a column of words without null."""
    places = words.indices
    values = np.frombuffer(places.buffers()[1], dtype=f"i{places.type.bit_width // 8}")
    return values[places.offset : places.offset + len(places)].astype(np.int64)


def texts(values: Sequence[str]) -> Any:
    """Return a column of texts."""
    import pyarrow as pa

    parts = [value.encode() for value in values]
    ends = np.cumsum([0, *map(len, parts)]).astype(np.int32)
    return pa.StringArray.from_buffers(len(parts), pa.py_buffer(ends), pa.py_buffer(b"".join(parts)))


def repeated(text: str, count: int) -> Any:
    """Return a column of one text so many times over, in parts that share their memory."""
    import pyarrow as pa

    part = texts([text] * min(count, ARROW_PART))
    return pa.chunked_array([*[part] * (count // ARROW_PART), part[: count % ARROW_PART]], pa.string())


def table(columns: dict[str, Any]) -> Any:
    """Return a table of columns by name."""
    import pyarrow as pa

    return pa.Table.from_arrays(list(columns.values()), names=list(columns))
