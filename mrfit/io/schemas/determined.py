"""How well the data determine a parameter or derived quantity: well, poorly, or not."""

import math
from enum import StrEnum

from mrfit.io.schemas.fit import Quantity

POOR = 0.25
"""Half of the 95 % interval over the value from which a parameter is poorly determined: one digit is uncertain."""
NEAR_ZERO = 0.1
"""Share of the width of its bounds against which a parameter is judged that may be zero or of either sign."""


class State(StrEnum):
    """How well the data determine a parameter."""

    WELL = "well"
    POORLY = "poorly"
    NOT = "not"
    HELD = "held"


def half_width(q: Quantity) -> float | None:
    """Return half of the 95 % interval over the value; None where an end is open or the value is zero."""
    if q.low is None or q.high is None or not q.value or not math.isfinite(q.high - q.low):
        return None
    return (q.high - q.low) / 2.0 / abs(q.value)


def state_of(q: Quantity) -> State:
    """Return how well the data determine a parameter.

    Half of the interval is compared with the value. Where the bounds hold zero, as those of an offset, a value near
    zero is no reason to distrust it: half of the interval is then compared with a tenth of the bounds' width, if that
    is more than the value.
    """
    if q.fixed:
        return State.HELD
    ends = [end for end in (q.low, q.high) if end is not None and math.isfinite(end)]
    if not q.identifiable or not ends:
        return State.NOT
    if len(ends) < 2:
        return State.POORLY
    scale = abs(q.value)
    if q.bound_low is not None and q.bound_high is not None and q.bound_low <= 0.0 <= q.bound_high:
        scale = max(scale, NEAR_ZERO * (q.bound_high - q.bound_low))
    return State.WELL if (ends[1] - ends[0]) / 2.0 <= POOR * scale else State.POORLY
