"""Measurement noise of several kinds, each with the standard deviation asked for, and the converter."""

import numpy as np
from scipy.signal import lfilter

from datasets.rig.stop import Array

KINDS = ("white", "coloured", "hum", "coarse")
CORRELATION = 0.8
MAINS = 50.0


def draw(kind: str, level: Array, samples: int, interval: Array, rng: np.random.Generator) -> Array:
    """Return noise (runs, samples).

    Parameters
    ----------
    kind
        ``white``; ``coloured`` (first-order autoregressive, lag-one correlation 0.8); ``hum`` (half of it at 50 Hz);
        ``coarse`` (white, and a third of the level: the converter's steps then stand above it).
    level
        Standard deviation of each run, in the unit of the signal, shape (runs,).
    samples
        Number of samples.
    interval
        Sample interval of each run, shape (runs,), s.
    rng
        Source of randomness.
    """
    shape = (len(level), samples)
    deviation = level[:, None]
    white = deviation * rng.normal(0.0, 1.0, shape)
    if kind == "white":
        return white
    if kind == "coarse":
        return white / 3.0
    if kind == "coloured":
        first = white[:, :1] / np.sqrt(1 - CORRELATION**2)
        filtered: Array = np.sqrt(1 - CORRELATION**2) * lfilter(
            [1.0], [1.0, -CORRELATION], np.hstack([first, white[:, 1:]]), axis=1
        )
        return filtered
    phase = rng.uniform(0, 2 * np.pi, (shape[0], 1))
    hum: Array = deviation * np.sin(2 * np.pi * MAINS * interval[:, None] * np.arange(shape[1]) + phase)
    return np.sqrt(0.5) * white + hum


def quantise(signal: Array, full_scale: float, bits: int = 12) -> Array:
    """Return a signal as a converter of +-full_scale stores it."""
    level = 2.0 * full_scale / 2**bits
    top = 2 ** (bits - 1)
    codes: Array = np.clip(np.rint(signal / level), -top, top - 1) * level
    return codes
