"""Whether a simulated model has left something of its inputs in the residual.

A simulated (output-error) model says nothing of the noise, so the residual need not be white. But it must not depend on
the inputs: at every lag the correlation of residual and input has to stay within what noise as correlated as this one
gives by chance (Ljung 1999, section 16.6, with a long-run variance in place of whiteness). Noise is what differs from
cycle to cycle; what repeats belongs to the model or to the instrument.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.fit.uncertainty import differing, long_run_covariance
from mrfit.specs import Array

LAGS = 25
# Two-sided 5 % over all 51 lags together (Bonferroni)
QUANTILE = 3.29
# Correlations below this explain less than 4 % of the residual: converter steps alone give as much
SMALLEST = 0.2


@dataclass(frozen=True)
class Dependence:
    """How the residual goes with one input.

    Attributes
    ----------
    channel
        The input.
    correlation
        Of residual and lagged input, the one that is largest against its limit.
    lag
        Samples by which the input is ahead of the residual there.
    limit
        What chance gives.
    """

    channel: str
    correlation: float
    lag: int
    limit: float

    @property
    def independent(self) -> bool:
        """Whether nothing of the input is left in the residual."""
        return abs(self.correlation) <= max(self.limit, SMALLEST)


def input_dependence(
    channel: str, inputs: Sequence[Array], residuals: Sequence[Array], periods: Sequence[float]
) -> Dependence | None:
    """Return how the residual goes with one input at ±25 lags, None where the input is constant.

    Lags are one sample apart, or a hundredth of a cycle where that is more, so that they reach a quarter of a cycle.

    Parameters
    ----------
    channel
        The input's name.
    inputs, residuals
        For each record the input and the residual, each (N_s,).
    periods
        For each record the samples per cycle, 0 where the drive is not periodic.
    """
    apart = max(1, round(max(periods, default=0.0) / (4 * LAGS)))
    reach = LAGS * apart
    usable = [k for k, u in enumerate(inputs) if len(u) > 4 * reach and np.ptp(u) > 1e-9 * np.abs(u).max()]
    sums, drives = np.zeros((2, 2 * LAGS + 1))
    variance, power = 0.0, 0.0
    for k in usable:
        centred = inputs[k] - inputs[k].mean()
        residual = residuals[k] - residuals[k].mean()
        inner = slice(reach, len(residual) - reach)
        windows = np.lib.stride_tricks.sliding_window_view(centred, len(residual) - 2 * reach)[::apart]
        sums += windows @ residual[inner]
        noise = differing(residual, periods[k])[inner]
        products = windows[[0, LAGS, 2 * LAGS]].T * noise[:, None]
        variance += float(np.diag(long_run_covariance(products)).max())
        power += float(residual[inner] @ residual[inner])
        drives += np.einsum("ln,ln->l", windows, windows)
    if power == 0.0 or not np.any(drives):
        return None
    # where the input rests for as long as a window, nothing can go with it
    scales = np.sqrt(power * np.where(drives > 0.0, drives, np.inf))
    place = int(np.argmax(np.abs(sums / scales)))
    # window k begins k lags into the input, while the residual begins LAGS lags in
    limit = QUANTILE * math.sqrt(variance) / scales[place]
    return Dependence(channel, float(sums[place] / scales[place]), (LAGS - place) * apart, float(limit))
