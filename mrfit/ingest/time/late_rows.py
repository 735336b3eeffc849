"""Rows that a late buffer repeats: the clock goes on, and every channel shows once more what it showed before."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.time.timebase import FILL_AT_MOST

NEAR_ROWS, NEAR_STEPS = 4, 0.5
"""Rows on each side of a late one, and the least share of them in which a channel moves."""
CHANCE_ROWS = 33
"""Rows about each in which the share of those is counted that repeat a value: a motion does not change much in them."""
BY_CHANCE = 4.0
"""Standard deviations above their expected number from which rows that agree are no accident."""


def late_rows(columns: Sequence[Array]) -> NDArray[np.int64]:
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
    # a channel that stands in two columns moves once
    columns = list({c[: series.SERIES_CHUNK].tobytes(): c for c in columns}.values())
    rows, chance = len(columns[0]) - 1, 0.0
    standing, in_motion = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.bool_)]
    for begin, end in series.spans(rows):
        low, high = max(begin - NEAR_ROWS, 0), min(end + NEAR_ROWS, rows)
        inner = slice(begin - low, end - low)
        parts = [values[low : high + 1] for values in columns]
        same = np.stack([part[1:] == part[:-1] for part in parts])
        steps = np.cumsum(np.pad(~same, ((0, 0), (NEAR_ROWS + 1, NEAR_ROWS))), axis=1)
        before = (steps[:, NEAR_ROWS : -NEAR_ROWS - 1] - steps[:, : -2 * NEAR_ROWS - 1])[:, inner]
        after = (steps[:, 2 * NEAR_ROWS + 1 :] - steps[:, NEAR_ROWS + 1 : -NEAR_ROWS])[:, inner]
        moving = np.count_nonzero(np.minimum(before, after) >= NEAR_STEPS * NEAR_ROWS, axis=0) > 1
        shares = uniform_filter1d(same.astype(np.float64), CHANCE_ROWS, axis=1, mode="nearest")[:, inner]
        chance += float(np.sum(np.prod(shares, axis=0)[moving]))
        stands = np.flatnonzero(np.all(same[:, inner], axis=0))
        standing.append(begin + 1 + stands)
        row, last = stands + begin - low + 1, high - low
        ends = np.clip([row - 1 - NEAR_ROWS, row - 1, row, row + NEAR_ROWS], 0, last)
        goes_on = [(p[ends[1]] - p[ends[0]]) * (p[ends[3]] - p[ends[2]]) > 0.0 for p in parts]
        in_motion.append(moving[stands] & np.any(goes_on, axis=0))
    rows_standing, late = np.concatenate(standing), np.concatenate(in_motion)
    group = np.cumsum(np.diff(rows_standing, prepend=-1) > 1) - 1
    late &= np.bincount(group)[group] <= FILL_AT_MOST if len(group) else True
    return rows_standing[late if np.count_nonzero(late) > chance + BY_CHANCE * np.sqrt(chance) else slice(0)]
