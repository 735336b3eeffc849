"""Numbers of a sheet as people read them: in units with prefixes, with their intervals, limits and changes."""

import math
import re
from collections.abc import Sequence

from mrfit.core.counting import number_of
from mrfit.core.grouping import grouped
from mrfit.io.schemas.sheet import ChangeRow, QuantityRow, SheetCondition, SheetFile, VerdictRow
from mrfit.report.curves import prefixed
from mrfit.report.numbers import in_html, significant, unit_html, with_interval

PURE_NUMBERS = {"ratio": False, "closure": True, "efficiency": True, "ripple": True, "fade+": True, "fade-": True}
"""Pure numbers -> whether they are read in percent."""
LEAST_SHOWN = {"ripple": 0.0, "free travel": 0.0}
"""Sizes whose estimate may fall below zero by noise, where it is shown as zero."""
CLEAR = 5.0
"""Widths of its interval from zero from which on the deviation of a cycle is told as a share."""
PREFIXED = ("N", "m", "m/s", "s", "J", "N/m")


def scaled(name: str, unit: str, row: QuantityRow | VerdictRow) -> tuple[float, str]:
    """Return the factor and unit in which the numbers of a quantity are shown."""
    if PURE_NUMBERS.get(name):
        return 100.0, "%"
    largest = max((abs(v) for v in (row.value, row.low, row.high) if v is not None), default=1.0)
    return prefixed(largest, unit) if unit in PREFIXED else (1.0, unit_html(unit))


def shown(quantity: str, value: float) -> float:
    """Return an estimate as it is shown: no size below zero."""
    return max(value, LEAST_SHOWN.get(quantity, -math.inf))


def interval_text(factor: float, value: float, low: float | None, high: float | None, of: str = "") -> tuple[str, str]:
    """Return a value and its interval times a factor, ``of`` what: sizes are not below zero."""
    ends = (None if v is None else factor * shown(of, v) for v in (low, high))
    middle, first, last = with_interval(factor * shown(of, value), *ends)
    return in_html(middle), f"{in_html(first)} to {in_html(last)}" if first and last else "–"


def numbers_of(row: QuantityRow) -> tuple[str, str, str, str]:
    """Return value, 95 % interval, unit, and what is to be said over the cycles, or why there is no value."""
    if row.value is None:
        return "–", "–", "", row.reason
    factor, unit = scaled(row.name, row.unit, row)
    return *interval_text(factor, row.value, row.low, row.high, row.name), unit, over_cycles(row)


def over_cycles(row: QuantityRow) -> str:
    """Return the course of a quantity over the cycles in words."""
    words = []
    if row.drift and row.value:
        words.append(f"drifts by {in_html(significant(100.0 * row.drift / abs(row.value)))} %")
    if row.greatest_deviation is not None and row.value and row.low is not None and row.high is not None:
        if abs(row.value) > CLEAR * (row.high - row.low):
            words.append(f"one cycle up to {significant(100.0 * row.greatest_deviation, 2)} % off")
    return ", ".join(words)


def number_text(row: VerdictRow) -> str:
    """Return the value of a verdict with its interval and unit."""
    if row.value is None:
        return "–"
    factor, unit = scaled(row.quantity, row.si_unit, row)
    value, interval = interval_text(factor, row.value, row.low, row.high, row.quantity)
    return f"{'off by ' if row.level == 'cycle' else ''}{value} {unit} ({interval})".replace("  ", " ")


def limits_text(row: VerdictRow) -> str:
    """Return the limits of a verdict in the unit of its value."""
    factor, unit = scaled(row.quantity, row.si_unit, row)
    least, most = (None if v is None else in_html(significant(factor * v, 4)) for v in (row.least, row.most))
    if least is not None and most is not None:
        return f"{least} to {most} {unit}"
    return f"at least {least} {unit}" if least is not None else f"at most {most} {unit}" if most is not None else "–"


def change_text(row: ChangeRow) -> str:
    """Return a change in percent with its interval."""
    if row.change is None:
        return "–"
    value, interval = interval_text(100.0, row.change, row.low, row.high)
    return f"{value} % ({interval})"


def unmatched_of(file: SheetFile) -> list[str]:
    """Return the conditions that have no partner in the logs compared with, or in these."""
    own = {c.condition for unit in file.units for c in unit.conditions}
    return [f"{name} (only {'here' if name in own else 'in the logs compared with'})" for name in file.unmatched]


def notes_of(conditions: Sequence[SheetCondition]) -> list[str]:
    """Return the notes on conditions; of those that differ in numbers alone the longest, with their count."""
    notes = grouped((_kind(text), (one.condition, text)) for one in conditions for text in one.findings)
    said = []
    for rows in notes.values():
        name, text = max(rows, key=lambda row: len(row[1]))
        more = len({condition for condition, _ in rows}) - 1
        said.append(f"{name}: {text}" + (f" (and {number_of('more condition', more)} alike)" if more else ""))
    return said


def _kind(text: str) -> str:
    """Return a note without its numbers, and without what a skew would change."""
    return re.sub(r"[\d.]+", "", text.partition(" would change ")[0])
