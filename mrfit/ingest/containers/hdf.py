"""Named arrays of an HDF5 file, for the readers of HDF5 and of MATLAB 7.3."""

import math
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mrfit.core.recording import Finding
from mrfit.ingest.containers.arrays import WIDEST_MATRIX, Arrays, FileArray, check_times
from mrfit.ingest.containers.attributes import ScaledDataset, UnclearPacking, decoded, doubt_of, packing_of, units_in
from mrfit.ingest.containers.labels import MOST_LABELS
from mrfit.ingest.containers.shelf import Shelf, check_disk
from mrfit.ingest.refusal import Refusal, TransientRefusal, damaged
from mrfit.ingest.table import Source

DEEPEST_GROUP = 6
"""Structs in structs that are followed."""
LONGEST_FIXED_TEXT = 10_000
"""Bytes of a text of fixed length that is read."""
MOST_VALUES = 20_000
"""References that are followed: those of a few arrays, each to the next, may be more than there is time for."""


def hdf_arrays(source: Source, arrays: Arrays) -> Arrays:
    """Return ``arrays`` with the numeric datasets of a file, by their path with dots, and its attributes as scalars.

    Nothing outside the file is opened: neither links nor datasets that lead there.

    Raises
    ------
    Refusal
        If h5py is not installed, the file is damaged, its datasets need more memory or disk than there is, or there are
        many numbers and neither times nor a rate.
    """
    path = source.head.path
    with _opened(path) as file:
        found: list[tuple[str, Any]] = []
        file.visititems(lambda name, item: found.append((name, item)))
        arrays.outside = _links_outside(file, [file, *(item for _, item in found)])
        _expect(path, arrays, [item for name, item in found if not _is_matlabs(name)])
        sets = [(n, item) for n, item in found if _is_set(item)]
        described = [(n, unit) for n, item in sets for unit in units_in(item.attrs) or [""]]
        described += [(column, "") for _, item in sets for column in item.dtype.names or ()]
        attributes = [key for item in (file, *(item for _, item in found)) for key in item.attrs]
        check_times(source, described, attributes, sum(math.prod(item.shape) for _, item in sets))
        _attributes(arrays, "", file.attrs)
        for name, item in found:
            if not _is_matlabs(name):
                _visit(arrays, name, item)
    return arrays


@contextmanager
def matlab_variables(source: Source, arrays: Arrays) -> Iterator[dict[str, Any]]:
    """Give the variables of a MATLAB 7.3 file while it is open; say in ``arrays`` which lie in other files.

    Variables are arrays, texts, structs, and object arrays for cells and struct arrays. MATLAB keeps the elements of
    cells and struct arrays in ``#refs#`` and points to them; the fields of a struct array have no ``MATLAB_class`` of
    their own, those of a single struct have one. What points back to where it is pointed to from is left empty.

    Raises
    ------
    Refusal
        If h5py is not installed, the file is damaged, its arrays need more memory or disk than there is, or it holds
        too many references to follow.
    """
    path = source.head.path
    with _opened(path) as file:
        inside: list[tuple[str, Any]] = []
        file.visititems(lambda name, item: inside.append((name, item)))
        items = [item for _, item in inside]
        _expect(path, arrays, items)
        sets = [i for i in items if _is_set(i)]
        # axes of dSPACE's captures, and signals in cells, have names that are not seen from here
        if not any(n.endswith("/X") for n, _ in inside) and not any(i.dtype.kind == "O" for i in sets):
            check_times(source, [(n, "") for n, _ in inside], [], sum(math.prod(i.shape) for i in sets))
        arrays.outside = _links_outside(file, [file, *items])
        walk = _Walk(file, path, arrays)
        names = [n for n in file if not n.startswith("#") and _is_inside(file, n)]
        yield {name: walk.value(file[name], DEEPEST_GROUP) for name in names}


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    try:
        import h5py
    except ImportError:
        raise TransientRefusal(path, "HDF5 needs h5py", "install it: pip install 'mrfit[hdf5]'") from None
    try:
        with h5py.File(path, "r") as file:
            yield file
    except Exception as error:  # h5py raises whatever the library met in a damaged file
        raise damaged(path, "HDF5", error) from None


