"""How well the data determine a parameter or derived quantity: well, poorly, or not."""

import math
from enum import StrEnum

POOR = 0.25
"""Half of the 95 % interval over the value from which a parameter is poorly determined: one digit is uncertain."""


class State(StrEnum):
    """How well the data determine a parameter."""

    WELL = "well"
    POORLY = "poorly"
    NOT = "not"
    HELD = "held"


def state_of(value: float, low: float | None, high: float | None) -> State:
    """Return how well an interval determines a value.

    A value whose interval holds zero is poorly determined, whatever its unit: not even its sign is known.

    Parameters
    ----------
    value
        Estimate.
    low, high
        Its 95 % interval; None where an end is open.
    """
    ends = [end for end in (low, high) if end is not None and math.isfinite(end)]
    if not ends:
        return State.NOT
    if len(ends) < 2:
        return State.POORLY
    return State.WELL if (ends[1] - ends[0]) / 2.0 <= POOR * abs(value) else State.POORLY
