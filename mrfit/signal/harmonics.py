"""Least-squares Fourier series of a uniformly sampled signal whose fundamental is not known exactly."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrfit.core.remembered import remembered
from mrfit.core.specs import Array
from mrfit.io.columns import chunks, is_on_disk

Spectrum = NDArray[np.complex128]

MOST_HARMONICS = 40
# A guess may be this far off, relatively; zero crossings do much better.
GUESS_ERROR = 0.05
# Residual below which float64 sums cannot tell one more harmonic from rounding, relative to the signal's rms.
SERIES_ROUNDING = 1e-8
FREQUENCY_ITERATIONS = 12
# Steps of the frequency, in rad over the record, at which it is found, and near enough for more harmonics to go on.
SETTLED, BEGUN = 1e-10, 1e-3


@dataclass(frozen=True, slots=True)
class HarmonicFit:
    """Fourier series y(t) = Re Σ_k c_k exp(2πi·k·f·t), with t in s from the first sample fitted.

    Attributes
    ----------
    frequency
        Fundamental f in Hz.
    coefficients
        c_0 … c_K, complex, in the signal's unit; c_0 is the mean.
    residual
        Rms of signal minus series.
    """

    frequency: float
    coefficients: Spectrum
    residual: float

    @property
    def harmonics(self) -> int:
        """Number K of harmonics above the mean."""
        return len(self.coefficients) - 1

    @property
    def amplitude(self) -> float:
        """Half the peak-to-peak value of the series."""
        return float(np.ptp(self.evaluate(np.arange(512, dtype=np.float64) / (512 * self.frequency)))) / 2

    def evaluate(self, t: Array, derivative: int = 0) -> Array:
        """Return the series or one of its time derivatives at any times (N,) in s; shape (N,)."""
        factors = self.derivative(derivative).coefficients
        turn = np.exp(2j * np.pi * self.frequency * t)
        total = np.full(t.shape, factors[-1])
        for factor in factors[-2::-1]:
            total = total * turn + factor
        return np.ascontiguousarray(total.real)

    def sampled(self, start: float, dt: float, samples: int) -> Array:
        """Return the series at so many times (N,), ``dt`` apart from ``start`` on, in s; ``evaluate`` is slower."""
        return synthesis(self.shifted(start).coefficients, 2 * np.pi * self.frequency * dt, samples)

    def derivative(self, order: int) -> "HarmonicFit":
        """Return the series of a time derivative of this order."""
        rates = 2j * np.pi * np.arange(len(self.coefficients)) * self.frequency
        return replace(self, coefficients=self.coefficients * rates**order)

    def shifted(self, seconds: float) -> "HarmonicFit":
        """Return the same series with its time counted from ``seconds`` after the present origin."""
        turns = np.exp(2j * np.pi * np.arange(len(self.coefficients)) * self.frequency * seconds)
        return replace(self, coefficients=self.coefficients * turns)


@remembered
def harmonic_fit(values: Array, dt: float, frequency_guess: float, refine: bool = True) -> HarmonicFit:
    """Return the least-squares Fourier series of a signal, with as many harmonics as the data tell from noise.

    The fundamental is refined by Gauss–Newton on all kept harmonics jointly (variable projection); their number K
    minimises the Bayesian information criterion N·ln(RSS) + 2K·ln N, K ≤ 40 and below 0.9 of the Nyquist frequency.
    Cost O(N·K), memory O(N): the normal equations of a uniform grid are sums of geometric series.

    Parameters
    ----------
    values
        Signal (N,), at least one cycle of it.
    dt
        Sample interval in s.
    frequency_guess
        Fundamental in Hz, within 5 %.
    refine
        Whether to refine the fundamental, or take it as given.
    """
    mean = float(np.mean(values))
    signal = values - mean
    omega = 2 * np.pi * frequency_guess * dt
    most = _most_harmonics(len(values), omega)
    if refine:
        omega = _coarse(signal, omega)
        omega = _refine(signal, omega, 1, BEGUN)
        omega = _refine(signal, omega, min(3, most))
    coefficients = _select(signal, omega, most)
    if refine and len(coefficients) > 4:
        omega = _refine(signal, omega, len(coefficients) - 1)
        coefficients = _select(signal, omega, most)
    residual = signal - synthesis(coefficients, omega, len(values))
    coefficients[0] += mean
    coefficients.flags.writeable = False
    return HarmonicFit(omega / (2 * np.pi * dt), coefficients, float(np.sqrt(np.mean(residual**2))))


def _most_harmonics(samples: int, omega: float) -> int:
    return max(1, min(MOST_HARMONICS, int(0.9 * np.pi / omega), (samples - 1) // 4))


def _rotations(omegas: Array, steps: Array) -> Spectrum:
    rotations: Spectrum = np.exp(1j * np.outer(steps, omegas))
    return rotations


def transform(values: Array, omegas: Array) -> Spectrum:
    """Return Σ_n x_n·exp(−i·ω·n) for angular frequencies ``omegas`` (K,) in rad per sample."""
    block = int(np.sqrt(len(values))) + 1
    rows = -(-len(values) // block)
    padded = np.zeros(rows * block)
    padded[: len(values)] = values
    inner = _rotations(-omegas, np.arange(block, dtype=np.float64))
    sums = padded.reshape(rows, block) @ np.hstack([inner.real, inner.imag])
    outer = _rotations(-omegas, np.arange(rows, dtype=np.float64) * block)
    count = len(omegas)
    total: Spectrum = np.sum((sums[:, :count] + 1j * sums[:, count:]) * outer, axis=0)
    return total


def synthesis(coefficients: Spectrum, omega: float, samples: int) -> Array:
    """Return Re Σ_k c_k·exp(i·k·ω·n) for n = 0 … samples − 1."""
    omegas = omega * np.arange(len(coefficients), dtype=np.float64)
    block = int(np.sqrt(samples)) + 1
    inner = _rotations(omegas, np.arange(block, dtype=np.float64)).T
    outer = _rotations(omegas, np.arange(-(-samples // block), dtype=np.float64) * block) * coefficients
    rows = outer.real @ inner.real - outer.imag @ inner.imag
    return rows.reshape(-1)[:samples]


def _coarse(signal: Array, omega: float) -> float:
    """Return the strongest line near a guess, on a grid fine enough for Gauss–Newton to converge from."""
    step = np.pi / (2 * len(signal))
    reach = min(GUESS_ERROR * omega, 250 * step)
    grid = omega + np.arange(-int(reach / step), int(reach / step) + 1, dtype=np.float64) * step
    return float(grid[np.argmax(np.abs(transform(signal, grid)))])


def _gram(samples: int, omega: float, harmonics: int) -> Array:
    """Return the normal matrix of 1, cos ωn, sin ωn, cos 2ωn, …: geometric series, no sum over samples."""
    phases = omega * np.arange(1, 2 * harmonics + 1)
    sums = np.concatenate([[samples + 0j], (1 - np.exp(1j * phases * samples)) / (1 - np.exp(1j * phases))])
    order = np.arange(harmonics + 1)
    difference = order[:, None] - order[None, :]
    minus = np.where(difference >= 0, sums[np.abs(difference)], np.conj(sums[np.abs(difference)]))
    plus = sums[order[:, None] + order[None, :]]
    gram = np.empty((2 * harmonics + 2, 2 * harmonics + 2))
    gram[0::2, 0::2] = (plus + minus).real / 2
    gram[1::2, 1::2] = (minus - plus).real / 2
    gram[1::2, 0::2] = (plus + minus).imag / 2
    gram[0::2, 1::2] = gram[1::2, 0::2].T
    keep = np.arange(2 * harmonics + 2) != 1
    return gram[np.ix_(keep, keep)]


def _moments(signal: Array, omega: float, harmonics: int) -> Array:
    """Return the signal's inner products with 1, cos ωn, sin ωn, cos 2ωn and so on."""
    return _as_moments(transform(signal, omega * np.arange(harmonics + 1, dtype=np.float64)))


