"""How far a simulated output is from the measured one, by every measure the field prints, each with its source.

All are computed over the samples compared (warm-up left out). A measure whose denominator is zero, or whose energy the
channels do not give, is nan rather than a number that means nothing. Fractions stay fractions; ``esr`` and
``fit_percent`` are in percent, as their sources print them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.errors import DataError


@dataclass(frozen=True, slots=True)
class Metric:
    """What one error measure is.

    Attributes
    ----------
    name
        Key in ``ErrorSums.measures`` and column in ``metrics.csv``.
    label
        Heading in tables.
    unit
        ``y`` for the output's unit, ``y^2`` for its square, ``1`` for a fraction, ``%`` for percent.
    formula
        Definition in plain text; y measured, ŷ simulated, ȳ the mean of y.
    source
        Where the definition comes from.
    """

    name: str
    label: str
    unit: str
    formula: str
    source: str


METRICS: tuple[Metric, ...] = (
    Metric("rmse", "RMSE", "y", "√(mean (y − ŷ)²)", "standard"),
    Metric("mse", "MSE", "y^2", "mean (y − ŷ)²", "MRF rotational stiffness device, eq. 4"),
    Metric("nrmse", "NRMSE", "1", "RMSE / (max y − min y)", "preyield and postyield modelling, section 4"),
    Metric("esr", "ESR", "%", "100 · Σ(y − ŷ)² / Σ(y − ȳ)²", "Savaia et al., figure 16, after Savaresi et al. (2005)"),
    Metric("relative_rmse", "relative RMSE", "1", "RMSE / √(mean y²)", "explicit inverse model (tanh), RMSE tables"),
    Metric("err_peak", "RMSE over the peak", "1", "RMSE / max |y|", "explicit inverse model (tanh), eq. 12"),
    Metric(
        "err_energy",
        "energy error",
        "1",
        "|E − Ê| / |E|, of several tests of their sums",
        "explicit inverse model (tanh), eq. 13",
    ),
    Metric("fit_percent", "fit", "%", "100 · (1 − ‖y − ŷ‖ / ‖y − ȳ‖)", "System Identification Toolbox"),
)


@dataclass(frozen=True, slots=True)
class ErrorSums:
    """What the error measures of one stretch are computed from; those of several stretches add up, see ``together``.

    Attributes
    ----------
    samples
        Number of samples N.
    errors, squares, spread
        Σ(y − ŷ)², Σy² and Σ(y − ȳ)².
    mean, low, high
        ȳ, min y and max y.
    energy, simulated_energy
        E and Ê in J, nan where they are not known.
    """

    samples: int
    errors: float
    squares: float
    spread: float
    mean: float
    low: float
    high: float
    energy: float
    simulated_energy: float

    def measures(self) -> dict[str, float]:
        """Return every error measure of ``METRICS`` by name, in its unit.

        nan where undefined: ``nrmse``, ``esr`` and ``fit_percent`` of a constant y, ``relative_rmse`` and ``err_peak``
        of y = 0, ``err_energy`` without drive or without energy; all of a simulation that is not finite.
        """
        mse, squares = self.errors / self.samples, self.squares / self.samples
        rmse = float(np.sqrt(mse))
        extent = self.high - self.low
        deviation = float(np.sqrt(self.spread / self.samples)) if extent > 0.0 else 0.0
        return {
            "rmse": rmse,
            "mse": mse,
            "nrmse": _ratio(rmse, extent),
            "esr": 100.0 * _ratio(mse, deviation**2),
            "relative_rmse": _ratio(rmse, float(np.sqrt(squares))),
            "err_peak": _ratio(rmse, max(abs(self.low), abs(self.high))),
            "err_energy": _ratio(abs(self.energy - self.simulated_energy), abs(self.energy)),
            "fit_percent": 100.0 * (1.0 - _ratio(rmse, deviation)),
        }


def error_sums(
    measured: Array, simulated: Array, drive: Array | None = None, starts: Sequence[int] = (0,)
) -> ErrorSums:
    """Return what the error measures are computed from.

    Parameters
    ----------
    measured, simulated
        Output y and ŷ in the output's SI unit, both of shape (N,); segments of one condition one after the other.
    drive
        Channel the output does work against, shape (N,), SI: displacement for force, angle for torque, current for
        flux linkage, flux linkage for current. None leaves ``err_energy`` undefined.
    starts
        Index of every segment's first sample, ascending from 0: no energy is counted across the seam of two segments.

    Raises
    ------
    DataError
        If there is no sample, or the two differ in length.
    """
    y, y_hat = np.asarray(measured, dtype=np.float64), np.asarray(simulated, dtype=np.float64)
    if y.shape != y_hat.shape or y.ndim != 1 or not len(y):
        raise DataError(
            f"cannot compare {y.shape} measured with {y_hat.shape} simulated samples; run `mrfit fit` again"
        )
    finite = bool(np.isfinite(y_hat).all())
    mean = float(np.mean(y))
    return ErrorSums(
        samples=len(y),
        errors=float(np.sum((y - y_hat) ** 2)) if finite else np.nan,
        squares=float(np.sum(y**2)),
        spread=float(np.sum((y - mean) ** 2)),
        mean=mean,
        low=float(np.min(y)),
        high=float(np.max(y)),
        energy=absorbed_energy(y, drive, starts) if drive is not None else np.nan,
        simulated_energy=absorbed_energy(y_hat, drive, starts) if drive is not None and finite else np.nan,
    )


def together(sums: Sequence[ErrorSums]) -> ErrorSums:
    """Return the sums over several stretches: no energy is counted across their seams."""
    samples = sum(s.samples for s in sums)
    mean = sum(s.samples * s.mean for s in sums) / samples
    return ErrorSums(
        samples=samples,
        errors=sum(s.errors for s in sums),
        squares=sum(s.squares for s in sums),
        spread=sum(s.spread + s.samples * (s.mean - mean) ** 2 for s in sums),
        mean=mean,
        low=min(s.low for s in sums),
        high=max(s.high for s in sums),
        energy=sum(s.energy for s in sums),
        simulated_energy=sum(s.simulated_energy for s in sums),
    )


def absorbed_energy(values: Array, drive: Array, starts: Sequence[int] = (0,)) -> float:
    """Return Σ ∫ y d(drive) over segments in J: the work F dx or T dθ, or i dλ if y is current and the drive is flux.

    With y = λ and the drive i it is the co-energy ∫ λ di, which over whole cycles is −∮ i dλ, the energy with its sign
    turned. Trapezoidal rule. A segment whose last sample lies within two sample steps of its first is taken as whole
    cycles, whose period need not be a whole number of samples, and closed with that step.

    Parameters
    ----------
    values
        Output y, measured or simulated, shape (N,), SI.
    drive
        The channel it does work against, shape (N,), SI.
    starts
        Index of every segment's first sample, ascending from 0.
    """
    ends = [*starts[1:], len(values)]
    return sum(_area(values[a:b], drive[a:b]) for a, b in zip(starts, ends, strict=True))


def _area(y: Array, x: Array) -> float:
    if len(x) > 2 and abs(x[0] - x[-1]) <= 2.0 * np.max(np.abs(np.diff(x))):
        y, x = np.append(y, y[0]), np.append(x, x[0])
    return float(np.trapezoid(y, x))


def _ratio(numerator: float, denominator: float) -> float:
    return numerator / denominator if denominator > 0.0 else np.nan
