"""Laws of the specimens: odd in the motion, timeless, at once in the current, and forgetting; none is a base of mrfit.

Four families are for development, four are seen in evaluation alone.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.law_mismatch.currents import FORMS, Saturation
from benchmarks.law_mismatch.integration import bristle, dahl, relaxed, series_flow, stops
from benchmarks.law_mismatch.motions import Array, Rng


@dataclass(frozen=True)
class Law:
    """A specimen's law.

    Attributes
    ----------
    family
        A key of ``FAMILIES``.
    rest, full
        Yield force without field and at the largest current (N).
    damping, growth
        Post-yield damping without field (N*s/m), and its share more at the largest current.
    field
        Share of the full field at a current.
    shape
        Numbers of the family, SI.
    """

    family: str
    rest: float
    full: float
    damping: float
    growth: float
    field: Saturation
    shape: dict[str, float]

    def force(self, x: Array, v: Array, i: Array, h: float) -> Array:
        """Return the force (N,) of displacement about the middle, velocity and current in steps of h (s), from rest."""
        share = self.field.at(i)
        fy = self.rest + (self.full - self.rest) * share
        return FAMILIES[self.family].force(Flow(x, v, fy, self.damping * (1 + self.growth * share), h), self.shape)


@dataclass(frozen=True)
class Flow:
    """What a law makes its force of: displacement, velocity, yield force and damping (N,), step (s)."""

    x: Array
    v: Array
    fy: Array
    c: Array
    h: float


@dataclass(frozen=True)
class Scales:
    """Half-stroke (m), largest speed (m/s) and the largest yield force (N) of the tests a law is made for."""

    stroke: float
    speed: float
    full: float

    @property
    def time(self) -> float:
        """Time scale of the fastest motion (s)."""
        return self.stroke / self.speed


Shape = dict[str, float]


def _papanastasiou(flow: Flow, p: Shape) -> Array:
    return series_flow(flow.x, flow.fy, flow.c, p["stiffness"], p["soft"], flow.h)


def _tanh(flow: Flow, p: Shape) -> Array:
    return flow.c * flow.v + flow.fy * np.tanh((flow.v + p["lead"] * flow.x) / p["soft"])


def _lugre(flow: Flow, p: Shape) -> Array:
    reach = 1 + p["stribeck"] * np.exp(-((flow.v / p["stribeck_speed"]) ** 2))
    z = bristle(flow.v, p["travel"], reach, flow.h)
    rate = (flow.v - np.abs(flow.v) * z / reach) / p["travel"]
    return flow.fy * (z + p["micro"] * rate) + flow.c * flow.v


def _iwan(flow: Flow, p: Shape) -> Array:
    travels = p["travel"] * np.linspace(0.15, 2.0, 10)
    weights = travels ** p["spread"]
    return flow.fy * stops(flow.x, travels, weights / weights.sum(), np.ones(len(flow.x))) + flow.c * flow.v


def _herschel_bulkley(flow: Flow, p: Shape) -> Array:
    u = np.abs(flow.v)
    stiff = -np.expm1(-u / p["soft"]) * np.sign(flow.v)
    bent = np.sign(flow.v) * (u / p["speed"]) ** p["power"]
    # a Maxwell element whose relaxation holds: its spring and dashpot grow with the field together
    strain = flow.v / p["speed"]
    maxwell = p["maxwell"] * relaxed(flow.fy * strain, p["relaxation"], flow.h)
    return flow.fy * stiff + flow.c * p["speed"] * bent + maxwell


def _prandtl_ishlinskii(flow: Flow, p: Shape) -> Array:
    fast = np.arcsinh(np.abs(flow.v) / p["rate_speed"])
    travels = p["travel"] * np.geomspace(0.1, 2.5, 12)
    weights = np.exp(-((np.log(travels / p["travel"]) / 1.1) ** 2))
    z = stops(flow.x, travels, weights / weights.sum(), 1 + p["widening"] * fast)
    return flow.fy * z * (1 + p["rate"] * fast) + flow.c * flow.v * (1 + p["turbulent"] * np.abs(flow.v))


def _dahl(flow: Flow, p: Shape) -> Array:
    z = dahl(flow.x, p["travel"], p["power"])
    bent = np.sign(flow.v) * np.abs(flow.v / p["speed"]) ** p["exponent"]
    falling = 1 + p["stribeck"] * np.exp(-np.abs(flow.v) / p["stribeck_speed"])
    return flow.fy * z * falling + flow.c * p["speed"] * bent


def _spectrum(flow: Flow, p: Shape) -> Array:
    u = np.tanh(flow.v / p["soft"])
    times = p["relaxation"] * np.geomspace(0.2, 1.0, 4)
    held = sum(relaxed(flow.fy * u, float(tau), flow.h) for tau in times) / len(times)
    return (1 - p["held"]) * flow.fy * u + p["held"] * held + flow.c * flow.v


@dataclass(frozen=True)
class Family:
    """A law's form and how its numbers are drawn for the scales of a test; ``memory`` multiplies what it remembers."""

    title: str
    force: Callable[[Flow, Shape], Array]
    draw: Callable[[Scales, Rng, float], Shape]
    split: str
    remembers: bool = True