def _as_moments(sums: Spectrum) -> Array:
    moments = np.stack([sums.real, -sums.imag], axis=1).reshape(-1)
    return np.delete(moments, 1)


def _complex(real: Array) -> Spectrum:
    pairs = np.insert(real, 1, 0.0).reshape(-1, 2)
    return pairs[:, 0] - 1j * pairs[:, 1]


def _solve(gram: Array, moments: Array) -> Array:
    solution: Any = np.linalg.lstsq(gram, moments, rcond=1e-13)[0]
    return np.asarray(solution)


def _refine(signal: Array, omega: float, harmonics: int, settled: float = SETTLED) -> float:
    """Return the frequency at which the residual is orthogonal to the series' derivative by it."""
    samples = len(signal)
    centred = np.arange(samples) - (samples - 1) / 2
    limit = np.pi / samples
    for _ in range(FREQUENCY_ITERATIONS):
        gram = _gram(samples, omega, harmonics)
        coefficients = _complex(_solve(gram, _moments(signal, omega, harmonics)))
        residual = signal - synthesis(coefficients, omega, samples)
        slope = centred * synthesis(1j * np.arange(harmonics + 1) * coefficients, omega, samples)
        inner = _moments(slope, omega, harmonics)
        free = float(slope @ slope - inner @ _solve(gram, inner))
        if not free > 0.0:
            break
        step = float(np.clip(slope @ residual / free, -limit, limit))
        if not 0.0 < omega + step < np.pi:
            break
        omega += step
        if abs(step) * samples < settled:
            break
    return omega


