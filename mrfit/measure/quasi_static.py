"""A slow test of a damper: what it takes whatever the speed, a stiffness along the stroke and a friction across it.

    F = f0 + k*(x - x_m) ± Ff

x stroke (m), F force (N), x_m middle of the stroke (m), k stiffness (N/m), the slope of the loop's middle line, Ff
friction (N), half the height between the two ways, f0 force of the middle line at x_m (N). Both are taken over the
middle part of the stroke, where the ends' reversals have died away. The work lost per cycle is the area of the loop.

Source: preyield paper Fig. 2, a quasi-static test of the damper without current.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from mrfit.core.specs import Array
from mrfit.errors import DataError
from mrfit.measure.usable import unusable
from mrfit.signal.cycles import turning_points

# Share of the stroke, about its middle, that is looked at
MIDDLE_PART = 0.6
# Places along it
STROKE_PLACES = 41
# Share of the stroke below which a swing is no way
WAY_SWING = 0.2
# Share of the stroke that a way has to cover to count
WAY_PART = 0.8


@dataclass(frozen=True, kw_only=True)
class QuasiStatic:
    """Stiffness, friction and loss of one slow record.

    Attributes
    ----------
    recording
        Its id.
    stiffness
        k in N/m.
    friction
        Ff in N.
    offset
        f0 in N.
    loss
        Work lost in a cycle, in J, of whole cycles.
    peak_speed
        Greatest speed in m/s: a test is slow where a slower one shows the same.
    ways
        Strokes there and back that were used.
    spread
        Greatest difference of a way's force from the mean of its direction, in N.
    """

    recording: str
    stiffness: float
    friction: float
    offset: float
    loss: float
    peak_speed: float
    ways: int
    spread: float


def quasi_static(name: str, stroke: Array, force: Array, dt: float) -> QuasiStatic:
    """Return stiffness and friction of a record of stroke (N,) in m and force (N,) in N.

    Raises
    ------
    DataError
        If the stroke or the force is constant but for noise or of no size, or if the record does not go there and back
        over most of its stroke.
    """
    for channel, values in (("displacement", stroke), ("force", force)):
        if reason := unusable(channel, values):
            raise DataError(f"{name}: {reason}")
    low, high = float(stroke.min()), float(stroke.max())
    middle, span = 0.5 * (low + high), high - low
    turns = turning_points(stroke, WAY_SWING * span).tolist()
    places = middle + MIDDLE_PART * 0.5 * span * np.linspace(-1.0, 1.0, STROKE_PLACES)
    ways = [(a, b) for a, b in zip(turns[:-1], turns[1:], strict=True) if abs(stroke[b] - stroke[a]) >= WAY_PART * span]
    up: list[Array] = []
    down: list[Array] = []
    for a, b in ways:
        x, f = stroke[a : b + 1], force[a : b + 1]
        order = np.argsort(x, kind="stable")
        (up if x[-1] > x[0] else down).append(_along(x[order], f[order], places))
    if not up or not down:
        raise DataError(f"{name}: no stroke there and back over {100 * WAY_PART:.0f} % of its range; give a slow cycle")
    there, back = np.mean(up, axis=0), np.mean(down, axis=0)
    slope, level = np.polyfit(places - middle, 0.5 * (there + back), 1)
    spread = max(float(np.abs(np.array(w) - np.mean(w, axis=0)).max()) for w in (up, down))
    cycles = [(a, c) for (a, b), (other, c) in zip(ways[:-1], ways[1:], strict=True) if b == other]
    losses = [float(np.trapezoid(force[a : c + 1], stroke[a : c + 1])) for a, c in cycles]
    width = max(3, len(stroke) // 400)
    speed = np.gradient(uniform_filter1d(stroke, width, mode="nearest"), dt)
    return QuasiStatic(
        recording=name,
        stiffness=float(slope),
        friction=float(0.5 * np.mean(there - back)),
        offset=float(level),
        loss=float(np.mean(losses)) if losses else float("nan"),
        peak_speed=float(np.abs(speed).max()),
        ways=len(up) + len(down),
        spread=spread,
    )


def _along(x: Array, force: Array, places: Array) -> Array:
    """Return the mean force at places along a way, each over the samples nearest to it."""
    edges = np.concatenate([[-np.inf], 0.5 * (places[1:] + places[:-1]), [np.inf]])
    inside = (x >= 2 * places[0] - places[1]) & (x <= 2 * places[-1] - places[-2])
    x, force = x[inside], force[inside]
    which = np.searchsorted(edges, x) - 1
    counts = np.bincount(which, minlength=len(places))
    if np.any(counts == 0):
        return np.asarray(np.interp(places, x, force))
    # the samples of a place lie about it: carried there by the way's own slope
    slope = np.polyfit(x, force, 1)[0]
    return np.asarray(np.bincount(which, force - slope * (x - places[which]), len(places)) / counts)