def between(rng: Rng, low: float, high: float) -> float:
    """Return a number between two, uniform in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# Travel over the half-stroke, and relaxation over the time scale of the motion, within which a law ends to remember
TRAVEL, RELAXATION = (0.006, 0.08), (0.02, 0.15)


def _travel(s: Scales, rng: Rng, memory: float) -> float:
    return s.stroke * (between(rng, *TRAVEL) if memory == 1 else memory)


def _relaxation(s: Scales, rng: Rng, memory: float) -> float:
    return s.time * between(rng, *RELAXATION) if memory == 1 else min(max(8 * memory * s.time, 0.01), 0.08)


def _soft(s: Scales, rng: Rng) -> float:
    return s.speed * between(rng, 0.01, 0.12)


FAMILIES = {
    "papanastasiou-maxwell": Family(
        "regularised Bingham flow in series with a spring (Papanastasiou, Maxwell)",
        _papanastasiou,
        lambda s, rng, m: {"stiffness": s.full / _travel(s, rng, m), "soft": s.speed * between(rng, 0.005, 0.06)},
        "development",
    ),
    "tanh": Family(
        "hyperbolic tangent of velocity and a little displacement (Kwok), no spring",
        _tanh,
        lambda s, rng, m: {
            "soft": (soft := _soft(s, rng)), "lead": min(soft / s.stroke, 1 / s.time) * rng.uniform(0.05, 0.6)
        },
        "development",
        remembers=False,
    ),
    "lugre": Family(
        "LuGre: bristles with Stribeck's dip and micro-damping",
        _lugre,
        lambda s, rng, m: {
            "travel": (d := _travel(s, rng, m)), "stribeck": rng.uniform(0, 0.35),
            "stribeck_speed": s.speed * between(rng, 0.02, 0.15), "micro": d / s.speed * rng.uniform(0, 0.3),
        },
        "development",
    ),
    "iwan": Family(
        "Iwan: ten Jenkins elements, their slips spread evenly over travel",
        _iwan,
        lambda s, rng, m: {"travel": _travel(s, rng, m), "spread": rng.uniform(-0.5, 1.0)},
        "development",
    ),
    "herschel-bulkley-maxwell": Family(
        "Herschel–Bulkley of eight parameters: regularised yield, power-law flow, Maxwell element beside it",
        _herschel_bulkley,
        lambda s, rng, m: {
            "soft": _soft(s, rng), "power": rng.uniform(0.4, 0.9), "speed": s.speed,
            "maxwell": rng.uniform(0.3, 1.0), "relaxation": _relaxation(s, rng, m),
        },
        "evaluation",
    ),
    "prandtl-ishlinskii-rate": Family(
        "Prandtl–Ishlinskii: twelve stops, travel and force grow with speed; turbulent damping",
        _prandtl_ishlinskii,
        lambda s, rng, m: {
            "travel": _travel(s, rng, m), "rate": rng.uniform(0, 0.08), "rate_speed": s.speed * between(rng, 0.02, 0.2),
            "widening": rng.uniform(0, 0.15), "turbulent": rng.uniform(0, 0.8) / s.speed,
        },
        "evaluation",
    ),
    "dahl-stribeck": Family(
        "Dahl with an exponent, Stribeck's dip and bent damping",
        _dahl,
        lambda s, rng, m: {
            "travel": _travel(s, rng, m), "power": float(rng.choice([1.0, 1.3, 1.6])), "stribeck": rng.uniform(0, 0.4),
            "stribeck_speed": s.speed * between(rng, 0.03, 0.2), "speed": s.speed, "exponent": rng.uniform(0.6, 1.6),
        },
        "evaluation",
    ),
    "relaxation-spectrum": Family(
        "smooth yield, a part of it held back by four relaxation times",
        _spectrum,
        lambda s, rng, m: {"soft": _soft(s, rng), "held": rng.uniform(0.3, 0.8), "relaxation": _relaxation(s, rng, m)},
        "evaluation",
    ),
}  # fmt: skip


def draw(family: str, scales: Scales, top: float, rng: Rng, memory: float = 1.0) -> Law:
    """Return a law of a family with random numbers; ``top`` is the largest current (A).

    ``memory`` is 1 for a law that forgets in time, else its yield travel over the half-stroke.
    """
    field = Saturation(str(rng.choice(FORMS)), top * rng.uniform(0.3, 1.2), top)
    rest = scales.full * between(rng, 0.04, 0.25)
    damping = scales.full / scales.speed * between(rng, 0.08, 0.5)
    shape = FAMILIES[family].draw(scales, rng, memory)
    return Law(family, rest, scales.full, damping, rng.uniform(0, 0.6), field, shape)
