"""Recordings too long to be looked at sample by sample, as means over neighbours that still show the drive."""

from dataclasses import replace

import numpy as np

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.io.columns import changed, span
from mrfit.signal.noise import LONG_SEGMENT, noise_level, windows

# Straight lines between the means may leave the drive by so many times its noise, or by this share of its range
THINNING_NOISES, THINNING_SHARE = 1.2, 1e-3


def thinned(recording: Recording, drive: str) -> tuple[Recording, int]:
    """Return a recording as means over so many neighbouring samples, and how many these are; 1 for one that is short.

    They are as many as leave no more than two million means, but fewer where the means would not show the drive. Means
    that are more than that stay on disk where the channels do.
    """
    values = recording.channels[drive]
    step = 1 << ((len(values) - 1) // LONG_SEGMENT).bit_length()
    if step > 1:
        limit = max(THINNING_NOISES * noise_level(values), THINNING_SHARE * span(values))
        while step > 1 and _left(values, step) > limit:
            step //= 2
    if step == 1:
        return recording, 1
    channels = {name: changed(channel, lambda part: means(part, step)) for name, channel in recording.channels.items()}
    return replace(recording, channels=channels, dt=step * recording.dt), step


def means(values: Array, step: int) -> Array:
    """Return the means over ``step`` neighbouring samples, (N,) -> (N // step,)."""
    found: Array = values[: len(values) // step * step].reshape(-1, step).mean(axis=1)
    return found


def _left(values: Array, step: int) -> float:
    """Return the RMS of what straight lines between the means leave of a drive, in windows spread over it."""
    power, count = 0.0, 0
    for window in windows(values):
        middles = np.arange(len(window) // step) * step + (step - 1) / 2.0
        inner = np.arange(step, len(middles) * step - step)
        left = window[inner] - np.interp(inner, middles, means(window, step))
        power, count = power + float(left @ left), count + len(left)
    return float(np.sqrt(power / count))