def _is_matlabs(name: str) -> bool:
    """Whether an object is one of those to which MATLAB's references point."""
    return name.startswith("#") or "/#" in name


def _is_inside(group: Any, name: str) -> bool:
    """Whether a member of a group lies in it, and is no link to elsewhere."""
    import h5py

    return isinstance(group.get(name, getlink=True), h5py.HardLink)


def _is_outside(item: Any) -> bool:
    """Whether the numbers of a dataset lie in other files."""
    virtual = item.is_virtual and any(part.file_name != "." for part in item.virtual_sources())
    return bool(virtual or item.external)


def _links_outside(file: Any, items: list[Any]) -> list[str]:
    """Return the names of datasets and links that lead to other files."""
    import h5py

    found = []
    for item in items:
        if hasattr(item, "shape"):
            found += [item.name.strip("/")] if _is_outside(item) else []
            continue
        for name in item if hasattr(item, "keys") else ():
            if isinstance(item.get(name, getlink=True), h5py.ExternalLink):
                found.append(f"{item.name}/{name}".strip("/"))
    return found


def _may_be_signals(item: Any) -> bool:
    """Whether a dataset has the shape of a signal or of a few side by side; others are not read."""
    shape = item.shape
    return shape is not None and (len(shape) < 2 or len(shape) == 2 and min(shape) <= WIDEST_MATRIX)


def _expect(path: Path, arrays: Arrays, items: list[Any]) -> None:
    """Check that there is room for the numbers of these objects, and to unpack each of their chunks."""
    sets = [item for item in items if _is_set(item)]
    long = [item for item in sets if _is_long(item, arrays.shelf)]
    if arrays.shelf:
        check_disk(path, sum(math.prod(item.shape) for item in long), arrays.shelf.folder)
    if room := arrays.room:
        short = [item for item in sets if not _is_long(item, arrays.shelf)]
        room.expect(sum(math.prod(item.shape) * len(item.dtype.names or "1") for item in short))
        for item in sets:
            chunk = 2.0 * math.prod(item.chunks or (0,)) * item.dtype.itemsize
            room.hold(f"'{item.name.strip('/')}' is packed in pieces", chunk)


def _is_set(item: Any) -> bool:
    return hasattr(item, "shape") and _may_be_signals(item)


def _is_long(item: Any, shelf: Shelf | None) -> bool:
    """Whether the numbers of a dataset are put on the disk rather than held in memory."""
    return bool(shelf and item.dtype.kind in "fiub" and item.shape and shelf.takes(max(item.shape)))


def _values(item: Any, shelf: Shelf | None) -> Any:
    """Return the numbers of a dataset, or what reads them slice by slice if it is long."""
    return FileArray(item, item.shape) if _is_long(item, shelf) else item[()]


@dataclass
class _Walk:
    """A walk through the variables of a MATLAB file along its references."""

    file: Any
    path: Path
    arrays: Arrays
    values: int = 0
    above: list[int] = field(default_factory=list)
    known: dict[int, Any] = field(default_factory=dict)

    def value(self, item: Any, depth: int) -> Any:
        """Return a variable, or an empty array where it is too deep or contains itself."""
        import h5py

        place = h5py.h5o.get_info(item.id).addr
        if depth == 0 or isinstance(item, h5py.Datatype) or place in self.above or "MATLAB_empty" in item.attrs:
            return np.empty(0)
        self.values += 1
        if self.values > MOST_VALUES:
            remedy = "save the signals as plain variables"
            raise Refusal(self.path, f"more than {MOST_VALUES} references from one variable to the next", remedy)
        self.above.append(place)
        try:
            return self._value(item, place, depth)
        finally:
            self.above.pop()

    def _value(self, item: Any, place: int, depth: int) -> Any:
        if not hasattr(item, "shape"):  # a group
            parts = {name: item[name] for name in item if _is_inside(item, name)}
            return _struct(parts, {name: self.value(part, depth - 1) for name, part in parts.items()})
        if _is_outside(item) or not _may_be_signals(item):
            return np.empty(0)
        if item.dtype.kind == "O":
            pointers = np.asarray(item).T.ravel()[:WIDEST_MATRIX]
            return _objects([self.value(self.file[p], depth - 1) for p in pointers if p])
        if place not in self.known:
            self.known[place] = _values(item, self.arrays.shelf)
        values = self.known[place]
        if item.attrs.get("MATLAB_class") == b"char" and not isinstance(values, FileArray):
            return "".join(chr(c) for c in values.T.ravel())
        return values.T


