"""Dampers and states that several tests put to use."""

import numpy as np

from mrfit.apply.damper import Damper, damper
from mrfit.apply.stepper import Channels, Stepper
from mrfit.core import registry
from mrfit.core.specs import Array

MODELS = tuple(n for n in registry.names("model") if registry.load("model", n).SPEC.output in ("force", "torque"))
JUMPING = ("biviscous-printed",)
# 004 Table 3: low 0-0.2 A, high 0.2-1 A, in N, mm
PAPER = {
    "fy": ((0.0, 579.6, 82.96), (-719.6, 1817.0, -135.7), 1.0),
    "c": ((0.0, 3.1, 0.71), (0.1429, 2.669, 0.84), 1e3),
    "f0": ((0.0, -19.95, -11.77), (16.28, -29.55, -11.67), 1.0),
}
STEP = 1e-3


def controllable(name: str) -> Damper:
    """Return a model whose positive parameters grow with current, on plain and logarithmic scales."""
    spec = registry.load("model", name).SPEC
    values = {p.name: p.start for p in spec.params}
    if "current" in spec.inputs:
        return damper(name, values)
    # where the force jumps at its knee, a knee that moves with current has forces that no current gives
    roles = ("yield", "viscous", "hysteresis", *(() if name in JUMPING else ("knee",)))
    varying = [p for p in spec.params if p.low > 0.0 and p.role in roles]
    varying = varying or [p for p in spec.params if p.name in ("a1", "b1")]
    for p in varying:
        del values[p.name]
        # with an exponent below 1 a loop may go on in more than one way
        size, least = p.start or 100.0, 1.0 if p.name == "n" else 0.0
        values |= {f"{p.name}@{i}A": max(size * share, least) for i, share in (("0", 0.3), ("0.5", 0.8), ("1", 1.0))}
    return damper(name, values, {p.name: 2 for p in varying})


def monotone(model: str = "tanh", **more: float) -> Damper:
    """Return a tanh-like damper with yield force 80 to 800 N and damping 700 to 3600 N*s/m."""
    values = {"fy@0A": 80.0, "fy@1A": 800.0, "a1": 80.0, "a2": 60.0, "c@0A": 700.0, "c@1A": 3600.0, "k": 270.0}
    return damper(model, {**values, "f0": -12.0, **more}, {"fy": 1, "c": 1})


def paper_tanh(**more: float) -> Damper:
    """Return the force-current model of 004, Table 3."""
    values = {"k": 270.0}
    for name, (low, high, unit) in PAPER.items():
        below, above = (np.polynomial.Polynomial(c[::-1]) for c in (low, high))
        values |= {f"{name}@{i:g}A{'-' if i == 0.2 else ''}": unit * below(i) for i in (0.0, 0.2)}
        values |= {f"{name}@{i:g}A{'+' if i == 0.2 else ''}": unit * above(i) for i in (0.2, 0.6, 1.0)}
    values |= {"a1@0.1A": 100.0, "a1@0.6A": 75.0, "a2@0.1A": 65.0, "a2@0.6A": 80.0}
    orders = {"fy": "1/0.2/2", "c": "1/0.2/2", "f0": "1/0.2/2", "a1": "0/0.2/0", "a2": "0/0.2/0"}
    effects = "".join(f"+{e}" for e in dict.fromkeys(n.partition(".")[0] for n in more))
    return damper(f"tanh{effects}", {**values, **more}, orders)


def channels(rng: np.random.Generator, lanes: int) -> dict[str, Array]:
    """Return a random motion and current of every lane."""
    x, v, a, i = (rng.uniform(low, high, lanes) for low, high in ((-0.01, 0.01), (-0.2, 0.2), (-5, 5), (0, 1)))
    turning = {"angle": 10 * x, "angular_velocity": 10 * v, "angular_acceleration": 10 * a}
    return {"displacement": x, "velocity": v, "acceleration": a, "current": i, **turning}


def wandered(stepper: Stepper, rng: np.random.Generator, lanes: int, steps: int = 5) -> tuple[Array, Channels]:
    """Return states after some random steps, and the channels of the next one."""
    state = stepper.rest(channels(rng, lanes))
    for _ in range(steps):
        state = stepper.step(state, channels(rng, lanes), STEP).state
    return state, channels(rng, lanes)
