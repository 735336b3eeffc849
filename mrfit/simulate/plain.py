"""Items of plug-ins that are functions of arrays, as compiled loops call them."""

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np

from mrfit.core.protocols import AddsTerm, ChangesInput, HasLaw, HasStep, ShapesOutput
from mrfit.core.specs import Array, EffectSpec
from mrfit.errors import DataError
from mrfit.kernels.elements import WIRED, Entry, entry_of

# Samples and interval with which a definition is tested for memory
_PROBE, _PROBE_DT = 24, 1e-3
_POINTER = ctypes.POINTER(ctypes.c_double)
_FUNCTION = ctypes.CFUNCTYPE(ctypes.c_double, *[_POINTER] * 4, ctypes.c_double, _POINTER)


def entry_for(item: Any, curved: bool = False) -> Entry:
    """Return an item for compiled loops to call: its ``step`` or ``law`` compiled, else its function of arrays.

    One that is ``curved`` is stepped along its curve.

    Raises
    ------
    DataError
        If it has a memory and no ``step``.
    """
    if curved or isinstance(item, HasLaw | HasStep):
        return entry_of(item, curved)
    return _called(item.SPEC.name, _Values(item))


@cache
def _called(name: str, values: "_Values") -> Entry:
    _check_memoryless(name, values)
    last, count = WIRED + len(values.inputs), len(values.item.SPEC.params)

    # an array of its own at every call would cost as much as most laws
    drive, given = np.empty((last - WIRED, 1)), np.empty((1, count))

    def function(state: Any, following: Any, inputs: Any, theta: Any, dt: float, past: Any) -> float:
        drive[:, 0], given[0] = inputs[WIRED:last], theta[count : 2 * count]
        return float(values(drive, given)[0])

    made = _FUNCTION(function)
    _alive.append(made)
    return Entry(ctypes.cast(made, ctypes.c_void_p).value or 0, values.inputs)


# What addresses point at
_alive: list[Any] = []


class _Values:
    """A model or an effect as a function of its inputs (C, N) and parameters (1, K)."""

    def __init__(self, item: Any) -> None:
        spec = item.SPEC
        signal = ("",) if isinstance(spec, EffectSpec) and spec.slot == "output" else ()
        self.item, self.inputs = item, (*signal, *spec.inputs)
        # chosen once: to ask which protocol an effect has takes longer than its term
        self.of = _function_of(item, self.inputs)

    def __hash__(self) -> int:
        return hash(id(self.item))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Values) and other.item is self.item

    def __call__(self, drive: Array, theta: Array) -> Array:
        channels = dict(zip(self.inputs, drive, strict=True)) or {"": np.zeros(drive.shape[1] if drive.size else 1)}
        return np.asarray(self.of(channels, drive, theta))


def _function_of(item: Any, inputs: tuple[str, ...]) -> Callable[[dict[str, Array], Array, Array], Array]:
    """Return the function of an item's channels by name, all its inputs (C, N) and its parameters (1, K).

    Raises
    ------
    DataError
        If an effect is none of these functions.
    """
    if not isinstance(item.SPEC, EffectSpec):
        return lambda channels, drive, theta: item.response(drive, theta, _PROBE_DT)[0]
    if isinstance(item, ChangesInput):
        return lambda channels, drive, theta: item.transform(channels, theta[0], _PROBE_DT)[inputs[-1]]
    if isinstance(item, AddsTerm):
        return lambda channels, drive, theta: item.term(channels, theta, _PROBE_DT)[0]
    if isinstance(item, ShapesOutput):
        return lambda channels, drive, theta: item.shape(channels.pop("")[None], channels, theta, _PROBE_DT)[0]
    raise DataError(f"apply does not take the effect {item.SPEC.name}: give it a law, see docs/plugins.md")


def _check_memoryless(name: str, values: _Values) -> None:
    """Refuse a definition with memory of which no step is known.

    Raises
    ------
    DataError
        If a permutation of samples does not permute its output.
    """
    rng = np.random.default_rng(0)
    drive = 0.05 * rng.standard_normal((len(values.inputs), _PROBE))
    theta = np.array([[p.start for p in values.item.SPEC.params]])
    order = rng.permutation(_PROBE)
    with np.errstate(all="ignore"):
        straight, mixed = values(drive, theta), values(np.ascontiguousarray(drive[:, order]), theta)
    if not np.allclose(straight[..., order], mixed, rtol=1e-12, atol=0.0, equal_nan=True):
        raise DataError(f"'{name}' has a memory, and apply knows no steps of it: give it a step, see docs/plugins.md")
