"""Named arrays of an HDF5 file, for the readers of HDF5 and of MATLAB 7.3."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.ingest.arrays import WIDEST, Arrays
from mrfit.ingest.refusal import Refusal

UNIT_KEYS = ("unit", "units", "Unit", "Units")
DEEPEST = 6
"""Structs in structs that are followed; damaged references may go in circles."""


def hdf_arrays(path: Path) -> Arrays:
    """Return the numeric datasets of a file, by their path with dots, and numeric attributes as scalars.

    Raises
    ------
    Refusal
        If h5py is not installed or the file is damaged.
    """
    arrays = Arrays()
    with _opened(path) as file:
        _attributes(arrays, "", file.attrs)
        file.visititems(lambda name, item: _visit(arrays, name, item))
    return arrays


def matlab_variables(path: Path) -> dict[str, Any]:
    """Return the variables of a MATLAB 7.3 file: arrays, texts, structs, and object arrays for cells and struct arrays.

    MATLAB keeps the elements of cells and struct arrays in ``#refs#`` and points to them; the fields of a struct array
    have no ``MATLAB_class`` of their own, those of a single struct have one.

    Raises
    ------
    Refusal
        If h5py is not installed or the file is damaged.
    """
    with _opened(path) as file:
        return {name: _matlab_value(item, file, DEEPEST) for name, item in file.items() if not name.startswith("#")}


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        import h5py
    except ImportError:
        raise Refusal(path, "HDF5 needs h5py", "install it: pip install 'mrfit[hdf5]'") from None
    try:
        with h5py.File(path, "r") as file:
            yield file
    except Exception as error:  # h5py raises whatever the library met in a damaged file
        text = (str(error).splitlines() or ["unreadable"])[0]
        raise Refusal(path, f"damaged HDF5 ({text})", "copy it again") from None


def _matlab_value(item: Any, file: Any, depth: int) -> Any:
    if depth == 0 or "MATLAB_empty" in item.attrs:
        return np.empty(0)
    if not hasattr(item, "shape"):
        fields = {name: _matlab_value(part, file, depth - 1) for name, part in item.items()}
        listed = [n for n, part in item.items() if hasattr(part, "shape") and "MATLAB_class" not in part.attrs]
        if listed and all(n in listed and fields[n].dtype == object for n in fields):
            rows = zip(*(fields[n].ravel() for n in listed), strict=True)
            return _objects([MatlabStruct(dict(zip(listed, row, strict=True))) for row in rows])
        return MatlabStruct(fields)
    values = np.asarray(item)
    if item.dtype.kind == "O":
        pointers = values.T.ravel()[:WIDEST]
        return _objects([_matlab_value(file[p], file, depth - 1) for p in pointers if p])
    if item.attrs.get("MATLAB_class") == b"char":
        return "".join(chr(c) for c in values.T.ravel())
    return values.T


class MatlabStruct:
    """A struct as scipy shows those of older files: its fields as attributes, their names in ``_fieldnames``."""

    def __init__(self, fields: dict[str, Any]) -> None:
        self.__dict__.update(fields)
        self._fieldnames = list(fields)


def _objects(items: list[Any]) -> Any:
    made = np.empty(len(items), dtype=object)
    for k, item in enumerate(items):
        made[k] = item
    return made


def _visit(arrays: Arrays, name: str, item: Any) -> None:
    if name.startswith("#") or "/#" in name:
        return  # MATLAB keeps its references there
    dotted = name.replace("/", ".")
    if hasattr(item, "shape"):
        for field in item.dtype.names or ():  # a table of several columns, as PyTables and numpy write them
            if item.dtype[field].kind in "fiu" and item.dtype[field].shape == ():
                arrays.add(f"{dotted}.{field}", np.asarray(item[field]))
        if item.dtype.kind in "fiu":
            unit = next((_text(item.attrs[k]) for k in UNIT_KEYS if k in item.attrs), "")
            arrays.add(dotted, np.asarray(item), unit)
    _attributes(arrays, dotted, item.attrs)


def _attributes(arrays: Arrays, name: str, attributes: Mapping[str, Any]) -> None:
    for key, value in attributes.items():
        number = np.asarray(value)
        if number.size == 1 and number.dtype.kind in "fiu":
            arrays.scalars.setdefault(f"{name}.{key}", float(number.reshape(())))


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
