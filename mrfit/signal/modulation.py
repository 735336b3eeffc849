"""Cycles that differ a little in amplitude or timing: told from noise of any colour, and followed.

y(t) = s(t)·(1 + g(t)) + h(t)·s'(t)/ω + b(t), with s a Fourier series and g, h, b cubic splines, slower than its cycles.
An instrument's noise knows nothing of the drive's phase: stationary noise of any colour, and hum, put as much power
into amplitude, g, as into timing, h, since their complex envelope is circular (Schreier and Scharf, Statistical Signal
Processing of Complex-Valued Data, 2010, section 2.5). That of a drive with an unsteady amplitude is not.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from mrfit.core.specs import Array
from mrfit.signal.harmonics import HarmonicFit, harmonic_fit

# Cycles over which the test takes weighted means (Hann), and the share of them within which means are alike
MODULATION_WINDOW, MODULATION_CORRELATION = 2.0, 0.5
# Cycles between knots; the series takes those of the least information criterion
KNOTS = (0.5, 1.0, 2.0, 4.0, 8.0)
DEGREE = 3
# Series and envelopes are fitted in turn
MODULATION_PASSES = 2
# Rms of a modulation, as a share of the series: below, the output moves by less than the least noise floor that counts
MODULATION_MIN = 3e-4
# … and above, cycles do not even nearly repeat
MODULATION_MAX = 0.1
# Means over so many parts of a cycle hold all there is to know of its amplitude and timing
MODULATION_PARTS = 64
LARGEST_STEP = 0.25


@dataclass(frozen=True, slots=True)
class ModulatedSeries:
    """A Fourier series whose amplitude, timing and mean move slowly.

    Attributes
    ----------
    derivatives
        It and its first two time derivatives (3, L + N), the lead-in first.
    depth
        Rms of amplitude and timing together, as a share of the series.
    residual
        Rms of signal minus series.
    """

    derivatives: Array
    depth: float
    residual: float


@dataclass(frozen=True, slots=True)
class _Parts:
    """Means over parts of a cycle (M,): cycles since the start, residual, s, s'/ω and 1 (3, M); and samples in each.

    ``scatter`` is the sum of squares about the means of the residual.
    """

    cycles: Array
    residual: Array
    carriers: Array
    counts: Array
    scatter: float


def modulation(values: Array, fit: HarmonicFit, dt: float) -> float:
    """Return the chance that noise gives envelopes like those of a signal, 1 where these are too small or too large.

    Their covariance is tested for circularity, by Mauchly's test in two dimensions: of n independent samples
    4·det/trace² is below q with probability q^((n − 1)/2). A constant envelope is none, and costs a sample.

    Parameters
    ----------
    values
        Signal (N,).
    fit
        Its Fourier series, with t = 0 at the first sample.
    dt
        Sample interval in s.
    """
    step = fit.frequency * dt
    if fit.harmonics < 1 or step > LARGEST_STEP or len(values) * step <= MODULATION_WINDOW:
        return 1.0
    parts = _parts(values, fit, dt)
    window = np.hanning(round(MODULATION_WINDOW * len(parts.cycles) / float(parts.cycles[-1])) + 2)[1:-1]
    if len(parts.cycles) <= len(window):
        return 1.0
    slow = [np.convolve(parts.residual * c, window, "valid") for c in parts.carriers[:2]]
    sizes = [np.convolve(c**2, window, "valid") for c in parts.carriers[:2]]
    covariance = np.cov(np.array(slow) / np.array(sizes), bias=True)
    trace, determinant = float(np.trace(covariance)), max(float(np.linalg.det(covariance)), 0.0)
    degrees = len(slow[0]) / (MODULATION_CORRELATION * len(window)) - 1.0
    if degrees <= 0.0 or not MODULATION_MIN**4 < trace**2 - 4.0 * determinant < MODULATION_MAX**4:
        return 1.0
    return float((4.0 * determinant / trace**2) ** (degrees / 2.0))


def modulated_series(values: Array, fit: HarmonicFit, dt: float, lead: int = 0) -> ModulatedSeries:
    """Return the modulated series of a signal (N,), see ``modulation``, and of L samples that lead in to it.

    There amplitude and timing are those of its first sample.
    """
    # an unsteady amplitude hides small harmonics, which come to light once it is taken away
    for _ in range(MODULATION_PASSES):
        steady = values - _moved(_spline(values, fit, dt), fit, dt, (0, len(values)))[0]
        fit = replace(harmonic_fit(steady, dt, fit.frequency, refine=False), frequency=fit.frequency)
    spline = _spline(values, fit, dt)
    time = np.arange(-lead, len(values), dtype=np.float64) * dt
    moved = _moved(spline, fit, dt, (lead, len(values)))
    derivatives = np.stack([fit.evaluate(time, k) for k in range(3)]) + moved
    depth = float(np.sqrt(np.mean(np.sum(spline(time[lead:] * fit.frequency)[:, :2] ** 2, axis=1))))
    residual = float(np.sqrt(np.mean((values - derivatives[0, lead:]) ** 2)))
    return ModulatedSeries(derivatives, depth, residual)


def _spline(values: Array, fit: HarmonicFit, dt: float) -> Any:
    """Return g, h and b as a spline over cycles, its knots those of the least information criterion."""
    parts, samples = _parts(values, fit, dt), len(values)
    last, tried = float(parts.cycles[-1]), []
    for spacing in (k for k in KNOTS if k == KNOTS[0] or k < last):
        spline, explained = _envelopes(parts, np.linspace(0.0, last, max(round(last / spacing), 1) + 1))
        left = parts.residual - np.sum(parts.carriers * explained, axis=0)
        power = (float(parts.counts @ left**2) + parts.scatter) / samples
        tried.append((samples * np.log(max(power, 1e-300)) + spline.c.size * np.log(samples), spline))
    return min(tried, key=lambda t: t[0])[1]


def _moved(spline: Any, fit: HarmonicFit, dt: float, samples: tuple[int, int]) -> Array:
    """Return s·g + h·s'/ω + b and two time derivatives (3, L + N), L samples before the first knot and N from it on."""
    lead, count = samples
    time = np.arange(-lead, count, dtype=np.float64) * dt
    within = np.clip(time * fit.frequency, 0.0, float(spline.t[-1]))
    slow = [spline(within, nu=k).T * fit.frequency**k for k in range(3)]
    for rate in slow[1:]:
        rate[:, :lead] = 0.0
    fast = [_carriers(fit, time, k) for k in range(3)]
    parts = (
        slow[0] * fast[0],
        slow[1] * fast[0] + slow[0] * fast[1],
        slow[2] * fast[0] + 2.0 * slow[1] * fast[1] + slow[0] * fast[2],
    )
    return np.stack([part.sum(axis=0) for part in parts])


