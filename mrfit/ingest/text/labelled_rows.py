"""The word for data before the first row of numbers, below lines that all begin with a label."""

import re
from collections.abc import Sequence

from mrfit.ingest.text.body import number_pattern, split

DATA_LABEL = re.compile(r"(?:trace[ _])?(?:data|values?|daten|werte) ?[:=]?", re.IGNORECASE)
"""Words for the numbers themselves."""


def begins_rows(lines: Sequence[str], delimiter: str, decimal: str, width: int, time: int | None) -> bool:
    """Whether the first of some lines is a row behind the word for data, from which times go on where there are any."""
    number = number_pattern(decimal)
    rows = [split(line, delimiter) for line in lines]
    if not DATA_LABEL.fullmatch(rows[0][0]) or len(rows[0]) <= width:
        return False
    if not all(map(number.fullmatch, rows[0][1 : width + 1])):
        return False
    times = [row[time] for row in rows if len(row) > time] if time is not None else []
    if len(times) < 3 or not all(map(number.fullmatch, times)):
        return True
    a, b, c = (float(t.replace(decimal, ".")) for t in times)
    return 0.0 < b - a < 1.5 * (c - b) < 2.25 * (b - a)
