"""Force that an effect adds, made from the effect's own function in its slot.

An effect adds a force, multiplies the law (``theta``, ``output``), or moves the current that the law sees (``input``).
A law of open form has no roles: an effect of the slot ``theta`` scales it as a whole, with one strength for all roles.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import cast

import numpy as np

from mrfit.core.channels import CONTROL, unit_of
from mrfit.core.protocols import AddsTerm, ChangesInput, Effect, ErrsInRecord, ScalesParameters, ShapesOutput
from mrfit.core.specs import Array, Breaks, EffectSpec, Param
from mrfit.discover.invariance.nuisance import Scales
from mrfit.discover.invariance.records import Record
from mrfit.discover.policy import STANDARD
from mrfit.kernels.theta import plain


@dataclass(frozen=True)
class ExaminedEffect:
    """An effect that breaks an invariance, as it is tested.

    Attributes
    ----------
    module
        The effect.
    numbers
        Groups of places in its parameters that move as one: the strength first, then the others.
    """

    module: Effect
    numbers: tuple[tuple[int, ...], ...]

    @property
    def spec(self) -> EffectSpec:
        """The effect's SPEC."""
        return self.module.SPEC

    @property
    def name(self) -> str:
        """Its name."""
        return self.spec.name

    @property
    def breaks(self) -> Breaks:
        """Distinction of the effect from any law."""
        assert self.spec.breaks is not None
        return self.spec.breaks

    @property
    def common(self) -> bool:
        """Whether several strengths are taken as one."""
        return len(self.numbers[0]) > 1

    @property
    def adds(self) -> bool:
        """Whether it adds a force."""
        return self.spec.slot in ("add", "record")

    @property
    def constant(self) -> bool:
        """Whether it adds a force that nothing changes: instruments may add one to any record."""
        return self.adds and not self.spec.inputs

    @property
    def moves(self) -> bool:
        """Whether it moves the current that the law sees."""
        return self.spec.slot == "input"

    def of(self, number: int) -> Param:
        """Return the parameter that stands for a group."""
        return self.spec.params[self.numbers[number][0]]

    def at(self, theta: Array, number: int, value: float) -> Array:
        """Return parameters (Q,) with one group set, within its bounds."""
        changed, param = theta.copy(), self.of(number)
        changed[list(self.numbers[number])] = min(max(value, param.low), param.high)
        return changed

    def value(self, theta: Array, number: int = 0) -> float:
        """Return the value of a group."""
        return float(theta[self.numbers[number][0]])


def examined(module: Effect) -> ExaminedEffect | None:
    """Return an effect as it is tested; None if it breaks no invariance, or in a slot that no law is open to."""
    spec = module.SPEC
    if spec.breaks is None or spec.slot == "loop":
        return None
    strengths = tuple(k for k, p in enumerate(spec.params) if p.role != "shape")
    shapes = tuple((k,) for k, p in enumerate(spec.params) if p.role == "shape")
    first = (strengths,) if spec.slot == "theta" else tuple((k,) for k in strengths)
    return ExaminedEffect(module, (*first, *shapes))


def starts(effect: ExaminedEffect, scales: Scales, middle: float) -> Iterator[Array]:
    """Yield the parameters (Q,) at which an effect is screened, ``middle`` the middle of the longest stroke."""
    neutral = np.array(effect.spec.neutral)
    shapes = [n for n in range(1, len(effect.numbers)) if effect.of(n).role == "shape"]
    for values in product(*(_grid(effect.of(n), scales, middle) for n in shapes)):
        theta = neutral.copy()
        for n, value in zip(shapes, values, strict=True):
            theta = effect.at(theta, n, value)
        if effect.moves:
            yield from (effect.at(theta, 0, s) for s in _strengths(effect.of(0), scales))
        else:
            yield theta


def _strengths(param: Param, scales: Scales) -> Sequence[float]:
    if param.unit == "s":
        return STANDARD.screened_times
    if param.unit == unit_of(CONTROL):
        return tuple(c * scales.control for c in STANDARD.screened_controls)
    return tuple(s * param.high for s in STANDARD.screened_shares)


def is_place(param: Param, scales: Scales) -> bool:
    """Return whether a parameter is a place in the stroke."""
    return param.unit == scales.unit


def _grid(param: Param, scales: Scales, middle: float) -> Sequence[float]:
    logarithmic = param.scale == "log"
    if is_place(param, scales):
        return tuple(p * scales.travel for p in STANDARD.screened_places) if logarithmic else _middles(scales, middle)
    if param.unit == f"{scales.unit}/s" and logarithmic:
        return tuple(s * scales.speed for s in STANDARD.screened_speeds)
    if param.unit == "s" and logarithmic:
        return STANDARD.screened_releases
    if param.unit == "1" and logarithmic:
        return param.start, float(np.sqrt(param.start * param.high))
    return (param.start,)


def _middles(scales: Scales, middle: float) -> tuple[float, ...]:
    return tuple(middle + m * scales.travel for m in STANDARD.screened_middles)


def added(effect: ExaminedEffect, record: Record, theta: Array) -> Array:
    """Return the force that an effect adds, (L + N,)."""
    made = cast(AddsTerm, effect.module).term if effect.spec.slot == "add" else cast(ErrsInRecord, effect.module).error
    return made(dict(record.channels), theta[None], record.dt)[0]


def moved(effect: ExaminedEffect, record: Record, control: Array, theta: Array) -> Array:
    """Return the current that the law sees, (L + N,), of the one before the effect."""
    channels = {**record.channels, CONTROL: plain(control)}
    return cast(ChangesInput, effect.module).transform(channels, theta, record.dt)[CONTROL]


def factor(effect: ExaminedEffect, record: Record, theta: Array) -> Array:
    """Return the factor of an effect on the law (L + N,): the mean over its roles, which share one strength."""
    found = cast(ScalesParameters, effect.module).factors(record.channels, theta[None], record.dt)
    rows = [np.broadcast_to(f[0], record.speed.shape) for f in found.values()]
    return np.mean(rows, axis=0)


def changed(effect: ExaminedEffect, record: Record, theta: Array, values: Array) -> Array:
    """Return columns of force (L + N, p) as an effect of the slots ``theta`` and ``output`` lets them pass."""
    if effect.spec.slot == "theta":
        return values * factor(effect, record, theta)[:, None]
    rows = np.ascontiguousarray(values.T)
    shape = cast(ShapesOutput, effect.module).shape
    return shape(rows, dict(record.channels), np.repeat(theta[None], len(rows), axis=0), record.dt).T


def step_of(effect: ExaminedEffect, number: int, value: float) -> float:
    """Return the step of a numerical derivative by one group of parameters."""
    param = effect.of(number)
    return STANDARD.derivative_step * (abs(value) if value else (param.high - param.low) * STANDARD.derivative_of_zero)


def missing(effect: ExaminedEffect, channels: frozenset[str], spans: Mapping[str, float]) -> str:
    """Return the reason for which an effect cannot be judged, a channel missing or at rest; empty if it can."""
    lacking = [n for n in effect.spec.inputs if n not in channels]
    if lacking:
        return f"no {lacking[0]} in every record"
    still = [n for n, least in effect.spec.moves if spans.get(n, 0.0) < least]
    return f"the {still[0]} does not move" if still else ""