def _carriers(fit: HarmonicFit, time: Array, derivative: int) -> Array:
    """Return s, s'/ω and a constant of its size, or time derivatives of them, (3, N); ω makes s'/ω as large as s."""
    power, order = np.abs(fit.coefficients[1:]) ** 2, np.arange(1, fit.harmonics + 1)
    size = float(np.sqrt(np.sum(power) / 2.0))
    omega = 2.0 * np.pi * fit.frequency * float(np.sqrt(np.sum(order**2 * power) / np.sum(power)))
    still = derivative == 0
    mean = float(fit.coefficients[0].real) if still else 0.0
    rows = [fit.evaluate(time, derivative) - mean, fit.evaluate(time, derivative + 1) / omega]
    return np.stack([*rows, np.full(len(time), size if still else 0.0)])


def _parts(values: Array, fit: HarmonicFit, dt: float) -> _Parts:
    time = np.arange(len(values), dtype=np.float64) * dt
    residual = values - fit.evaluate(time)
    starts = np.flatnonzero(np.diff(np.floor(time * fit.frequency * MODULATION_PARTS + 1e-6), prepend=-1.0))
    counts = np.diff(starts, append=len(values)).astype(np.float64)
    rows = np.vstack([time * fit.frequency, residual, _carriers(fit, time, 0)])
    means = np.add.reduceat(rows, starts, axis=1) / counts
    scatter = float(residual @ residual - counts @ means[1] ** 2)
    return _Parts(means[0], means[1], means[2:], counts, max(scatter, 0.0))


def _envelopes(parts: _Parts, grid: Array) -> tuple[Any, Array]:
    """Return g, h, b of least squares as a spline over cycles with knots on a grid, and their values (3, M)."""
    from scipy.interpolate import BSpline
    from scipy.sparse import diags_array, eye_array, hstack
    from scipy.sparse.linalg import spsolve

    knots = np.concatenate([np.full(DEGREE, grid[0]), grid, np.full(DEGREE, grid[-1])])
    basis, weight = BSpline.design_matrix(parts.cycles, knots, DEGREE), np.sqrt(parts.counts)
    design = hstack([diags_array(weight * c) @ basis for c in parts.carriers], format="csc")
    gram = (design.T @ design).tocsc()
    ridge = 1e-10 * float(gram.diagonal().mean()) * eye_array(gram.shape[0], format="csc")
    solved = spsolve(gram + ridge, design.T @ (weight * parts.residual))
    spline = BSpline(knots, solved.reshape(3, -1).T, DEGREE)
    return spline, np.ascontiguousarray(spline(parts.cycles).T)
