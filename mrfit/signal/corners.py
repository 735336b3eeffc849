"""Corners of a signal: where it jumps or its slope does, as at the turns of a triangle or of a switched current.

A smoother that works across a corner rounds it, and is wrong about the derivative as far as its window reaches.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from mrfit.core.specs import Array, Index, Mask
from mrfit.signal.convolution import correlated

# Samples on each side of a place that is tested, at every level of averaging
SIDE = 12
CORNER_WINDOW = 2 * SIDE
# Two parabolas and one quintic have as many coefficients: neither fits better by having more freedom.
COEFFICIENTS = 6
FREEDOM = CORNER_WINDOW - COEFFICIENTS
# Residual power in shares of the noise's by which two parabolas must fit better, about one chance in 10⁹ …
EVIDENCE = 45.0
# … by which a quintic must, on a finer level, or a corner rounded within so many samples, for the corner to be none …
ROUNDED = 20.0
ROUNDINGS = (2, 4, 8)
# … and the most that parabolas may leave per degree of freedom, unless a quintic leaves so many times more
EXPLAINED, OVERWHELMING = 2.0, 30.0
# In this share of short windows there is no corner. A level does not resolve the signal if a parabola leaves so many
# times the noise's power there.
USUAL, ROUGH_EXCESS = 0.25, 1.5
# Quartile of χ² with SIDE − 3 degrees of freedom
USUAL_BY_CHANCE = 5.899
# Tested at all only where a kink or a step explains this much
CANDIDATE = 30.0
# Rounding errors in shares of a signal's range
CORNER_ROUNDING = 1e-10
CORNER_GRID = 4_000


def find_corners(values: Array, noise: float) -> Index:
    """Return the first sample after each corner of a signal (N,), ascending, at least ``SIDE`` samples apart.

    At a corner, two parabolas that end there fit better than one polynomial of degree 5 across. Means over 1, 2, 4 …
    samples are tested in turn: sharp or strong corners are seen at once, those buried in noise only in long windows. A
    corner that a finer level shows to be rounded is none.

    Parameters
    ----------
    values
        Signal (N,).
    noise
        Rms of its white noise, in its unit.
    """
    found = np.empty(0, dtype=np.int64)
    span = float(np.ptp(values)) if len(values) else 0.0
    levels: list[_Level] = []
    block = 1
    while len(values) // block >= 2 * CORNER_WINDOW and span > 0.0:
        levels.append(_Level(values, block, max(noise / np.sqrt(block), CORNER_ROUNDING * span)))
        fresh = levels[-1].corners(found)
        fresh = fresh[_sharp(levels, fresh)]
        if block > 1:
            fresh = np.array([_placed(values, int(at), block) for at in fresh], dtype=np.int64)
        found = np.unique(np.concatenate([found, fresh]))
        block *= 2
    return found[np.diff(found, prepend=-SIDE) >= SIDE]


class _Level:
    """A signal averaged over blocks, and how well two parabolas and one quintic fit about a place in it."""

    def __init__(self, values: Array, block: int, noise: float) -> None:
        count = len(values) // block
        self.block = block
        self.values = values[: count * block].reshape(count, block).mean(axis=1) if block > 1 else values
        step = max(1, (count - SIDE) // CORNER_GRID)
        halves = np.lib.stride_tricks.sliding_window_view(self.values, SIDE)[::step]
        usual = float(np.quantile(_left(halves - halves[:, :1], HALF), USUAL)) / USUAL_BY_CHANCE
        self.power = max(noise**2, usual)
        # where a parabola leaves more than noise, this level does not resolve the signal
        self.rough = usual > ROUGH_EXCESS * noise**2

    def residuals(self, places: Index) -> tuple[Array, Array]:
        """Return the sums of squares (C,) that two parabolas and that one quintic leave about places (C,)."""
        windows = np.lib.stride_tricks.sliding_window_view(self.values, CORNER_WINDOW)[places - SIDE]
        windows = windows - windows.mean(axis=1, keepdims=True)
        return _left(windows, SPLIT), _left(windows, SMOOTH)

    def rounding(self, places: Index) -> Array:
        """Return the power (C,) of what two parabolas leave about places (C,) that a bend explains, but no corner."""
        windows = np.lib.stride_tricks.sliding_window_view(self.values, CORNER_WINDOW)[places - SIDE]
        windows = windows - windows.mean(axis=1, keepdims=True)
        explained: Array = np.max((windows @ BENDS) ** 2, axis=1)
        return explained

    def corners(self, known: Index) -> Index:
        """Return the samples of the whole signal at which corners show, clear of those known."""
        places = self._candidates(known)
        gain = self._gain(places)
        places = places[gain > EVIDENCE / 2]
        shifts = np.clip(places[:, None] + np.arange(-2, 3), SIDE, len(self.values) - SIDE)
        apart, across = (r.reshape(shifts.shape) for r in self.residuals(shifts.reshape(-1)))
        best = np.argmin(apart, axis=1)[:, None]
        places, apart, across = (np.take_along_axis(a, best, axis=1)[:, 0] for a in (shifts, apart, across))
        clear = across > OVERWHELMING * apart
        if not self.rough:
            clear |= apart <= EXPLAINED * FREEDOM * self.power
        gain = np.where(clear, self._gain(places), 0.0)
        return self.block * _strongest(places[gain > EVIDENCE], gain[gain > EVIDENCE])

    def _gain(self, places: Index) -> Array:
        apart, across = self.residuals(places)
        return (across - apart) / np.maximum(self.power, apart / FREEDOM)

    def _candidates(self, known: Index) -> Index:
        """Return the places where a kink or a step explains most for its neighbourhood, away from known corners."""
        centred = self.values - self.values.mean()
        kink, step = (correlated(centred, shape) for shape in (KINK, STEP_SHAPE))
        power = kink**2 + step**2
        peaks = (power == greatest_near(power, SIDE // 2)) & (power > CANDIDATE * self.power)
        blocked = np.zeros(len(power) + 1, dtype=np.int64)
        near = known // self.block - SIDE
        np.add.at(blocked, np.clip(near - SIDE, 0, len(power)), 1)
        np.add.at(blocked, np.clip(near + SIDE + 1, 0, len(power)), -1)
        return np.flatnonzero(peaks & (np.cumsum(blocked)[:-1] == 0)) + SIDE


def greatest_near(values: Array, width: int) -> Array:
    """Return the greatest value (N,) of a window around each, mirrored at the ends, as of ``maximum_filter1d``.

    ``scipy.ndimage``, of which no command uses anything else, takes 0.03 s to import.
    """
    before = width // 2
    greatest: Array = sliding_window_view(np.pad(values, (before, width - 1 - before), "symmetric"), width).max(axis=1)
    return greatest


def _sharp(levels: list[_Level], corners: Index) -> Mask:
    """Return which corners neither their own level nor a finer one shows to be rounded."""
    sharp = np.ones(len(corners), dtype=bool)
    for level in levels if len(corners) else []:
        places = corners // level.block
        apart, across = level.residuals(np.clip(places, SIDE, len(level.values) - SIDE))
        near = np.clip(places[:, None] + np.arange(-1, 2), SIDE, len(level.values) - SIDE)
        bend = level.rounding(near.reshape(-1)).reshape(near.shape).min(axis=1)
        sharp &= (apart - across <= ROUNDED * level.power) & (bend <= ROUNDED * level.power)
    return sharp


def _strongest(places: Index, gain: Array) -> Index:
    """Return the places that gain most, at least ``SIDE`` apart."""
    kept: list[int] = []
    best = 0.0
    for place, value in zip(places.tolist(), gain.tolist(), strict=True):
        if kept and place - kept[-1] < SIDE:
            if value > best:
                kept[-1], best = place, value
        else:
            kept.append(place)
            best = value
    return np.array(kept, dtype=np.int64)


def _placed(values: Array, about: int, block: int) -> int:
    """Return the sample within a block or two of ``about`` that parts two parabolas best."""
    first, last = max(about - SIDE * block, 0), min(about + SIDE * block, len(values))
    window = values[first:last] - values[first:last].mean()
    at = np.linspace(-1.0, 1.0, len(window))
    powers = np.vander(at, 5, increasing=True)
    cuts = np.arange(max(about - 2 * block, first + SIDE), min(about + 2 * block, last - SIDE) + 1) - first
    sums = np.cumsum(powers, axis=0)
    moments = np.cumsum(powers[:, :3] * window[:, None], axis=0)
    hankel = np.arange(3)[:, None] + np.arange(3)[None, :]
    explained = np.zeros(len(cuts))
    for total, moment in (
        (sums[cuts - 1], moments[cuts - 1]),
        (sums[-1] - sums[cuts - 1], moments[-1] - moments[cuts - 1]),
    ):
        solution = np.linalg.solve(total[:, hankel], moment[:, :, None])[:, :, 0]
        explained += np.sum(solution * moment, axis=1)
    return int(first + cuts[np.argmax(explained)])


def _left(windows: Array, basis: Array) -> Array:
    residual = windows - (windows @ basis) @ basis.T
    power: Array = np.einsum("ij,ij->i", residual, residual)
    return power


def _orthonormal(columns: Array) -> Array:
    return np.linalg.qr(columns)[0]


def _beyond_cubic(shape: Array) -> Array:
    """Return what a cubic leaves of a shape (CORNER_WINDOW,), of unit length."""
    cubic = SMOOTH[:, :4]
    residual = shape - cubic @ (cubic.T @ shape)
    return residual / np.linalg.norm(residual)


OFFSETS = (np.arange(CORNER_WINDOW) - (CORNER_WINDOW - 1) / 2) / SIDE
SMOOTH = _orthonormal(np.vander(OFFSETS, COEFFICIENTS, increasing=True))
SPLIT = _orthonormal(
    np.concatenate([np.vander(OFFSETS, 3, increasing=True) * (side * OFFSETS > 0)[:, None] for side in (-1, 1)], axis=1)
)
HALF = _orthonormal(np.vander(np.arange(SIDE) / SIDE, 3, increasing=True))
KINK, STEP_SHAPE = _beyond_cubic(np.abs(OFFSETS)), _beyond_cubic(np.sign(OFFSETS))
_ROUND = np.stack([np.maximum(1.0 - np.abs(OFFSETS) * SIDE / width, 0.0) ** 2 for width in ROUNDINGS], axis=1)
_BEYOND_SPLIT = _ROUND - SPLIT @ (SPLIT.T @ _ROUND)
BENDS = _BEYOND_SPLIT / np.linalg.norm(_BEYOND_SPLIT, axis=0)
