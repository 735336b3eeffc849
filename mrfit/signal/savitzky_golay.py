"""Local polynomials in windows as wide as the noise allows (Savitzky and Golay, Anal. Chem. 36 (1964) 1627).

Windows end at corners (``corners``). Between corners their width varies: a window is as wide as it can be without
differing from a narrower one by more than noise (Lepski, Theory Probab. Appl. 35 (1991) 454).
"""

from dataclasses import dataclass
from functools import cached_property
from math import factorial

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.kernels.windows import moving_mean
from mrfit.signal.convolution import correlated
from mrfit.signal.corners import SIDE, find_corners
from mrfit.signal.cycles import without_small_swings
from mrfit.signal.noise import white_part
from mrfit.signal.polynomial_pieces import PIECE_ORDER_MAX, lowest_polynomials
from mrfit.signal.sampling_jitter import noise_power

POLYNOMIAL_ORDER = 3
WINDOW_MIN, WINDOW_MAX = 7, 16_001
# The narrowest window interpolates; each of the others is so many times wider than the one before.
INTERPOLATING = 5
GROWTH = 1.5
# A window is too wide where it differs from one half as wide by more than noise does anywhere in so many records.
RECORDS = 1_000
# Noise takes at most this share of a signal's range; below the other it cannot make reversals worth removing.
CALM_SHARE, NEGLIGIBLE_NOISE = 0.003, 1e-9
# Power of noise grows by less than this from one window to the next, as that of a random walk does (1.5²) …
SLOWLY = 3.4
# … in the quietest quarter of at most so many blocks of so many samples
USUAL, BLOCKS, SMOOTH_BLOCK = 0.25, 16, 8_192
# Swings of the smoothed channel below so many standard errors are noise
SWING = 4.0
# Longest kernel that is applied sample by sample
DIRECT = 64


@dataclass(frozen=True, slots=True)
class SmoothRanges:
    """The ranges between corners; window ends and averages stay within them."""

    starts: Index
    stops: Index

    @classmethod
    def between(cls, corners: Index, samples: int) -> "SmoothRanges":
        """Return the pieces between the first samples after corners."""
        return cls(np.concatenate([[0], corners]), np.concatenate([corners, [samples]]))

    @property
    def lengths(self) -> Index:
        """Samples in each piece."""
        return self.stops - self.starts

    def spread(self, of_each: Array | Mask | Index) -> np.ndarray:
        """Return for every sample the entry of its piece."""
        return np.repeat(of_each, self.lengths)

    def moving_mean(self, values: Array, half: int) -> Array:
        """Return means over ``half`` samples to either side, as far as the piece goes."""
        return moving_mean(values, self.starts, self.stops, half)


@dataclass(frozen=True)
class _Window:
    """Weighted polynomials of one order over so many samples."""

    width: int
    order: int

    @property
    def half(self) -> int:
        return self.width // 2

    @cached_property
    def _powers(self) -> Array:
        offsets = np.arange(-self.half, self.half + 1) / (self.half + 1.0)
        return np.vander(offsets, self.order + 1, increasing=True)

    def kernel(self, derivative: int) -> Array:
        """Return what gives the derivative per sample at the middle of a window, (width,)."""
        weights = np.cos(np.pi / 2 * np.arange(-self.half, self.half + 1) / (self.half + 1.0)) ** 2
        weighted = self._powers.T * weights
        row = np.linalg.solve(weighted @ self._powers, weighted)[derivative]
        kernel: Array = row * factorial(derivative) / (self.half + 1.0) ** derivative
        return kernel

    def ends(self, derivative: int) -> tuple[Array, Array]:
        """Return an orthonormal basis (width, order + 1) and its derivatives at the first half of the samples.

        Within half a window of an end there is one polynomial, that of the first or last window, of equal weights.
        """
        basis, triangle = np.linalg.qr(self._powers)
        units = np.eye(self.order + 1)
        slopes = np.array([np.polynomial.polynomial.polyder(unit, derivative) for unit in units])
        at = self._powers[: self.half, : slopes.shape[1]] @ slopes.T / (self.half + 1.0) ** derivative
        return basis, np.linalg.solve(triangle.T, at.T).T

    def applied(self, values: Array, pieces: SmoothRanges, derivative: int) -> tuple[Array, Array]:
        """Return estimates and their variance in shares of the noise's, (N,), right where pieces are long enough."""
        kernel = self.kernel(derivative)
        estimate, variance = np.zeros(len(values)), np.full(len(values), float(kernel @ kernel))
        if len(values) >= self.width:
            estimate[self.half : len(values) - self.half] = _correlated(values, kernel)
        basis, slopes = self.ends(derivative)
        spread = np.einsum("ij,ij->i", slopes, slopes)
        long = pieces.lengths >= self.width
        window, inner = np.arange(self.width), np.arange(self.half)
        for edges, sign in ((pieces.starts[long], 1), (pieces.stops[long] - 1, -1)):
            fitted = values[edges[:, None] + sign * window] @ basis
            estimate[edges[:, None] + sign * inner] = (fitted @ slopes.T) * float(sign) ** derivative
            variance[edges[:, None] + sign * inner] = spread
        return estimate, variance


