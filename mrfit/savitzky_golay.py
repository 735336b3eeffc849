"""Local polynomials in windows as wide as the noise allows (Savitzky and Golay, Anal. Chem. 36 (1964) 1627)."""

from dataclasses import dataclass
from math import factorial, sqrt

import numpy as np

from mrfit.cycles import turning_points
from mrfit.noise import noise_level
from mrfit.specs import Array

POLYNOMIAL_ORDER = 3
NARROWEST, WIDEST = 7, 16_001
# Residual allowed above that of pure noise: a bias of a third of the noise.
WINDOW_EXCESS = 1.05
# Swings below this share of the range are wiggles; smoothing them away may change the signal by as much.
CALM_SHARE = 0.003
# Noise below this share of the signal cannot make reversals worth removing.
NEGLIGIBLE = 1e-9


@dataclass(frozen=True, slots=True)
class Smoothed:
    """A smoothed channel, its first two time derivatives (N,), and its narrowest and widest window (1: as recorded)."""

    values: Array
    first: Array
    second: Array
    window: int
    widest: int
    residual: float


def savitzky_golay(values: Array, dt: float, noise: float | None = None) -> Smoothed:
    """Return local cubic polynomials' values and derivatives, in the widest window whose residual is still noise.

    Weights fall to zero at the window's ends (Hann), since the side lobes of equal weights let through the wiggles that
    smoothing is to remove (Schmid, Rath and Diebold, ACS Meas. Sci. Au 2 (2022) 185).

    Parameters
    ----------
    values
        Channel (N,), N ≥ 7.
    dt
        Sample interval in s.
    noise
        Rms of the channel's noise, or None to estimate it from its high frequencies.
    """
    level = noise_level(values) if noise is None else noise
    window = _calm_window(values, _widest_window(values, level))
    width = max(window, NARROWEST)
    smoothed = _local_polynomial(values, width, 0) if window > 1 else values
    series = [smoothed, _local_polynomial(values, width, 1), _local_polynomial(values, width, 2)]
    widest = window
    if not _calm(smoothed, CALM_SHARE * float(np.ptp(values))) and level > NEGLIGIBLE * float(np.ptp(values)):
        series, widest = _widened(values, level, series, width)
    residual = float(np.sqrt(np.mean((values - series[0]) ** 2)))
    return Smoothed(series[0], series[1] / dt, series[2] / dt**2, window, widest, residual)


def _widened(values: Array, noise: float, series: list[Array], width: int) -> tuple[list[Array], int]:
    """Return value and derivatives per sample in windows that are wider wherever the signal allows it, and the widest.

    Edges, as in a binary sequence, keep their narrow window; plateaus between them get a wide one. A window may be used
    where its residual over it is noise; in between, the two estimates are mixed with weights that change slowly.
    """
    widest = width
    while (width := int(1.6 * width) // 2 * 2 + 1) < min(WIDEST, len(values) // 4):
        wide = _local_polynomial(values, width, 0)
        limit = (WINDOW_EXCESS + 2.0 / sqrt(width)) * noise * sqrt(_residual_share(width))
        fits = (_moving_mean((values - wide) ** 2, width) <= limit**2).astype(np.float64)
        weight = _moving_mean((_moving_mean(fits, width // 2) > 1.0 - 1e-9).astype(np.float64), width // 2)
        if not weight.any():
            break
        wides = [wide, _local_polynomial(values, width, 1), _local_polynomial(values, width, 2)]
        series = [weight * w + (1.0 - weight) * s for w, s in zip(wides, series, strict=True)]
        widest = width
    return series, widest


def _moving_mean(values: Array, width: int) -> Array:
    running = np.concatenate([[0.0], np.cumsum(values)])
    middles = np.arange(len(values)) - width // 2
    first, last = np.maximum(middles, 0), np.minimum(middles + width, len(values))
    means: Array = (running[last] - running[first]) / (last - first)
    return means


def _local_polynomial(values: Array, width: int, derivative: int) -> Array:
    """Return the ``derivative``-th derivative per sample of weighted cubics over ``width`` samples."""
    from scipy.signal import oaconvolve

    half = width // 2
    powers, weights = _window_basis(width)
    projector = np.linalg.solve((powers.T * weights) @ powers, powers.T * weights)
    scale = factorial(derivative) / (half + 1.0) ** derivative
    interior = oaconvolve(values, projector[derivative][::-1], mode="valid")
    # Within half a window of an end there is one polynomial, that of the first or last window.
    slopes = np.array([np.polynomial.polynomial.polyder(unit, derivative) for unit in np.eye(POLYNOMIAL_ORDER + 1)])
    slopes = slopes / factorial(derivative)
    at_edges = powers[:, : slopes.shape[1]] @ slopes.T
    first = at_edges @ np.linalg.lstsq(powers, values[:width], rcond=None)[0]
    last = at_edges @ np.linalg.lstsq(powers, values[-width:], rcond=None)[0]
    smoothed: Array = scale * np.concatenate([first[:half], interior, last[half + 1 :]])
    return smoothed


def _window_basis(width: int) -> tuple[Array, Array]:
    half = width // 2
    offsets = np.arange(-half, half + 1) / (half + 1.0)
    return np.vander(offsets, POLYNOMIAL_ORDER + 1, increasing=True), np.cos(np.pi / 2 * offsets) ** 2


def _calm_window(values: Array, window: int) -> int:
    """Return the narrowest window from ``window`` on that leaves few reversals but those of large swings.

    White noise sets the first window; noise that is not white leaves wiggles behind it. Widening stops where it would
    change the signal by more than a small share of its range.
    """
    smallest = CALM_SHARE * float(np.ptp(values))
    while not _calm(_local_polynomial(values, window, 0) if window > 1 else values, smallest):
        wider = max(NARROWEST, int(1.3 * window) // 2 * 2 + 1)
        residual = values - _local_polynomial(values, wider, 0) if wider < len(values) // 4 else np.full(1, np.inf)
        if np.sqrt(np.mean(residual**2)) > smallest:
            break
        window = wider
    return window


def _calm(values: Array, swing: float) -> bool:
    reversals = int(np.sum(np.diff(np.sign(np.diff(values))) != 0))
    return reversals <= 1.2 * len(turning_points(values, swing)) + 2


def _widest_window(values: Array, noise: float) -> int:
    """Return the widest odd window consistent with the noise, 1 if none is; bisects widths 15 % apart."""
    if noise <= NEGLIGIBLE * float(np.ptp(values)):
        return 1
    widest = max(min(WIDEST, (len(values) - 1) // 4), NARROWEST)
    grid = np.unique(np.round(np.geomspace(NARROWEST, widest, 56)).astype(int) // 2 * 2 + 1)
    if not _consistent(values, int(grid[0]), noise):
        return 1
    low, high = 0, len(grid)
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if _consistent(values, int(grid[middle]), noise) else (low, middle)
    return int(grid[low])


def _consistent(values: Array, width: int, noise: float) -> bool:
    """Tell whether what a window takes away has the rms that white noise alone would leave there."""
    residual = values - _local_polynomial(values, width, 0)
    excess = WINDOW_EXCESS + 2.0 / sqrt(len(values))  # the noise is known no better than that
    return float(np.sqrt(np.mean(residual**2))) <= excess * noise * sqrt(_residual_share(width))


def _residual_share(width: int) -> float:
    """Return the share of white noise's power that a window leaves in the residual."""
    powers, weights = _window_basis(width)
    centre = np.linalg.solve((powers.T * weights) @ powers, powers.T * weights)[0]
    return float(1.0 - 2.0 * centre[width // 2] + centre @ centre)
