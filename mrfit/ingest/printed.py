"""How finely numbers were printed."""

import numpy as np

from mrfit.ingest import series
from mrfit.specs import Array

PRINT_BLOCK = 512
STRIPE = 2048
"""Blocks of that many rows whose print is looked at together."""


def print_step(time: Array) -> Array:
    """Return the unit of the last printed decimal of every time, found over blocks of rows; 0 where there is none."""
    parts = [_decimal_steps(time[k : k + STRIPE * PRINT_BLOCK]) for k in range(0, len(time), STRIPE * PRINT_BLOCK)]
    blocks = np.concatenate(parts)
    # a block in which the print changes shows the finer step: its neighbours know better
    wide = np.maximum(blocks, np.maximum(np.append(blocks[1:], 0.0), np.append(0.0, blocks[:-1])))
    return series.mapped(lambda k: wide[(k // PRINT_BLOCK).astype(np.int64)], series.ordinals(len(time)))


def _decimal_steps(time: Array) -> Array:
    """Return the unit of the last decimal of each block, seen in up to 64 of its rows."""
    whole = len(time) // PRINT_BLOCK * PRINT_BLOCK
    rest = time[whole:]
    found = _last_decimal(time[:whole].reshape(-1, PRINT_BLOCK)[:, :: PRINT_BLOCK // 64])
    return np.append(found, _last_decimal(rest[None, :: max(1, len(rest) // 64)])) if len(rest) else found


def _last_decimal(times: Array) -> Array:
    """Return for each row of ``times`` the largest power of ten that divides all of it; 0 if there is none to trust."""
    found = np.zeros(len(times))
    left = np.arange(len(times))
    for decimals in range(13):
        scaled = times[left] * 10.0**decimals
        fits = np.all(np.abs(scaled - np.round(scaled)) < 1e-4, axis=1)
        trusted = fits & ((decimals < 9) | (np.max(np.abs(scaled), axis=1) < 1e11))
        found[left[trusted]] = 10.0**-decimals
        left = left[~fits]
    return found
