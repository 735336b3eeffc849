"""Resolution of printed numbers."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mrfit.core.specs import Array
from mrfit.ingest import series

PRINT_BLOCK = 512
STRIPE = 2048
"""Blocks of that many rows whose print is looked at together."""
MOST_DECIMALS = 18
STRIDES = (9, 7, 3, 1)
"""Every n-th row shows the last decimal of even times only where n has no factor 2 or 5."""
PRINT_NOISE = 64 * np.finfo(np.float64).eps
"""Relative error that conversions leave on a printed number, at most."""
NUMERAL = re.compile(r"[+-]?\d*(?:[.,](\d*))?(?:[eE]([+-]?\d+))?")


@dataclass(frozen=True, slots=True)
class Digits:
    """Form in which a column is printed throughout: its decimals, those of a mantissa if ``scientific``."""

    decimals: int
    scientific: bool

    def step(self, largest: float) -> float:
        """Return the unit of the last digit of numbers up to ``largest``."""
        power = np.floor(np.log10(largest)) if self.scientific and largest > 0.0 else 0.0
        return float(10.0 ** (power - self.decimals))


def digits_of(texts: Sequence[str]) -> Digits | None:
    """Return the form of printed numbers; None where they have no common form, as where final zeros are left out."""
    forms = {(len(match[1] or ""), bool(match[2])) for t in texts if t and (match := NUMERAL.fullmatch(t))}
    if len(forms) != 1:
        return None
    decimals, scientific = forms.pop()
    return Digits(decimals, scientific)


def print_step(time: Array) -> Array:
    """Return the unit of the last printed decimal of every time, found over blocks of rows; 0 where there is none."""
    parts = [_decimal_steps(time[k : k + STRIPE * PRINT_BLOCK]) for k in range(0, len(time), STRIPE * PRINT_BLOCK)]
    blocks = np.concatenate(parts)
    known = blocks[np.isfinite(blocks)]
    # a block of zeros shows no decimal: it is as coarse as any other
    blocks[np.isnan(blocks)] = known.max() if len(known) else 1.0
    # a block in which the print changes shows the finer step: its neighbours know better
    wide = np.maximum(blocks, np.maximum(np.append(blocks[1:], 0.0), np.append(0.0, blocks[:-1])))
    return series.mapped(lambda k: wide[(k // PRINT_BLOCK).astype(np.int64)], series.ordinals(len(time)))


def _decimal_steps(time: Array) -> Array:
    """Return the unit of the last decimal of each block, seen in about 64 of its rows; nan for a block of zeros."""
    whole = len(time) // PRINT_BLOCK * PRINT_BLOCK
    found = _last_decimal(time[:whole].reshape(-1, PRINT_BLOCK)[:, :: STRIDES[0]])
    if whole == len(time):
        return found
    rest = time[-PRINT_BLOCK:]  # a few rows by themselves may all happen to end in zeros
    stride = next(s for s in STRIDES if s <= max(1, len(rest) // 56))
    return np.append(found, _last_decimal(rest[None, ::stride]))


def _last_decimal(times: Array) -> Array:
    """Return for each row of ``times`` the largest power of ten that divides all of it.

    It is 0 if there is none to trust, and nan if all times are zero.
    """
    largest = np.max(np.abs(times), axis=1)
    found = np.where(largest > 0.0, 0.0, np.nan)
    left = np.flatnonzero(largest > 0.0)
    for decimals in range(MOST_DECIMALS + 1):
        scaled = times[left] * 10.0**decimals
        size = largest[left] * 10.0**decimals
        near = np.minimum(PRINT_NOISE * size, 1e-4)[:, None]
        fits = np.all(np.abs(scaled - np.round(scaled)) <= near, axis=1)
        trusted = fits & ((decimals < 9) | (size < 1e11))
        found[left[trusted]] = 10.0**-decimals
        left = left[~fits]
    return found
