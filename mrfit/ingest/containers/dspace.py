"""dSPACE ControlDesk captures, as they stand in a MAT-file: time axes in ``X``, signals in ``Y``."""

import re
from typing import Any

import numpy as np

from mrfit.ingest.containers.arrays import Arrays

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
