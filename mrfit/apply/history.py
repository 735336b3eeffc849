"""The past of a record that nobody logged, as far as its known beginning shows it.

Hysteresis that does not depend on time remembers only the turning points of its drive. Two of them before the first
sample, from the demagnetised state on, make most of the states that a core can be in: a greatest swing and the turn
after it. They are those with which the model comes nearest to the output that is known.

Source: I. D. Mayergoyz, Mathematical Models of Hysteresis (1991), ch. 1 (the wiping-out property).
"""

from collections.abc import Callable

import numpy as np

from mrfit.core.specs import Array

# Points of the first grid for the two turning points, of those that refine it, and how often
_FIRST, _LATER, _ROUNDS = (13, 17), (7, 9), 4


def fitted_history(error: Callable[[Array], float], reach: float) -> Array:
    """Return the drive before the first sample: none, or 0 and two turning points, (0,) or (3,).

    Parameters
    ----------
    error
        Of the known output, of a drive before it.
    reach
        Greatest turning point looked at.
    """
    least, best = error(np.empty(0)), np.empty(0)
    centre, widths = np.zeros(2), np.full(2, reach)
    for k in range(_ROUNDS):
        grids = [
            np.clip(np.linspace(c - w, c + w, n), -reach, reach)
            for c, w, n in zip(centre, widths, _LATER if k else _FIRST, strict=True)
        ]
        tried = [np.array([0.0, a, b]) for a in grids[0] for b in grids[1]]
        errors = [error(one) for one in tried]
        nearest = int(np.argmin(errors))
        centre, widths = tried[nearest][1:], np.array([1.2 * (g[1] - g[0]) for g in grids])
        if errors[nearest] < least:
            least, best = errors[nearest], tried[nearest]
    return best
