"""A laboratory in closed form: a plain damper with a mass or a spring, tested at one frequency only."""

from collections.abc import Mapping

import numpy as np

import mrfit
from mrfit.core.specs import Array

RATE, NOISE = 250.0, 2.0
FREQUENCY, SECONDS = 2.0, 4.0
MASS, SPRING = 20.0, 4000.0
RIG = {"seconds": 6, "stroke": "30 mm", "speed": 0.3, "acceleration": 10}
MODEL = "regularised-bingham"


def log(motion: Array, name: str, hidden: Mapping[str, float], rng: np.random.Generator) -> mrfit.Recording:
    """Return the log of a motion (3, N): position, speed and acceleration in SI."""
    x, v, a = motion
    force = 120.0 * np.sign(v) * -np.expm1(-np.abs(v) / 0.01) + 900.0 * v
    force = force + hidden.get("inertia", 0.0) * a + hidden.get("gas-spring", 0.0) * x
    noisy = x + 1e-6 * rng.standard_normal(len(x)), force + NOISE * rng.standard_normal(len(x))
    return mrfit.Recording.from_arrays(dt=1 / RATE, name=name, displacement=noisy[0], force=noisy[1])


def one_frequency(hidden: Mapping[str, float], rng: np.random.Generator) -> list[mrfit.Recording]:
    """Return sines of five strokes at one frequency, which cannot tell a mass from a spring."""
    time, w = np.arange(int(SECONDS * RATE)) / RATE, 2 * np.pi * FREQUENCY
    shape = np.stack([np.sin(w * time), w * np.cos(w * time), -(w**2) * np.sin(w * time)])
    return [log(size * shape, f"a{k}", hidden, rng) for k, size in enumerate((4e-3, 6e-3, 8e-3, 10e-3, 12e-3))]


def advised(
    advice: mrfit.Advice, hidden: Mapping[str, float], rng: np.random.Generator, names: tuple[str, ...]
) -> list[mrfit.Recording]:
    """Return the logs of advised drives, as a press makes them that is given the files alone."""
    made = []
    for name in names:
        drive = advice.drive(name)
        x, v = (drive[f"{c} [{u}]"].to_numpy() for c, u in (("displacement", "m"), ("velocity", "m/s")))
        made.append(log(np.stack([x, v, np.gradient(v, 1 / RATE)]), name.partition(".")[0], hidden, rng))
    return made