def _correlated(values: Array, kernel: Array) -> Array:
    return np.convolve(values, kernel[::-1], mode="valid") if len(kernel) <= DIRECT else correlated(values, kernel)


def _windows(longest: int, derivative: int) -> list[_Window]:
    widths, width = [], WINDOW_MIN
    while width <= min(WINDOW_MAX, longest):
        widths.append(width)
        width = int(GROWTH * width) // 2 * 2 + 1
    first = _Window(INTERPOLATING, INTERPOLATING - 1) if derivative else _Window(1, 0)
    return [first, *(_Window(w, POLYNOMIAL_ORDER) for w in widths)]


@dataclass(slots=True)
class Mixture:
    """Estimates of windows of several widths, their variance (N,), and the narrowest and widest window used."""

    values: Array
    variance: Array
    window: int
    widest: int


class Smoother:
    """One channel's local cubic polynomials, in the widest windows that its noise allows.

    Weights fall to zero at a window's ends (Hann), since the side lobes of equal weights let through the wiggles that
    smoothing is to remove (Schmid, Rath and Diebold, ACS Meas. Sci. Au 2 (2022) 185).

    Parameters
    ----------
    values
        Channel (N,), N ≥ 7.
    noise
        Rms of its white noise, or None to estimate noise of any colour from the channel itself.
    moves
        Whether it is a motion, whose noise is larger where it is fast if the samples' instants scatter.

    Attributes
    ----------
    corners
        Number of corners that no window crosses.
    """

    def __init__(self, values: Array, noise: float | None = None, moves: bool = False) -> None:
        self.values, self.noise = values, noise
        self.level = white_part(values) if noise is None else noise
        self.offset, self.span = float(values.mean()), float(np.ptp(values))
        jittered = noise_power(values) if moves and self.level else None
        self.excess = None if jittered is None else jittered / self.level**2
        # one level for all: that of the fastest samples
        level = self.level if self.excess is None else self.level * float(np.sqrt(np.max(self.excess)))
        self.pieces = SmoothRanges.between(find_corners(values, level), len(values))
        self.corners = len(self.pieces.starts) - 1

    @cached_property
    def power(self) -> Array:
        """The noise's power as each of the windows sees it, (W,)."""
        white = np.full(len(_windows(len(self.values), 0)), self.level**2)
        return white if self.noise is not None else _coloured(self.values - self.offset, self.pieces.starts, white)

    def near_corners(self) -> Mask:
        """Return which samples (N,) lie near a corner."""
        near = np.zeros(len(self.values), dtype=bool)
        for offset in range(-SIDE, SIDE):
            near[self.pieces.starts[1:] + offset] = True
        return near

    def smoothed(self, derivative: int) -> Mixture:
        """Return the channel (order 0) or a derivative of order 1 or 2 per sample."""
        return self._smoothed(derivative) if derivative else self._undifferentiated

    def _smoothed(self, derivative: int) -> Mixture:
        noisy = bool(self.power.max() > (NEGLIGIBLE_NOISE * self.span) ** 2)
        if not noisy and not derivative:
            return Mixture(self.values, np.zeros(len(self.values)), 1, 1)
        found, whole = self._polynomials(derivative, noisy)
        rest = ~self.pieces.spread(whole)
        if rest.any():
            lengths = self.pieces.lengths[~whole]
            pieces = SmoothRanges(np.cumsum(lengths) - lengths, np.cumsum(lengths))
            windows = _windows(int(lengths.max()), derivative)[: None if noisy else 1]
            excess = None if self.excess is None else self.excess[rest]
            local = _Ladder((self.values - self.offset)[rest], pieces, derivative, self.power, excess).climbed(windows)
            found.values[rest], found.variance[rest] = local.values, local.variance
            found.window, found.widest = min(found.window, local.window), max(found.widest, local.widest)
        if noisy and not derivative:
            swing = SWING * float(np.sqrt(np.median(found.variance)))
            found.values = without_small_swings(found.values, swing) + self.offset
        return found

    def _polynomials(self, derivative: int, noisy: bool) -> tuple[Mixture, Mask]:
        """Return the pieces that are one polynomial each, and which of the pieces (P,) are."""
        pieces, samples = self.pieces, len(self.values)
        whole = np.zeros(len(pieces.starts), dtype=bool)
        if not noisy or not self.corners:
            return Mixture(np.empty(samples), np.empty(samples), samples, 1), whole
        power, centred = float(self.power[-1]), self.values - self.offset
        values, whole = lowest_polynomials(centred, pieces.starts, pieces.stops, np.sqrt(power), derivative)
        lengths = pieces.lengths[whole] if whole.any() else np.array([samples])
        variance = pieces.spread(power * (PIECE_ORDER_MAX + 1) / pieces.lengths)
        return Mixture(values, variance, int(lengths.min()), int(lengths.max()) if whole.any() else 1), whole

    @cached_property
    def residual(self) -> float:
        """Rms of the recorded less the smoothed channel."""
        return float(np.sqrt(np.mean((self.values - self._undifferentiated.values) ** 2)))

    @cached_property
    def _undifferentiated(self) -> Mixture:
        return self._smoothed(0)


