"""The map between physical parameters and the unit cube in which optimizers search."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from mrfit.core.specs import Array, Index, Mask, ModelSpec, Param
from mrfit.errors import ConfigError
from mrfit.kernels.cube import spread_out
from mrfit.simulate.current_dependence import base_name

Value = TypeVar("Value")

# Its multiples modulo 1 are different for every parameter and never near 0 or 1: the golden ratio's fraction
GOLDEN_FRACTION = 0.6180339887498949


@dataclass(frozen=True)
class Cube:
    """Free parameters of a model, each bound mapped to 0 and 1, linearly or in the logarithm; the others held.

    Attributes
    ----------
    params
        All parameters in the order of theta, bounds and starts as the user changed them.
    free
        Index of the parameters that are fitted, shape (F,).
    """

    params: tuple[Param, ...]
    free: Index

    @cached_property
    def start(self) -> Array:
        """Start point, shape (F,)."""
        start: Array = self.to_points(np.array([[p.start for p in self.params]]))[0]
        return start

    def probes(self, inside: int = 1) -> Array:
        """Return points (1 + I, F) at which to try what a model is like: the start, and some off middle and bounds."""
        places = np.arange(1, inside * len(self.free) + 1) * GOLDEN_FRACTION % 1.0
        return np.vstack([self.start[None, :], places.reshape(inside, len(self.free))])

    def to_theta(self, points: Array) -> Array:
        """Map points (P, F) of the cube to parameter vectors (P, K); held parameters take their start value."""
        return spread_out(np.ascontiguousarray(points), *self.map)

    def slopes(self, theta: Array) -> Array:
        """Return what a parameter gains per length along its axis of the cube, (P, F), at parameter vectors (P, K)."""
        _, _, (low, high, *_), logarithmic = self.map
        slopes: Array = np.where(logarithmic, theta[:, self.free], 1.0) * (high - low)
        return slopes

    @cached_property
    def map(self) -> tuple[Index, Array, Array, Mask]:
        """Free parameters (F,), starts (K,), ends on their scale and bounds (4, F), which are logarithmic (F,)."""
        ends = np.array([self._ends(int(k)) for k in self.free]).reshape(-1, 2).T
        bounds = np.array([(self.params[k].low, self.params[k].high) for k in self.free]).reshape(-1, 2).T
        logarithmic = np.array([self.params[k].scale == "log" for k in self.free], dtype=np.bool_)
        start = np.array([p.start for p in self.params])
        return self.free, start, np.ascontiguousarray(np.concatenate([ends, bounds])), logarithmic

    def to_points(self, theta: Array) -> Array:
        """Map parameter vectors (P, K) to points (P, F); values outside the bounds go to the nearest bound."""
        _, _, (at_0, at_1, low, high), logarithmic = self.map
        values = np.minimum(np.maximum(theta[:, self.free], low), high)
        values[:, logarithmic] = np.log(values[:, logarithmic])
        points: Array = (values - at_0) / (at_1 - at_0)
        return points

    def _ends(self, k: int) -> tuple[float, float]:
        p = self.params[k]
        return (float(np.log(p.low)), float(np.log(p.high))) if p.scale == "log" else (p.low, p.high)


@dataclass(frozen=True)
class FreeParameters:
    """The free parameters of a cube as coordinates of their own: in SI units, none of them logarithmic."""

    cube: Cube

    @property
    def low(self) -> Array:
        """Lower bounds, shape (F,)."""
        bounds: Array = self.cube.map[2][2]
        return bounds

    @property
    def high(self) -> Array:
        """Upper bounds, shape (F,)."""
        bounds: Array = self.cube.map[2][3]
        return bounds

    def to_values(self, points: Array) -> Array:
        """Map points (P, F) of the cube to the parameters' values (P, F)."""
        return self.cube.to_theta(points)[:, self.cube.free]

    def to_points(self, values: Array) -> Array:
        """Map the parameters' values (P, F) to points (P, F) of the cube."""
        theta = np.empty((len(values), len(self.cube.params)))
        theta[:, self.cube.free] = values
        return self.cube.to_points(theta)


def cube_of(
    spec: ModelSpec,
    bounds: Mapping[str, tuple[float, float]],
    start: Mapping[str, float],
    fixed: Mapping[str, float],
) -> Cube:
    """Return the cube of a model with the user's bounds, start values and fixed parameters.

    A parameter that its SPEC fixes is fitted where the user gives its bounds or start.
    What is given for a parameter that depends on current (``fy``) goes to its values at all nodes (``fy@0A`` …), what
    is given for one node to this one.

    Raises
    ------
    ConfigError
        If a name is not a parameter, bounds are reversed or unusable on a logarithmic scale, a start lies outside its
        bounds, or nothing is left to fit.
    """
    for name in [*bounds, *start, *fixed]:
        if name not in spec.names and name not in map(base_name, spec.names):
            raise ConfigError(f"model '{spec.name}' has no parameter '{name}'; it has {', '.join(spec.names)}")
    params = tuple(
        _adjusted(p, _given(bounds, p.name), _given(start, p.name), _given(fixed, p.name)) for p in spec.params
    )
    free = np.array([k for k, p in enumerate(params) if _given(fixed, p.name) is None and not p.fixed], dtype=np.int64)
    if not len(free):
        raise ConfigError(f"every parameter of '{spec.name}' is fixed; leave at least one free")
    return Cube(params, free)


def _given(values: Mapping[str, Value], name: str) -> Value | None:
    return values.get(name, values.get(base_name(name)))


def _adjusted(param: Param, bounds: tuple[float, float] | None, start: float | None, fixed: float | None) -> Param:
    if fixed is not None:
        return replace(param, start=fixed, low=min(param.low, fixed), high=max(param.high, fixed), fixed=False)
    low, high = bounds or (param.low, param.high)
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ConfigError(f"bounds of {param.name} must be finite and rising, not {low:g}:{high:g}")
    if param.scale == "log" and low <= 0:
        raise ConfigError(f"{param.name} is fitted on a logarithmic scale: its lower bound must be > 0, not {low:g}")
    value = param.start if start is None else start
    if start is not None and not low <= start <= high:
        raise ConfigError(f"start value {start:g} of {param.name} lies outside its bounds {low:g}:{high:g}")
    if bounds is None and start is None and low <= value <= high:
        # a copy is checked as a plug-in's parameter is, which short fits would notice
        return param
    held = param.fixed and bounds is None and start is None
    return replace(param, low=low, high=high, start=min(max(value, low), high), fixed=held)
