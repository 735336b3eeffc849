"""Degree to which the data determine a parameter or derived quantity: well, poorly, or not."""

import math
from enum import StrEnum

POOR = 0.25
"""Half of the 95 % interval over the value from which a parameter is poorly determined: one digit is uncertain."""
SLIGHT = 0.01
"""Half of the interval of an offset over the range of what it adds to, up to which it is well determined near zero."""


class State(StrEnum):
    """Degree to which the data determine a parameter."""

    WELL = "well"
    POORLY = "poorly"
    NOT = "not"
    HELD = "held"


def state_of(
    value: float, low: float | None, high: float | None, added_to: float | None = None, logarithm: bool = False
) -> State:
    """Return the degree to which an interval determines a value.

    A value whose interval holds zero is poorly determined, whatever its unit: not even its sign is known. An offset,
    which may be zero, is well determined nevertheless where the data that it adds to do not tell it from its ends. Of a
    logarithm it is the quantity itself that is judged, in any unit.

    Parameters
    ----------
    value
        Estimate.
    low, high
        Its 95 % interval; None where an end is open.
    added_to
        Of an offset, the range of the data that it adds to.
    logarithm
        Whether it is the logarithm of a quantity.
    """
    ends = [end for end in (low, high) if end is not None and math.isfinite(end)]
    if not ends:
        return State.NOT
    if len(ends) < 2:
        return State.POORLY
    fine = POOR if logarithm else max(POOR * abs(value), SLIGHT * (added_to or 0.0))
    return State.WELL if (ends[1] - ends[0]) / 2.0 <= fine else State.POORLY
