"""How well the data determine a parameter: well, poorly, or not."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from mrfit.io.schemas.fit import Fit, Quantity
from mrfit.report.numbers import in_html, significant

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


def words_of(q: Quantity) -> str:
    """Return how well a parameter is determined in words, empty where it is well or held."""
    state = state_of(q)
    if state is State.NOT:
        return "not determined"
    if state is not State.POORLY:
        return ""
    half = half_width(q)
    return "poorly determined" + (f" (± {in_html(significant(100.0 * half, 2))} %)" if half else "")


@dataclass(frozen=True)
class Count:
    """How many parameters the data determine.

    Attributes
    ----------
    free
        Those that were fitted.
    well, poorly, undetermined
        How many of these are in each state.
    """

    free: int
    well: int
    poorly: int
    undetermined: int

    @property
    def words(self) -> str:
        """Return it in words, as ``5 of 7, 1 poorly, 1 not``."""
        rest = [f", {n} {word}" for n, word in ((self.poorly, "poorly"), (self.undetermined, "not")) if n]
        return f"{self.well} of {self.free}" + "".join(rest)


def counted(quantities: Iterable[Quantity]) -> Count:
    """Return how many of the parameters that were fitted the data determine."""
    states = [state_of(q) for q in quantities]
    numbers = [states.count(s) for s in (State.WELL, State.POORLY, State.NOT)]
    return Count(sum(numbers), *numbers)


def count_of(fit: Fit) -> Count:
    """Return how many parameters of a fit, of all its sets together, the data determine."""
    return counted(q for result in fit.results for q in result.parameters)


def sentences(fit: Fit) -> list[str]:
    """Return how many parameters and derived quantities the data determine, and which of one set only poorly."""
    count = count_of(fit)
    text = f"The data determine {count.well} of {count.free} parameters well"
    text += "".join(f", {n} {word}" for n, word in ((count.poorly, "poorly"), (count.undetermined, "not")) if n)
    if count.poorly and len(fit.results) == 1:
        poor = [q for q in fit.results[0].parameters if state_of(q) is State.POORLY]
        text += f"; poorly: {', '.join(q.name + words_of(q).removeprefix('poorly determined') for q in poor)}"
    said = [text + "."]
    derived = counted(q for result in fit.results for q in result.derived)
    if derived.free:
        said.append(f"Derived quantities well determined: {derived.words}.")
    return said
