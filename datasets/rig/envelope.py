"""Amplitudes that differ from cycle to cycle, as those of a press or an amplifier that does not quite hold them."""

from collections.abc import Callable

import numpy as np
from scipy.interpolate import PchipInterpolator

from datasets.rig.stop import Array

KINDS = ("beat", "random", "ramp")
# Share of a cycle about its start over which a random amplitude moves to the next one
MOVING = 0.2
BEAT_CYCLES = (4.0, 9.0)

Envelope = Callable[[Array, int], Array]
"""Maps cycles since the start (N,) and the order of a derivative by them to the factor on the amplitude (N,)."""


def envelope(kind: str, depth: float, cycles: float, rng: np.random.Generator) -> Envelope:
    """Return the factor on the amplitude of a test.

    Parameters
    ----------
    kind
        ``beat``: a slow sine, one turn in 4 to 9 cycles; ``random``: every cycle has its own, uniformly drawn;
        ``ramp``: it rises steadily over the test.
    depth
        Largest departure from 1.
    cycles
        Length of the test.
    rng
        Source of randomness.
    """
    if kind == "beat":
        rate, phase = 2 * np.pi / rng.uniform(*BEAT_CYCLES), rng.uniform(0, 2 * np.pi)
        return lambda at, order: (order == 0) + depth * rate**order * np.sin(rate * at + phase + order * np.pi / 2)
    if kind == "ramp":
        return lambda at, order: (
            1.0 + depth * (2.0 * at / cycles - 1.0)
            if order == 0
            else np.full_like(at, 2.0 * depth / cycles * (order < 2))
        )
    count = int(np.ceil(cycles)) + 1
    level = np.repeat(1.0 + depth * rng.uniform(-1.0, 1.0, count), 2)
    place = np.arange(count)[:, None] + np.array([MOVING, -MOVING]) / 2 + np.array([0.0, 1.0])
    between = PchipInterpolator(place.ravel(), level)
    return lambda at, order: np.asarray(between(at, order))
