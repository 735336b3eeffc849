"""Named arrays of an HDF5 file, for the readers of HDF5 and of MATLAB 7.3."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.ingest.arrays import Arrays
from mrfit.ingest.refusal import Refusal

UNIT_KEYS = ("unit", "units", "Unit", "Units")


def hdf_arrays(path: Path) -> Arrays:
    """Return the numeric datasets of a file, by their path with dots, and numeric attributes as scalars.

    Raises
    ------
    Refusal
        If h5py is not installed or the file is damaged.
    """
    try:
        import h5py
    except ImportError:
        raise Refusal(path, "HDF5 needs h5py", "install it: pip install 'mrfit[hdf5]'") from None
    arrays = Arrays()
    try:
        with h5py.File(path, "r") as file:
            _attributes(arrays, "", file.attrs)
            file.visititems(lambda name, item: _visit(arrays, name, item))
    except Exception as error:  # h5py raises whatever the library met in a damaged file
        raise Refusal(path, f"damaged HDF5 ({str(error).splitlines()[0]})", "copy it again") from None
    return arrays


def _visit(arrays: Arrays, name: str, item: Any) -> None:
    if name.startswith("#") or "/#" in name:
        return  # MATLAB keeps its references there
    dotted = name.replace("/", ".")
    if hasattr(item, "shape"):
        if item.dtype.kind in "fiu" and item.attrs.get("MATLAB_class") != b"char":
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
