"""Times of a data frame's rows, as its index gives them, beside a sample interval or without."""

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from mrfit.core.specs import Array
from mrfit.errors import ConfigError, DataError
from mrfit.ingest.text.layout import TIME_NAMES

if TYPE_CHECKING:
    from pandas import Index

AGREE = 1e-3
"""Relative difference of a step of the index from the sample interval up to which both agree."""
NO_INDEX = "or take the index away: frame.reset_index(drop=True)"


def index_times(index: "Index[Any]", dt: float | None, name: str) -> Array | None:
    """Return the times of rows in s, or None where the rows are samples one after the other.

    Parameters
    ----------
    index
        Of the frame: times, sample numbers, or anything else, which says nothing.
    dt
        Sample interval in s, or None.
    name
        Of the log.

    Raises
    ------
    ConfigError
        If there is neither an interval nor an index of times, or they disagree.
    DataError
        If the index does not rise.
    """
    timed = _times(index)
    if dt is None:
        if timed is None:
            raise ConfigError(f"{name}: no sample interval: give dt = SECONDS, or a column 'time'")
        _check_rises(timed, name)
        return timed
    numbers = timed if timed is not None else _numbers(index)
    if numbers is None or len(numbers) < 2 or not isinstance(dt, (int, float, np.number)) or not dt > 0.0:
        return None
    if timed is None and np.all(np.diff(numbers) == 1.0):
        return None
    _check_rises(numbers, name)
    step = float(np.median(np.diff(numbers)))
    if abs(step / dt - 1.0) < AGREE:
        return np.asarray(numbers - numbers[0])
    if timed is None and step == 1.0:
        return np.asarray((numbers - numbers[0]) * dt)
    what = f"its index steps by {step:.6g} and dt is {dt:.6g} s"
    raise ConfigError(f"{name}: {what}; give the interval of the rows and leave the other out, {NO_INDEX}")


def seconds_of(times: NDArray[Any]) -> Array:
    """Return dates or durations in s from the first one."""
    from_first = times - times[0] if len(times) else times
    return np.asarray(from_first / np.timedelta64(1, "s"), dtype=np.float64)


def _times(index: "Index[Any]") -> Array | None:
    aware = getattr(index, "tz", None) is not None
    values: NDArray[Any] = (index.tz_convert(None) if aware else index).to_numpy()  # type: ignore[attr-defined]
    if values.dtype.kind in "mM":
        return seconds_of(values)
    called = str(index.name).lower() in TIME_NAMES
    return _numbers(index) if called else None


def _numbers(index: "Index[Any]") -> Array | None:
    values: NDArray[Any] = index.to_numpy()
    return np.asarray(values, dtype=np.float64) if values.dtype.kind in "fiu" else None


def _check_rises(times: Array, name: str) -> None:
    steps = np.diff(times)
    if len(times) and not np.all(steps > 0.0):
        row = int(np.argmin(steps > 0.0)) + 1
        what = f"its index does not rise at row {row} (from {times[row - 1]:.6g} to {times[row]:.6g})"
        raise DataError(f"{name}: {what}; sort the frame: frame.sort_index(), {NO_INDEX}")
