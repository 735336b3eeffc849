"""Coil resistance from stretches in which voltage and current stand still."""

from collections.abc import Sequence

import numpy as np

from mrfit.core.specs import Array
from mrfit.io.columns import is_on_disk, span
from mrfit.signal.noise import noise_level

PLATEAU_BLOCKS = 100
FEWEST_BLOCKS = 4
# Levels must span this share of the largest current for an offset of the probes to be told from resistance.
LEVEL_SPAN = 0.2


def steady_blocks(voltage: Array, current: Array) -> Array:
    """Return block means (B, 2) of current and voltage where both stand still within their noise."""
    size = max(10, len(current) // PLATEAU_BLOCKS)
    count = len(current) // size
    if count < FEWEST_BLOCKS:
        return np.empty((0, 2))
    means = np.stack([_block_means(v, count, size) for v in (current, voltage)], axis=1)
    limits = [max(4 * noise_level(v) / np.sqrt(size), 1e-3 * span(v)) for v in (current, voltage)]
    still = np.all(np.abs(np.diff(means, axis=0)) <= limits, axis=1)
    steady: Array = means[1:-1][still[1:] & still[:-1]]
    return steady


def _block_means(values: Array, count: int, size: int) -> Array:
    """Return the means (B,) over blocks of a channel."""
    if is_on_disk(values):
        return np.array([np.mean(values[k * size : (k + 1) * size]) for k in range(count)])
    means: Array = values[: count * size].reshape(count, size).mean(axis=1)
    return means


def resistance_of_plateaus(blocks: Sequence[Array], peak: float) -> tuple[float, float, str] | None:
    """Return resistance, standard error in Ω and how it was found, from the steady blocks of all recordings.

    With currents at several levels R is the slope of u over i, free of offsets; with one level it is u/i. None if there
    are too few blocks or no current.

    Parameters
    ----------
    blocks
        Block means (B, 2) of current and voltage, as from ``steady_blocks``.
    peak
        Largest current of the recordings in A: a level far below it is a probe's offset.
    """
    points = np.concatenate([b for b in blocks if len(b)] or [np.empty((0, 2))])
    if len(points) < FEWEST_BLOCKS:
        return None
    current, voltage = points[:, 0], points[:, 1]
    largest = float(np.max(np.abs(current)))
    if largest < LEVEL_SPAN * peak or largest <= 0.0:
        return None
    if float(np.ptp(current)) > LEVEL_SPAN * largest:
        centred = current - np.mean(current)
        slope = float(centred @ voltage / (centred @ centred))
        rest = voltage - np.mean(voltage) - slope * centred
        error = float(np.sqrt(rest @ rest / (len(rest) - 2) / (centred @ centred)))
        return slope, error, "slope of voltage over steady currents"
    ratios = voltage / current
    error = float(np.std(ratios, ddof=1) / np.sqrt(len(ratios)))
    return float(np.mean(ratios)), error, "voltage over one steady current; an offset of the probes is in it"
