"""MATLAB MAT-files: version 5 (scipy) and 7.3 (h5py), plain variables, structs, and dSPACE's X/Y structs."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.ingest.arrays import Arrays, tables_of
from mrfit.ingest.hdf import hdf_arrays
from mrfit.ingest.head import Head
from mrfit.ingest.refusal import Refusal
from mrfit.ingest.table import Source, Table
from mrfit.specs import ReaderSpec

SPEC = ReaderSpec("matlab", "MATLAB MAT-file")
FRAGILE = True  # read in a process of its own: the library crashes on some damaged files
DEEPEST = 6


def sniff(head: Head) -> bool:
    """Whether the file begins as MATLAB writes it."""
    return head.raw.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file"))


def read(source: Source) -> list[Table]:
    """Return the vectors as tables; a matrix ``x`` gives columns ``x[0]``, ``x[1]`` and so on.

    Raises
    ------
    Refusal
        If the file is damaged or holds no vectors.
    """
    path = source.head.path
    if source.head.raw.startswith(b"MATLAB 7.3"):
        return tables_of(hdf_arrays(path), source)
    arrays = Arrays()
    for name, value in _variables(path).items():
        if not name.startswith("__"):
            _take(arrays, name, value, DEEPEST)
    return tables_of(arrays, source)


def _variables(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a variable that stands twice, an unknown opaque class
            return dict(loadmat(path, struct_as_record=False, squeeze_me=True))
    except Exception as error:  # scipy raises whatever it met in a damaged file
        text = (str(error).splitlines() or ["unreadable"])[0]
        raise Refusal(path, f"damaged MAT-file ({text})", "save it again, as version 7 or 7.3") from None


def _take(arrays: Arrays, name: str, value: Any, depth: int) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is None:
        if not (isinstance(value, np.ndarray) and value.dtype == object):
            arrays.add(name, value)
        return
    if depth == 0:
        return
    if {"X", "Y"} <= set(fields):
        _take_dspace(arrays, value)
        return
    for field in fields:
        _take(arrays, f"{name}.{field}", getattr(value, field), depth - 1)


def _take_dspace(arrays: Arrays, value: Any) -> None:
    """Take a dSPACE capture: X.Data is time, every Y has Name, Unit and Data."""
    for entry in np.atleast_1d(value.X):
        if hasattr(entry, "Data"):
            arrays.add("time", entry.Data)
    for entry in np.atleast_1d(value.Y):
        if hasattr(entry, "Data") and hasattr(entry, "Name"):
            unit = getattr(entry, "Unit", "")
            arrays.add(str(entry.Name), entry.Data, unit if isinstance(unit, str) else "")
