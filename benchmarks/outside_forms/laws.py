"""Laws of dampers, odd in the motion and forgetting: six that are in no catalogue, and three of published equations.

Force = yield_force(u) * shape + damping(u) * viscous. Velocity w and current u are shares of their largest values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp

from .drives import Drive

Array = np.ndarray
Numbers = dict[str, float]


@dataclass(frozen=True)
class Law:
    """A law: rates of its states (1/s), its yielding and viscous parts, and the model of mrfit that it is, if any."""

    name: str
    parts: Callable[[Array, Array, Array, Numbers], tuple[Array, Array]]
    rates: Callable[[Array, float, float, Numbers], list[float]] | None = None
    states: int = 0
    model: str = ""


@dataclass(frozen=True)
class Damper:
    """A law with its numbers: forces (N), scales of speed (m/s), stroke (m) and current (A)."""

    law: Law
    numbers: Numbers
    rest: float
    gain: float
    bend: float  # share by which the yield force curves over the current
    damping: float
    slope: float  # share by which the damping grows with the current
    speed: float
    stroke: float
    greatest: float

    def force(self, drive: Drive, t: Array) -> Array:
        """Return the law's force (N) at times (s)."""
        x, v, _ = drive.motion.at(t)
        w, u = v / self.speed, drive.current(t) / self.greatest
        shape, viscous = self.law.parts(self._states(drive, t), w, u, self.numbers)
        yielding = self.rest + self.gain * u * (1 + self.bend * (1 - u))
        return yielding * shape + self.damping * (1 + self.slope * u) * viscous

    def _states(self, drive: Drive, t: Array) -> Array:
        law = self.law
        if law.rates is None:
            return np.zeros((0, t.size))
        fine = np.arange(0.0, t[-1] + 1e-3, 2.5e-4)
        velocity, control = drive.motion.at(fine)[1] / self.speed, drive.current(fine) / self.greatest
        numbers = {**self.numbers, "k": self.speed / self.stroke}

        def rates(now: float, z: Array) -> list[float]:
            k = min(int(now * 4000), fine.size - 2)
            part = now * 4000 - k
            w = velocity[k] + part * (velocity[k + 1] - velocity[k])
            return law.rates(z, float(w), float(control[k]), numbers)

        whole = (0.0, float(t[-1]))
        solved = solve_ivp(rates, whole, np.zeros(law.states), "LSODA", t, rtol=1e-6, atol=1e-7, max_step=0.01)
        if not solved.success:
            raise ArithmeticError(f"{law.name}: {solved.message}")
        return solved.y


WIDTHS = (0.3, 1.0, 3.0)


def _bundle(z: Array, w: float, u: float, p: Numbers) -> list[float]:
    return [p["k"] * w / (p["d"] * c) * (1 - (w * s > 0) * abs(s) ** 3) for s, c in zip(z, WIDTHS, strict=True)]


def _creep(z: Array, w: float, u: float, p: Numbers) -> list[float]:
    return [p["k"] / p["d"] * (w - 0.03 * np.sinh(z[0] * np.arcsinh(1 / 0.03)))]


def _travel(z: Array, w: float, u: float, p: Numbers) -> list[float]:
    return [p["k"] * (w - abs(w) * z[0]) / (p["d"] * (1 + p.get("widening", 0.0) * u))]


def _shear(w: Array, eps: float, n: float) -> Array:
    return w * (w**2 + eps**2) ** ((n - 1) / 2)


LAWS = {
    law.name: law
    for law in (
        Law("creep", lambda z, w, u, p: (z[0], w), _creep, 1),
        Law("bundle", lambda z, w, u, p: (np.array([0.3, 0.4, 0.3]) @ z, w), _bundle, 3),
        Law(
            "lagged-shear",
            lambda z, w, u, p: (z[0], w),
            lambda z, w, u, p: [(w * (w * w + p["s"] ** 2) ** -0.4 - z[0]) / p["tau"]],
            1,
        ),
        Law("knee", lambda z, w, u, p: (2 / np.pi * np.arctan(w / p["s"]), w / (1 + np.abs(w) * p["knee"]))),
        Law("widening", lambda z, w, u, p: (z[0], _shear(w, 0.05, 0.6)), _travel, 1),
        Law(
            "relaxing",
            lambda z, w, u, p: (np.tanh(w / p["s"]), 0.5 * w + 0.5 * z[0]),
            lambda z, w, u, p: [(w - z[0]) / (4 * p["tau"])],
            1,
        ),
        Law("dahl", lambda z, w, u, p: (z[0], w), _travel, 1, model="dahl"),
        Law("biviscous", lambda z, w, u, p: (np.clip(w / p["s"], -1, 1), w), model="biviscous"),
        Law(
            "regularised",
            lambda z, w, u, p: (-np.sign(w) * np.expm1(-np.abs(w) / p["s"]), w),
            model="regularised-bingham",
        ),
    )
}
WRONG = tuple(name for name, law in LAWS.items() if not law.model)
EXACT = tuple(name for name, law in LAWS.items() if law.model)


def draw_damper(rng: np.random.Generator, law: Law) -> Damper:
    """Draw a damper of a law."""
    top = float(np.exp(rng.uniform(np.log(300.0), np.log(3000.0))))
    numbers = {
        "d": float(rng.uniform(0.02, 0.06)),
        "s": float(rng.uniform(0.04, 0.15)),
        "tau": float(rng.uniform(0.004, 0.01)),
        "knee": float(rng.uniform(0.2, 0.6)),
    }
    if law.name == "widening":
        numbers["widening"] = float(rng.uniform(0.5, 1.5))
    return Damper(
        law,
        numbers,
        rest=top * float(rng.uniform(0.08, 0.2)),
        gain=top,
        bend=float(rng.choice([0.0, rng.uniform(0.2, 0.6)])),
        damping=top * float(rng.uniform(0.2, 0.6)),
        slope=float(rng.choice([0.0, rng.uniform(0.1, 0.5)])),
        speed=float(rng.uniform(0.12, 0.4)),
        stroke=float(rng.uniform(0.008, 0.025)),
        greatest=float(rng.uniform(0.8, 2.5)),
    )
