"""Determination of a fit's parameters by the data, in words and numbers."""

from collections.abc import Iterable
from dataclasses import dataclass

from mrfit.io.schemas.determined import State
from mrfit.io.schemas.discovery import EffectParameter
from mrfit.io.schemas.fit import Fit, Quantity
from mrfit.report.curves import prefixed
from mrfit.report.numbers import in_html, significant, with_interval

NEXT_TO_NOTHING = 0.005
"""Share of half an interval about 0 below which a value is 0."""


def words_of(q: Quantity) -> str:
    """Return the state of a parameter in words, empty where it is well determined or held."""
    if q.determined is State.NOT:
        return "not determined"
    if q.determined is not State.POORLY:
        return ""
    if q.low is None or q.high is None:
        return "poorly determined"
    if q.low <= 0.0 <= q.high and not q.logarithm:
        return "poorly determined (its interval holds zero)"
    half = (q.high - q.low) / 2.0 / (1.0 if q.logarithm else abs(q.value))
    return f"poorly determined (± {in_html(significant(100.0 * half, 2))} %)"


def measured(p: EffectParameter | Quantity) -> str:
    """Return a value with half its interval behind it, or both ends where it does not lie in the middle."""
    half_width = None if p.low is None or p.high is None else 0.5 * (p.high - p.low)
    if half_width is not None and abs(p.value) < NEXT_TO_NOTHING * half_width:
        factor, unit = prefixed(half_width, p.unit)
        return f"0 ± {in_html(significant(factor * half_width, 2))} {unit}".strip()
    factor, unit = prefixed(abs(p.value), p.unit)
    value, low, high = with_interval(factor * p.value, *(None if e is None else factor * e for e in (p.low, p.high)))
    if p.low is None or p.high is None or not half_width:
        return f"{in_html(value)} {unit}".strip()
    half = factor * half_width
    shown = (
        significant(half, 2)
        if "e" in value or half >= abs(factor * p.value)
        else f"{half:.{len(value.partition('.')[2])}f}"
    )
    lopsided = abs(0.5 * (p.high + p.low) - p.value) > 0.1 * (p.high - p.low)
    ends = f"({in_html(low)} to {in_html(high)})" if lopsided else f"± {in_html(shown)}"
    return f"{in_html(value)} {ends} {unit}".strip()


@dataclass(frozen=True)
class Count:
    """Numbers of parameters that the data determine well, poorly and not.

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
    """Return the count of fitted parameters by their state."""
    states = [q.determined for q in quantities]
    numbers = [states.count(s) for s in (State.WELL, State.POORLY, State.NOT)]
    return Count(sum(numbers), *numbers)


def count_of(fit: Fit) -> Count:
    """Return the count of a fit's parameters by their state, all sets together."""
    return counted(q for result in fit.results for q in result.parameters)


def sentences(fit: Fit) -> list[str]:
    """Return sentences on the parameters and derived quantities that the data determine, or determine poorly."""
    count = count_of(fit)
    text = f"The data determine {count.well} of {count.free} parameters well"
    text += "".join(f", {n} {word}" for n, word in ((count.poorly, "poorly"), (count.undetermined, "not")) if n)
    if count.poorly and len(fit.results) == 1:
        poor = [q for q in fit.results[0].parameters if q.determined is State.POORLY]
        text += f"; poorly: {', '.join(q.name + words_of(q).removeprefix('poorly determined') for q in poor)}"
    said = [text + "."]
    derived = counted(q for result in fit.results for q in result.derived)
    if derived.free:
        said.append(f"Derived quantities well determined: {derived.words}.")
    return said
