"""Levels at which a signal is held between its changes, as the current of most tests is.

Beside an edge a smoother has few samples that belong together, and leaves their noise or adds an overshoot. A memory of
extreme values, as a play is, would keep either. A held signal has one value, known by the mean over the whole hold.
"""

import numpy as np

from mrfit.core.specs import Array
from mrfit.signal.runs import runs

# Shortest hold in samples, over which noise is told from movement
PLATEAU_SAMPLES_MIN = 32
# Residual of a hold over the noise, less what chance allows …
EXCESS = 1.05
# … and standard errors by which a line or a parabola through it may differ from its mean
MOVED = 4.0


def at_levels(values: Array, smoothed: Array, noise: float) -> Array:
    """Return a smoothed signal (N,) with its mean as recorded wherever it was held.

    Parameters
    ----------
    values, smoothed
        The signal as recorded and smoothed, (N,).
    noise
        Rms of its noise, in its unit.
    """
    if len(values) < PLATEAU_SAMPLES_MIN or noise <= 0.0:
        return smoothed
    found = smoothed.copy()
    for first, last in _still(values, noise):
        hold = values[first:last]
        if _is_level(hold, noise):
            found[first:last] = hold.mean()
    return found


def _still(values: Array, noise: float) -> list[tuple[int, int]]:
    """Return the ranges that are covered by windows in which the signal does not leave its noise."""
    centred = values - values.mean()
    sums, squares = (np.concatenate([[0.0], np.cumsum(c)]) for c in (centred, centred**2))
    mean = (sums[PLATEAU_SAMPLES_MIN:] - sums[:-PLATEAU_SAMPLES_MIN]) / PLATEAU_SAMPLES_MIN
    power = (squares[PLATEAU_SAMPLES_MIN:] - squares[:-PLATEAU_SAMPLES_MIN]) / PLATEAU_SAMPLES_MIN - mean**2
    still = power <= ((EXCESS + 2.0 / np.sqrt(PLATEAU_SAMPLES_MIN)) * noise) ** 2
    return [(int(a), int(b) + PLATEAU_SAMPLES_MIN - 1) for a, b in runs(still)]


def _is_level(hold: Array, noise: float) -> bool:
    """Return whether a hold's residual is noise, without a trend or a bend."""
    at = np.linspace(-1.0, 1.0, len(hold))
    shapes = (np.sqrt(3.0) * at, np.sqrt(5.0) * (1.5 * at**2 - 0.5))
    moves = [abs(float(shape @ (hold - hold.mean()))) for shape in shapes]
    limit = (EXCESS + 2.0 / np.sqrt(len(hold))) * noise
    return bool(max(moves) <= MOVED * noise * np.sqrt(len(hold)) and np.std(hold) <= limit)
