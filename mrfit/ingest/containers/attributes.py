"""Attributes of an array: units of its numbers, their packing, and numbers that stand for missing ones.

Packing and marks follow the conventions of NetCDF (CF): marks are compared with the stored numbers, which are scaled
afterwards.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mrfit.core.specs import Array

UNIT_KEYS = ("unit", "units", "unit_string", "ni_unitdescription")
SCALE_ATTRIBUTES, OFFSET_ATTRIBUTES = ("scale_factor", "gain", "conversion"), ("add_offset", "intercept", "offset")
COUNTED_SCALES = ("scale", "slope")
"""Words for the factor of whole numbers; beside measured ones they may mean anything."""
OTHER_FACTOR_ATTRIBUTES = (
    *("multiplier", "factor", "scaling", "zero", "bias"),
    *("sensitivity", "calibration", "calibration_factor", "conversion_factor", "lsb"),
)
"""More words of that kind, which are said and never applied."""
FILL_ATTRIBUTES = ("_fillvalue", "missing_value", "fillvalue", "fill_value", "missingvalue", "nodata", "nodata_value")


class UnclearPacking(ValueError):
    """A factor or an offset that does not fit its array; the text says which."""


class _LowerCaseAttributes(Mapping[str, Any]):
    """Attributes by their keys in lower-case letters, each read only when it is asked for."""

    def __init__(self, about: Mapping[Any, Any]) -> None:
        self.about = about
        self.keys_of = {decoded(key).lower(): key for key in about}

    def __getitem__(self, key: str) -> Any:
        return self.about[self.keys_of[key]]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys_of)

    def __len__(self) -> int:
        return len(self.keys_of)


def units_in(about: Mapping[Any, Any]) -> list[str]:
    """Return the unit texts that attributes state: none, one, or one for each column; keys of any case, even bytes."""
    named = _LowerCaseAttributes(about)
    value = next((named[k] for k in UNIT_KEYS if k in named), None)
    array = np.asarray("" if value is None or not hasattr(value, "__len__") else value)
    if array.dtype.kind in "iu":  # the codes of its letters
        array = np.asarray(bytes(array.astype(np.uint8).ravel()))
    texts = [decoded(t) for t in array.ravel()] if array.dtype.kind in "SUO" else []
    return texts if any(texts) else []


def unit_beside(name: str, texts: Mapping[str, str], marks: Sequence[str], columns: Iterable[str] = ()) -> str:
    """Return the text that states the unit of a number, as ``dt_unit`` or ``units.dt`` of ``dt``; empty without one.

    It stands beside the number or in a group further out.

    Parameters
    ----------
    name
        Of the number.
    texts
        Texts by name, of any case, but for those of another column: ``T_unit`` is no text of ``t`` beside ``T``.
    marks
        What may stand between a name and the word for its unit.
    columns
        Names of all columns.
    """
    plain = {key.lstrip("."): text for key, text in texts.items()}
    twins = (n for n in columns if n != name and n.lower() == name.lower())
    of_twins = {key for twin in twins for key in _unit_keys(twin, marks)}
    low = {key.lower(): text for key, text in plain.items() if key not in of_twins}
    found = (plain.get(key) or low.get(key.lower()) for key in _unit_keys(name, marks))
    return next(filter(None, found), "")


def _unit_keys(name: str, marks: Sequence[str]) -> Iterator[str]:
    """Yield the names of a text that states a unit, from the nearest place to the farthest."""
    parents, leaf = name.split(".")[:-1], name.rpartition(".")[2]
    words = [word for key in UNIT_KEYS[:2] for word in (key, key.capitalize(), key.upper())]
    beside = [*(f"{leaf}{mark}{word}" for mark in marks for word in words), *(f"{word}.{leaf}" for word in words)]
    for depth in range(len(parents), -1, -1):
        yield from (".".join([*parents[:depth], one]) for one in beside)
    yield from (f"{word}.{name}" for word in words)


def decoded(text: Any) -> str:
    """Return a text that may be bytes, without the marks of its end."""
    if not isinstance(text, bytes):
        return str(text).strip("\0 ")
    try:
        return text.decode().strip("\0 ")
    except UnicodeDecodeError:
        return text.decode("latin-1").strip("\0 ")


@dataclass(frozen=True, slots=True, eq=False)
class StorageForm:
    """Form of stored numbers: value = scale · stored + offset, but for marks and what lies beyond the valid ones.

    Attributes
    ----------
    scale, offset
        Numbers, or one for each column.
    marks
        Stored numbers that stand for missing ones.
    marked_values
        Marks that cannot be stored as the array is, and are meant as values.
    low, high
        Least and greatest valid stored number.
    keys
        Attributes that give scale and offset.
    """

    scale: Any = 1.0
    offset: Any = 0.0
    marks: tuple[float, ...] = ()
    marked_values: tuple[float, ...] = ()
    low: float = -np.inf
    high: float = np.inf
    keys: tuple[str, ...] = ()

    @property
    def scales(self) -> bool:
        """Whether values differ from the stored numbers."""
        return bool(np.any(np.asarray(self.scale) != 1.0) or np.any(np.asarray(self.offset) != 0.0))

    def unpacked(self, stored: Any) -> Array:
        """Return values, nan where they are missing."""
        stored = np.asarray(stored)
        missing = (stored < self.low) | (stored > self.high)
        for mark in self.marks:
            missing |= stored == np.array(mark).astype(stored.dtype)
        values = stored.astype(np.float64)
        values = np.asarray(values * self.scale + self.offset if self.scales else values)
        for mark in self.marked_values:
            missing |= np.isclose(values, mark, rtol=1e-9, atol=0.0)
        return np.asarray(np.where(missing, np.nan, values), dtype=np.float64)


class ScaledDataset:
    """A dataset whose numbers are unpacked where slices of it are read.

    Parameters
    ----------
    dataset
        What gives ``dataset[rows]``.
    packing
        How its numbers are stored.
    """

    def __init__(self, dataset: Any, packing: StorageForm) -> None:
        self.dataset, self.packing = dataset, packing
        self.shape, self.dtype = dataset.shape, np.dtype(np.float64)

    def __getitem__(self, key: Any) -> Array:
        return self.packing.unpacked(self.dataset[key])


def packing_of(
    about: Mapping[Any, Any], shape: tuple[int, ...], kind: np.dtype[Any], unwritten: float = 0.0
) -> StorageForm | None:
    """Return the packing of an array of a shape and a type; None where its numbers are the values.

    ``unwritten`` is what the file holds where nothing was written, if it is not zero.

    Raises
    ------
    UnclearPacking
        If a factor, an offset or a limit is no number, or does not fit the shape.
    """
    named = _LowerCaseAttributes(about)
    scales = (*SCALE_ATTRIBUTES, *COUNTED_SCALES) if kind.kind in "iu" else SCALE_ATTRIBUTES
    factor = next((k for k in scales if k in named), None)
    shift = next((k for k in (OFFSET_ATTRIBUTES if factor else OFFSET_ATTRIBUTES[:1]) if k in named), None)
    marks = [m for k in FILL_ATTRIBUTES if k in named for m in _numbers(named, k)] + ([unwritten] if unwritten else [])
    exact = [m for m in marks if _is_storable(m, kind)]
    valid = _numbers(named, "valid_range") if "valid_range" in named else np.array([-np.inf, np.inf])
    if valid.size != 2:
        raise UnclearPacking(f"its valid_range has {valid.size} numbers")
    found = StorageForm(
        _each(named, factor, shape, 1.0),
        _each(named, shift, shape, 0.0),
        tuple(exact),
        tuple(m for m in marks if m not in exact and np.isfinite(m)),
        float(_each(named, "valid_min" if "valid_min" in named else None, (), valid[0])),
        float(_each(named, "valid_max" if "valid_max" in named else None, (), valid[1])),
        tuple(key for key in (factor, shift) if key),
    )
    plain = not found.scales and not marks and not np.isfinite([found.low, found.high]).any()
    return None if plain else found


def doubt_of(about: Mapping[Any, Any], packing: StorageForm | None) -> str:
    """Return the doubts that attributes leave about a packing: factors not applied, or the order of two; or none."""
    named = _LowerCaseAttributes(about)
    used = packing.keys if packing else ()
    left = [
        k
        for k in (*SCALE_ATTRIBUTES, *COUNTED_SCALES, *OFFSET_ATTRIBUTES, *OTHER_FACTOR_ATTRIBUTES)
        if k in named and k not in used
    ]
    told = [f"'{k}' = {named[k]}" for k in left if _changes(named, k, k in (*OFFSET_ATTRIBUTES, "zero", "bias"))]
    if told:
        return f"{' and '.join(told)} not applied, since the numbers may hold it already"
    both = packing and np.any(np.asarray(packing.scale) != 1.0) and np.any(np.asarray(packing.offset) != 0.0)
    if both and used[1] == "offset":
        other = f"(stored + offset) × {used[0]}"
        return f"taken as stored × {used[0]} + offset; the names do not say that it is not {other}"
    return ""


def _changes(named: Mapping[str, Any], key: str, added: bool) -> bool:
    try:
        return bool(np.any(_numbers(named, key) != (0.0 if added else 1.0)))
    except UnclearPacking:
        return False


def _is_storable(mark: float, kind: np.dtype[Any]) -> bool:
    if kind.kind == "f":
        return True
    about = np.iinfo(kind)
    return bool(float(mark).is_integer() and about.min <= mark <= about.max)


def _numbers(named: Mapping[str, Any], key: str) -> Array:
    try:
        return np.asarray(named[key], dtype=np.float64).ravel()
    except (TypeError, ValueError):
        raise UnclearPacking(f"its {key} is no number") from None


def _each(named: Mapping[str, Any], key: str | None, shape: tuple[int, ...], default: float) -> Any:
    """Return a number, or the numbers of all columns; ``default`` where there is no such attribute."""
    if key is None:
        return default
    numbers = _numbers(named, key)
    if not np.isfinite(numbers).all():
        raise UnclearPacking(f"its {key} is no finite number")
    if numbers.size == 1:
        return float(numbers[0])
    if len(shape) == 2 and numbers.size == shape[1]:
        return numbers
    raise UnclearPacking(f"its {key} has {numbers.size} numbers, and its shape is {shape}")
