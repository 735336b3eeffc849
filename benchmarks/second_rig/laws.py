"""Laws of dampers by their published equations: force = yield_force * u + damping * w, u and w of the motion."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Shape = dict[str, float]
Parts = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True)
class Law:
    """Law of a damper: its name, the parts of its force, how its shape is drawn, and what it owns by itself."""

    name: str
    parts: Callable[[np.ndarray, np.ndarray, Shape], Parts]
    draw: Callable[[np.random.Generator, float, float], Shape]
    spring: bool = False  # has a stiffness of its own
    memory: bool = False  # has a loop of its own
    jumps: bool = False  # has no value at rest


def _bingham(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    return np.sign(v), v


def _herschel(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    return np.sign(v), np.sign(v) * np.abs(v) ** s["n"]


def _biviscous(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    return np.clip(v / s["vy"], -1, 1), v


def _regularised(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    return np.sign(v) * -np.expm1(-np.abs(v) / s["vy"]), v


def _tanh(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    return np.tanh((v + s["a"] * x) / s["vy"]), v


def _guo(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    u = v + s["a"] * x
    return np.tanh(u / s["vy"]), u


def _dahl(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    return travel_memory(x, s["d"]), v


def travel_memory(x: np.ndarray, d: float) -> np.ndarray:
    """Integrate dz = (dx - |dx| z)/d from 0, exactly over each step of the stroke."""
    return _kept(x, (d,), lambda: _step_exponentials(x, d))


def _boucwen(x: np.ndarray, v: np.ndarray, s: Shape) -> Parts:
    n, b, d = s["n"], s["b"], s["d"]
    return _kept(x, (n, b, d), lambda: _step_loop(np.diff(x, prepend=x[0]) / d, n, b)), v


_MEMORIES: dict[tuple[object, ...], np.ndarray] = {}  # states of strokes that were integrated before


def _kept(x: np.ndarray, shape: tuple[float, ...], integrate: Callable[[], np.ndarray]) -> np.ndarray:
    key = (hash(x.tobytes()), shape)
    if key not in _MEMORIES:
        if len(_MEMORIES) > 60:
            _MEMORIES.clear()
        _MEMORIES[key] = integrate()
    return _MEMORIES[key]


def _step_exponentials(x: np.ndarray, d: float) -> np.ndarray:
    steps = np.diff(x, prepend=x[0])
    decay = np.exp(-np.abs(steps) / d).tolist()
    z, at = np.empty(x.size), 0.0
    for k, (sign, e) in enumerate(zip(np.sign(steps).tolist(), decay, strict=True)):
        at = sign + (at - sign) * e
        z[k] = at
    return z


def _step_loop(steps: np.ndarray, n: float, b: float) -> np.ndarray:
    """Integrate dz/dx = (1 - (b + (1 - b) sign(v z)) |z|^n)/d by the midpoint rule; |z| tends to 1."""
    z, at = np.empty(steps.size), 0.0
    pieces = (np.abs(steps) / 0.1).astype(int) + 1
    for k, (h, count) in enumerate(zip((steps / pieces).tolist(), pieces.tolist(), strict=True)):
        for _ in range(count):
            loss = 1.0 if h * at > 0 else 2 * b - 1
            middle = at + h / 2 * (1 - loss * abs(at) ** n)
            loss = 1.0 if h * middle > 0 else 2 * b - 1
            at += h * (1 - loss * abs(middle) ** n)
        z[k] = at
    return z


def _knee(rng: np.random.Generator, speed: float, stroke: float) -> Shape:
    return {"vy": speed * float(rng.uniform(0.05, 0.2))}


def _hysteretic(rng: np.random.Generator, speed: float, stroke: float) -> Shape:
    return {"vy": speed * float(rng.uniform(0.05, 0.2)), "a": speed / stroke * float(rng.uniform(0.03, 0.12))}


LAWS = {
    law.name: law
    for law in (
        Law("bingham", _bingham, lambda rng, speed, stroke: {}, jumps=True),
        Law("herschel-bulkley", _herschel, lambda rng, speed, stroke: {"n": float(rng.uniform(0.6, 0.9))}, jumps=True),
        Law("biviscous", _biviscous, _knee),
        Law("regularised-bingham", _regularised, _knee),
        Law("tanh", _tanh, _hysteretic, spring=True, memory=True),
        Law("guo", _guo, _hysteretic, memory=True),
        Law("dahl", _dahl, lambda rng, speed, stroke: {"d": stroke * float(rng.uniform(0.02, 0.08))}, memory=True),
        Law(
            "boucwen",
            _boucwen,
            lambda rng, speed, stroke: {
                "n": float(rng.uniform(1.0, 2.0)),
                "b": float(rng.uniform(0.5, 0.8)),
                "d": stroke * float(rng.uniform(0.02, 0.08)),
            },
            spring=True,
            memory=True,
        ),
    )
}


@dataclass(frozen=True)
class FieldLaw:
    """Yield force (N) and damping over the current (A): line, parabola, or one of two forms that saturate."""

    form: str
    rest: float  # yield force without current
    gain: float  # yield force that the greatest current adds
    greatest: float  # A
    knee: float  # current at which a saturating form bends, as a share of the greatest
    damping: float
    damping_slope: float  # share of the damping that the greatest current adds

    @property
    def saturates(self) -> bool:
        """Whether the yield force saturates."""
        return self.form in ("tanh", "exponential")

    def yield_force(self, current: np.ndarray) -> np.ndarray:
        """Return the yield force (N) at a current (A)."""
        u = current / self.greatest
        share = {
            "line": lambda: u,
            "parabola": lambda: u * (1 + self.knee * (1 - u)),
            "tanh": lambda: np.tanh(u / self.knee) / np.tanh(1 / self.knee),
            "exponential": lambda: np.expm1(-u / self.knee) / np.expm1(-1 / self.knee),
        }[self.form]()
        return self.rest + self.gain * share

    def damping_at(self, current: np.ndarray) -> np.ndarray:
        """Return the factor of the law's viscous part at a current (A)."""
        return self.damping * (1 + self.damping_slope * current / self.greatest)


def draw_field(rng: np.random.Generator, greatest: float, viscous_unit: float) -> FieldLaw:
    """Draw the dependence on current; ``viscous_unit`` is the law's viscous part at the greatest speed."""
    top = float(np.exp(rng.uniform(np.log(300.0), np.log(3000.0))))
    return FieldLaw(
        form=str(rng.choice(["line", "parabola", "tanh", "exponential"])),
        rest=top * float(rng.uniform(0.06, 0.2)),
        gain=top,
        greatest=greatest,
        knee=float(rng.uniform(0.4, 0.9)),
        damping=top * float(rng.uniform(0.25, 0.7)) / viscous_unit,
        damping_slope=float(rng.choice([0.0, rng.uniform(0.1, 0.5)])),
    )
