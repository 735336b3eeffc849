"""Waveform of a drive, from its Fourier series where it repeats, else from its plateaus and reversals."""

import numpy as np

from mrfit.core.specs import Array
from mrfit.signal.cycles import turning_points
from mrfit.signal.harmonics import HarmonicFit
from mrfit.signal.noise import noise_level
from mrfit.signal.runs import runs

# A current called sine by its laboratory is bent by the coil; a triangle's own misfit to a sine is 0.12.
SINE_MISFIT = 0.2
TRIANGLE_MISFIT = 0.06
STILL_NOISE = 8.0
REVERSAL_SWING = 0.05
WAVEFORM_BLOCKS = 400
STILL_SHARE = 0.6
FEW_CHANGES = 12
STRAIGHT_RAMP = 0.03


def periodic_waveform(fit: HarmonicFit) -> str:
    """Return ``sine``, ``triangle`` or ``periodic`` for a Fourier series.

    The misfits are the rms distances to the closest sine and the closest triangle in phase with the fundamental, in
    shares of the signal's rms; a triangle has the harmonics 1/k², k odd.
    """
    harmonics = fit.coefficients[1:]
    power = float(np.sum(np.abs(harmonics) ** 2))
    if power <= 0.0:
        return "periodic"
    order = np.arange(1, len(harmonics) + 1)
    template = np.where(order % 2 == 1, np.exp(1j * order * np.angle(harmonics[0])) / order**2, 0.0)
    # What the series was too short to hold counts as missing too.
    whole = np.pi**4 / 96
    sine = np.sqrt(max(0.0, 1.0 - abs(harmonics[0]) ** 2 / power))
    triangle = np.sqrt(max(0.0, 1.0 - float(np.sum(harmonics * np.conj(template)).real) ** 2 / (power * whole)))
    if triangle < TRIANGLE_MISFIT and triangle < sine / 2:
        return "triangle"
    return "sine" if sine < SINE_MISFIT else "periodic"


def irregular_waveform(values: Array) -> str | None:
    """Return the waveform of a drive (N,) that does not repeat, None for one at rest.

    It is ``step`` between levels, ``transient`` where the drive comes back to the one level at which it stands most of
    the time, as in an earthquake, ``quasi-static`` of few slow ramps, else ``random``.
    """
    span, noise = float(np.ptp(values)), noise_level(values)
    if span <= STILL_NOISE * noise or span == 0.0 or len(values) < 3 * FEW_CHANGES:
        return None
    levels, share = _plateaus(values, noise)
    jumps = int(np.sum(np.abs(np.diff(levels)) > REVERSAL_SWING * span))
    if share >= STILL_SHARE and 0 < jumps <= FEW_CHANGES:
        return "step"
    if share >= STILL_SHARE:
        return "random" if jumps else "transient"
    points = turning_points(values, max(REVERSAL_SWING * span, STILL_NOISE * noise))
    if len(points) - 2 <= FEW_CHANGES or _straight(values, points):
        return "quasi-static"
    return "random"


def _plateaus(values: Array, noise: float) -> tuple[Array, float]:
    """Return the levels at which a record stands still, one for each stretch, and their share of the whole.

    Of 400 blocks those are still that are as they were a 40th of the record before: a ramp across the whole record
    moves by a 40th of its span in that time, which is more than a plateau may. Motion too passes where it was, but
    not for several blocks on end.
    """
    size = max(4, len(values) // WAVEFORM_BLOCKS)
    means = values[: len(values) // size * size].reshape(-1, size).mean(axis=1)
    lag = max(1, len(means) // 40)
    change = np.abs(means[lag:] - means[:-lag])
    still = change <= 0.01 * float(np.ptp(values)) + 4 * noise / np.sqrt(size)
    stretches = [(a, b) for a, b in runs(still) if b - a >= max(1, lag // 2)]
    levels = np.array([np.median(means[lag + a : lag + b]) for a, b in stretches])
    return levels, sum(b - a for a, b in stretches) / len(still)


def _straight(values: Array, points: Array | np.ndarray) -> bool:
    """Tell whether most branches between turning points are ramps."""
    departures = []
    for a, b in zip(points[:-1], points[1:], strict=True):
        ramp = values[a] + (values[b] - values[a]) * np.arange(b - a + 1) / (b - a)
        rms = np.sqrt(np.mean((values[a : b + 1] - ramp) ** 2))
        departures.append(rms / abs(values[b] - values[a]))
    return float(np.median(departures)) < STRAIGHT_RAMP
