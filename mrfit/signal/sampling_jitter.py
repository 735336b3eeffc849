"""Noise that grows with a channel's slope: its samples are taken a little early or late, as by a clock of software.

A sample that is taken δ late errs by δ·ẋ. With white noise of variance σ² beside it, and δ of variance τ², the noise
has the power σ² + τ²·ẋ². A fast signal has no such spectrum: of noise, differences of every order see the same τ.
"""

from math import comb

import numpy as np

from mrfit.core.specs import Array
from mrfit.signal.noise import robust_rms

# Orders of the differences that see the same noise
JITTER_ORDERS = (4, 6, 8)
# A slope is taken over so many samples to either side
SLOPE_SIDE = 4
# Share of the samples that are slow, and shares of the fast ones, of which both halves have to agree
SLOW_SHARE, FAST_SHARE, FASTEST_SHARE = 0.5, 0.9, 0.95
# Fewest samples of a half
FAST_SAMPLES_MIN = 50
# Jitter is worth knowing where the noise of the fast samples has so many times the power of that of the slow ones
NOISE_RATIO_MIN = 2.0
# Two estimates of one jitter that differ by less say the same, those of two halves and those of two orders
SAME_OF_HALVES, SAME_OF_ORDERS = 1.5, 1.25
JITTER_PASSES = 10


def noise_power(values: Array) -> Array | None:
    """Return the power (N,) of the noise of a channel (N,) at each sample, or None where it is the same everywhere.

    Parameters
    ----------
    values
        Channel (N,), sampled evenly but for a jitter.
    """
    if len(values) <= 2 * SLOPE_SIDE:
        return None
    slope = np.abs(values[2 * SLOPE_SIDE :] - values[: -2 * SLOPE_SIDE]) / (2 * SLOPE_SIDE)
    ends = np.quantile(slope, (SLOW_SHARE, FAST_SHARE, FASTEST_SHARE))
    slow, fast = slope <= ends[0], slope > ends[1]
    halves = (fast & (slope <= ends[2]), slope > ends[2])
    if min(np.count_nonzero(half) for half in halves) < FAST_SAMPLES_MIN:
        return None
    seen = []
    for order in JITTER_ORDERS:
        difference = np.diff(values, order) / np.sqrt(comb(2 * order, order))
        inner = difference[SLOPE_SIDE - order // 2 :][: len(slope)]
        noise = robust_rms(inner[slow]) ** 2
        if not robust_rms(inner[fast]) ** 2 > NOISE_RATIO_MIN * noise:
            return None
        squares = [_squared_jitter(inner[half], slope[half], noise) for half in halves]
        if not max(squares) < SAME_OF_HALVES**2 * min(squares):
            return None
        seen.append((_squared_jitter(inner[fast], slope[fast], noise), noise))
    jitters = [jitter for jitter, _ in seen]
    if not max(jitters) < SAME_OF_ORDERS**2 * min(jitters):
        return None
    jitter, noise = min(seen)
    power: Array = np.pad(noise + jitter * slope**2, SLOPE_SIDE, "edge")
    return power


def _squared_jitter(difference: Array, slope: Array, noise: float) -> float:
    """Return the variance of the instants, in samples squared, at which the noise of fast samples is as it should be.

    ``noise`` is the power beside that of the jitter.
    """
    squares = slope**2
    jitter = max(robust_rms(difference) ** 2 - noise, 0.0) / float(np.median(squares))
    for _ in range(JITTER_PASSES):
        jitter *= robust_rms(difference / np.sqrt(noise + jitter * squares)) ** 2
    return jitter
