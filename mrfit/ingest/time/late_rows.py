"""Rows that a late buffer repeats: the clock goes on, and every channel shows once more what it showed before."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from mrfit.core.specs import Array, Index, Mask
from mrfit.ingest import series
from mrfit.ingest.time.timebase import FILL_AT_MOST

FEWEST_ROWS = 100
"""A shorter log is not judged: of few rows it cannot be told how often they agree."""
NEAR_ROWS, NEAR_STEPS = 4, 0.5
"""Rows on each side of a late one, and the least share of them in which a channel moves."""
CHANCE_REACH = 16
"""Rows on either side of each for the share of those that repeat a value: a motion changes little there."""
BY_CHANCE = 4.0
"""Standard deviations above their expected number from which rows that agree are no accident."""


def late_rows(columns: Sequence[Array]) -> Index:
    """Return the rows in which every channel repeats the row before, where that is not chance.

    Channels of a coarse converter repeat values, the more the slower they move, and now and then all of them do so in
    one row. With shares p_c of such rows among the neighbours of each row, the sum of their products is expected of
    that. Only rows beside which at least two channels move, and one goes on as before, are looked at: a machine at rest
    is not late, and where a swing turns, neighbours are alike. Runs too long to be interpolated are left: there a
    logger hangs.

    Parameters
    ----------
    columns
        The channels (N,).
    """
    rows, chance = len(columns[0]) - 1, 0.0
    if rows < FEWEST_ROWS:
        return np.empty(0, dtype=np.int64)
    # a channel that stands in two columns moves once
    columns = list({c[: series.SERIES_CHUNK].tobytes(): c for c in columns}.values())
    standing, in_motion = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.bool_)]
    for begin, end in series.spans(rows):
        low, high = max(begin - NEAR_ROWS, 0), min(end + NEAR_ROWS, rows)
        inner = slice(begin - low, end - low)
        parts = [values[low : high + 1] for values in columns]
        same = np.stack([part[1:] == part[:-1] for part in parts])
        before, after = (_counts(~same, *ends, "constant")[:, inner] for ends in ((-NEAR_ROWS, -1), (1, NEAR_ROWS)))
        moving = np.count_nonzero(np.minimum(before, after) >= NEAR_STEPS * NEAR_ROWS, axis=0) > 1
        shares = _counts(same, -CHANCE_REACH, CHANCE_REACH, "edge")[:, inner] / (2 * CHANCE_REACH + 1)
        chance += float(np.sum(np.prod(shares, axis=0)[moving]))
        stands = np.flatnonzero(np.all(same[:, inner], axis=0))
        standing.append(begin + 1 + stands)
        row, last = stands + begin - low + 1, high - low
        ends = np.clip([row - 1 - NEAR_ROWS, row - 1, row, row + NEAR_ROWS], 0, last)
        goes_on = [(p[ends[1]] - p[ends[0]]) * (p[ends[3]] - p[ends[2]]) > 0.0 for p in parts]
        in_motion.append(moving[stands] & np.any(goes_on, axis=0))
    rows_standing, late = np.concatenate(standing), np.concatenate(in_motion)
    # of rows that stand together all are late or none
    group = np.cumsum(np.diff(rows_standing, prepend=-1) > 1) - 1
    is_late = (np.bincount(group, late) > 0) & (np.bincount(group) <= FILL_AT_MOST)
    found: Index = rows_standing[is_late[group]]
    return found if len(found) > chance + BY_CHANCE * np.sqrt(chance) else found[:0]


def _counts(mask: Mask, first: int, last: int, ends: Literal["constant", "edge"]) -> Index:
    """Return the number (C, N) of true entries among k + first … k + last, for each entry k of a mask (C, N)."""
    reach, size = max(-first, last), mask.shape[1]
    sums = np.cumsum(np.pad(mask, ((0, 0), (reach + 1, reach)), mode=ends), axis=1, dtype=np.int64)
    counts: Index = sums[:, reach + last + 1 :][:, :size] - sums[:, reach + first :][:, :size]
    return counts