def _select(signal: Array, omega: float, most: int) -> Spectrum:
    """Return the coefficients of the series whose length minimises the Bayesian information criterion."""
    samples, power = len(signal), float(signal @ signal)
    if power <= 0.0:
        return np.zeros(1, dtype=complex)
    return _chosen(samples, power, omega, _moments(signal, omega, most))


def _chosen(samples: int, power: float, omega: float, moments: Array) -> Spectrum:
    """Return the same from the sum of squares and the inner products of the longest series."""
    most = len(moments) // 2
    gram = _gram(samples, omega, most)
    # Columns are nested, so one triangular factor gives the residual of every shorter series.
    factor = np.linalg.cholesky(gram + np.eye(len(gram)) * 1e-12 * samples)
    explained = np.cumsum(np.linalg.solve(factor, moments) ** 2)[0::2]
    left = np.maximum(power - explained, power * SERIES_ROUNDING**2 + 1e-300)
    criterion = samples * np.log(left) + 2 * np.arange(most + 1) * np.log(samples)
    kept = int(np.argmin(criterion))
    size = 2 * kept + 1
    return _complex(_solve(gram[:size, :size], moments[:size]))


def series_at(values: Array, dt: float, frequency: float) -> HarmonicFit:
    """Return the series of a signal (N,) at a fundamental that is known, as ``harmonic_fit``; it may stay on disk."""
    if not is_on_disk(values):
        return harmonic_fit(values, dt, frequency, refine=False)
    samples, omega = len(values), 2 * np.pi * frequency * dt
    most = _most_harmonics(samples, omega)
    order = np.arange(most + 1, dtype=np.float64)
    mean = sum(float(np.sum(part)) for part in chunks(values)) / samples
    sums, power, begin = np.zeros(most + 1, dtype=complex), 0.0, 0
    for part in chunks(values):
        centred = part - mean
        sums += np.exp(-1j * omega * order * begin) * transform(centred, omega * order)
        power, begin = power + float(centred @ centred), begin + len(part)
    if power <= 0.0:
        return HarmonicFit(frequency, np.array([mean + 0j]), 0.0)
    coefficients = _chosen(samples, power, omega, _as_moments(sums))
    left, begin = 0.0, 0
    for part in chunks(values):
        turned = coefficients * np.exp(1j * omega * np.arange(len(coefficients)) * begin)
        rest = part - mean - synthesis(turned, omega, len(part))
        left, begin = left + float(rest @ rest), begin + len(part)
    coefficients[0] += mean
    return HarmonicFit(frequency, coefficients, float(np.sqrt(left / samples)))
