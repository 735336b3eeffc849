"""What is known of an output's noise floor: its size, how it was found, and between which bounds it lies."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from mrfit.core.specs import Array, Mask
from mrfit.signal.noise import noise_level, quantisation
from mrfit.signal.runs import runs

Method = Literal["cycles", "repeats", "regression", "other records", "not known"]
# Fewest samples on one straight line that no noisy channel has by chance
PATCH_SAMPLES = 8
# Second differences below this share of the range are rounding
FLOOR_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class NoiseFloor:
    """Noise floor of an output over one segment.

    Attributes
    ----------
    value
        RMS of the noise in the output's unit; nan where it is not known.
    method
        ``cycles``: what differs from cycle to cycle; ``repeats``: what differs between records of the same drive;
        ``regression``: what a flexible regression on the inputs leaves; ``other records``: that of other pieces
        of the record, or the white noise times the colour that records with cycles have; ``not known``.
    low, high
        Bounds in the output's unit; nan where there is none.
    """

    value: float
    method: Method
    low: float
    high: float

    @property
    def known(self) -> bool:
        """Whether there is a value."""
        return bool(np.isfinite(self.value))

    @property
    def scale(self) -> float:
        """The value; where it is not known, the least that the noise can be, for weights."""
        return self.value if self.known else self.low

    @property
    def most(self) -> float:
        """The value; where it is not known, the most that the noise can be, inf without a bound."""
        if self.known:
            return self.value
        return self.high if np.isfinite(self.high) else float("inf")


def not_known(values: Array, high: float = float("nan")) -> NoiseFloor:
    """Return the floor of an output (N,) of which only the white part, the least there can be, is seen."""
    least = white_noise(values)
    return NoiseFloor(float("nan"), "not known", min(least, high) if np.isfinite(high) else least, high)


def white_noise(values: Array) -> float:
    """Return the RMS of the white noise of a channel (N,) where it was measured; 0 where hardly anything was."""
    measured = values[measured_samples(values)]
    return noise_level(measured) if len(measured) > PATCH_SAMPLES else 0.0


def measured_samples(values: Array) -> Mask:
    """Return which samples (N,) were measured, not filled in: those on no exactly straight line of 8 or more.

    Loggers fill dropouts with a held value or a straight line. On an amplitude grid a slow signal is constant for long
    without any dropout, so all samples count as measured there; so they do where hardly any other would be left.
    """
    measured: Mask = np.ones(len(values), dtype=bool)
    if len(values) < PATCH_SAMPLES or quantisation(values) > 0.0:
        return measured
    straight = np.abs(np.diff(values, 2)) <= FLOOR_ROUNDING * float(np.ptp(values))
    for first, last in runs(straight):
        if last - first >= PATCH_SAMPLES - 2:
            measured[first : last + 2] = False
    return measured