def _struct(parts: Mapping[str, Any], fields: dict[str, Any]) -> Any:
    """Return a struct, or an array of them where every field is an array of references."""
    listed = [n for n, part in parts.items() if hasattr(part, "shape") and "MATLAB_class" not in part.attrs]
    if listed and all(n in listed and fields[n].dtype == object for n in fields):
        rows = zip(*(fields[n].ravel() for n in listed), strict=True)
        return _objects([MatlabStruct(dict(zip(listed, row, strict=True))) for row in rows])
    return MatlabStruct(fields)


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
    dotted = name.replace("/", ".")
    if hasattr(item, "shape") and _may_be_signals(item) and not _is_outside(item):
        columns = item.dtype.names or ()
        units = units_in(item.attrs)
        written = dict(zip(columns, units, strict=True)) if len(columns) == len(units) else {}
        for column in columns:  # a table of several columns, as PyTables and numpy write them
            if item.dtype[column].kind in "fiu" and item.dtype[column].shape == ():
                arrays.add(f"{dotted}.{column}", np.asarray(item[column]), [written.get(column, "")])
        if item.dtype.kind in "fiu":
            _add(arrays, dotted, item, units)
        elif _is_text(item.dtype) and item.size <= MOST_LABELS:
            arrays.tell(dotted, _texts(item[()]))
    _attributes(arrays, dotted, item.attrs)


def _add(arrays: Arrays, name: str, item: Any, units: list[str]) -> None:
    """Take the numbers of a dataset as its attributes mean them."""
    try:
        packing = packing_of(item.attrs, item.shape, item.dtype, _unwritten(item))
    except UnclearPacking as unclear:
        arrays.findings.append(Finding("not-read", "", None, f"'{name}' cannot be unpacked, since {unclear}: left out"))
        return
    arrays.add(name, _values(item if packing is None else ScaledDataset(item, packing), arrays.shelf), units)
    if name in arrays.scalars or not _may_be_signals(item):
        return
    if packing and packing.scales:
        text = f"'{name}': stored numbers × {packing.scale} + {packing.offset}, as its attributes say"
        arrays.findings.append(Finding("unpacked", "", None, text))
    if doubt := doubt_of(item.attrs, packing):
        text = f"'{name}': {doubt}; a channel map can say another scale and offset"
        arrays.findings.append(Finding("packing-unclear", "", None, text))


def _unwritten(item: Any) -> float:
    """Return the number that a program chose for those that were never written; 0 if it chose nothing."""
    import h5py

    chosen = item.id.get_create_plist().fill_value_defined() == h5py.h5d.FILL_VALUE_USER_DEFINED
    return float(item.fillvalue) if chosen else 0.0


def _attributes(arrays: Arrays, name: str, attributes: Any) -> None:
    for key in attributes:
        about = attributes.get_id(key)
        size = 0 if about.shape is None else math.prod(about.shape)
        if size == 1 and about.dtype.kind in "fiu":
            arrays.scalars.setdefault(f"{name}.{key}", float(np.asarray(attributes[key]).reshape(())))
        elif 0 < size <= MOST_LABELS and _is_text(about.dtype):
            arrays.tell(f"{name}.{key}", _texts(attributes[key]))


def _is_text(kind: Any) -> bool:
    """Whether a type is that of texts, none so long that a few bytes may stand for more than there is room for."""
    import h5py

    return kind.itemsize <= LONGEST_FIXED_TEXT if kind.kind == "S" else h5py.check_string_dtype(kind) is not None


def _texts(values: Any) -> list[str]:
    return [decoded(text) for text in np.asarray(values).ravel().tolist()]
