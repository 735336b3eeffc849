"""Terms that a law may lack: odd in the motion, with a memory of their own, each times a function of the current.

A term is evaluated, written into a plug-in and said from its one expression in ``operators.toml``.
"""

import math
import tomllib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Literal, cast

import numpy as np
from pydantic import TypeAdapter

from mrfit.core.specs import Array
from mrfit.discover.invariance.nuisance import Scales
from mrfit.kernels.filters import lag
from mrfit.kernels.memory import stopped, travel_memory

LEVELS = {"": "1.0", "*i": "{i}", "*i^2": "{i} * {i}", "*tanh(2*i/i_max)": "math.tanh(2.0 * {i})"}
"""Functions of the scaled current by what is written of them."""
_ARRAYS = SimpleNamespace(**{n: getattr(np, n) for n in ("tanh", "exp", "sqrt", "cosh")}, inf=math.inf)


@dataclass(frozen=True)
class Operator:
    """A kind of term; ``operators.toml`` describes its fields."""

    title: str
    expression: str
    text: str
    memory: Literal["none", "lag", "travel", "stop", "wear"] = "none"
    speeds: tuple[float, ...] = (1.0,)
    memories: tuple[float, ...] = (1.0,)


_WRITTEN = tomllib.loads(Path(__file__).with_name("operators.toml").read_text(encoding="utf-8"))
TERM_KINDS = TypeAdapter(dict[str, Operator]).validate_python(_WRITTEN)
"""Every kind of term by its name, simple ones first."""


@dataclass(frozen=True)
class LawTerm:
    """A term at its constants: a speed in V, a memory in 1/w or X, and a factor of the current."""

    kind: str
    speed: float
    memory: float
    level: str = ""

    @property
    def operator(self) -> Operator:
        """Its kind."""
        return TERM_KINDS[self.kind]

    def expression(self, **names: str) -> str:
        """Return the term in functions of ``math`` of named scaled variables v, z, i and L."""
        own = self.operator.expression.format(s=repr(self.speed), **{"z": "z", "L": "L"} | names)
        factor = LEVELS[self.level].format(**names)
        return own if factor == "1.0" else f"{own} * ({factor})"

    def reach(self, scales: Scales) -> float:
        """Return its memory in s, or in the unit of the place."""
        return self.memory / scales.rate if self.operator.memory == "lag" else self.memory * scales.travel

    def text(self, scales: Scales) -> str:
        """Return the term in SI."""
        seconds = self.operator.memory == "lag"
        memory = f"{self.reach(scales):.3g} {'s' if seconds else scales.unit}"
        return self.operator.text.format(memory, f"{self.speed * scales.speed:.3g}") + self.level

    def column(self, drive: "TermInputs", scales: Scales) -> Array:
        """Return the term (N,) at a drive."""
        step, reach = np.zeros(len(drive.speed)), self.reach(scales)
        step[1:] = 0.5 * (drive.speed[1:] + drive.speed[:-1]) * drive.dt
        memory, z = self.operator.memory, np.empty(0)
        if memory == "travel":
            z = travel_memory(step, np.array([reach]))[0]
        elif memory == "stop":
            z = stopped(step / reach)
        elif memory == "wear":
            z = np.cumsum(np.abs(step)) / reach
        values = _evaluated(self)(
            drive.speed / scales.speed, z, drive.control / scales.control, drive.force / scales.span
        )
        values = np.broadcast_to(values, drive.speed.shape)
        if memory == "lag":
            values = lag(np.ascontiguousarray(values)[None], np.array([reach / drive.dt]))[0]
        return np.asarray(values)


@dataclass(frozen=True)
class TermInputs:
    """Velocity, current and force of the law of a record (N,), with its sample interval in s."""

    speed: Array
    control: Array
    force: Array
    dt: float


def _evaluated(term: LawTerm) -> Callable[..., Array]:
    # the text is this package's own: no other way makes what is evaluated and what is written out the same
    code = f"lambda v, z, i, L: {term.expression(v='v', z='z', i='i', L='L')}"
    return cast(Callable[..., Array], eval(code, {"math": _ARRAYS, "abs": np.abs}))


def candidates(varies: bool) -> tuple[LawTerm, ...]:
    """Return all terms, with functions of the current where it varies over the records."""
    return tuple(
        LawTerm(kind, speed, memory, level)
        for kind, own in TERM_KINDS.items()
        for speed in own.speeds
        for memory in own.memories
        for level in (LEVELS if varies else ("",))
    )
