"""What is hidden in a specimen: effects that the library knows and some that it does not, written anew here."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from benchmarks.law_mismatch.integration import play, relaxed, released
from benchmarks.law_mismatch.laws import Law, between
from benchmarks.law_mismatch.motions import Array, Rng


@dataclass(frozen=True)
class State:
    """One record in fine steps: times, motion about the middle, current, temperature beyond the mean (N,), step (s)."""

    t: Array
    x: Array
    v: Array
    a: Array
    i: Array
    warmth: Array
    h: float
    number: int = 0


@dataclass(frozen=True)
class Fault:
    """An effect with its numbers; ``strength`` is that of its first parameter, in SI."""

    name: str
    strength: float
    shape: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Bench:
    """What strengths are measured by: half-stroke (m), speed (m/s), current (A), middle frequency (Hz), interval (s).

    ``second`` is the half-stroke that at least two records reach.
    """

    stroke: float
    second: float
    speed: float
    top: float
    frequency: float
    dt: float


# how an effect acts: on the current, on the motion, as a factor of the law, as a force beside it, on all the force
Input = Callable[[State, Fault], Array]


def _lagging(s: State, f: Fault) -> Array:
    return relaxed(s.i, f.strength, s.h)


def _playing(s: State, f: Fault) -> Array:
    return play(s.i, f.strength)


def _releasing(s: State, f: Fault) -> Array:
    return s.i + f.strength * (released(s.i, f.shape["tau"], s.h) - s.i)


def _warm(s: State, f: Fault) -> Array:
    return np.exp(-f.strength * s.warmth)


def _lopsided(s: State, f: Fault) -> Array:
    return 1 + f.strength * np.tanh(s.v / f.shape["v_a"])


def _spring(s: State, f: Fault) -> Array:
    c = f.shape["c"]
    return f.strength * (s.x if c == 0 else ((1 - c * s.x) ** -1.3 - 1) / (1.3 * c))


def _mass(s: State, f: Fault) -> Array:
    return f.strength * s.a


def _stop(s: State, f: Fault) -> Array:
    deep = np.maximum(np.abs(s.x) - f.shape["x_s"], 0.0)
    hit = deep if f.shape["side"] == 0 else np.where(np.sign(s.x) == f.shape["side"], deep, 0.0)
    return f.strength * 1e-3 * (hit / 1e-3) ** f.shape["p"] * np.sign(s.x)


def _drifting(s: State, f: Fault) -> Array:
    return 1 + f.strength * s.t


def _ripple(s: State, f: Fault) -> Array:
    return 1 + f.strength * np.sin(2 * np.pi * s.x / f.shape["wave"] + f.shape["phase"])


def _worn(s: State, f: Fault) -> Array:
    return 1 + f.strength * (s.x / f.shape["stroke"]) ** 2


def _jumping(s: State, f: Fault) -> Array:
    rng = np.random.default_rng([int(f.shape["seed"]), s.number])
    times = np.sort(rng.uniform(s.t[0], s.t[-1], rng.integers(2, 5)))
    levels = np.concatenate([[0.0], rng.choice([-1.0, 1.0], len(times)) * rng.uniform(0.5, 1, len(times))])
    return f.strength * levels[np.searchsorted(times, s.t)]


def _wandering(s: State, f: Fault) -> Array:
    rng = np.random.default_rng([int(f.shape["seed"]), s.number])
    turns = rng.uniform(0.3, 1.2, 3) / (s.t[-1] - s.t[0])
    waves = np.sin(2 * np.pi * turns[:, None] * s.t + rng.uniform(0, 2 * np.pi, (3, 1)))
    return f.strength * waves.sum(0) / 3


def _loose(s: State, f: Fault) -> Array:
    return play(s.x - s.x[0], f.strength) + s.x[0]


INPUTS: dict[str, Input] = {"current-lag": _lagging, "play": _playing, "slow-release": _releasing}
MOTIONS: dict[str, Input] = {"backlash": _loose}
FACTORS: dict[str, Input] = {
    "temperature": _warm, "asymmetry": _lopsided, "position-ripple": _ripple, "position-damping": _worn
}  # fmt: skip
ADDED: dict[str, Input] = {
    "gas-spring": _spring, "inertia": _mass, "end-stop": _stop, "force-jumps": _jumping, "offset-wander": _wandering
}  # fmt: skip
GAINS: dict[str, Input] = {"gain-drift": _drifting}

# the library's name of each, its parameter that is judged and its unit
LIBRARY = {
    "gas-spring": ("gas-spring", "k_g", "N/m"),
    "inertia": ("inertia", "m", "kg"),
    "temperature": ("temperature", "b_yield", "1/K"),
    "gain-drift": ("gain-drift", "g", "1/s"),
    "asymmetry": ("asymmetry", "g_yield", "1"),
    "end-stop": ("end-stop", "peak", "N"),
    "current-lag": ("current-lag", "tau", "s"),
    "play": ("residual-magnetism", "w", "A"),
    "slow-release": ("slow-release", "tau", "s"),
}
OUTSIDE = ("position-ripple", "position-damping", "force-jumps", "backlash", "offset-wander")
OF_CURRENT = tuple(INPUTS)
# what two hidden effects may not have in common
CLASS = {
    "gas-spring": "position", "end-stop": "position", "current-lag": "current", "play": "current",
    "slow-release": "current",
}  # fmt: skip


def force(law: Law, s: State, faults: tuple[Fault, ...], offset: float = 0.0) -> Array:
    """Return the force (N,) of a law with all faults; a gain acts on the load cell's offset (N) too."""
    i, x, v = s.i, s.x, s.v
    for f in faults:
        if f.name in INPUTS:
            i = INPUTS[f.name](s, f)
        if f.name in MOTIONS:
            x = MOTIONS[f.name](s, f)
            v = np.gradient(x, s.h)
    total = law.force(x, v, i, s.h)
    for f in faults:
        if f.name in FACTORS:
            total = total * FACTORS[f.name](s, f)
    total = total + offset
    for f in faults:
        if f.name in ADDED:
            total = total + ADDED[f.name](s, f)
    for f in faults:
        if f.name in GAINS:
            total = total * GAINS[f.name](s, f)
    return total


