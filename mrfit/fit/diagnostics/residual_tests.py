"""Whether a simulated model has left something of its inputs in the residual.

A simulated (output-error) model says nothing of the noise, so the residual need not be white. But it must not depend on
the inputs: at every lag the correlation of residual and input has to stay within what noise as correlated as this one
gives by chance (Ljung 1999, section 16.6, with a long-run variance in place of whiteness). Noise is what differs from
cycle to cycle; what repeats belongs to the model or to the instrument.

Every condition is tested by itself, since an error may change sign between them and cancel in their sum. All of them
together are tested as well: what is too weak to be seen in any one of many short records may be seen in their sum.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import stdtrit

from mrfit.core.specs import Array
from mrfit.fit.diagnostics.uncertainty import bandwidth, differing, long_run_covariance
from mrfit.io.schemas.fit import ResidualTest

RESIDUAL_LAGS = 25
# Two-sided level over all lags, conditions and inputs together (Bonferroni)
LEVEL = 0.05
# Correlations below this explain less than 4 % of the residual: converter steps alone give as much
CORRELATION_MIN = 0.2
# Name of the test that takes all conditions together
ALL = "all"


@dataclass(frozen=True)
class _Correlation:
    """Correlation of residual and lagged input, largest against its standard error, over some records."""

    value: float
    lag: int
    error: float
    degrees: float


def varies(values: Array) -> bool:
    """Return whether an input (N,) moves at all, so that a residual may go with it."""
    return bool(np.ptp(values) > 1e-9 * np.abs(values).max())


def input_dependence(
    channel: str,
    inputs: Sequence[Array],
    residuals: Sequence[Array],
    periods: Sequence[float],
    conditions: Sequence[str],
    channels: int = 1,
) -> ResidualTest | None:
    """Return the correlation of the residual with one input at ±25 lags, None where the input is constant.

    Lags are one sample apart, or a hundredth of a cycle where that is more, so that they reach a quarter of a cycle.

    Parameters
    ----------
    channel
        The input's name.
    inputs, residuals
        For each record the input and the residual, each (N_s,).
    periods
        For each record the samples per cycle, 0 where the drive is not periodic.
    conditions
        For each record its condition.
    channels
        Inputs that are tested together: the chance that any of them is found by mistake is 5 %.
    """
    names = list(dict.fromkeys(conditions))
    groups = {name: [k for k, c in enumerate(conditions) if c == name] for name in names}
    if len(names) > 1:
        groups[ALL] = list(range(len(conditions)))
    found = {name: _correlation(inputs, residuals, periods, own) for name, own in groups.items()}
    known = {name: c for name, c in found.items() if c is not None}
    if not known:
        return None
    level = LEVEL / ((2 * RESIDUAL_LAGS + 1) * len(known) * channels)
    single = sum(name in known for name in names)

    def row(name: str, dependent: int = 0) -> ResidualTest:
        own = known[name]
        limit = own.error * float(stdtrit(own.degrees, 1.0 - level / 2))
        about: dict[str, Any] = {"channel": channel, "condition": name, "dependent": dependent, "conditions": single}
        independent = _excess(own.value, limit) <= 1.0
        return ResidualTest(correlation=own.value, lag=own.lag, limit=limit, independent=independent, **about)

    rows = {name: row(name) for name in known}
    worst = max(rows, key=lambda name: _excess(rows[name].correlation, rows[name].limit))
    return row(worst, sum(not rows[name].independent for name in names if name in rows))


def _excess(correlation: float, limit: float) -> float:
    """Return a correlation in multiples of what matters: its limit, and what is too small to."""
    return abs(correlation) / max(limit, CORRELATION_MIN)


def _correlation(
    inputs: Sequence[Array], residuals: Sequence[Array], periods: Sequence[float], records: Sequence[int]
) -> _Correlation | None:
    """Return the correlation over some records that share their lags, None where no input varies."""
    apart = max(1, round(max((periods[k] for k in records), default=0.0) / (4 * RESIDUAL_LAGS)))
    reach = RESIDUAL_LAGS * apart
    usable = [k for k in records if len(residuals[k]) > 4 * reach and varies(inputs[k])]
    sums, drives = np.zeros((2, 2 * RESIDUAL_LAGS + 1))
    variance, power, spread = 0.0, 0.0, 0.0
    for k in usable:
        centred = inputs[k] - inputs[k].mean()
        residual = residuals[k] - residuals[k].mean()
        inner = slice(reach, len(residual) - reach)
        windows = np.lib.stride_tricks.sliding_window_view(centred, len(residual) - 2 * reach)[::apart]
        sums += windows @ residual[inner]
        noise = _noise(residual, inner, periods[k], windows)
        products = windows[[0, RESIDUAL_LAGS, 2 * RESIDUAL_LAGS]].T * noise[:, None]
        own = float(np.diag(long_run_covariance(products)).max())
        variance += own
        spread += own**2 / _degrees(products, len(residual) / periods[k] if periods[k] >= 1.0 else math.inf)
        power += float(residual[inner] @ residual[inner])
        drives += np.einsum("ln,ln->l", windows, windows)
    if power == 0.0 or not np.any(drives):
        return None
    # where the input rests for as long as a window, nothing can go with it
    scales = np.sqrt(power * np.where(drives > 0.0, drives, np.inf))
    place = int(np.argmax(np.abs(sums / scales)))
    # window k begins k lags into the input, while the residual begins RESIDUAL_LAGS lags in
    lag = (RESIDUAL_LAGS - place) * apart
    degrees = variance**2 / spread if spread > 0.0 else math.inf
    return _Correlation(
        float(sums[place] / scales[place]), lag, float(math.sqrt(variance) / scales[place]), float(degrees)
    )


def _noise(residual: Array, inner: slice, period: float, windows: Array) -> Array:
    """Return what of a residual (N,) within a range is noise: all that differs between cycles, or does not go with u.

    Without cycles the lagged input (L, N_i) most correlated with the residual is taken away: an error that is no noise
    at all would else raise its own limit. As in a regression, that costs a degree of freedom.
    """
    if len(residual) >= 2.0 * period >= 2.0:
        return differing(residual, period)[inner]
    own = residual[inner]
    power = np.einsum("ln,ln->l", windows, windows)
    slopes = (windows @ own) / np.where(power > 0.0, power, np.inf)
    most = int(np.argmax(slopes**2 * power))
    left: Array = own - slopes[most] * windows[most]
    return left


def _degrees(products: Array, cycles: float) -> float:
    """Return the degrees of freedom of the long-run variance of products (N, L): N / bandwidth, for the kernel used.

    What repeats was taken away before, one part in ``cycles``.
    """
    independent = len(products) / max(bandwidth(products), 1.0)
    share = 1.0 - 1.0 / cycles if cycles >= 2.0 else 1.0
    return max(independent * share - 1.0, 1.0)
