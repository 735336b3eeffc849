"""MATLAB MAT-files: versions 4 and 5 (scipy) and 7.3 (h5py), plain variables, structs, cells, and dSPACE's captures.

dSPACE ControlDesk captures, as they stand in a MAT-file: time axes in ``X``, signals in ``Y``.
"""

import math
import re
import struct
import warnings
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from mrfit.core.recording import Finding
from mrfit.core.specs import ReaderSpec
from mrfit.ingest.containers.arrays import WIDEST_MATRIX, Arrays, check_times, tables_of
from mrfit.ingest.containers.hdf import matlab_variables
from mrfit.ingest.containers.labels import LONGEST_LABEL
from mrfit.ingest.containers.shelf import Shelf, check_disk
from mrfit.ingest.refusal import damaged
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.head import Head

PORT = re.compile(r"(In|Out|Input|Output|Value)\d*", re.IGNORECASE)


def captures_of(value: Any, like: Arrays) -> list[Arrays]:
    """Return the arrays of a capture, one set for each time axis that signals belong to.

    ``X(k).Data`` is a time axis in s. ``Y(i)`` has ``Name`` (a path through the model), ``Data``, often ``Unit``, and
    says its axis by ``XIndex`` (from 1) or ``Raster``; where it says neither, the axis of its length is meant. Where
    no axis holds data, ``Capture.SamplingPeriod`` times ``Capture.Downsampling`` is the interval. Numbers are kept as
    ``like`` keeps them.
    """
    axes = [x for x in np.atleast_1d(value.X) if np.size(getattr(x, "Data", ())) > 1]
    sets = [like.another() for _ in axes] or [like.another()]
    for axis, arrays in zip(axes, sets, strict=False):
        arrays.add("time", axis.Data, ["s"])
    if not axes and (interval := _interval(getattr(value, "Capture", None))):
        sets[0].scalars["dt"] = interval
    for entry in np.atleast_1d(value.Y):
        if hasattr(entry, "Data") and hasattr(entry, "Name"):
            arrays = sets[_axis_of(entry, list(np.atleast_1d(value.X)), axes)]
            unit = getattr(entry, "Unit", "")
            arrays.add(_name(str(entry.Name), arrays), entry.Data, [unit] if isinstance(unit, str) else [])
    return [arrays for arrays in sets if len(arrays.signals) > (1 if axes else 0)]


def _axis_of(entry: Any, all_axes: list[Any], axes: list[Any]) -> int:
    index, raster, size = getattr(entry, "XIndex", None), getattr(entry, "Raster", None), np.size(entry.Data)
    if isinstance(index, (int, float, np.number)) and 1 <= index <= len(all_axes):
        chosen = all_axes[int(index) - 1]
        if found := [k for k, axis in enumerate(axes) if axis is chosen]:
            return found[0]
    fitting = [k for k, axis in enumerate(axes) if np.size(axis.Data) == size]
    named = [k for k in fitting if isinstance(raster, str) and raster and getattr(axes[k], "Raster", None) == raster]
    return (named or fitting or [0])[0]


def _interval(capture: Any) -> float:
    period, every = getattr(capture, "SamplingPeriod", 0.0), getattr(capture, "Downsampling", 1)
    numbers = isinstance(period, (int, float, np.number)) and isinstance(every, (int, float, np.number))
    return float(period) * float(every) if numbers else 0.0


def _name(path: str, arrays: Arrays) -> str:
    """Return a signal's own name: the last part of ``"Model Root"/"Rig"/"force"/"Out1"`` that is no port."""
    parts = [p.strip(' "[]{}') for p in re.split(r"[/\\]", path)]
    parts = [p for p in parts if p] or ["signal"]
    if len(parts) > 1 and PORT.fullmatch(parts[-1]):
        parts.pop()
    for first in range(len(parts) - 1, -1, -1):
        if (name := ".".join(parts[first:])) not in arrays.signals:
            return name
    return f"{parts[-1]}_{len(arrays.signals)}"