def draw(name: str, bench: Bench, rng: Rng) -> tuple[Fault, float]:
    """Return a fault of a trial strength, its shape at random, and the largest strength that makes sense."""
    if name == "current-lag":
        tau = between(rng, min(max(8e-3, 2.5 * bench.dt, 0.015 / bench.frequency), 50e-3), 60e-3)
        return Fault(name, tau), tau
    shapes: dict[str, dict[str, float]] = {
        "slow-release": {"tau": between(rng, 0.06, 0.5) / bench.frequency},
        "asymmetry": {"v_a": bench.speed * between(rng, 0.01, 0.08)},
        "gas-spring": {"c": float(rng.choice([0.0, 1.0])) * rng.uniform(-0.12, 0.12) / bench.stroke},
        "end-stop": {
            "x_s": rng.uniform(0.5, 0.88) * bench.second, "p": rng.uniform(1, 2), "side": float(rng.integers(-1, 2))
        },
        "position-ripple": {"wave": bench.stroke * rng.uniform(0.15, 0.6), "phase": rng.uniform(0, 6.28)},
        "position-damping": {"stroke": bench.stroke},
        "force-jumps": {"seed": float(rng.integers(1 << 30))},
        "offset-wander": {"seed": float(rng.integers(1 << 30))},
    }  # fmt: skip
    trials = {
        "play": (0.05, 0.45), "slow-release": (0.3, 0.95), "temperature": (0.002, 0.04),
        "backlash": (between(rng, 0.005, 0.04), 1.0),
    }  # fmt: skip
    strength, most = trials.get(name, (0.01, np.inf))
    unit = {"play": bench.top, "backlash": bench.stroke}.get(name, 1.0)
    sign = float(rng.choice([-1.0, 1.0])) if name in ("asymmetry", "gain-drift") else 1.0
    return Fault(name, sign * strength * unit, shapes.get(name, {})), most * unit
