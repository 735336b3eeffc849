"""A label before the first row of numbers, below lines that all begin with one."""

import re
from collections.abc import Sequence

from mrfit.ingest.text.body import number_pattern, split

DATA_LABEL = re.compile(r"(?:trace[ _])?(?:data|values?|daten|werte) ?[:=]?", re.IGNORECASE)
"""Words for the numbers themselves."""


def begins_rows(lines: Sequence[str], delimiter: str, decimal: str, width: int, time: int | None) -> bool:
    """Whether the first of some lines is a row behind a label: the word for data, or times that go on below it."""
    number = number_pattern(decimal)
    label, *cells = split(lines[0], delimiter)
    if DATA_LABEL.fullmatch(label):
        return len(cells) >= width and all(map(number.fullmatch, cells[:width]))
    times = [c[time : time + 1] if time is not None else [] for c in (split(line, delimiter) for line in lines)]
    if len(times) < 3 or not all(t and number.fullmatch(t[0]) for t in times):
        return False
    a, b, c = (float(t[0].replace(decimal, ".")) for t in times)
    return 0.0 < b - a < 1.5 * (c - b) < 2.25 * (b - a)
