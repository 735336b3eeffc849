"""Rows that a late buffer repeats: the clock goes on, and every channel shows once more what it showed before."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrfit.core.specs import Array
from mrfit.ingest import series
from mrfit.ingest.time.timebase import FILL_AT_MOST

RARELY_EQUAL = 0.02
"""Largest share of rows at which the finest channel repeats a value; one that does so more often is coarse or held."""
NEAR_ROWS, NEAR_STEPS = 4, 0.5
"""Rows on each side of a late one, and the least share of them in which a channel moves."""
BY_CHANCE = 4.0
"""Standard deviations above their expected number from which rows that agree are no accident."""
CHANCE_ROUNDS = 20
"""Rounds in which the number by chance is found."""


def late_rows(columns: Sequence[Array]) -> NDArray[np.int64]:
    """Return the rows in which every channel repeats the row before, where that is not chance.

    Channels of a coarse converter repeat values, and now and then all of them do so in one row. With shares p_c of
    such rows among N, N times the product of p_c is expected of that. Only rows beside which at least two channels move
    are looked at: a machine at rest is not late. Runs too long to be interpolated are left: there a logger hangs.

    Parameters
    ----------
    columns
        The channels (N,).
    """
    # a channel that stands in two columns moves once
    columns = list({c[: series.SERIES_CHUNK].tobytes(): c for c in columns}.values())
    rows, moved, equal = len(columns[0]) - 1, 0, np.zeros(len(columns))
    standing, in_motion = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.bool_)]
    for begin, end in series.spans(rows):
        low, high = max(begin - NEAR_ROWS, 0), min(end + NEAR_ROWS, rows)
        inner = slice(begin - low, end - low)
        parts = [values[low : high + 1] for values in columns]
        same = np.stack([part[1:] == part[:-1] for part in parts])
        steps = np.cumsum(np.pad(~same, ((0, 0), (NEAR_ROWS + 1, NEAR_ROWS))), axis=1)
        before = steps[:, NEAR_ROWS : -NEAR_ROWS - 1] - steps[:, : -2 * NEAR_ROWS - 1]
        after = steps[:, 2 * NEAR_ROWS + 1 :] - steps[:, NEAR_ROWS + 1 : -NEAR_ROWS]
        moves = np.minimum(before, after) >= NEAR_STEPS * NEAR_ROWS
        moving, same = (np.count_nonzero(moves, axis=0) > 1)[inner], same[:, inner]
        moved += int(np.count_nonzero(moving))
        equal += np.count_nonzero(same & moving, axis=1)
        stands = np.flatnonzero(np.all(same, axis=0))
        standing.append(begin + 1 + stands)
        in_motion.append(moving[stands])
    rows_standing, late = np.concatenate(standing), np.concatenate(in_motion)
    group = np.cumsum(np.diff(rows_standing, prepend=-1) > 1) - 1
    late &= np.bincount(group)[group] <= FILL_AT_MOST if len(group) else True
    number = np.count_nonzero(late)
    if not number or equal.min() > RARELY_EQUAL * moved:
        return rows_standing[:0]
    shares, chance = equal[equal < moved], float(number)
    # late rows are among those counted of each channel, all but those by chance
    for _ in range(CHANCE_ROUNDS):
        chance = moved * float(np.prod((shares - number + chance) / moved))
    return rows_standing[late if number > chance + BY_CHANCE * np.sqrt(chance) else slice(0)]
