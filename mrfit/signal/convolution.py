"""Signals under kernels and under themselves, by the fast Fourier transform.

``correlated`` gives the numbers of ``scipy.signal.oaconvolve`` to the last digit. That package costs every command
0.4 s of processor time to import, for all its filters and, through them, ``scipy.stats``; ``scipy.fft`` is there
already.
"""

import math

import numpy as np

from mrfit.core.specs import Array


def correlated(values: Array, kernel: Array) -> Array:
    """Return a kernel's sum of products with a signal at every place where it lies within (overlap-add).

    y_i = Σ_j k_j x_{i+j}

    Parameters
    ----------
    values
        Signal, x (N,).
    kernel
        Weights, k (K,), 2 ≤ K ≤ N.

    Returns
    -------
    Array
        (N − K + 1,).
    """
    from scipy.fft import irfft, next_fast_len, rfft

    samples, overlap = len(values), len(kernel) - 1
    size = _block(samples, overlap + 1)
    if size >= samples:
        size = next_fast_len(samples + overlap, real=True)
        blocks = values[None, :]
    else:
        step = size - overlap
        blocks = np.zeros((math.ceil((samples + overlap) / step), step))
        blocks.reshape(-1)[:samples] = values
    summed: Array = irfft(rfft(blocks, size) * rfft(kernel[None, ::-1], size), size)
    # what a block's sums reach into the next one's
    summed[1:, :overlap] += summed[:-1, size - overlap :]
    return summed[:, : blocks.shape[1]].reshape(-1)[overlap:samples] if len(blocks) > 1 else summed[0, overlap:samples]


def autocorrelation(values: Array) -> Array:
    """Return the sums of products of a series with itself (N,), from the lag 0 on; there is nothing beyond its ends."""
    spectrum = np.fft.rfft(values, 2 * len(values))
    return np.fft.irfft(np.abs(spectrum) ** 2)[: len(values)]


def correlation_time(series: Array, least: float) -> float:
    """Return the integrated correlation time of a series (N,) in samples, 1 for white noise.

    1 + 2 Σ ρ_k over the lags up to the first whose correlation ρ_k is below ``least``.
    """
    products = autocorrelation(series)
    if not products[0] > 0.0:
        return 1.0
    ends = np.flatnonzero(products < least * products[0])
    return float(1.0 + 2.0 * np.sum(products[1 : ends[0] if len(ends) else None]) / products[0])


def _block(samples: int, width: int) -> int:
    """Return the length of a block at which a kernel of a width takes the fewest operations a sample."""
    from scipy.fft import next_fast_len
    from scipy.special import lambertw

    if 2 * width >= samples:
        return samples
    # least N log(2N)/(N − K) over N, with K = width − 1
    best = (1 - width) * lambertw(1 / (2 * math.e * (1 - width)), k=-1).real
    return int(next_fast_len(math.ceil(best)))
