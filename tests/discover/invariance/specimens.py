"""Records of laws that mrfit does not have, with or without one effect."""

from collections.abc import Callable, Mapping

import numpy as np
from scipy.signal import lfilter

from mrfit.core.protocols import Effect
from mrfit.core.registry import load, names
from mrfit.core.specs import Array
from mrfit.discover.invariance.records import Record, thinned

DT = 2e-3
HALF_STROKE = 0.012

Force = Callable[[Mapping[str, Array], Array], Array]
"""What a law's force (N,) becomes, of channels (N,)."""


def law(v: Array, i: Array) -> Array:
    """Return a regularised Bingham law whose yield force lags by 1 ms: it is odd and soon forgets.

    The viscous force does not lag, since a lag of c*v by tau is a mass of -c*tau at any current.
    """
    yielding = (300.0 + 600.0 * i) * (1.0 - np.exp(-np.abs(v) / 0.01)) * np.sign(v)
    keep = np.exp(-DT / 1e-3)
    lagged = lfilter([1.0 - keep], [1.0, -keep], yielding)
    force: Array = lagged + 1500.0 * v
    return force


def no_effect(channels: Mapping[str, Array], force: Array) -> Array:
    """Leave the force as it is."""
    return force


def records(effect: Force = no_effect, moved: Callable[[Array], Array] | None = None, seed: int = 0) -> list[Record]:
    """Return eight conditions: sines of two strokes and frequencies at 0 and 1 A; in two the current steps."""
    rng, found = np.random.default_rng(seed), []
    for n, (share, f, level) in enumerate((a, f, i) for a in (1.0, 0.5) for f in (1.0, 3.0) for i in (0.0, 1.0)):
        t = np.arange(1500) * DT
        w = 2.0 * np.pi * f
        x = share * HALF_STROKE * np.sin(w * t)
        v, a = share * HALF_STROKE * w * np.cos(w * t), -(w**2) * x
        steps = rng.choice([0.0, 0.5, 1.0], 12).repeat(125)
        current = steps if n in (2, 5) else np.full(len(t), level)
        warm = 20.0 + n + 3.0 * t
        channels = {
            "displacement": x, "velocity": v, "acceleration": a, "current": current, "temperature": warm, "time": t,
        }  # fmt: skip
        force = effect(channels, law(v, current if moved is None else moved(current)))
        noisy = force + rng.normal(0.0, 3.0, len(t))
        found.append(thinned(f"condition {n}", DT, channels, noisy, "force"))
    return found


def library(output: str = "force") -> list[Effect]:
    """Return all effects that may be proposed for an output."""
    found = [load("effect", n) for n in names("effect")]
    return [m for m in found if output in m.SPEC.outputs and m.SPEC.proposed]
