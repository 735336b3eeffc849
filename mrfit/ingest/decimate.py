"""Fewer samples of a log than it has, without what their rate could not tell from slower motion.

A symmetric low-pass delays nothing, and all channels go through the same one, so that what a model says of them holds.
"""

from dataclasses import replace
from functools import cache
from typing import cast

import numpy as np

from mrfit.core.recording import Recording
from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.refusal import Refusal

# Up to this share of the new Nyquist frequency everything is kept, beyond the whole of it nothing
KEPT_BAND = 0.8
# Least attenuation of what is left out, and most ripple of what is kept, in dB
DECIMATION_ATTENUATION = 80.0


def decimated(record: Recording, factor: int) -> Recording:
    """Return a recording at the ``factor``-th part of its rate, low-passed to 0.8 of the Nyquist frequency it has then.

    y_k = Σ_j h_j·x_{kM+j}, j = −L … L, h a Kaiser window's low-pass of unit gain; beyond its ends the record goes on
    mirrored at its first and last sample. A channel on disk is read as it is asked for.

    Raises
    ------
    Refusal
        If the record is shorter than the filter.
    """
    if factor == 1:
        return record
    reach = len(filter_of(factor)) // 2
    if record.samples <= reach:
        raise Refusal(
            record.source,
            f"its {record.samples} samples are too few to keep every {factor}th of them",
            f"give a smaller decimate in its channel map, of which {reach + 1} samples are needed at {factor}",
        )
    channels = {name: _under(values, filter_of(factor), factor) for name, values in record.channels.items()}
    rate, kept = 1.0 / (record.dt * factor), KEPT_BAND / (2.0 * record.dt * factor)
    line = f"decimated by {factor} to {rate:.6g} Hz, low-passed above {kept:.6g} Hz"
    return replace(record, dt=record.dt * factor, channels=channels, history=(*record.history, line))


@cache
def filter_of(factor: int) -> Array:
    """Return the low-pass, shape (2L + 1,), for every ``factor``-th sample."""
    from scipy.signal import firwin, kaiserord

    taps, beta = kaiserord(DECIMATION_ATTENUATION, (1.0 - KEPT_BAND) / factor)
    # as many taps to either side as make the filter whole at a sample that is kept
    side = factor * -(-taps // (2 * factor))
    return firwin(2 * side + 1, (1.0 + KEPT_BAND) / (2.0 * factor), window=("kaiser", beta))


def smoothed(values: Array, weights: Array) -> Array:
    """Return values (N,) under symmetric weights (2L + 1,), mirrored at both ends; on disk where they are."""
    return _under(values, weights, 1)


def _under(values: Array, weights: Array, factor: int) -> Array:
    length = -(-len(values) // factor)
    step = max(1, series.SERIES_CHUNK // factor)

    def read(begin: int, end: int) -> Array:
        parts = [_part(values, weights, factor, (a, min(a + step, end))) for a in range(begin, end, step)]
        return np.concatenate(parts) if parts else np.empty(0)

    if series.in_memory(values):
        return read(0, length)
    return cast(Array, series.Series(length, read))


def _part(values: Array, weights: Array, factor: int, span: tuple[int, int]) -> Array:
    """Return low-passed values begin … end-1, of those the filter reaches."""
    from scipy.signal import upfirdn

    begin, end = span
    reach, last = len(weights) // 2, len(values) - 1
    first, final = begin * factor - reach, (end - 1) * factor + reach
    inside = np.asarray(values[max(first, 0) : min(final, last) + 1], dtype=np.float64)
    before = 2.0 * values[0] - values[1 : 1 - first][::-1] if first < 0 else inside[:0]
    beyond = final - last
    after = 2.0 * values[last] - values[last - beyond : last][::-1] if beyond > 0 else inside[:0]
    around = np.concatenate([before, inside, after])
    made: Array = upfirdn(weights, around, 1, factor)
    # the filter is whole where it has met 2L + 1 samples; L is a multiple of the factor
    skip = 2 * reach // factor
    return made[skip : skip + end - begin]