SPEC = ReaderSpec("matlab", "MATLAB MAT-file", fragile=True, libraries=("scipy.io", "h5py"))
DEEPEST_STRUCT = 6
HEADER = 128
"""Bytes before the first element of a version 5 file; the last two say the order of bytes."""
HEADER_4, LONGEST_NAME_4 = 20, 64
"""Bytes of the header of a matrix in a version 4 file, and of the longest name behind it."""
COMPRESSED = 15
"""Type of an element that is another one, deflated."""
NUMERIC = ("double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "logical")
MATRIX_PIECE = 1 << 20
"""Bytes unpacked at once where they are only counted."""
CATMAN_DATA, CATMAN_HEADER, CATMAN_FILE = "_Data", "_Header", "File_Header"
"""Ends of the names of a channel's numbers and of what is said of them in catman's MAT-files, and that of the file."""


def sniff(head: Head) -> bool:
    """Whether the file begins as MATLAB writes it."""
    return head.raw.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")) or is_version_4(head.raw)


def is_version_4(raw: bytes) -> bool:
    """Whether bytes begin as a MAT-file of version 4: with the header of a matrix, which ends in the matrix's name."""
    if len(raw) < HEADER_4:
        return False
    for order in "<>":
        kind, *shape, imaginary, length = struct.unpack(f"{order}5i", raw[:HEADER_4])
        name = raw[HEADER_4 : HEADER_4 + length]
        # thousands say the order of bytes, tens the type of the numbers, ones whether it is a text
        known = kind in (
            thousands + tens + ones for thousands in (0, 1000) for tens in range(0, 60, 10) for ones in (0, 1)
        )
        whole = known and (kind >= 1000) == (order == ">") and imaginary in (0, 1) and min(shape) > 0
        if whole and 1 < length <= LONGEST_NAME_4 and re.fullmatch(rb"[A-Za-z]\w*\0+", name):
            return True
    return False


def read(source: Source) -> list[Table]:
    """Return the vectors as tables; a matrix ``x`` gives columns ``x[0]``, ``x[1]`` and so on.

    Every time axis of a dSPACE capture gives a table of its own.

    Raises
    ------
    Refusal
        If the file is damaged or holds no vectors.
    """
    path = source.head.path
    found = _FileArrays(Arrays(room=source.room(), shelf=source.shelf), [])
    if source.head.raw.startswith(b"MATLAB 7.3"):
        with matlab_variables(source, found.arrays) as variables:
            for name, value in variables.items():
                _take(found, name, value, DEEPEST_STRUCT)
    else:
        for variables in _variables(path, source):
            for name, value in variables.items():
                _take(found, name, value, DEEPEST_STRUCT)
    told_by_headers(found.arrays)
    tables = [table for arrays in found.captures for table in tables_of(arrays, source)]
    if not tables:
        return tables_of(found.arrays, source)
    if beside := ", ".join(f"'{n}'" for n in found.arrays.signals):
        left = Finding("not-read", "", None, f"arrays beside the capture are left out: {beside}")
        tables[0] = replace(tables[0], findings=(*tables[0].findings, left))
    return tables


@dataclass(slots=True)
class _FileArrays:
    """The plain arrays of a file, and those of each time axis of its dSPACE captures."""

    arrays: Arrays
    captures: list[Arrays]


def _variables(path: Path, source: Source) -> Iterator[dict[str, Any]]:
    """Yield the variables in the order of the file, long ones one by one, so that each is put away before the next."""
    from scipy.io import loadmat, whosmat

    room = source.room()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # a variable that stands twice, an unknown opaque class
            about = whosmat(path)
            if all(kind in (*NUMERIC, "char") for _, _, kind in about):  # what is in structs is not seen from here
                check_times(source, [(n, "") for n, _, _ in about], [], sum(math.prod(shape) for _, shape, _ in about))
            plain = not source.head.raw.startswith(b"MATLAB")  # version 4 packs nothing
            sizes = [float(source.head.size)] if plain else unpacked_sizes(path, 4.0 * room.limit)
            long = _long_ones(path, source.shelf, sizes)
            together = sum(sizes) - sum(long.values())
            room.hold("its variables unpack to arrays", 2.0 * max([together, *long.values()]))
            load = partial(loadmat, path, struct_as_record=False, squeeze_me=True)
            if not long:
                yield load()
                return
            order = [name for name, _, _ in whosmat(path)]
            others = load(variable_names=[n for n in order if n not in long])
            for name in order:
                yield load(variable_names=[name]) if name in long else {name: others[name]}
    except Exception as error:  # scipy raises whatever it met in a damaged file
        raise damaged(path, "MAT-file", error, "save it again, as version 7 or 7.3") from None


def _long_ones(path: Path, shelf: Shelf | None, sizes: list[float]) -> dict[str, float]:
    """Return the numeric variables that are put on the disk rather than held in memory, with their bytes."""
    if shelf is None or max(sizes, default=0.0) <= shelf.above:
        return {}
    from scipy.io import whosmat

    about = whosmat(path)
    if len(about) != len(sizes) or len({name for name, _, _ in about}) < len(about):
        return {}
    long = {n: math.prod(shape) for n, shape, kind in about if kind in NUMERIC and shelf.takes(max(shape, default=0))}
    check_disk(path, sum(long.values()), shelf.folder)
    return {name: size for (name, _, _), size in zip(about, sizes, strict=True) if name in long}


def unpacked_sizes(path: Path, enough: float) -> list[float]:
    """Return the bytes that each element of a version 5 file unpacks to, counted until they are ``enough`` together."""
    sizes: list[float] = []
    with path.open("rb") as handle:
        order = ">" if handle.read(HEADER)[-2:] == b"MI" else "<"
        while sum(sizes) <= enough and len(tag := handle.read(8)) == 8:
            kind, size = struct.unpack(f"{order}2I", tag)
            if kind == COMPRESSED:
                sizes.append(_inflated_size(handle, size, enough - sum(sizes)))
            else:
                sizes.append(float(size))
                handle.seek(size, 1)
    return sizes


def _inflated_size(handle: BinaryIO, size: int, enough: float) -> float:
    """Return the bytes that the ``size`` deflated ones at hand unpack to."""
    stream, total, end = zlib.decompressobj(), 0.0, handle.tell() + size
    while total <= enough and not stream.eof and (raw := handle.read(min(MATRIX_PIECE, end - handle.tell()))):
        while raw and total <= enough:
            total += len(stream.decompress(raw, MATRIX_PIECE))
            raw = stream.unconsumed_tail
    handle.seek(end)
    return total


def _take(found: _FileArrays, name: str, value: Any, depth: int) -> None:
    fields = getattr(value, "_fieldnames", None)
    if fields is None:
        if not (isinstance(value, np.ndarray) and value.dtype == object):
            found.arrays.add(name, value)
        elif value.size and all(isinstance(item, str) for item in value.ravel()):
            found.arrays.tell(name, value.ravel().tolist())
        elif depth and value.size <= WIDEST_MATRIX:  # a cell array, or a struct array such as Simulink's signals
            for k, item in enumerate(value.ravel()):
                _take(found, f"{name}{_label(item) or f'[{k}]'}", item, depth - 1)
        return
    if depth == 0:
        return
    if {"X", "Y"} <= set(fields):
        found.captures += captures_of(value, found.arrays)
        return
    for field in fields:
        item = getattr(value, field)
        _take(found, f"{name}.{field}{_label(item)}", item, depth - 1)


def _label(item: Any) -> str:
    """Return the label that Simulink gives a signal, as a part of a path; empty without one."""
    label = getattr(item, "label", "")
    return f".{label}" if isinstance(label, str) and label else ""


def told_by_headers(arrays: Arrays) -> None:
    """Give the channels of a MAT-file as catman exports it the name, the unit and the rate of their headers.

    ``Channel_1_Header`` has ``SignalName``, ``Unit`` and ``SampleFrequency`` of ``Channel_1_Data``; the rate that
    ``File_Header`` states is that of the quickest.
    """
    texts = arrays.texts
    held: tuple[dict[str, Any], ...] = (arrays.texts, arrays.scalars)
    for name in [n for n in arrays.signals if n.endswith(CATMAN_DATA)]:
        head = f"{name.removesuffix(CATMAN_DATA)}{CATMAN_HEADER}."
        if label := texts.get(f"{head}SignalName"):
            arrays.labels[name] = label[:LONGEST_LABEL]
        if unit := texts.get(f"{head}Unit"):
            arrays.units.setdefault(name, unit)
        for told in held:
            if (rate := told.pop(f"{head}SampleFrequency", None)) is not None:
                told[f"{name}.SampleFrequency"] = rate
                for of_file in held:
                    of_file.pop(f"{CATMAN_FILE}.SampleFrequency", None)