def _coloured(values: Array, starts: Index, power: Array) -> Array:
    """Return the noise's power as each of the windows (W,) sees it, at least that of white noise.

    The power of the difference between one window and another half as wide is the signal's spectrum about one
    frequency. A signal's falls steeply; noise's does not. So the widest window at which the power grows slowly, and
    that takes away little, sees nothing but noise, and so do all that are narrower.
    """
    blocks = np.unique(np.linspace(0, max(len(values) - SMOOTH_BLOCK, 0), BLOCKS).astype(np.int64))
    chosen = np.zeros(len(values), dtype=bool)
    for block in blocks:
        chosen[block : block + SMOOTH_BLOCK] = True
    kept = np.flatnonzero(chosen)
    breaks = np.flatnonzero(np.diff(kept, prepend=-2) > 1)
    inside = np.searchsorted(kept, starts[chosen[starts]])
    pieces = SmoothRanges.between(np.unique(np.concatenate([breaks, inside]))[1:], len(kept))
    sample, span = values[kept], float(np.ptp(values))
    seen, last, noisy = power.copy(), 0, False
    windows = _windows(int(pieces.lengths.max()) // 4, 0)
    before = narrow = windows[0].applied(sample, pieces, 0)
    for number, window in enumerate(windows[1:], start=1):
        long = pieces.spread(pieces.lengths >= window.width)
        wide = window.applied(sample, pieces, 0)
        if not long.any() or np.sqrt(np.mean((sample - wide[0])[long] ** 2)) > CALM_SHARE * span:
            break
        found, freedom = _difference(
            pieces, WindowEstimate(window, *wide), WindowEstimate(windows[max(number - 2, 0)], *before), 0
        )
        usual = float(np.quantile(found[long], USUAL)) / _most_by_chance(freedom, 1.0 - USUAL)
        seen[number] = max(usual, power[number])
        slow = number > 1 and seen[number] <= SLOWLY * seen[number - 1]
        last = number if slow and noisy else last
        noisy = slow
        before, narrow = narrow, wide
    seen[last + 1 :] = seen[last]
    return np.maximum(seen, power) if last else power


@dataclass(frozen=True)
class WindowEstimate:
    """Estimates (N,) by a window, and their variances in white noise of power 1."""

    window: _Window
    values: Array
    variances: Array


def _difference(
    pieces: SmoothRanges,
    wide: WindowEstimate,
    narrow: WindowEstimate,
    derivative: int,
) -> tuple[Array, float]:
    """Return the mean squared difference (N,) of two windows' estimates about each sample, and its degrees of freedom.

    It is in shares of what white noise of power 1 makes of it.
    """
    inner, margin = wide.window.kernel(derivative), wide.window.half - narrow.window.half
    difference = inner.copy()
    difference[margin : wide.window.width - margin] -= narrow.window.kernel(derivative)
    apart = float(difference @ difference)
    # The one polynomial at an end is fitted with equal weights: what it shares with any other is its own variance.
    inside = np.abs(wide.variances - float(inner @ inner)) <= 1e-12 * wide.variances
    expected = np.where(inside, apart, np.maximum(narrow.variances - wide.variances, apart))
    found = pieces.moving_mean((wide.values - narrow.values) ** 2 / expected, wide.window.half)
    return found, _freedom(difference / np.sqrt(apart), 2 * wide.window.half + 1)


class _Ladder:
    """Windows from narrow to wide, each used where those up to the next wider one agree.

    ``excess`` (N,) is the noise's power at each sample over ``power``, None where it is the same everywhere.
    """

    def __init__(
        self, values: Array, pieces: SmoothRanges, derivative: int, power: Array, excess: Array | None = None
    ) -> None:
        self.values, self.pieces, self.derivative, self.power = values, pieces, derivative, power
        self.excess = excess

    def climbed(self, windows: list[_Window]) -> Mixture:
        """Return the mixture of all windows."""
        before = last = windows[0].applied(self.values, self.pieces, self.derivative)
        agree = np.ones(len(self.values), dtype=bool)
        mixture = Mixture(last[0], last[1] * self.power[0], windows[0].width, windows[0].width)
        for number, window in enumerate(windows[1:], start=1):
            long = self.pieces.spread(self.pieces.lengths >= window.width)
            # A piece that ends here is smoothed by its widest window.
            self._mix(mixture, last, number - 1, windows[number - 1], agree & ~long)
            agree &= long
            if not agree.any():
                return mixture
            wide = window.applied(self.values, self.pieces, self.derivative)
            narrower = windows[max(number - 2, 0)]
            found, freedom = _difference(
                self.pieces, WindowEstimate(window, *wide), WindowEstimate(narrower, *before), self.derivative
            )
            if self.excess is not None:
                found = found / self.pieces.moving_mean(self.excess, window.half)
            chance = window.width / (RECORDS * len(self.values))
            agree &= found <= _most_by_chance(freedom, chance) * self.power[min(number, len(self.power) - 1)]
            self._mix(mixture, last, number - 1, windows[number - 1], agree)
            before, last = last, wide
        self._mix(mixture, last, len(windows) - 1, windows[-1], agree)
        if self.excess is not None:
            mixture.variance = mixture.variance * self.excess
        return mixture

    def _mix(self, mixture: Mixture, new: tuple[Array, Array], number: int, window: _Window, where: Mask) -> None:
        """Mix in a window's estimates where all about agrees, by weights that change slowly."""
        if number == 0 or not where.any():
            return
        mixture.widest = window.width
        variance = new[1] * self.power[number]
        if where.all():
            mixture.window, mixture.values, mixture.variance = window.width, new[0], variance
            return
        half = window.half // 2
        clear = self.pieces.moving_mean(where.astype(np.float64), half) > 1.0 - 1e-9
        weight = self.pieces.moving_mean(clear.astype(np.float64), half)
        mixture.values = mixture.values + weight * (new[0] - mixture.values)
        mixture.variance = mixture.variance + weight * (variance - mixture.variance)


def _freedom(kernel: Array, samples: int) -> float:
    """Return the degrees of freedom of the mean over so many samples of white noise filtered by a kernel, squared."""
    spectrum = np.abs(np.fft.rfft(kernel, 2 * len(kernel))) ** 2
    correlation = np.fft.irfft(spectrum)
    return max(samples / float(correlation @ correlation), 1.0)


def _most_by_chance(freedom: float, chance: float) -> float:
    """Return the value that a mean square over so many degrees of freedom exceeds by chance (Wilson and Hilferty)."""
    from scipy.special import ndtri

    spread = 2.0 / (9.0 * freedom)
    return float((1.0 - spread - ndtri(chance) * np.sqrt(spread)) ** 3)
