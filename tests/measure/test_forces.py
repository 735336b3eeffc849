"""A peak force is never below the force at mid-stroke of the same direction."""

import numpy as np

from mrfit.measure.forces import _greater
from mrfit.measure.intervals import PerCycle


def test_the_peak_is_the_force_at_mid_stroke_where_that_is_greater() -> None:
    low, high = (PerCycle(np.full(3, force), np.zeros(3)) for force in (610.1, 610.5))
    assert _greater(low, high, True) is high and _greater(high, low, True) is high
    # the least is the peak of negative velocity
    assert _greater(high, low, False) is low and _greater(low, high, False) is low
